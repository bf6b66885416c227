//! Points and lines of a built-in scene, with the attributes that make them smoke and hair.

use glam::DVec3;

/// glTF's primitive modes.
const POINTS: u32 = 0;
const LINES: u32 = 1;

/// A mesh of points or lines.
#[derive(Debug, Clone)]
pub(crate) struct OccluderMesh {
    /// glTF's primitive mode.
    pub mode: u32,
    pub positions: Vec<[f32; 3]>,
    /// Of lines, two each.
    pub indices: Vec<u32>,
    /// One number a vertex: the attribute's name, and its values.
    pub scalars: [(&'static str, Vec<f32>); 2],
}

impl OccluderMesh {
    /// Spheres of smoke: middle, radius, density.
    pub(crate) fn particles(spheres: &[(DVec3, f64, f64)]) -> Self {
        Self {
            mode: POINTS,
            positions: spheres.iter().map(|(centre, ..)| rounded(*centre)).collect(),
            indices: Vec::new(),
            scalars: [
                ("_RADIUS", spheres.iter().map(|(_, radius, _)| *radius as f32).collect()),
                ("_DENSITY", spheres.iter().map(|(.., density)| *density as f32).collect()),
            ],
        }
    }

    /// Strands of one opacity, each thinner towards its tip.
    pub(crate) fn strands(strands: &[Vec<DVec3>], radius: f64, opacity: f64) -> Self {
        let mut mesh = Self {
            mode: LINES,
            positions: Vec::new(),
            indices: Vec::new(),
            scalars: [("_RADIUS", Vec::new()), ("_OPACITY", Vec::new())],
        };
        for strand in strands {
            let first = mesh.positions.len() as u32;
            for (index, p) in strand.iter().enumerate() {
                let share = index as f64 / (strand.len() - 1) as f64;
                mesh.positions.push(rounded(*p));
                mesh.scalars[0].1.push((radius * (1.0 - 0.5 * share)) as f32);
                mesh.scalars[1].1.push(opacity as f32);
            }
            mesh.indices.extend((1..strand.len() as u32).flat_map(|k| [first + k - 1, first + k]));
        }
        mesh
    }
}

/// Rounded to f32, with one zero.
fn rounded(p: DVec3) -> [f32; 3] {
    p.to_array().map(|x| x as f32 + 0.0)
}
