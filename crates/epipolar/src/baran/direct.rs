//! The definition, slice by slice: every view ray adds up its own lit stretches, each in closed form.
//!
//! O(queries · runs), where Baran's factors need one sum for all queries. Nothing is factorised, so along a slice the answer
//! is exact to the rounding of the row: what [`Baran`](super::Baran) is tested against, and the shortest example of a
//! [`SliceIntegrator`].

use scatter_core::{Medium, RayLight};

use crate::driver::{SliceIntegrator, SliceQueries, SliceRoom, SliceSetup, SliceView};
use crate::rows::{Row, TexturedRow};

/// The direct sum over a slice's lit light rays (Baran et al. 2010, Section 3, before any factorisation): for every light,
/// every medium and textures.
///
/// Shares are exact along the slice but for the positions of its rows, which are f32. O(queries · runs) closed forms a
/// slice: slow.
#[derive(Debug, Default)]
pub struct DirectIntegrator {
    channels: usize,
}

/// A worker's row.
#[derive(Debug, Default)]
pub struct DirectScratch {
    row: Row,
    textured: TexturedRow,
}

impl SliceIntegrator for DirectIntegrator {
    type Scratch = DirectScratch;

    fn set_up(&mut self, setup: &SliceSetup<'_>) {
        self.channels = channels_of(setup.setup.medium());
    }

    fn channels(&self) -> usize {
        self.channels
    }

    fn reserve(&self, room: &SliceRoom<'_>, scratch: &mut DirectScratch) {
        scratch.row.clear(room.runs);
    }

    fn integrate(&self, slice: &SliceView<'_>, queries: &mut SliceQueries, scratch: &mut DirectScratch) {
        let DirectScratch { row, textured } = scratch;
        slice.rectify(0.0, row);
        match slice.frame().texture() {
            None => sum_directly(slice, (row.starts(), row.lit()), None, queries),
            Some(texture) => {
                textured.fill(row, slice.texture_line(texture).as_ref(), texture);
                sum_directly(slice, (textured.starts(), textured.lit()), Some(textured), queries);
            }
        }
    }
}

/// Writes the share of its unoccluded light that every query's view ray has in the lit ones of a slice's runs, each in closed
/// form, f64. `runs` are the light rays at which they start, and how many columns, counted from the light, see them lit.
/// O(queries · runs).
pub fn sum_directly(
    slice: &SliceView<'_>,
    (starts, lit): (&[f32], &[u32]),
    colours: Option<&TexturedRow>,
    queries: &mut SliceQueries,
) {
    let frame = slice.frame();
    let open = queries.open(0..queries.len());
    let mut shares = open.shares;
    for (query, (&column, &end)) in open.columns.iter().zip(open.ends).enumerate() {
        let (index, column) = (column as usize, slice.order.columns[0] + column);
        let (ray, rank) = (slice.view_ray(column), slice.order.rank(column));
        let light = RayLight::new(frame.light(), frame.medium(), slice.camera().eye(), &ray);
        let (sine, cosine) = (f64::from(slice.sines()[index]), f64::from(slice.cosines()[index]));
        // Where the view ray meets a light ray, no farther than it reaches.
        let meets = |gamma: f32| slice.light.distance(gamma.into(), sine, cosine).clamp(0.0, end.into());
        let mut sum = [0.0f64; 3];
        for run in (0..lit.len()).filter(|&run| lit[run] > rank) {
            let (a, b) = (meets(starts[run]), meets(starts[run + 1]));
            let light = if b > a { light.interval(a, b).to_array() } else { continue };
            for (channel, sum) in sum.iter_mut().enumerate() {
                let colour = colours.map_or(1.0, |textured| textured.colour(channel)[run]);
                *sum += f64::from(colour) * light[channel];
            }
        }
        let whole = light.interval(0.0, end.into()).to_array();
        for (channel, shares) in shares.iter_mut().enumerate().filter(|(_, shares)| !shares.is_empty()) {
            // A ray without light has no shadow.
            let share = if whole[channel] > 0.0 { sum[channel] / whole[channel] } else { 1.0 };
            shares[query] = if colours.is_some() { share } else { share.min(1.0) } as f32;
        }
    }
}

/// Channels whose shares differ: one where all three see the same medium by the same phase functions.
fn channels_of(medium: &Medium) -> usize {
    let alike = |sigma: [f64; 3]| sigma[0] == sigma[1] && sigma[1] == sigma[2];
    let components = medium.components();
    let scatters_alike = components.len() == 1 || components.iter().all(|component| alike(component.sigma_s));
    if medium.is_grey() && scatters_alike { 1 } else { 3 }
}
