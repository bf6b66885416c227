//! What plans count, for whole frames up to 4K and maps up to 8192²: printed, and no buffer exceeds what WebGPU guarantees
//! unless the error says so. No adapter is needed.

use scatter_core::{Camera, Light, MapKind, MapLayout, MapProjection, Medium, Phase, Setup};
use scatter_kernels::minmax::MinMaxPlan;
use scatter_kernels::plan::MOST_BINDING_BYTES;
use scatter_kernels::{Plan, TooLarge};

const SIZES: [[u32; 2]; 3] = [[1920, 1080], [2560, 1440], [3840, 2160]];
const SIDES: [u32; 4] = [1024, 2048, 4096, 8192];

/// Exact min/max with maps of `side`² texels.
fn min_max(size: [u32; 2], side: u32, cascades: usize) -> Result<Plan, TooLarge> {
    let camera = Camera::perspective([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], 60.0, size).unwrap();
    let down = [0.0, -1.0, 0.0];
    let sun = Light::directional(down, [1.0; 3]).unwrap();
    let map = MapProjection::orthographic([0.0; 3], down, [1.0, 0.0, 0.0], [1.0; 2], [side; 2]).unwrap();
    let layout = MapLayout::new(MapKind::Cascades, &vec![map; cascades]).unwrap();
    let medium = Medium::homogeneous([0.1; 3], [0.0; 3], Phase::Isotropic).unwrap();
    let mut frame = MinMaxPlan::default();
    frame.rebuild(&Setup::new(&camera, &sun, layout, &medium, 10.0).unwrap())?;
    let plan = Plan::min_max(&frame, size, 1, 1, false);
    plan.check()?;
    Ok(plan)
}

#[test]
fn no_buffer_exceeds_a_binding_or_the_error_says_so() {
    let (mut planned, mut refused) = (0, 0);
    for size in SIZES {
        for scale in [1, 2, 4] {
            let plan = Plan::march(size, scale, 1, 64, false);
            plan.check().unwrap();
            assert!(plan.buffers.iter().all(|buffer| buffer.bytes <= MOST_BINDING_BYTES));
            planned += 1;
        }
        for (side, cascades) in SIDES.into_iter().flat_map(|side| [1, 4, 16].map(|count| (side, count))) {
            // 8 bytes a node, 1/16 + 1/64 + … of the texels.
            let trees = u64::from(side).pow(2) * cascades as u64 * 2 / 3;
            match min_max(size, side, cascades) {
                Ok(plan) => {
                    assert!(plan.buffers.iter().all(|buffer| buffer.bytes <= MOST_BINDING_BYTES));
                    planned += 1;
                }
                Err(error) => {
                    assert!(trees > MOST_BINDING_BYTES - 4096, "{side}² × {cascades} would fit: {error}");
                    assert!(error.to_string().contains("134217728"), "{error}");
                    refused += 1;
                }
            }
        }
    }
    println!("{planned} frames planned, {refused} refused by name");
    // 8192² × 4 and × 16, 4096² × 16, for each size.
    assert_eq!(refused, 3 * SIZES.len());
}

/// The table in scatter-gpu's README.
#[test]
fn counts_of_a_frame() {
    println!("| 1920×1080 | pass | workgroups | texel loads |\n| --- | --- | --- | --- |");
    let plans = [
        ("march, 64 steps", Plan::march([1920, 1080], 1, 1, 64, false)),
        ("min/max, one 2048²", min_max([1920, 1080], 2048, 1).unwrap()),
        ("min/max, four 2048²", min_max([1920, 1080], 2048, 4).unwrap()),
    ];
    for (name, plan) in &plans {
        for pass in &plan.passes {
            let groups: u64 = pass.groups.iter().map(|&n| u64::from(n)).product();
            println!("| {name} | `{}` | {groups} | {} |", pass.name, pass.loads);
        }
        println!("| {name} | buffers | | {} bytes |", plan.bytes());
    }
    // P × steps of the design, and P × 8 B for distances: a load and a store of 4.
    assert_eq!(plans[0].1.passes[1].loads, 1920 * 1080 * 64);
    assert_eq!(plans[1].1.passes[1].loads, 2048 * 2048);
}
