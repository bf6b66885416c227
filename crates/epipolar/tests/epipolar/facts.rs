//! Facts of slices on scenes whose facts are known.

use std::f64::consts::PI;

use epipolar::driver::SliceFacts;
use scatter_core::{Camera, Light, MapProjection, RenderStats};
use scatter_testing::{OwnedFrame, boards};

fn facts(scene: &OwnedFrame) -> SliceFacts {
    scene.with(|frame| {
        let mut stats = RenderStats::default();
        let facts = SliceFacts::of(frame, &mut stats);
        assert!(stats.stages.get("slice-facts").is_some(), "its cost is told");
        facts
    })
}

#[test]
fn boards_under_a_sun_have_two_edges_a_board_and_nothing_has_none() {
    let mut scene = boards([67, 45]);
    let some = facts(&scene);
    println!("{some:?}");
    // Three boards, of which no slice crosses less than none or more than all, each with two edges; texels of a board
    // that is seen steeply may end more than a view ray apart.
    assert!(some.transitions > 0.5 && some.slices > 30);
    scene.texels.iter_mut().for_each(|texels| texels.fill(f32::INFINITY));
    let none = facts(&scene);
    assert_eq!((none.transitions, none.most_transitions, none.runs), (0.0, 0, 1.0));
    assert!(none.end_variation < 3.0, "one smooth background: {none:?}");
}

#[test]
fn the_epipole_and_the_angles_are_where_the_camera_sees_the_sun() {
    let mut scene = boards([67, 45]);
    for towards in [1.0, -1.0] {
        // The sun 10° above the view direction, before or behind the camera; the image is 60° high.
        let camera =
            Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, [67, 45]).unwrap();
        let (sine, cosine) = 10f64.to_radians().sin_cos();
        let to_light = glam::DVec3::new(0.0, sine, -cosine) * towards;
        let direction = (-to_light).to_array();
        scene.camera = camera;
        scene.light = Light::directional(direction, [1.0; 3]).unwrap();
        let up = [0.0, 1.0, 0.0];
        scene.projections =
            vec![MapProjection::orthographic([0.0; 3], direction, up, [5.0, 4.0], [80, 64]).unwrap()];
        let facts = facts(&scene);
        assert_eq!((facts.towards_light, facts.epipole_on_screen), (towards > 0.0, true));
        let [x, y] = facts.epipole.unwrap();
        let expected = 22.5 * (1.0 - 10f64.to_radians().tan() / 30f64.to_radians().tan());
        assert!((x - 33.5).abs() < 1e-9 && (y - expected).abs() < 1e-9, "{x} {y}");
        // The farthest corner is the one below: 40° below the sun and aside.
        let corner =
            glam::DVec3::new(30f64.to_radians().tan() * 67.0 / 45.0, -(30f64.to_radians().tan()), -1.0);
        let farthest = (corner.normalize().dot(to_light * towards)).acos();
        let [least, most] = facts.angles;
        let (near, far) = if towards > 0.0 { (least, most) } else { (PI - most, PI - least) };
        // A sample of slices and of columns' middles: two pixels of 1.3°.
        assert!(near == 0.0 && (far - farthest).abs() < 0.05, "{least} {most} {farthest}");
    }
}
