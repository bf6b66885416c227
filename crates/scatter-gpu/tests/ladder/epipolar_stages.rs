//! Rung 2 of the ladder for epipolar slices: rows against the CPU's, what pixels ask against the CPU's geometry, sums equal to a Rust
//! mirror to the bit; mutants of each.

use epipolar::driver::{SliceAngles, SliceScene, SliceView};
use epipolar::geometry::{ColumnOrder, Epipole, FanPixels, SliceMap, SliceSet};
use epipolar::rows::{MinMaxTiles, Row};
use scatter_core::{Camera, DepthEncoding, Frame, Light, simd_level};
use scatter_gpu::harness::{Bound, HarnessDevice};
use scatter_gpu::{EpipolarSettings, GpuFrame, ShadowDepth, wgpu};
use scatter_kernels::FrameUniform;
use scatter_kernels::epipolar::{
    EDGES, EpipolarPlan, MOST_BANDS, ROWS, Run, SUMS, SUMS_RAW, SliceData, WHOLE, sum_mirror,
};
use scatter_kernels::modules::Module;
use scatter_testing::{Filling, MapKind, OwnedFrame, boards, coloured_medium};

use crate::support::changed;

static ROWS_STATIC: Module = ROWS;
static SUMS_STATIC: Module = SUMS_RAW;
static SHARES_STATIC: Module = SUMS;
static EDGES_STATIC: Module = EDGES;

/// A frame on the device, for passes that run by themselves.
struct Scene {
    uniform: FrameUniform,
    plan: EpipolarPlan,
    /// The plan's, to be changed.
    slices: Vec<SliceData>,
    maps: wgpu::TextureView,
    distances: wgpu::TextureView,
}

fn settings(spacing: f64) -> EpipolarSettings {
    EpipolarSettings {
        spacing,
        towards_light: 1.0,
        fewest_slices: 1.0,
        factor_error: 1e-3,
        ..EpipolarSettings::default()
    }
}

fn scene(device: &HarnessDevice, frame: &Frame<'_>, spacing: f64) -> Scene {
    let layers: Vec<_> = frame.shadow().layers().collect();
    let size = layers.iter().fold([1; 2], |[w, h], layer| {
        let [width, height] = layer.projection().size();
        [w.max(width), h.max(height)]
    });
    let texture = device.r32float(size, layers.len().max(1) as u32);
    for (index, layer) in layers.iter().enumerate() {
        device.write(&texture, index as u32, layer.projection().size(), bytemuck::cast_slice(layer.texels()));
    }
    let shadow: Vec<_> = (0..layers.len() as u32).map(ShadowDepth::linear).collect();
    let gpu_frame =
        GpuFrame { setup: *frame.setup(), depth: DepthEncoding::AlongRay, shadow: &shadow, exposure: 1.0 };
    let mut uniform = FrameUniform::new(&gpu_frame, [0, 0]).unwrap();
    uniform.depth_more[1] = 1.0;
    let mut plan = EpipolarPlan::default();
    plan.rebuild(frame.setup(), &settings(spacing)).unwrap();
    assert_eq!(plan.uniforms().len(), 1, "one batch");
    let maps = texture.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..Default::default()
    });
    let distance = device.r32float(frame.size(), 1);
    let ends: Vec<f32> = frame.depth().texels().iter().map(|depth| depth.min(1e18)).collect();
    device.write(&distance, 0, frame.size(), bytemuck::cast_slice(&ends));
    Scene {
        uniform,
        slices: plan.slices().to_vec(),
        plan,
        maps,
        distances: distance.create_view(&Default::default()),
    }
}

/// All rows by the pass, and how many stretches had no room.
fn rows(device: &HarnessDevice, scene: &Scene, module: &'static Module) -> (Vec<Run>, u32) {
    let plan = &scene.plan;
    let blank = vec![0xffu8; plan.room().rows as usize];
    let found = device.run(
        module,
        0,
        &[
            (0, Bound::Uniform(bytemuck::bytes_of(&scene.uniform))),
            (4, Bound::Texture(&scene.maps)),
            (8, Bound::Storage(&[0; 16])),
            (9, Bound::Uniform(bytemuck::cast_slice(plan.uniforms()))),
            (10, Bound::Storage(bytemuck::cast_slice(&scene.slices))),
            (11, Bound::Storage(bytemuck::cast_slice(plan.lines()))),
            (12, Bound::Storage(&blank)),
        ],
        plan.groups(0)[0],
    );
    let status: Vec<u32> = bytemuck::pod_collect_to_vec(&found[0]);
    (bytemuck::pod_collect_to_vec(&found[3]), status[1])
}

/// What a pass tells pixels, of `T` a channel and pixel: eight vectors of the raw sums, else a number.
fn answers<T: bytemuck::AnyBitPattern + bytemuck::NoUninit>(
    device: &HarnessDevice,
    scene: &Scene,
    rows: &[Run],
    module: &'static Module,
) -> Vec<T> {
    let plan = &scene.plan;
    let uniform = &plan.uniforms()[0];
    let blank = vec![0u8; size_of::<T>() * (uniform.counts[0] * uniform.counts[3]) as usize];
    let is_bound = |number: u32| module.entries[0].bindings.iter().any(|binding| binding.number == number);
    let bound: Vec<_> = [
        (0, Bound::Uniform(bytemuck::bytes_of(&scene.uniform))),
        (3, Bound::Texture(&scene.distances)),
        (9, Bound::Uniform(bytemuck::cast_slice(plan.uniforms()))),
        (10, Bound::Storage(bytemuck::cast_slice(&scene.slices))),
        (12, Bound::Storage(bytemuck::cast_slice(rows))),
        (13, Bound::Storage(bytemuck::cast_slice(plan.tasks()))),
        (14, Bound::Storage(bytemuck::cast_slice(plan.ranges()))),
        (15, Bound::Storage(bytemuck::cast_slice(plan.nodes()))),
        (16, Bound::Storage(&blank)),
    ]
    .into_iter()
    .filter(|(number, _)| is_bound(*number))
    .collect();
    let mut groups = plan.groups(0)[1];
    if module.entries[0].name == "edges" {
        groups[2] = 1;
    }
    let found = device.run(module, 0, &bound, groups);
    bytemuck::pod_collect_to_vec(found.last().expect("the answers"))
}

/// Share of all rows' γ over which the pass and the CPU differ in who sees them lit.
fn rows_differ(frame: &Frame<'_>, scene: &Scene, found: &[Run]) -> f64 {
    let epipole = Epipole::new(frame.camera(), frame.light());
    let mut set = SliceSet::default();
    set.distribute(&epipole, frame.size(), scene.plan.spacing());
    let tiles = MinMaxTiles::default();
    let view = SliceScene { frame, epipole, tiles: &tiles, simd: simd_level() };
    let (mut pixels, mut angles, mut row) = (FanPixels::default(), SliceAngles::default(), Row::default());
    let (mut apart, mut whole, mut number) = (0.0f64, 0.0f64, 0);
    for fan in &set.fans {
        pixels.find(&epipole, frame.size(), fan, &set.slices);
        let order = ColumnOrder { columns: pixels.columns, ascending: fan.ascending == epipole.outward };
        for slice in &set.slices[fan.first..][..fan.count] {
            let data = &scene.plan.slices()[number];
            number += 1;
            if data.line_count == 0 {
                continue;
            }
            let lines = &scene.plan.lines()[data.first_line as usize..][..data.line_count as usize];
            let reach =
                lines.iter().map(|line| line.gamma[0] + line.gamma[1] * line.length).fold(0.0, f32::max);
            SliceView::new(view, *slice, fan.major, order, &mut angles).up_to(reach).rectify(0.0, &mut row);
            let count = found[data.first_run as usize][0] as usize;
            let own = &found[data.first_run as usize + 1..][..=count];
            assert!(own.windows(2).all(|pair| pair[0][0] <= pair[1][0]), "starts in order");
            // Both lists of edges, merged.
            let (mut a, mut b, mut at) = (0, 0, 0.0f32);
            while at < reach {
                let next_own = f32::from_bits(own[a + 1][0]);
                let next = next_own.min(row.starts()[b + 1]).min(reach);
                if own[a][1] != row.lit()[b] {
                    apart += f64::from(next - at);
                }
                a += usize::from(next_own <= next && a + 1 < count);
                b += usize::from(row.starts()[b + 1] <= next && b + 1 < row.len());
                if next <= at && next >= reach {
                    break;
                }
                at = next;
            }
            whole += f64::from(reach);
        }
    }
    apart / whole
}

/// Frames whose slices run in every way: away from the epipole and towards it, on screen and off, one map and cascades.
fn frames() -> Vec<(&'static str, OwnedFrame)> {
    let noise = Filling::Random { seed: 3, far: 12.0 };
    let mut all = vec![("boards", boards([63, 65]))];
    for (name, kind, size, side) in [
        ("one map", MapKind::Orthographic, [37, 21], 64),
        ("cascades", MapKind::Cascades, [21, 37], 65),
        ("a row of pixels", MapKind::Orthographic, [64, 1], 127),
        ("large map", MapKind::Orthographic, [13, 9], 517),
    ] {
        all.push((name, OwnedFrame::stock(kind, size, side, noise)));
    }
    for (name, turned) in [("into the sun", -1.0), ("away from the sun", 1.0)] {
        let mut frame = OwnedFrame::stock(MapKind::Cascades, [31, 33], 64, noise);
        let eye = frame.camera.eye();
        let Light::Directional(sun) = &frame.light else { panic!("a sun") };
        let target = eye + turned * sun.direction();
        frame.camera =
            Camera::perspective(eye.to_array(), target.to_array(), [0.1, 1.0, 0.2], 50.0, [31, 33]).unwrap();
        all.push((name, frame));
    }
    let mut coloured = OwnedFrame::stock(MapKind::Orthographic, [37, 21], 64, noise);
    coloured.medium = coloured_medium();
    all.push(("coloured", coloured));
    all
}

/// Both compute the same f32 lines, in another order of operations: borders between runs move by a few roundings of positions of
/// up to 517 texels, 2^-15 of a texel each.
const ROWS_APART: f64 = 1e-5;

#[test]
fn rows_are_the_cpus_rows() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mutants = [
        changed(
            &ROWS_STATIC,
            "rows, columns and rows of texels swapped",
            "(index % width, index / width)",
            "(index / width, index % width)",
        ),
        changed(
            &ROWS_STATIC,
            "rows, a texel column off",
            "line.first + line.advance * i32(column)",
            "line.first + line.advance * i32(column + 1u)",
        ),
        changed(&ROWS_STATIC, "rows, without cuts", "step < apart(lit_first, lit_last)", "step < 0u"),
        changed(&ROWS_STATIC, "rows, runs that continue kept apart", "lit.x != before)", "lit.x == before)"),
    ];
    let mut seen = [false; 4];
    for (name, owned) in frames() {
        owned.with(|frame| {
            let scene = scene(&device, frame, 0.5);
            let (found, short) = rows(&device, &scene, &ROWS_STATIC);
            let apart = rows_differ(frame, &scene, &found);
            let runs: u64 = scene.plan.slices().iter().map(|slice| u64::from(found[slice.first_run as usize][0])).sum();
            println!(
                "{name}: {} slices, {runs} runs, {apart:.1e} of the light rays differ ({ROWS_APART:e}), {short} stretches without room",
                scene.plan.slices().len()
            );
            assert!(apart <= ROWS_APART, "{name}: {apart:e}");
            for (seen, mutant) in seen.iter_mut().zip(mutants).filter(|(seen, _)| !**seen) {
                let (found, _) = rows(&device, &scene, mutant);
                let is_whole = scene.plan.slices().iter().all(|slice| {
                    let count = found[slice.first_run as usize][0];
                    let own = found.get(slice.first_run as usize + 1..).and_then(|own| own.get(..=count as usize));
                    count >= 1 && own.is_some_and(|own| own.windows(2).all(|pair| pair[0][0] <= pair[1][0]))
                });
                *seen |= !is_whole || rows_differ(frame, &scene, &found) > ROWS_APART;
            }
        });
    }
    for (seen, mutant) in seen.into_iter().zip(mutants) {
        assert!(seen, "{} is not seen", mutant.name);
    }
}

#[test]
fn rows_without_room_are_cut_less_finely_and_counted() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mut all = 0;
    for (name, owned) in frames().into_iter().filter(|(name, _)| matches!(*name, "one map" | "into the sun"))
    {
        owned.with(|frame| {
            let mut scene = scene(&device, frame, 0.5);
            // Room for two runs a texel column alone: none for cuts within a texel.
            for slice in &mut scene.slices {
                slice.room -= 256 + 2 * slice.column_count;
            }
            let (found, short) = rows(&device, &scene, &ROWS_STATIC);
            let apart = rows_differ(frame, &scene, &found);
            println!("{name}: {short} stretches without room, {apart:.1e} of the light rays differ");
            for slice in &scene.slices {
                assert!(found[slice.first_run as usize][0] <= slice.room);
            }
            assert!(short > 0 || apart <= ROWS_APART, "{name}: what is not exact is counted");
            all += short;
            // Still an answer a side and pixel, and sums to the bit.
            let told = answers(&device, &scene, &found, &SUMS_STATIC);
            judge(frame, &scene, &found, &told).unwrap();
        });
    }
    assert!(all > 0, "no row was short of room");
}

/// What is wrong with the answers of a frame, if anything: the pixels that ask, their places, and the sums to the bit.
fn judge(frame: &Frame<'_>, scene: &Scene, rows: &[Run], answers: &[[[i32; 4]; 8]]) -> Result<u64, String> {
    let epipole = Epipole::new(frame.camera(), frame.light());
    let (mut set, uniform) = (SliceSet::default(), &scene.plan.uniforms()[0]);
    set.distribute(&epipole, frame.size(), scene.plan.spacing());
    let pixels: Vec<_> = set
        .fans
        .iter()
        .map(|fan| {
            let mut pixels = FanPixels::default();
            pixels.find(&epipole, frame.size(), fan, &set.slices);
            pixels
        })
        .collect();
    let map = SliceMap { slices: &set, pixels: &pixels };
    let [width, height] = frame.size();
    let [left, right, top, bottom] = uniform.walked;
    let longest = uniform.reach[0];
    let mut asks = 0;
    for channel in 0..uniform.counts[0] {
        let [first, intervals, bits, _] = uniform.tables[channel as usize];
        let nodes = &scene.plan.nodes()[first as usize..][..=intervals as usize];
        for y in 0..height {
            for x in 0..width {
                let at = format!("pixel {x} {y}, channel {channel}");
                let told = &answers[(channel * width * height + y * width + x) as usize];
                let place = map.locate([x, y]);
                let is_walked = (left..right).contains(&x) && (top..bottom).contains(&y);
                if place.is_none() != is_walked {
                    return Err(format!("{at} is walked: {is_walked}"));
                }
                let mut parts = 0;
                for side in 0..2 {
                    let [sum, end, [slice, band, rank, gamma], [part, sine, is_told, _]] =
                        [0, 1, 2, 3].map(|n| told[4 * side + n]);
                    if (is_told == 1) == is_walked {
                        return Err(format!("{at} has an answer: {is_told}"));
                    }
                    if is_walked {
                        continue;
                    }
                    asks += 1;
                    parts += part;
                    let place = place.expect("it is not walked");
                    // Side 0: the pixel is in the gap before the slice. A pixel within a rounding of a slice may lie in either gap.
                    let expected = place.slice as i32 + 1 - side as i32;
                    let near = |part: f32| (place.part - part).abs() < 1e-3;
                    if slice != expected
                        && !(near(0.0) && slice + 1 == expected || near(1.0) && slice == expected + 1)
                    {
                        return Err(format!(
                            "{at} asks slice {slice}, and {expected} on the CPU ({})",
                            place.part
                        ));
                    }
                    let weight = if side == 0 { place.part } else { 1.0 - place.part };
                    // 2^-19 of a pixel a column, over gaps of half a pixel and less towards the epipole.
                    if slice == expected && (part as f32 / 65536.0 - weight).abs() > 0.02 {
                        return Err(format!("{at} weighs {part} / 65536, and {weight} on the CPU"));
                    }
                    let ray = frame.camera().pixel_ray(x, y).direction;
                    let depth = frame.depth().texels()[(y * width + x) as usize].min(longest);
                    let own = f64::from(depth) * ray.cross(epipole.to_light).length();
                    let found = f64::from(f32::from_bits(gamma as u32));
                    let column = &scene.plan.slices()[slice as usize];
                    let own_sine = f64::from(f32::from_bits(sine as u32));
                    // The slice's view ray is up to half a pixel beside the pixel's.
                    if (found - f64::from(depth) * own_sine).abs() > 1e-6 * found.max(1e-30) {
                        return Err(format!("{at} ends at {found}, its slice's sine is {own_sine}"));
                    }
                    if (found / own - 1.0).abs() > 0.2 {
                        return Err(format!("{at} ends at {found}, by its own ray at {own}"));
                    }
                    let major = if column.flags & 4 == 0 { x } else { y } as i32;
                    let k = (major - column.column[0]) * column.column[1];
                    let own_rank =
                        if uniform.counts[2] == 1 { column.column_count as i32 - 1 - k } else { k };
                    if rank != own_rank {
                        return Err(format!("{at} has rank {rank}, and {own_rank} by its place"));
                    }
                    let start = column.first_run as usize + 1;
                    let runs = &rows[start..=start + rows[start - 1][0] as usize];
                    let scale = uniform.bands[channel as usize][band as usize][0];
                    assert!((band as usize) < MOST_BANDS);
                    let expected = sum_mirror(runs, (nodes, bits, scale), rank as u32, gamma as u32);
                    if [sum, end] != expected {
                        return Err(format!("{at}: {:?}, and the mirror {expected:?}", [sum, end]));
                    }
                }
                if !is_walked && parts != 65536 {
                    return Err(format!("{at}: weights add up to {parts} / 65536"));
                }
            }
        }
    }
    Ok(asks)
}

#[test]
fn pixels_ask_their_two_slices_and_sums_are_the_mirrors_to_the_bit() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mutants = [
        changed(&SUMS_STATIC, "sums, a chunk off by one", "j < inside", "j <= inside"),
        changed(&SUMS_STATIC, "sums, the column itself", "let first = rank + 1u;", "let first = rank;"),
        changed(
            &SUMS_STATIC,
            "sums, a run late",
            "chunk_start[run + step] <= gamma",
            "chunk_start[run + step - 1u] <= gamma",
        ),
        changed(
            &SUMS_STATIC,
            "asks, the other end of the light",
            "epipolar.counts.z == 1u",
            "epipolar.counts.z == 0u",
        ),
        changed(
            &SUMS_STATIC,
            "asks, columns and rows swapped",
            "vec2<i32>(column, minor), vec2<i32>(minor, column)",
            "vec2<i32>(minor, column), vec2<i32>(column, minor)",
        ),
    ];
    let mut seen = [false; 5];
    for (name, owned) in frames() {
        owned.with(|frame| {
            let scene = scene(&device, frame, 0.5);
            let (runs, _) = rows(&device, &scene, &ROWS_STATIC);
            let told = answers(&device, &scene, &runs, &SUMS_STATIC);
            match judge(frame, &scene, &runs, &told) {
                Ok(asks) => println!(
                    "{name}: {asks} asks, {} tasks, all sums equal to the bit",
                    scene.plan.tasks().len()
                ),
                Err(problem) => panic!("{name}: {problem}"),
            }
            for (seen, mutant) in seen.iter_mut().zip(mutants).filter(|(seen, _)| !**seen) {
                let told = answers(&device, &scene, &runs, mutant);
                *seen |= judge(frame, &scene, &runs, &told).is_err();
            }
        });
    }
    for (seen, mutant) in seen.into_iter().zip(mutants) {
        assert!(seen, "{} is not seen", mutant.name);
    }
}

/// Shares by the sums of four factors, and by closed forms at the edges of the same runs: apart by the factorisation's error, which is
/// set to 1e-3, and by rounding.
const FACTORS_APART: f64 = 1e-3 + 1e-5;

#[test]
fn shares_of_the_sums_are_those_of_the_closed_forms() {
    if crate::support::skipped() {
        return;
    }
    let device = HarnessDevice::shared().unwrap();
    let mutants = [
        changed(&SHARES_STATIC, "shares, a wrong polynomial", "2.0 * z * z - 1.0", "2.0 * z * z"),
        changed(&SHARES_STATIC, "shares, a wrong weight", "65536u - part_of", "65535u - part_of"),
        changed(&EDGES_STATIC, "edges, a column late", "next.y > rank", "next.y >= rank"),
        changed(&EDGES_STATIC, "edges, the other gap", "minor < own", "minor > own"),
    ];
    let mut seen = [false; 4];
    for (name, owned) in frames() {
        owned.with(|frame| {
            let scene = scene(&device, frame, 0.5);
            let (runs, _) = rows(&device, &scene, &ROWS_STATIC);
            let told = |module| answers::<u32>(&device, &scene, &runs, module);
            let (sums, edges) = (told(&SHARES_STATIC), told(&EDGES_STATIC));
            let apart = |a: &[u32], b: &[u32]| {
                let most = a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0);
                f64::from(most) / f64::from(WHOLE)
            };
            let most = apart(&sums, &edges);
            println!(
                "{name}: shares apart by {most:.1e} ({FACTORS_APART:.1e}; the factors' bound is {:.1e})",
                scene.plan.factor_bound()
            );
            assert!(
                most <= FACTORS_APART && sums.iter().chain(&edges).all(|&share| share <= WHOLE),
                "{name}: {most:e}"
            );
            // What is lit all along is exactly whole, by both.
            let whole = |shares: &[u32]| shares.iter().filter(|&&share| share == WHOLE).count();
            assert!(whole(&edges) <= whole(&sums), "{name}");
            for (index, (seen, mutant)) in
                seen.iter_mut().zip(mutants).enumerate().filter(|(_, (seen, _))| !**seen)
            {
                let found = told(mutant);
                let other = if index < 2 { &edges } else { &sums };
                *seen |= apart(&found, other) > FACTORS_APART || whole(&found) < whole(&edges);
            }
        });
    }
    for (seen, mutant) in seen.into_iter().zip(mutants) {
        assert!(seen, "{} is not seen", mutant.name);
    }
}
