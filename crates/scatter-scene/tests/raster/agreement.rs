//! Texel by texel: the raster pass's maps are the ray casts' maps, and as drawn they differ by the rasteriser's grid.

use std::sync::Arc;
use std::time::Instant;

use glam::{DMat4, DVec3, DVec4};
use rayon::prelude::*;
use scatter_core::{Camera, Light, MapProjection, Projection};
use scatter_scene::{FittedMap, MapResolution, MapSource, RasterScene, SceneCaster, Shot, ShotMaps};

use super::driver::{assert_valid, builtin, device, shared};

/// Share of the depth range from which on a texel differs.
const DIFFERS: f64 = 1e-4;
/// Share of texels that may differ.
const MAY_DIFFER: f64 = 1e-4;
/// The same for foliage, which is all silhouette.
const MAY_DIFFER_IN_LEAVES: f64 = 2e-3;
/// The rasteriser's grid \[texels\].
const GRID: f64 = 1.0 / 256.0;
/// Rounding of a depth, as a share of the range.
const ROUNDING: f64 = 1e-5;
/// Share of texels that may look through a crack as drawn: triangles that meet along an edge without sharing its
/// vertices (a T-joint) are moved apart by less than a step of the grid, and the surface behind them shows. Or that a
/// sliver much thinner than the grid, seen edge on, covers with a depth of its plane outside of itself. Rays have no
/// grid, and decide those.
const MAY_CRACK_AS_DRAWN: f64 = 1e-5;

/// What the maps must keep.
#[derive(Debug, Clone, Copy)]
struct Limits {
    /// Share of texels that may differ from the ray cast.
    may_differ: f64,
    /// Share of texels that may differ by more than the grid explains.
    may_crack: f64,
}

/// A map that both can make: texels, and rays at any place of them.
struct View<'a> {
    size: [u32; 2],
    /// `(column, row)` in texels → depth of the first surface.
    cast: Box<dyn Fn(f64, f64) -> f64 + Sync + 'a>,
}

impl<'a> View<'a> {
    fn of_map(caster: &'a SceneCaster, map: MapProjection) -> Self {
        let cast = move |u: f64, v: f64| {
            let (start, step) = map.light_ray(u, v).unwrap();
            // The fitted map's plane of depth 0 lies before the whole scene.
            let hit = caster.closest_hit(start, step.normalize(), f64::INFINITY);
            hit.map_or(f64::INFINITY, |t| t / step.length())
        };
        Self { size: map.size(), cast: Box::new(cast) }
    }

    fn of_camera(caster: &'a SceneCaster, camera: &'a Camera) -> Self {
        let cast = move |x: f64, y: f64| {
            let ray = camera.ray(x, y);
            let hit = caster.closest_hit(camera.eye() + ray.origin, ray.direction, f64::INFINITY);
            hit.unwrap_or(f64::INFINITY)
        };
        Self { size: camera.size(), cast: Box::new(cast) }
    }

    /// Checks every `stride`th row of `texels`; returns the share that differs. Of those beyond the grid there may be
    /// `may_crack`.
    fn check(&self, what: &str, texels: &[f32], stride: usize, may_crack: f64) -> f64 {
        let [width, height] = self.size.map(|n| n as usize);
        assert_eq!(texels.len(), width * height);
        let rows: Vec<usize> = (stride / 2..height).step_by(stride).collect();
        let casts: Vec<Vec<f64>> = rows
            .par_iter()
            .map(|&row| {
                let centre = |column: usize| (self.cast)(column as f64 + 0.5, row as f64 + 0.5);
                (0..width).map(centre).collect()
            })
            .collect();
        let finite = casts.iter().flatten().copied().filter(|d| d.is_finite());
        let (low, high) = finite.fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), d| (a.min(d), b.max(d)));
        let range = if high > low { high - low } else { 1.0 };
        let differing: Vec<(usize, usize, f64, f64)> = rows
            .iter()
            .zip(&casts)
            .flat_map(|(&row, casts)| {
                casts.iter().enumerate().filter_map(move |(column, &cast)| {
                    let found = f64::from(texels[row * width + column]);
                    let same = found == cast || (found - cast).abs() <= DIFFERS * range;
                    (!same).then_some((column, row, found, cast))
                })
            })
            .collect();
        let beyond: Vec<_> = differing
            .par_iter()
            .filter(|&&(column, row, found, _)| !self.is_near(column, row, found, range))
            .collect();
        let count = rows.len() * width;
        let share = differing.len() as f64 / count as f64;
        println!(
            "{what} {width}x{height}: {} of {count} texels differ ({:.5} %), {} beyond the grid, range {range:.3}",
            differing.len(),
            100.0 * share,
            beyond.len(),
        );
        // A small sample may hold two by chance, if it may hold any.
        let most = if may_crack > 0.0 { (may_crack * count as f64).max(2.0) } else { 0.0 };
        assert!(
            beyond.len() as f64 <= most,
            "{what}: beyond the grid (column, row, found, cast): {beyond:?}"
        );
        share
    }

    /// Whether a value lies within the range of casts at the centre and at up to ±1/256 texel around it.
    fn is_near(&self, column: usize, row: usize, found: f64, range: f64) -> bool {
        // A leaf's tip may show at any place within the grid, so a coarse lattice comes first and a fine one after it.
        [1, 16].iter().any(|&steps| {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for j in -steps..=steps {
                for i in -steps..=steps {
                    let place = |at: usize, k: i32| at as f64 + 0.5 + GRID * f64::from(k) / f64::from(steps);
                    let depth = (self.cast)(place(column, i), place(row, j));
                    (low, high) = (low.min(depth), high.max(depth));
                }
            }
            found == low
                || found == high
                || (low - ROUNDING * range <= found && found <= high + ROUNDING * range)
        })
    }
}

/// Every map of a shot at one size, of its first light as it is fitted and of the camera, is the ray casts'; and as
/// drawn it keeps within the grid.
fn shot_agrees(test: &str, shot: &Shot, size: u32, may_differ: f64) {
    let Some(device) = device(test) else { return };
    let caster = Arc::new(SceneCaster::new(&shot.scene).unwrap());
    let open = || RasterScene::new(&device, caster.clone()).unwrap();
    maps_agree(test, shot, size, &caster, &open(), Limits { may_differ, may_crack: 0.0 });
    // An image of few pixels has a coarse grid: its steep surfaces are moved by more.
    let limits = Limits { may_differ: 10.0 * may_differ, may_crack: MAY_CRACK_AS_DRAWN };
    maps_agree(&format!("{test}, as drawn"), shot, size, &caster, &open().as_drawn(), limits);
    assert_valid(&device);
}

fn maps_agree(
    test: &str,
    shot: &Shot,
    size: u32,
    caster: &SceneCaster,
    raster: &RasterScene,
    limits: Limits,
) {
    let light = &shot.lights[0].light;
    let mut texels = Vec::new();
    raster.depth_map(&shot.camera, &mut texels).unwrap();
    let Limits { may_differ, may_crack } = limits;
    let view = View::of_camera(caster, &shot.camera);
    let share = view.check(&format!("{test} camera"), &texels, 1, may_crack);
    assert!(share <= may_differ, "{test}: {share} of the camera's depth differs");

    let maps = ShotMaps::build_from(raster, caster, &shot.camera, light, shot.max_distance, size).unwrap();
    let area = size as usize * size as usize;
    let projections: Vec<MapProjection> = match maps.fitted() {
        FittedMap::Orthographic(map) | FittedMap::Perspective(map) => vec![*map],
        FittedMap::Cube { position, size } => {
            (0..6).map(|face| MapProjection::cube_face(*position, face, *size).unwrap()).collect()
        }
        FittedMap::Cascades(maps) => maps.clone(),
    };
    // A thousand rows of any map: every one up to 1024².
    let stride = (size as usize / 1024).max(1);
    let mut shares = 0.0;
    for (index, (map, texels)) in projections.iter().zip(maps.shadow().chunks(area)).enumerate() {
        let what = format!("{test} map {index}");
        shares += View::of_map(caster, *map).check(&what, texels, stride, may_crack);
    }
    let share = shares / projections.len() as f64;
    assert!(share <= may_differ, "{test}: {share} of the shadow map differs");
    time_both(test, raster, caster, &projections[0]);
}

/// Prints the times of one map by both ways; the second of two raster passes, as a frame loop would have it.
fn time_both(test: &str, raster: &RasterScene, caster: &SceneCaster, map: &MapProjection) {
    let mut texels = Vec::new();
    raster.shadow_map(map, &mut texels).unwrap();
    let start = Instant::now();
    raster.shadow_map(map, &mut texels).unwrap();
    let rastered = start.elapsed();
    if map.size()[0] > 1024 {
        println!("{test}: {:?} texels by raster {rastered:.1?}", map.size());
        return;
    }
    let start = Instant::now();
    caster.shadow_map(map, &mut texels).unwrap();
    println!(
        "{test}: {:?} texels by raster {rastered:.1?}, by ray casts {:.1?}",
        map.size(),
        start.elapsed()
    );
}

#[test]
fn sponzas_maps_agree() {
    let test = "sponzas_maps_agree";
    for file in ["sponza-atrium.toml", "sponza-gallery.toml", "sponza-lamp.toml"] {
        let Some(shot) = shared(test, file) else { return };
        shot_agrees(&format!("{test} {file}"), &shot, 1024, MAY_DIFFER);
    }
}

#[test]
fn sponzas_large_map_agrees() {
    let test = "sponzas_large_map_agrees";
    let Some(shot) = shared(test, "sponza-atrium.toml") else { return };
    shot_agrees(test, &shot, 4096, MAY_DIFFER);
}

#[test]
fn sibeniks_maps_agree() {
    let test = "sibeniks_maps_agree";
    for file in ["sibenik-clerestory.toml", "sibenik-rose.toml"] {
        let Some(shot) = shared(test, file) else { return };
        shot_agrees(&format!("{test} {file}"), &shot, 1024, MAY_DIFFER);
    }
}

#[test]
fn sibeniks_large_map_agrees() {
    let test = "sibeniks_large_map_agrees";
    let Some(shot) = shared(test, "sibenik-clerestory.toml") else { return };
    shot_agrees(test, &shot, 4096, MAY_DIFFER);
}

#[test]
fn leaves_agree() {
    shot_agrees("leaves_agree", &builtin("grove"), 1024, MAY_DIFFER_IN_LEAVES);
    shot_agrees("leaves_agree", &builtin("grove"), 4096, MAY_DIFFER_IN_LEAVES);
}

#[test]
fn a_lamp_and_a_spot_agree() {
    for name in ["lamp", "stage"] {
        let shot = builtin(name);
        assert!(!matches!(shot.lights[0].light, Light::Directional(_)));
        shot_agrees(&format!("a_lamp_and_a_spot_agree {name}"), &shot, 512, MAY_DIFFER);
    }
}

#[test]
fn cascades_of_a_valley_agree() {
    let test = "cascades_of_a_valley_agree";
    let Some(device) = device(test) else { return };
    let shot = builtin("valley");
    let caster = Arc::new(SceneCaster::new(&shot.scene).unwrap());
    let raster = RasterScene::new(&device, caster.clone()).unwrap();
    let light = &shot.lights[0].light;
    let maps = ShotMaps::build_from(
        &raster,
        &caster,
        &shot.camera,
        light,
        shot.max_distance,
        MapResolution::cascaded(513, 3),
    )
    .unwrap();
    let FittedMap::Cascades(projections) = maps.fitted() else { panic!("a sun has cascades") };
    for (index, (map, texels)) in projections.iter().zip(maps.shadow().chunks(513 * 513)).enumerate() {
        let share = View::of_map(&caster, *map).check(&format!("{test} {index}"), texels, 3, 0.0);
        assert!(share <= MAY_DIFFER_IN_LEAVES, "cascade {index}: {share} differs");
    }
    assert_valid(&device);
}

#[test]
fn cameras_of_any_kind_agree() {
    let test = "cameras_of_any_kind_agree";
    let Some(device) = device(test) else { return };
    let shot = builtin("lamp");
    let caster = Arc::new(SceneCaster::new(&shot.scene).unwrap());
    let raster = RasterScene::new(&device, caster.clone()).unwrap();
    let (low, high) = caster.bounds().unwrap();
    // In the middle of the scene, so that surfaces lie behind the eye too.
    let eye = (low + high) * 0.5 + DVec3::new(0.013, 0.027, 0.031);
    let target = eye + DVec3::new(0.9, -0.2, 0.4);
    let (eye, target, up) = (eye.to_array(), target.to_array(), [0.0, 1.0, 0.0]);
    let size = [193, 128];
    let height = 0.4 * (high - low).y;
    // Engines' matrices: a sheared image from an eye beside the view's origin, and oblique parallel rays.
    let view = look_to(DVec3::from(eye), DVec3::from(target) - DVec3::from(eye), DVec3::Y);
    let of_rows = |rows: [[f64; 4]; 4]| {
        let clip = DMat4::from_cols_array_2d(&rows).transpose();
        Camera::from_matrices(view.to_cols_array_2d(), clip.to_cols_array_2d(), size).unwrap()
    };
    let sheared =
        of_rows([[0.8, 0.3, 0.1, 0.02], [-0.2, 1.1, 0.0, 0.03], [0.0, 0.0, 0.0, 0.1], [0.0, 0.0, -1.0, 0.0]]);
    let (x, y) = (1.5 / height, 2.0 / height);
    let oblique = of_rows([
        [x, 0.1 * x, 0.3 * x, 0.1],
        [0.0, y, -0.2 * y, 0.0],
        [0.0, 0.0, -0.01, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);
    let cameras = [
        Camera::perspective(eye, target, up, 140.0, size).unwrap().shifted(11.3, -7.1),
        Camera::orthographic(eye, target, up, height, size).unwrap(),
        sheared,
        oblique,
    ];
    for camera in cameras {
        let what = match camera.projection() {
            Projection::Perspective => "perspective",
            Projection::Orthographic => "orthographic",
        };
        let mut texels = Vec::new();
        raster.depth_map(&camera, &mut texels).unwrap();
        assert!(texels.iter().any(|d| d.is_finite()), "{what} sees nothing");
        let share = View::of_camera(&caster, &camera).check(&format!("{test} {what}"), &texels, 1, 0.0);
        assert!(share <= MAY_DIFFER, "{what}: {share} differs");
    }
    assert_valid(&device);
}

#[test]
fn an_engines_matrix_gives_the_same_map_from_both_sources() {
    let test = "an_engines_matrix_gives_the_same_map_from_both_sources";
    let Some(device) = device(test) else { return };
    let shot = builtin("lamp");
    let caster = Arc::new(SceneCaster::new(&shot.scene).unwrap());
    let raster = RasterScene::new(&device, caster.clone()).unwrap();
    let (low, high) = caster.bounds().unwrap();
    let (centre, radius) = ((low + high) * 0.5, 0.5 * (high - low).length());
    let view = look_to(centre + DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.5, -0.8, 0.33), DVec3::Z);
    // Columns of clip_from_view, with view −z forward; z of clip space over the stretch from `near` to `far`.
    let (near, far) = (0.05 * radius, 0.8 * radius);
    let clip = |x: f64, y: f64, z: [f64; 2], perspective: bool| {
        let w = if perspective { [-1.0, 0.0] } else { [0.0, 1.0] };
        let columns = [
            DVec4::new(x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, y, 0.0, 0.0),
            DVec4::new(0.0, 0.0, z[0], w[0]),
            DVec4::new(0.0, 0.0, z[1], w[1]),
        ];
        DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]) * view
    };
    let matrices = [
        // Its planes cut the scene: what is before the near one is clamped to 0, what is behind the far one is cut.
        ("parallel", clip(1.0 / radius, 1.4 / radius, [-2.0 / radius, 0.0], false)),
        ("perspective", clip(1.2, 1.5, [far / (near - far), near * far / (near - far)], true)),
        ("endless", clip(1.6, 1.9, [-1.0, -near], true)),
    ];
    for (what, clip) in matrices {
        let size = [201, 160];
        let (mut drawn, mut cast) = (Vec::new(), Vec::new());
        raster.clip_map(clip.to_cols_array_2d(), size, &mut drawn).unwrap();
        caster.clip_map(clip.to_cols_array_2d(), size, &mut cast).unwrap();
        let differ = |(a, b): &(&f32, &f32)| !(a == b || (**a - **b).abs() <= 1e-4);
        let count = drawn.iter().zip(&cast).filter(differ).count();
        let hits = cast.iter().filter(|d| d.is_finite()).count();
        println!("{test} {what}: {count} of {} texels differ, {hits} hit", cast.len());
        assert!(hits > 1000, "{what}: the matrix sees too little to test anything");
        // Of a silhouette of some hundred texels.
        assert!(count <= 1, "{what}: {count} texels differ");
    }
    assert_valid(&device);
}

/// World to view, looking along `forward` (view −z).
fn look_to(eye: DVec3, forward: DVec3, up: DVec3) -> DMat4 {
    let back = -forward.normalize();
    let right = up.cross(back).normalize();
    let row = |axis: DVec3| axis.extend(-axis.dot(eye));
    DMat4::from_cols(row(right), row(back.cross(right)), row(back), DVec4::W).transpose()
}

/// Both sources serve as the same trait object.
#[test]
fn a_caster_and_a_raster_scene_are_both_map_sources() {
    let test = "a_caster_and_a_raster_scene_are_both_map_sources";
    let Some(device) = device(test) else { return };
    let shot = builtin("comb");
    let caster = Arc::new(SceneCaster::new(&shot.scene).unwrap());
    let raster = RasterScene::new(&device, caster.clone()).unwrap();
    let light = &shot.lights[0].light;
    let sources: [&dyn MapSource; 2] = [&*caster, &raster];
    let [a, b] = sources.map(|source| {
        ShotMaps::build_from(source, &caster, &shot.camera, light, shot.max_distance, 129).unwrap()
    });
    assert_eq!(a.shadow().len(), b.shadow().len());
    let finite = |maps: &ShotMaps| maps.shadow().iter().filter(|d| d.is_finite()).count() as f64;
    assert!((finite(&a) / finite(&b) - 1.0).abs() < 0.01, "{} {}", finite(&a), finite(&b));
}
