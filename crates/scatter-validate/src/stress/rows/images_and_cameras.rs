//! Images of one pixel, row or column; lenses from 1° to 179.9999°; cameras without a perspective.

use scatter_core::{Camera, ModelError, Window};

use crate::scenario::Scenario;
use crate::stress::row::StressRow;
use crate::stress::scenes::{self, EYE, SCENES, SIZE, TARGET};

/// Rows of image sizes and cameras.
pub fn rows() -> Vec<StressRow> {
    let mut rows = Vec::new();
    for (light, scene) in SCENES {
        for size in [[1, 1], [1, 37], [37, 1], [2, 3]] {
            let seen = seen_by(scene(), scenes::camera(size));
            rows.push(StressRow::image("image size", format!("{}x{}, {light}", size[0], size[1]), seen));
        }
    }
    let up = [0.0, 1.0, 0.0];
    let (eye, target) = (EYE.to_array(), TARGET.to_array());
    for (light, scene) in SCENES {
        let cameras = [
            ("field of view of 1°", Camera::perspective(eye, target, up, 1.0, SIZE)),
            ("field of view of 170°", Camera::perspective(eye, target, up, 170.0, SIZE)),
            ("field of view of 179°", Camera::perspective(eye, target, up, 179.0, SIZE)),
            ("field of view of 179.9999°", Camera::perspective(eye, target, up, 179.9999, SIZE)),
            ("orthographic", Camera::orthographic(eye, target, up, 5.0, SIZE)),
            ("off-centre", off_centre([-0.2, 0.9, -0.7, 0.1])),
            ("mirrored window", off_centre([0.8, -0.7, -0.5, 0.5])),
            ("rolled by 77°", Camera::perspective(eye, target, [0.97, 0.22, 0.1], 60.0, SIZE)),
        ];
        for (name, camera) in cameras {
            rows.push(StressRow::image("camera", format!("{name}, {light}"), seen_by(scene(), camera)));
        }
    }
    rows
}

fn seen_by(
    scene: Result<Scenario, ModelError>,
    camera: Result<Camera, ModelError>,
) -> Result<Scenario, ModelError> {
    Ok(scene?.seen_by(camera?))
}

fn off_centre([left, right, bottom, top]: [f64; 4]) -> Result<Camera, ModelError> {
    let window = Window { left, right, bottom, top };
    Camera::perspective_off_centre(EYE.to_array(), TARGET.to_array(), [0.0, 1.0, 0.0], window, SIZE)
}
