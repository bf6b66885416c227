//! Tiles' extrema are those of their texels, and a row that steps over tiles is the row that reads every texel.

use epipolar::baran::Cells;
use epipolar::rows::{MinMaxTiles, TILE_SIDE, TileSide};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use scatter_core::{CubeShadow, Frame, Level, MapProjection, ShadowLayer, ShadowMap, simd_level};
use scatter_testing::{MapKind, OwnedFrame, Random, SliceCase, Texels, slice_cases};

use crate::row_of_pixel::RowOfPixel;

/// More columns than a register has lanes, so that one texel hides many.
const IMAGE: [u32; 2] = [67, 45];

/// Sizes of maps: several tiles, not whole ones, less than one, and exactly four.
const MAPS: [[u32; 2]; 6] = [[70, 53], [129, 33], [33, 129], [15, 90], [64, 64], [17, 31]];

type Tile = [f32; 2];

/// Minima and maxima of a layer's tiles, texel by texel.
fn brute_force(layer: &ShadowLayer<'_>, side: usize) -> Vec<Tile> {
    let [width, height] = layer.projection().size().map(|size| size as usize);
    let wide = width.div_ceil(side);
    let mut tiles = vec![[f32::INFINITY, f32::NEG_INFINITY]; wide * height.div_ceil(side)];
    for (j, i) in (0..height).flat_map(|j| (0..width).map(move |i| (j, i))) {
        let tile = &mut tiles[j / side * wide + i / side];
        let depth = layer.at(i as u32, j as u32);
        *tile = [tile[0].min(depth), tile[1].max(depth)];
    }
    tiles
}

/// A pixel's row by given tiles, layer by layer.
fn row(frame: &Frame<'_>, pixel: [u32; 2], tiles: &[Vec<Tile>]) -> Option<RowOfPixel> {
    let mut given = MinMaxTiles::default();
    given.rebuild(simd_level(), frame.shadow());
    for (layer, tiles) in tiles.iter().enumerate() {
        given.layer_mut(layer).copy_from_slice(tiles);
    }
    RowOfPixel::with_tiles(frame, pixel, Cells::Exact, &given)
}

/// Tiles that rule nothing out. Depths as large as "no surface" is taken for, before the plane and behind it.
fn unknown(tiles: &[Vec<Tile>]) -> Vec<Vec<Tile>> {
    tiles.iter().map(|layer| vec![[-1e25, f32::INFINITY]; layer.len()]).collect()
}

fn is_same(a: &RowOfPixel, b: &RowOfPixel) -> bool {
    let bits = |row: &RowOfPixel| row.row.starts().iter().map(|start| start.to_bits()).collect::<Vec<_>>();
    bits(a) == bits(b) && a.row.lit() == b.row.lit()
}

/// A scene with a map of several tiles, and pixels of it.
fn scene_of(case: SliceCase, map: usize) -> (OwnedFrame, Vec<[u32; 2]>) {
    let scene = case.frame_of(IMAGE, Some(MAPS[map]));
    let mut random = Random(!case.seed);
    let pixels = (0..12).map(|_| [random.below(IMAGE[0]), random.below(IMAGE[1])]).collect();
    (scene, pixels)
}

/// A kind of light, texels and view, drawn for maps of several tiles.
fn tiled_cases() -> impl Strategy<Value = (SliceCase, usize)> {
    let texels = prop_oneof![
        1 => Just(Texels::Random),
        1 => Just(Texels::Constant),
        1 => Just(Texels::Checkerboard),
        1 => Just(Texels::Slabs),
        2 => Just(Texels::WideSlabs),
        3 => Just(Texels::Mixed)
    ];
    (slice_cases(), texels, 0..MAPS.len()).prop_map(|(case, texels, map)| (SliceCase { texels, ..case }, map))
}

/// As many of them, the same ones on every machine.
fn drawn(count: usize) -> impl Iterator<Item = (SliceCase, usize)> {
    let mut runner = TestRunner::deterministic();
    (0..count).map(move |_| tiled_cases().new_tree(&mut runner).unwrap().current())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 600, failure_persistence: None, ..ProptestConfig::default() })]

    /// To the bit: what is stepped over has the lit columns that its texels would have been given, and begins in the
    /// same place.
    #[test]
    fn a_row_that_steps_over_tiles_is_the_row_that_reads_every_texel((case, map) in tiled_cases()) {
        let (scene, pixels) = scene_of(case, map);
        scene.with(|frame| {
            let tiles: Vec<_> = frame.shadow().layers().map(|layer| brute_force(&layer, TILE_SIDE)).collect();
            let unknown = unknown(&tiles);
            for pixel in pixels {
                let Some(stepped) = RowOfPixel::new(frame, pixel, Cells::Exact) else { continue };
                let read = row(frame, pixel, &unknown).unwrap();
                prop_assert!(is_same(&stepped, &read), "{:?} pixel {pixel:?}:\n{:?} {:?}\n{:?} {:?}",
                    MAPS[map], stepped.row.starts(), stepped.row.lit(), read.row.starts(), read.row.lit());
                prop_assert!(stepped.read <= read.read);
            }
            Ok(())
        })?;
    }
}

#[test]
fn rows_by_wrong_extrema_differ() {
    type Wrong = (&'static str, fn(&[Tile], usize) -> Tile);
    let wrong: [Wrong; 4] = [
        ("nearest only", |tiles, index| [tiles[index][0]; 2]),
        ("farthest only", |tiles, index| [tiles[index][1]; 2]),
        ("the next tile's", |tiles, index| tiles[(index + 1) % tiles.len()]),
        ("exchanged", |tiles, index| [tiles[index][1], tiles[index][0]]),
    ];
    let (mut rows, mut differing) = (0, [0; 4]);
    for (case, map) in drawn(200) {
        let (scene, pixels) = scene_of(case, map);
        scene.with(|frame| {
            let tiles: Vec<_> = frame.shadow().layers().map(|layer| brute_force(&layer, TILE_SIDE)).collect();
            for pixel in pixels {
                let Some(good) = row(frame, pixel, &tiles) else { continue };
                rows += 1;
                for (count, (_, wrong)) in differing.iter_mut().zip(wrong) {
                    let spoil = |layer: &Vec<Tile>| (0..layer.len()).map(|n| wrong(layer, n)).collect();
                    let tiles: Vec<Vec<Tile>> = tiles.iter().map(spoil).collect();
                    *count += usize::from(!is_same(&good, &row(frame, pixel, &tiles).unwrap()));
                }
            }
        });
    }
    for ((name, _), count) in wrong.iter().zip(differing) {
        println!("{name}: {count} of {rows} rows differ");
        assert!(count > 0, "{name}: nothing would notice");
    }
}

#[test]
fn rows_of_walls_that_are_tiles_wide_read_a_part_of_them() {
    /// Slabs of 32 texels and more hold a whole tile, every other one nothing: of the stretches along them, a sixth
    /// at least passes over nothing, whose light every column sees.
    const MOST: f64 = 5.0 / 6.0;
    let (mut read, mut all) = (0u64, 0u64);
    for (case, map) in drawn(300) {
        let (scene, pixels) = scene_of(SliceCase { texels: Texels::WideSlabs, ..case }, map % 3);
        scene.with(|frame| {
            let unknown = unknown(
                &frame.shadow().layers().map(|layer| brute_force(&layer, TILE_SIDE)).collect::<Vec<_>>(),
            );
            for pixel in pixels {
                let Some(stepped) = RowOfPixel::new(frame, pixel, Cells::Exact) else { continue };
                read += stepped.read;
                all += row(frame, pixel, &unknown).unwrap().read;
            }
        });
    }
    let share = read as f64 / all as f64;
    println!("{read} of {all} texel columns read: {share:.3}");
    assert!(share < MOST, "{share}");
}

#[test]
fn of_a_suns_map_that_nothing_stands_in_hardly_anything_is_read() {
    /// In f32 a tile is in doubt where light rays are nearly parallel to the outermost view ray, or to the image
    /// plane, so that they meet nothing or everything at infinity: an edge case, one tile in twenty at the most.
    const MOST: f64 = 0.05;
    let (mut read, mut all) = (0u64, 0u64);
    for (case, map) in drawn(300).filter(|(case, _)| case.kind == MapKind::Orthographic) {
        let (mut scene, pixels) = scene_of(case, map);
        scene.texels.iter_mut().for_each(|texels| texels.fill(f32::INFINITY));
        scene.with(|frame| {
            let unknown = unknown(
                &frame.shadow().layers().map(|layer| brute_force(&layer, TILE_SIDE)).collect::<Vec<_>>(),
            );
            for pixel in pixels {
                let Some(stepped) = RowOfPixel::new(frame, pixel, Cells::Exact) else { continue };
                assert_eq!(stepped.row.lit(), &[stepped.column_count], "{case:?} {pixel:?}");
                read += stepped.read;
                all += row(frame, pixel, &unknown).unwrap().read;
            }
        });
    }
    let share = read as f64 / all as f64;
    println!("{read} of {all} texel columns read: {share:.4}");
    assert!(all > 10_000 && share < MOST, "{read} of {all}");
}

#[test]
fn extrema_are_the_minima_and_maxima_of_tiles() {
    let mut random = Random(16);
    let mut texels_of = |count: u32| -> Vec<f32> {
        let draw = |random: &mut Random| match random.below(40) {
            0 => f32::INFINITY,
            1 => 0.0,
            _ => random.range(0.01, 9.0) as f32,
        };
        (0..count).map(|_| draw(&mut random)).collect()
    };
    let down = [0.1, -1.0, 0.2];
    let parallel =
        |size| MapProjection::orthographic([0.0, 8.0, 0.0], down, [0.0, 0.0, 1.0], [5.0; 2], size).unwrap();
    // One instance for all, from large to small and back: nothing of a map stays.
    let mut tiles = MinMaxTiles::default();
    let mut check = |map: &ShadowMap<'_>| {
        for level in [simd_level(), Level::baseline()] {
            tiles.rebuild(level, map);
            for (index, layer) in map.layers().enumerate() {
                let found = tiles.layer(index);
                let size = layer.projection().size();
                assert_eq!(tiles.level_count(index), 1);
                assert_eq!(found.width, (size[0] as usize).div_ceil(TILE_SIDE), "{size:?}");
                assert_eq!(found.extrema, brute_force(&layer, TILE_SIDE), "{size:?}, layer {index}");
            }
            for (finest, side) in [(TileSide::Four, 4), (TileSide::Eight, 8), (TileSide::Sixteen, 16)] {
                tiles.rebuild_levels(level, map, finest);
                for (index, layer) in map.layers().enumerate() {
                    let last = tiles.level_count(index) - 1;
                    for depth in 0..=last {
                        let expected = brute_force(&layer, side << depth);
                        assert_eq!(tiles.level(index, depth).extrema, expected, "{side} << {depth}");
                        assert_eq!(expected.len() == 1, depth == last, "the last level is one tile");
                    }
                }
            }
        }
    };
    for size in [[129, 33], [1, 1], [16, 16], [15, 17], [17, 15], [1, 50], [50, 1], [70, 53], [32, 48]] {
        let texels = texels_of(size[0] * size[1]);
        check(&ShadowMap::Orthographic(ShadowLayer::new(parallel(size), &texels).unwrap()));
    }
    for side in [37, 16, 5] {
        let texels = texels_of(6 * side * side);
        check(&ShadowMap::Cube(CubeShadow::new([0.0, 3.0, 0.0], side, &texels).unwrap()));
    }
    let sizes = [[40, 19], [7, 90], [33, 33]];
    let texels = sizes.map(|[width, height]| texels_of(width * height));
    let layers = sizes.iter().zip(&texels);
    let layers = layers.map(|(&size, texels)| ShadowLayer::new(parallel(size), texels).unwrap());
    let layers: Vec<_> = layers.collect();
    check(&ShadowMap::Cascades(&layers));
}

#[test]
fn drawn_maps_are_of_every_kind() {
    // The properties above say little of lights that are never drawn.
    for kind in [MapKind::Orthographic, MapKind::Spot, MapKind::SpotCube, MapKind::Point] {
        assert!(drawn(200).filter(|(case, _)| case.kind == kind).count() > 10, "{kind:?}");
    }
}
