//! Smoke and hair on the way of the light: thin, opaque, without thickness, out of order, beside the map.

use scatter_core::{ModelError, TranslucentLayer, TranslucentSegment};

use crate::scenario::{MapFrame, Scenario, Shadow, Smoke, texels_of};
use crate::stress::row::{StressRow, Trial};
use crate::stress::scenes;

const GROUP: &str = "smoke and hair";

/// A scene of a sun or a spot with segments in the texels of a map of its own, `texels(column, row)`, whose depths are shares of
/// the scene's.
fn with(
    scene: Result<Scenario, ModelError>,
    size: [u32; 2],
    texels: impl Fn(u32, u32) -> Vec<TranslucentSegment>,
) -> Result<Scenario, ModelError> {
    let scene = scene?;
    let (frame, [near, far]) = match &scene.shadow {
        // Depths around the target's.
        Shadow::Parallel(layers) => (layers[0].frame, [14.0, 26.0]),
        Shadow::Perspective(layer) => (layer.frame, [0.5, 7.0]),
        Shadow::None | Shadow::Cube { .. } => return Ok(scene),
    };
    let place = |depth: f32| near + (far - near) * depth;
    let placed = |segment: TranslucentSegment| TranslucentSegment {
        entry: place(segment.entry),
        exit: place(segment.exit),
        ..segment
    };
    let frame = MapFrame { size, ..frame };
    let texels = texels_of(size, |i, j| texels(i, j).into_iter().map(placed).collect());
    Ok(Scenario { smoke: Some(Smoke { frame, texels }), ..scene })
}

/// A number in [0, 1) for each texel and index: the same on every machine.
fn number(i: u32, j: u32, index: u32) -> f32 {
    let bits = (i.wrapping_mul(0x9e37_79b9) ^ j.wrapping_mul(0x85eb_ca6b)) ^ index.wrapping_mul(0xc2b2_ae35);
    let bits = (bits ^ (bits >> 15)).wrapping_mul(0x2c1b_3c6d);
    (bits ^ (bits >> 12)) as f32 / 4_294_967_296.0
}

/// A segment of smoke somewhere.
fn cloud(i: u32, j: u32, index: u32) -> TranslucentSegment {
    let entry = 0.8 * number(i, j, 3 * index);
    let exit = entry + 0.2 * number(i, j, 3 * index + 1);
    TranslucentSegment { entry, exit, optical_depth: 1.5 * number(i, j, 3 * index + 2) }
}

fn hair(i: u32, j: u32, index: u32) -> TranslucentSegment {
    TranslucentSegment::hair(number(i, j, 2 * index), 0.4 * number(i, j, 2 * index + 1))
}

/// A row's name, an input, the model's answer to it, and what its message must name.
type Refusal = (&'static str, fn() -> Result<(), ModelError>, &'static str);

/// Rows of smoke and hair.
pub fn rows() -> Vec<StressRow> {
    let mut rows = Vec::new();
    let mut row =
        |name: &str, scene: Result<Scenario, ModelError>| rows.push(StressRow::image(GROUP, name, scene));
    let size = [9, 7];
    row("overlapping smoke, sun", with(scenes::sun(), size, |i, j| (0..3).map(|n| cloud(i, j, n)).collect()));
    row(
        "smoke and hair in some texels, sun",
        with(scenes::sun(), size, |i, j| {
            if (i + j) % 3 == 0 { vec![cloud(i, j, 0), hair(i, j, 9)] } else { vec![] }
        }),
    );
    row(
        "one texel for all, sun",
        with(scenes::sun(), [1, 1], |_, _| vec![cloud(0, 0, 1), hair(0, 0, 3), hair(0, 0, 4)]),
    );
    row(
        "an optical depth of 1e-9, and one of 1e4, sun",
        with(scenes::sun(), size, |i, j| {
            let whole = if i % 2 == 0 { 1e-9 } else { 1e4 };
            vec![TranslucentSegment { optical_depth: whole, ..cloud(i, j, 0) }]
        }),
    );
    row(
        "opaque hair and opaque smoke, sun",
        with(scenes::sun(), size, |i, j| {
            let opaque = TranslucentSegment { optical_depth: f32::INFINITY, ..cloud(i, j, 0) };
            if i % 2 == 0 {
                vec![opaque, cloud(i, j, 1)]
            } else {
                vec![TranslucentSegment::hair(number(i, j, 5), 1.0)]
            }
        }),
    );
    let lights: [scenes::NamedScene; 2] = [("sun", scenes::sun), ("spot", scenes::spot)];
    for (light, scene) in lights {
        let mut row =
            |name: &str, scene: Result<Scenario, ModelError>| row(&format!("{name}, {light}"), scene);
        // A spot's map is square.
        let size = if light == "sun" { [9, 7] } else { [8, 8] };
        row("hair out of order", with(scene(), size, |i, j| (0..9).map(|n| hair(i, j, n)).collect()));
        row("no segment at all", with(scene(), size, |_, _| Vec::new()));
        row("opaque hair", with(scene(), size, |i, j| vec![TranslucentSegment::hair(number(i, j, 5), 1.0)]));
        row(
            "the same hair a hundred times",
            with(scene(), size, |i, j| vec![TranslucentSegment::hair(number(i, j, 1), 0.02); 100]),
        );
        row("all before everything", with(scene(), size, |_, _| vec![TranslucentSegment::hair(0.0, 0.5)]));
        row(
            "smoke without length, and hair of no opacity",
            with(scene(), size, |i, j| {
                let sheet = cloud(i, j, 0);
                let sheet = TranslucentSegment { exit: sheet.entry, ..sheet };
                vec![sheet, TranslucentSegment::hair(number(i, j, 5), 0.0)]
            }),
        );
        row("the same smoke ten times", with(scene(), size, |i, j| vec![cloud(i, j, 1); 10]));
        row("far ones first", with(scene(), size, |i, j| layers(i, j).into_iter().rev().collect()));
        row(
            "an opaque surface first, smoke before and behind it",
            with(scene(), size, |i, j| {
                let opaque = TranslucentSegment::hair(0.5, 1.0);
                std::iter::once(opaque).chain(layers(i, j)).collect()
            }),
        );
        row(
            "smoke of infinite extinction over a length",
            with(scene(), size, |i, j| {
                vec![cloud(i, j, 0), TranslucentSegment { optical_depth: f32::INFINITY, ..cloud(i, j, 1) }]
            }),
        );
        row(
            "a wall of optical depth 10⁴ in a thousandth of the way",
            with(scene(), size, |i, j| {
                let entry = 0.9 * number(i, j, 3);
                vec![TranslucentSegment { entry, exit: entry + 1e-3, optical_depth: 1e4 }, cloud(i, j, 0)]
            }),
        );
        // 0.99004983 is left of the light (1-model's extremes), at ten depths, so that brute force ends.
        row(
            "ten thousand hairs of opacity 1e-6",
            with(scene(), [1, 1], |_, _| {
                let hair = |n: u32| TranslucentSegment::hair(0.08 * (n % 10) as f32 + 0.1, 1e-6);
                (0..10_000).map(hair).collect()
            }),
        );
        row(
            "three hundred thin slices of smoke",
            with(scene(), [2, 2], |i, j| {
                let slice = |n: u32| {
                    let entry = number(i, j, n);
                    TranslucentSegment { entry, exit: entry + 1e-4, optical_depth: 0.01 }
                };
                (0..300).map(slice).collect()
            }),
        );
    }
    let refusals: [Refusal; 5] = [
        ("a segment that ends before it begins", || given(0.6, 0.5, 1.0), "texel (1, 0)"),
        ("a segment before depth 0", || given(-0.1, 0.5, 1.0), "texel (1, 0)"),
        ("a segment without an end", || given(0.1, f32::INFINITY, 1.0), "texel (1, 0)"),
        ("NaN as an optical depth", || given(0.1, 0.5, f32::NAN), "texel (1, 0)"),
        ("a negative optical depth", || given(0.1, 0.5, -1.0), "texel (1, 0)"),
    ];
    rows.extend(refusals.map(|(name, input, names)| StressRow {
        group: GROUP,
        name: name.into(),
        trial: Trial::Refusal { input, names },
    }));
    rows
}

/// Five clouds, one behind the other, and a hair between.
fn layers(i: u32, j: u32) -> Vec<TranslucentSegment> {
    let cloud = |n: u32| {
        let entry = 0.19 * n as f32;
        TranslucentSegment { entry, exit: entry + 0.15, optical_depth: 0.6 * number(i, j, n) }
    };
    (0..5).map(cloud).chain([TranslucentSegment::hair(0.36, 0.3)]).collect()
}

/// A layer whose second texel has this segment.
fn given(entry: f32, exit: f32, optical_depth: f32) -> Result<(), ModelError> {
    let frame = scenes::sun_frame(scenes::SUN, scenes::TARGET, [1.0, 1.0], [2, 1]);
    let segments = [TranslucentSegment { entry, exit, optical_depth }];
    TranslucentLayer::new(frame.projection()?, &[0, 0, 1], &segments).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contender::Contender;
    use crate::stress::run;

    #[test]
    fn the_exact_walk_is_what_brute_force_says_of_smoke_and_hair() {
        // No technique: the references alone.
        let contenders = Contender::all(&[]);
        for row in rows() {
            let start = std::time::Instant::now();
            let result = run(row, &contenders);
            for (cell, _) in &result.cells {
                println!("{}: {cell} ({:.0?})", result.name, start.elapsed());
            }
            assert!(!result.has_failed(), "{}", result.name);
        }
    }
}
