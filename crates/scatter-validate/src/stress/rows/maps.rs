//! Shadow maps of one texel, all near, all far, checkered, beside the view; cascades; coloured glass.

use scatter_core::ModelError;

use crate::checks::{behind_lamp_glass, cascades, coloured_glass};
use crate::scenario::{MapLayer, Scenario, Shadow};
use crate::stress::row::StressRow;
use crate::stress::scenes::{self, SCENES};

const GROUP: &str = "shadow maps";

/// Rows of maps.
pub fn rows() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for (light, scene) in SCENES {
        let mut row = |name: &str, change: &dyn Fn(Scenario) -> Scenario| {
            rows.push(StressRow::image(GROUP, format!("{name}, {light}"), scene().map(change)));
        };
        row("1x1 texels", &|scene| scene.with_map_side(1).with_depths(|_, _, _| 2.0));
        row("all near: depth 0", &|scene| scene.with_depths(|_, _, _| 0.0));
        row("all far: no surface", &|scene| scene.with_depths(|_, _, _| f32::INFINITY));
        row("all far: depth 1e30", &|scene| scene.with_depths(|_, _, _| 1e30));
        row("checkerboard of 0 and ∞", &|scene| {
            scene.with_depths(|_, i, j| if (i + j) % 2 == 0 { 0.0 } else { f32::INFINITY })
        });
        row("every other column dark", &|scene| {
            scene.with_depths(|_, i, _| if i % 2 == 0 { 0.0 } else { f32::INFINITY })
        });
        row("one lit texel", &|scene| {
            scene.with_depths(|_, i, j| if (i, j) == (6, 5) { f32::INFINITY } else { 0.0 })
        });
        row("63x63 texels", &|scene| scene.with_map_side(63));
    }
    let row = |name: &str, scene| StressRow::image(GROUP, name, scene);
    rows.push(row("wholly beside the view, sun", beside_the_view()));
    rows.push(row("three cascades", cascades()));
    rows.push(row(
        "coloured glass, sun",
        scenes::sun().map(|s| Scenario { glass: Some(coloured_glass()), ..s }),
    ));
    for (light, scene) in [("point", scenes::point()), ("spot", scenes::spot())] {
        rows.push(row(&format!("coloured glass, {light}"), scene.map(behind_lamp_glass)));
    }
    rows
}

fn beside_the_view() -> Result<Scenario, ModelError> {
    let mut scene = scenes::sun()?;
    let aside = scenes::TARGET + 500.0 * scene.camera.right();
    let frame = scenes::sun_frame(scenes::SUN, aside, [3.0, 2.0], [9, 7]);
    scene.shadow = Shadow::Parallel(vec![MapLayer::filled(frame, |_, _| 1.0)]);
    Ok(scene)
}
