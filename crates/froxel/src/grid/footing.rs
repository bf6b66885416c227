//! Which columns and rows of the grid a pixel reads, and with which weights.

/// The two neighbours of a pixel on one axis of the grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footing {
    /// The lower one.
    pub first: u32,
    /// The upper one; the lower one again where it has no weight.
    pub second: u32,
    /// Weight of the upper one, in [0, 1).
    pub share: f32,
}

/// The neighbours of all pixels of an axis of `pixels`, in a grid of `cells` ≤ `pixels`, into `out`. Centres of cells lie at
/// `(i + ½)·pixels/cells`; what lies beyond the outermost reads it alone.
pub fn footings(pixels: u32, cells: u32, out: &mut Vec<Footing>) {
    let scale = f64::from(cells) / f64::from(pixels);
    out.clear();
    out.extend((0..pixels).map(|pixel| {
        let place = (f64::from(pixel) + 0.5) * scale - 0.5;
        let place = place.clamp(0.0, f64::from(cells - 1));
        let first = place as u32;
        let share = (place - f64::from(first)) as f32;
        Footing { first, second: if share > 0.0 { first + 1 } else { first }, share }
    }));
}

/// The pixels that read any cell from `from` to `to`, half-open: half-open.
pub fn readers(footings: &[Footing], [from, to]: [u32; 2]) -> [usize; 2] {
    let start = footings.partition_point(|footing| footing.second < from);
    let end = footings.partition_point(|footing| footing.first < to);
    [start, end.max(start)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(pixels: u32, cells: u32) -> Vec<Footing> {
        let mut out = Vec::new();
        footings(pixels, cells, &mut out);
        out
    }

    #[test]
    fn a_grid_as_fine_as_the_picture_is_read_a_column_a_pixel() {
        for pixels in [1, 7, 640, 1281] {
            let all = of(pixels, pixels);
            assert!(
                all.iter()
                    .enumerate()
                    .all(|(x, f)| (f.first as usize, f.second, f.share) == (x, f.first, 0.0))
            );
        }
    }

    #[test]
    fn neighbours_surround_the_pixel_and_readers_are_all_that_read() {
        for (pixels, cells) in [(640, 160), (63, 17), (8, 1), (21, 20)] {
            let all = of(pixels, cells);
            for (x, footing) in all.iter().enumerate() {
                let read = f64::from(footing.first) + f64::from(footing.share);
                let place = (x as f64 + 0.5) * f64::from(cells) / f64::from(pixels) - 0.5;
                assert!((read - place.clamp(0.0, f64::from(cells - 1))).abs() < 1e-6);
                assert!(footing.second < cells);
            }
            for from in (0..cells).step_by(5) {
                let to = (from + 5).min(cells);
                let [start, end] = readers(&all, [from, to]);
                for (x, footing) in all.iter().enumerate() {
                    let reads = footing.first < to && footing.second >= from;
                    assert_eq!(reads, (start..end).contains(&x), "{pixels}, {cells}: {x} of {from} to {to}");
                }
            }
        }
    }
}
