//! Ground: smooth noise and sheets of triangles over a grid.
//!
//! Value noise on a hashed lattice with cubic easing, and ridged sums of it (Musgrave, in Ebert et al., "Texturing
//! and Modeling", 3rd ed., section 16.3, with fixed instead of signal-dependent weights).

use super::mesh::Mesh;
use super::random::{mix, unit_from_bits};
use glam::DVec3;

/// Smooth noise in [−1, 1] with features of size 1; zero on average.
pub(crate) fn smooth_noise(x: f64, z: f64, seed: u64) -> f64 {
    let corner = |dx: f64, dz: f64| {
        let column = ((x.floor() + dx) as i64 as u64).wrapping_mul(0x1_0000_0001);
        let row = ((z.floor() + dz) as i64 as u64).wrapping_mul(0x9e37_79b9);
        2.0 * unit_from_bits(mix(mix(column ^ row ^ (seed << 56)))) - 1.0
    };
    let (u, v) = (ease(x - x.floor()), ease(z - z.floor()));
    let low = corner(0.0, 0.0) * (1.0 - u) + corner(1.0, 0.0) * u;
    let high = corner(0.0, 1.0) * (1.0 - u) + corner(1.0, 1.0) * u;
    low * (1.0 - v) + high * v
}

/// Noise with sharp crests, in [0, 1]: octaves of `1 − |noise|`, each half as wide and half as high as the last.
pub(crate) fn ridged_noise(x: f64, z: f64, octaves: u32, seed: u64) -> f64 {
    let (mut sum, mut weight, mut scale) = (0.0, 0.5, 1.0);
    for octave in 0..octaves {
        let crest = 1.0 - smooth_noise(x * scale, z * scale, seed + u64::from(octave)).abs();
        sum += weight * crest * crest;
        weight *= 0.5;
        // Not exactly two: lattice points of different octaves would fall together.
        scale *= 2.03;
    }
    sum
}

/// 0 below 0, 1 above 1, and a smooth step between.
pub(crate) fn ease(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A sheet over the rectangle from `low` to `high` (x, z), `cells` along each side, at the given height.
pub(crate) fn sheet(
    low: [f64; 2],
    high: [f64; 2],
    cells: [usize; 2],
    height: impl Fn(f64, f64) -> f64,
) -> Mesh {
    let mut mesh = Mesh::default();
    let at =
        |axis: usize, index: usize| low[axis] + (high[axis] - low[axis]) * index as f64 / cells[axis] as f64;
    for i in 0..=cells[0] {
        for k in 0..=cells[1] {
            let (x, z) = (at(0, i), at(1, k));
            mesh.push_apart(DVec3::new(x, height(x, z), z));
        }
    }
    let row = cells[1] as u32 + 1;
    for i in 0..cells[0] as u32 {
        for k in 0..cells[1] as u32 {
            let first = i * row + k;
            mesh.quad([first, first + 1, first + row + 1, first + row]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_continuous_over_the_lattice_and_bounded() {
        for i in -300..300 {
            let (x, z) = (f64::from(i) * 0.37, f64::from(i) * -0.21);
            let here = smooth_noise(x, z, 7);
            assert!(here.abs() <= 1.0 && (0.0..=1.0).contains(&ridged_noise(x, z, 5, 7)));
            // The slope of easing is at most 1.5, and corners differ by at most 2.
            let step = 1e-3;
            assert!((smooth_noise(x + step, z, 7) - here).abs() <= 3.0 * step * 1.0001);
            let line = x.round();
            assert!((smooth_noise(line - 1e-9, z, 7) - smooth_noise(line, z, 7)).abs() < 1e-8);
        }
    }

    #[test]
    fn a_sheet_has_two_triangles_a_cell_all_facing_up() {
        let mesh = sheet([-1.0, 0.0], [2.0, 5.0], [3, 4], |x, z| 0.1 * x - 0.2 * z);
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4 * 5, 2 * 3 * 4));
        for corners in &mesh.triangles {
            let [a, b, c] = corners.map(|index| DVec3::from(mesh.positions[index as usize].map(f64::from)));
            assert!((b - a).cross(c - a).y > 0.0);
        }
    }
}
