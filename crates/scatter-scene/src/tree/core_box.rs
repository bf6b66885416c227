//! Where nearly all of a scene is, for scenes with a vertex or two very far out.
//!
//! An f32 tree holds coordinates relative to one point. In the middle of a scene's bounds that costs nothing; but one
//! stray vertex 10¹³ units away moves the middle 10¹² units off, where f32 knows no place better than by 10⁵ units, and
//! every box overlaps every other one.

use glam::DVec3;

/// The box that holds a scene but for its outermost vertices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CoreBox {
    /// Its middle.
    pub centre: DVec3,
    /// Largest half of a side.
    pub reach: f64,
}

/// Share of the vertices, at each end of each axis, that may be strays.
const STRAYS: usize = 64;
/// Vertices below which none is a stray: there is nothing to compare it with.
const FEWEST: usize = 8;

impl CoreBox {
    /// Of these positions, all finite; `None` unless some vertex is more than `factor` times as far out as the box
    /// reaches. `O(n)`.
    pub fn of(positions: &[DVec3], factor: f64) -> Option<Self> {
        if positions.len() < FEWEST {
            return None;
        }
        let cut = (positions.len() / STRAYS).max(1);
        let mut axis: Vec<f64> = Vec::with_capacity(positions.len());
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        for i in 0..3 {
            axis.clear();
            axis.extend(positions.iter().map(|p| p[i]));
            low[i] = *axis.select_nth_unstable_by(cut, f64::total_cmp).1;
            high[i] = *axis.select_nth_unstable_by(positions.len() - 1 - cut, f64::total_cmp).1;
        }
        let core = Self { centre: 0.5 * (low + high), reach: 0.5 * (high - low).max_element() };
        // A scene of one point has no size to compare with.
        let is_stray = |p: &DVec3| core.distance(*p) > factor * core.reach && core.reach > 0.0;
        positions.iter().any(is_stray).then_some(core)
    }

    /// How far a point is from the middle, along the axis on which it is farthest.
    pub fn distance(&self, p: DVec3) -> f64 {
        (p - self.centre).abs().max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stray_vertex_is_told_from_a_wide_scene() {
        let mut positions: Vec<DVec3> = (0..1000)
            .map(|i| DVec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)))
            .collect();
        assert_eq!(CoreBox::of(&positions, 1e3), None);
        positions.push(DVec3::new(-1e13, 3.0, 2.0));
        let core = CoreBox::of(&positions, 1e3).unwrap();
        assert_eq!((core.centre, core.reach), (DVec3::splat(4.5), 4.5));
        assert_eq!(CoreBox::of(&positions, 1e13), None);
        // A terrain of one kilometre under a hut is no stray of it, nor are a few vertices.
        assert_eq!(CoreBox::of(&positions[997..], 1e3), None);
    }
}
