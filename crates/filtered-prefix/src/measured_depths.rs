//! The depths of a slice's row in another measure than places in the order of its columns: the angle to the light, with or without a
//! warp (Klehm et al. 2014, Sections 4.1 and 5).
//!
//! Columns are told apart as before, so that what is lit stays the same; what changes is how far apart the basis sees two of them. The
//! columns' borders become whole numbers that grow with the measure, and runs and view rays are renumbered by them:
//! whatever filters ranks filters these.

use epipolar::driver::SliceView;
use epipolar::geometry::STEEPEST;

use crate::options::Depths;
use crate::runs::{Asked, Runs};

/// Whole steps of a slice's range. Fewer, and columns beside the epipole are no farther apart than one step; twice as many would leave
/// no room for the columns that need a step of their own.
const STEPS: f64 = 1_073_741_824.0;

/// Runs and view rays of a slice by their depths; a buffer, empty where places are kept.
#[derive(Debug, Default)]
pub struct MeasuredDepths {
    /// Of the columns' borders, in the order of light: one more than there are columns.
    borders: Vec<u32>,
    /// The borders behind which light rays end, of each run.
    lit: Vec<u32>,
    /// The places of the view rays, while they have depths in their stead.
    ranks: Vec<u32>,
}

impl MeasuredDepths {
    /// Room for slices of so many columns, runs and queries.
    pub fn reserve(&mut self, columns: usize, runs: usize, queries: usize) {
        for (list, length) in
            [(&mut self.borders, columns + 1), (&mut self.lit, runs), (&mut self.ranks, queries)]
        {
            list.clear();
            list.reserve(length);
        }
    }

    /// Gives runs and view rays their depths; by [`Depths::Places`] nothing.
    pub fn measure(&mut self, depths: Depths, slice: &SliceView<'_>, runs: Runs<'_>, asked: &mut Asked) {
        if depths == Depths::Places {
            return;
        }
        let [first, end] = slice.order.columns.map(f64::from);
        self.number(slice.order.count(), runs.lit, &mut asked.ranks, |place| {
            let column = if slice.order.ascending { first + place } else { end - place };
            let ray = slice.plane.view_ray(column - 0.5);
            measured(depths, ray.x.atan2(ray.y))
        });
    }

    /// Numbers `count` columns by the measure `at` a place: whole at their borders, and a half more in their middles.
    fn number(&mut self, count: usize, lit: &[u32], ranks: &mut [u32], at: impl Fn(f64) -> f64) {
        // The outer borders may lie beyond the epipole, their columns' middles do not.
        let width = count as f64;
        let [low, high] = [at(0.5), at(width - 0.5)];
        let beyond = if count > 1 { [at(1.5) - low, high - at(width - 1.5)] } else { [1.0; 2] };
        let [low, high] = [low - 0.5 * beyond[0], high + 0.5 * beyond[1]];
        let scale = STEPS / (high - low);
        let step = |place: f64| ((at(place) - low) * scale) as u32;
        self.borders.clear();
        let mut next = 0;
        for border in 0..count {
            self.borders.push(if border == 0 { 0 } else { step(border as f64).max(next) });
            // However near two borders are, a view ray has room between them.
            next = self.borders[border] + 1;
        }
        self.borders.push((STEPS as u32).max(next));
        self.lit.clear();
        self.lit.extend(lit.iter().map(|&lit| self.borders[lit as usize]));
        self.ranks.clear();
        self.ranks.extend_from_slice(ranks);
        for rank in ranks {
            let [from, to] = [*rank, *rank + 1].map(|border| self.borders[border as usize]);
            *rank = step(f64::from(*rank) + 0.5).clamp(from, to - 1);
        }
    }

    /// The runs, by their depths if they have some.
    pub fn of<'a>(&'a self, runs: Runs<'a>) -> Runs<'a> {
        if self.borders.is_empty() { runs } else { Runs { lit: &self.lit, ..runs } }
    }

    /// The depths of the columns of two view rays and of all between them, the first and the last.
    #[inline(always)]
    pub fn range(&self, rays: [usize; 2], asked: &Asked) -> [u32; 2] {
        let places = if self.borders.is_empty() { &asked.ranks } else { &self.ranks };
        // Ranks follow the columns, up or down.
        let [a, b] = rays.map(|ray| places[ray]);
        let [first, last] = [a.min(b), a.max(b)];
        if self.borders.is_empty() {
            [first, last]
        } else {
            [self.borders[first as usize], self.borders[last as usize + 1] - 1]
        }
    }

    /// Gives the view rays their places back.
    pub fn restore(&mut self, asked: &mut Asked) {
        if !self.borders.is_empty() {
            asked.ranks.copy_from_slice(&self.ranks);
            self.borders.clear();
        }
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        4 * (self.borders.capacity() + self.lit.capacity() + self.ranks.capacity())
    }
}

/// A measure of the angle between a view ray and the light; grows.
fn measured(depths: Depths, angle: f64) -> f64 {
    // Nearer to the axis than this no view ray is told from it.
    let angle = angle.clamp(1.0 / STEEPEST, std::f64::consts::PI - 1.0 / STEEPEST);
    match depths {
        Depths::Places | Depths::Angles => angle,
        Depths::Tangents => {
            let tangent = -1.0 / angle.tan();
            tangent / (1.0 + tangent.abs())
        }
        Depths::Warp => (0.5 * angle).tan().ln(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Columns whose tangents are evenly apart, as a camera has them, from half a column beside the epipole on.
    fn angle(place: f64) -> f64 {
        (0.003 * place).atan()
    }

    #[test]
    fn depths_tell_the_same_columns_apart_and_nothing_is_lost() {
        for depths in [Depths::Angles, Depths::Tangents, Depths::Warp] {
            for count in [1u32, 2, 3, 64, 1000] {
                let lit: Vec<u32> = (0..=count).collect();
                let mut asked = Asked::default();
                asked.make_room(count as usize);
                (0..count).for_each(|rank| asked.ranks[rank as usize] = rank);
                let mut own = MeasuredDepths::default();
                own.number(count as usize, &lit, &mut asked.ranks, |place| measured(depths, angle(place)));
                for (rank, &depth) in asked.ranks.iter().enumerate() {
                    for (&lit, &border) in lit.iter().zip(&own.lit) {
                        assert_eq!(border > depth, lit > rank as u32, "{depths:?} {count}: {lit} {rank}");
                    }
                }
                // The range of some view rays is that of their columns, borders and all.
                let [first, last] = own.range([0, count as usize - 1], &asked);
                assert_eq!([first, last + 1], [own.lit[0], own.lit[count as usize]]);
                own.restore(&mut asked);
                assert!(asked.ranks.iter().copied().eq(0..count));
            }
        }
    }

    #[test]
    fn a_warp_stretches_what_is_beside_the_epipole() {
        // The part of a range of 200 columns that the ten columns from the third on have: by their angles and their
        // logarithms (the first column's outer border is as far from its middle as the other one of its measure's step).
        let part = |depths| {
            let mut own = MeasuredDepths::default();
            own.number(200, &[3, 13], &mut [], |place| measured(depths, angle(place)));
            f64::from(own.lit[1] - own.lit[0]) / STEPS
        };
        let angles = (angle(13.0) - angle(3.0)) / (angle(200.0) - angle(0.0));
        let log = |place: f64| (0.5 * angle(place)).tan().ln();
        let low = log(0.5) - 0.5 * (log(1.5) - log(0.5));
        let warp = (log(13.0) - log(3.0)) / (log(199.5) + 0.5 * (log(199.5) - log(198.5)) - low);
        println!("angles {:.4}, warp {:.4}", part(Depths::Angles), part(Depths::Warp));
        // Extrapolated outer borders move the range of angles, which bends, by less than a hundredth of a column.
        assert!((part(Depths::Angles) / angles - 1.0).abs() < 1e-4);
        assert!((part(Depths::Warp) / warp - 1.0).abs() < 1e-6 && warp > 4.0 * angles);
    }
}
