//! A lamp straight behind the eye, in the middle of a pixel: view rays beside that pixel's meet light rays that its own never meets.

use filtered_prefix::{FilteredPrefix, Options};
use glam::DVec3;
use scatter_core::{Camera, RayLight};
use scatter_testing::{Filling, MapKind, OwnedFrame};

/// Lit up to a plane across the view: each pixel's light is a closed form up to it.
#[test]
fn uncertified_rows_know_all_light_rays_that_their_view_rays_meet() {
    let stock = OwnedFrame::stock(MapKind::Point, [3, 5], 16, Filling::Constant(4.0));
    let lamp = stock.light.position().unwrap();
    let eye = lamp - DVec3::Y * 3.3;
    let camera =
        Camera::perspective(eye.to_array(), (eye - DVec3::Y).to_array(), [0.0, 0.0, 1.0], 30.0, [3, 5]);
    let frame = OwnedFrame { camera: camera.unwrap(), ..stock };
    let options = Options {
        certified: false,
        spacing: 0.25,
        target: None,
        uncut_columns: 0.0,
        shared_columns: 0,
        ..Options::default()
    };
    let image = frame.render(&mut FilteredPrefix::new(options));
    frame.with(|frame| {
        let mut worst = 0.0f64;
        for (x, y) in (0..5).flat_map(|y| (0..3).map(move |x| (x, y))) {
            let ray = frame.camera().pixel_ray(x, y);
            let light = RayLight::new(frame.light(), frame.medium(), eye, &ray);
            let end = frame.ray_end(x, y);
            let [lit, whole] = [(4.0 - 3.3) / -ray.direction.y, end].map(|end| light.interval(0.0, end).x);
            let off = (f64::from(image.at(x, y)[0]) - lit).abs() / whole;
            worst = worst.max(off);
        }
        println!("largest error of a pixel, of its unoccluded light: {worst:.1e}");
        // One surface is exact to the bias of 5e-6; a band's rays share weights, and what they have of a light ray differs by the ratio of
        // sines at which bands end, 1.25: half the L1 distance of such weights is at most tanh(ln 1.25 / 4) = 0.056.
        assert!(worst < 0.05, "{worst}");
    });
}
