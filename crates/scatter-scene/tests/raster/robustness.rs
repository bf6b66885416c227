//! Sizes, limits, errors, other processes, and many lives of a device.

use std::process::Command;
use std::sync::Arc;

use glam::DVec3;
use scatter_core::{MapProjection, MapSource};
use scatter_scene::{RasterDevice, RasterOptions, RasterScene, Scene, SceneCaster, raster_devices};

use super::driver::{assert_valid, device};

/// A square of 2×2 units at y = 0 with a tent over its +x half.
fn tent() -> Arc<SceneCaster> {
    let p = DVec3::new;
    let positions = vec![
        p(-1.0, 0.0, -1.0),
        p(1.0, 0.0, -1.0),
        p(1.0, 0.0, 1.0),
        p(-1.0, 0.0, 1.0),
        p(0.0, 0.5, -1.0),
        p(1.0, 1.5, 0.0),
        p(0.0, 0.5, 1.0),
    ];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6]];
    Arc::new(SceneCaster::new(&Scene { positions, triangles, ..Scene::default() }).unwrap())
}

/// From above: 3 units over the square.
fn above(size: [u32; 2]) -> MapProjection {
    MapProjection::orthographic([0.0, 3.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.25, 1.25], size)
        .unwrap()
}

#[test]
fn sizes_from_one_texel_to_the_devices_limit_are_drawn() {
    let test = "sizes_from_one_texel_to_the_devices_limit_are_drawn";
    let Some(device) = device(test) else { return };
    let caster = tent();
    let raster = RasterScene::new(&device, caster.clone()).unwrap();
    let limit = device.largest_map();
    assert!(limit >= 4096, "Vulkan's own minimum");
    // The last but one comes back in two strips and a bit.
    let sizes = [
        [1, 1],
        [1, 7],
        [64, 1],
        [65, 63],
        [127, 128],
        [limit, 1],
        [1, limit],
        [limit.min(8192), 4111],
        [3, 2],
    ];
    for size in sizes {
        let (mut drawn, mut cast) = (vec![7.0], Vec::new());
        raster.shadow_map(&above(size), &mut drawn).unwrap();
        caster.shadow_map(&above(size), &mut cast).unwrap();
        assert_eq!(drawn.len(), cast.len());
        let differ = drawn.iter().zip(&cast).filter(|(a, b)| !(a == b || (*a - *b).abs() < 1e-5)).count();
        // Texel centres on an edge may fall to either side: a row's or a column's worth.
        assert!(differ <= 4 * (size[0] + size[1]) as usize, "{size:?}: {differ} differ");
    }
    assert_valid(&device);
}

#[test]
fn row_zero_is_on_top_and_depth_is_linear() {
    let Some(device) = device("row_zero_is_on_top_and_depth_is_linear") else { return };
    let raster = RasterScene::new(&device, tent()).unwrap();
    let mut texels = Vec::new();
    // Texels of ½ × ¼ unit; up is −z. The tent covers x ≥ |z| at the height ½ + x.
    raster.shadow_map(&above([5, 10]), &mut texels).unwrap();
    let at = |column: usize, row: usize| f64::from(texels[row * 5 + column]);
    assert_eq!((at(0, 0), at(4, 9)), (f64::INFINITY, f64::INFINITY));
    let near = |a: f64, b: f64| (a - b).abs() < 1e-6;
    assert!(near(at(1, 4), 3.0) && near(at(1, 1), 3.0), "{texels:?}");
    // Column 3 is x = ½: the tent's height there is 1 within |z| < ½.
    assert!(near(at(3, 4), 2.0) && near(at(3, 5), 2.0), "{texels:?}");
    assert!(near(at(3, 1), 3.0) || at(3, 1) < 3.0, "{texels:?}");
    assert_valid(&device);
}

#[test]
fn a_scene_without_triangles_has_empty_maps() {
    let Some(device) = device("a_scene_without_triangles_has_empty_maps") else { return };
    let caster = SceneCaster::new(&Scene::default()).unwrap();
    let raster = RasterScene::new(&device, Arc::new(caster)).unwrap();
    let mut texels = vec![1.0; 3];
    raster.shadow_map(&above([5, 3]), &mut texels).unwrap();
    assert_eq!(texels, [f32::INFINITY; 15]);
    raster.cube_map([0.0; 3], 2, &mut texels).unwrap();
    assert_eq!(texels, [f32::INFINITY; 24]);
}

#[test]
fn a_map_beyond_the_limits_is_an_error_with_its_cure() {
    let Some(device) = device("a_map_beyond_the_limits_is_an_error_with_its_cure") else { return };
    let raster = RasterScene::new(&device, tent()).unwrap();
    let mut texels = Vec::new();
    for size in [[65536, 65536], [device.largest_map() + 1, 1]] {
        let error = raster.shadow_map(&above(size), &mut texels).unwrap_err().to_string();
        assert!(error.contains("smaller map") && error.contains(&size[0].to_string()), "{error}");
        assert!(!error.contains('\n'));
    }
    let mut out = Vec::new();
    let singular = [[0.0; 4]; 4];
    let error = raster.clip_map(singular, [3, 2], &mut out).unwrap_err().to_string();
    assert!(error.contains("singular"), "{error}");
    let unit = glam::DMat4::IDENTITY.to_cols_array_2d();
    let error = raster.clip_map(unit, [0, 3], &mut out).unwrap_err().to_string();
    assert!(error.contains("1x1"), "{error}");
    // It is as good as before.
    raster.shadow_map(&above([4, 3]), &mut texels).unwrap();
    assert!(texels.iter().any(|t| t.is_finite()));
    assert_valid(&device);
}

#[test]
fn the_device_is_found_by_its_name_and_its_number() {
    let Some(device) = device("the_device_is_found_by_its_name_and_its_number") else { return };
    let devices = raster_devices().unwrap();
    let name = &device.info().name;
    let index = devices.iter().position(|info| info == device.info()).unwrap();
    for choice in [index.to_string(), name.to_uppercase()] {
        let options = RasterOptions { device: choice.parse().unwrap(), validate: false };
        assert_eq!(RasterDevice::open(&options).unwrap().info(), device.info());
    }
    let options = RasterOptions { device: "no such device".parse().unwrap(), validate: false };
    let error = RasterDevice::open(&options).unwrap_err();
    assert!(!error.is_missing_driver() && error.to_string().contains(name.as_str()), "{error}");
}

#[test]
fn a_machine_without_a_driver_gets_one_line_with_the_cure() {
    // A child whose loader finds no driver.
    let Some(_) = device("a_machine_without_a_driver_gets_one_line_with_the_cure") else { return };
    let none = std::env::temp_dir().join("no-such-driver.json");
    let output = child("child_prints_its_error")
        .env("VK_ICD_FILENAMES", &none)
        .env("VK_DRIVER_FILES", &none)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{text}");
    let line = text.lines().find(|line| line.contains("CHILD")).unwrap_or_default();
    assert!(line.contains("no Vulkan driver") && line.contains("apt-get install"), "{text}");
}

#[test]
fn two_processes_draw_at_once() {
    let Some(_) = device("two_processes_draw_at_once") else { return };
    let start = || child("child_draws").stdout(std::process::Stdio::piped()).spawn().unwrap();
    let children = [start(), start()];
    for child in children {
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success() && text.contains("CHILD drew"), "{text}");
    }
}

#[test]
fn a_hundred_devices_one_after_the_other_leave_nothing_behind() {
    let Some(_) = device("a_hundred_devices_one_after_the_other_leave_nothing_behind") else { return };
    // A process of its own: other tests' memory must not count.
    let output = child("child_lives_a_hundred_times").output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && text.contains("CHILD grew"), "{text}");
    print!("{text}");
}

/// This program again, with one of the tests below.
fn child(test: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", &format!("robustness::{test}"), "--nocapture"]).env(CHILD, "1");
    command
}

/// Set in children: without it their tests have nothing to do.
const CHILD: &str = "SCATTER_TEST_CHILD";

fn is_child() -> bool {
    std::env::var_os(CHILD).is_some()
}

#[test]
fn child_prints_its_error() {
    if is_child() {
        match RasterDevice::open(&RasterOptions::default()) {
            Ok(device) => println!("CHILD found {}", device.info()),
            Err(error) => println!("CHILD {error}"),
        }
    }
}

#[test]
fn child_draws() {
    if is_child() {
        let device = RasterDevice::open(&RasterOptions::default()).unwrap();
        let raster = RasterScene::new(&device, tent()).unwrap();
        let mut texels = Vec::new();
        for _ in 0..20 {
            raster.shadow_map(&above([700, 500]), &mut texels).unwrap();
        }
        println!("CHILD drew {} texels", texels.iter().filter(|t| t.is_finite()).count());
    }
}

#[test]
fn child_lives_a_hundred_times() {
    if !is_child() {
        return;
    }
    let caster = tent();
    let live = || {
        let device = RasterDevice::open(&RasterOptions::default()).unwrap();
        let raster = RasterScene::new(&device, caster.clone()).unwrap();
        let mut texels = Vec::new();
        raster.shadow_map(&above([256, 256]), &mut texels).unwrap();
    };
    // The driver's and the allocator's caches fill first.
    for _ in 0..20 {
        live();
    }
    let before = resident_bytes();
    for _ in 0..100 {
        live();
    }
    let grown = resident_bytes().saturating_sub(before);
    println!("CHILD grew by {grown} bytes in 100 lives");
    // A leaked map would be 26 MB, a leaked device several MB a life.
    assert!(grown < 8 << 20, "{grown} bytes");
}

/// Resident memory of this process; 0 where the system does not tell.
fn resident_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()).and_then(|n| n.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
