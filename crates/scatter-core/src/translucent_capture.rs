//! Segments of one map, captured from a source into memory that is kept for the next frame.

use std::sync::Mutex;

use crate::error::checked_size;
use crate::map_projection::MapProjection;
use crate::map_source::MapError;
use crate::parallel;
use crate::translucent::{TranslucentLayer, TranslucentSource};
use crate::translucent_segment::TranslucentSegment;

/// Captures all segments of a map from a [`TranslucentSource`] and lends them as a [`TranslucentLayer`].
///
/// The source is asked twice, to count and to fill, in bands of rows side by side; so exactly what is kept is allocated, 12
/// bytes a segment and 4 a texel, and nothing at all from the second map of the same size and content on. The
/// segments of a texel stand in the order of submission, whatever the number of threads.
#[derive(Debug, Clone, Default)]
pub struct TranslucentCapture {
    projection: Option<MapProjection>,
    offsets: Vec<u32>,
    segments: Vec<TranslucentSegment>,
}

/// Rows of a band. Fewer ask the source more often, each time over all of its occluders; more leave threads idle on small maps.
const BAND: usize = 16;

impl TranslucentCapture {
    /// Memory of one layer that is enough for hair and smoke in maps of today's sizes, in bytes: 1 GiB, which is 89
    /// million segments, 21 a texel at 2048². More than that is rather a mistake of scale than a scene.
    pub const DEFAULT_LIMIT: u64 = 1 << 30;

    /// Nothing captured yet, nothing allocated.
    pub fn new() -> Self {
        Self::default()
    }

    /// Captures the segments of a map from `source`, in at most `limit_bytes` ([`Self::DEFAULT_LIMIT`]).
    ///
    /// # Errors
    ///
    /// The source's own; a segment that is not sane, with its texel; more segments than the limit holds, before anything
    /// is allocated, with their number and the cure. Nothing is captured then.
    pub fn capture(
        &mut self,
        source: &dyn TranslucentSource,
        projection: &MapProjection,
        limit_bytes: u64,
    ) -> Result<TranslucentLayer<'_>, MapError> {
        self.projection = None;
        let texels = checked_size("translucent layer", projection.size())?;
        self.count(source, projection, texels)?;
        let total = self.make_prefix_sums();
        let bytes = 4 * (texels as u64 + 1) + 12 * total;
        if bytes > limit_bytes || total > u64::from(u32::MAX) {
            let [width, height] = projection.size();
            return Err(MapError::Source(format!(
                "a {width}x{height} map of the translucent occluders holds {total} segments, {bytes} bytes, and the limit \
                 is {limit_bytes}; give a smaller map, fewer or smaller occluders, or a higher limit"
            )));
        }
        let empty = TranslucentSegment { entry: 0.0, exit: 0.0, optical_depth: 0.0 };
        self.segments.clear();
        self.segments.resize(total as usize, empty);
        self.fill(source, projection)?;
        self.projection = Some(*projection);
        Ok(TranslucentLayer::from_checked(*projection, &self.offsets, &self.segments))
    }

    /// What was captured last; `None` before, and after an error.
    pub fn layer(&self) -> Option<TranslucentLayer<'_>> {
        let projection = self.projection?;
        Some(TranslucentLayer::from_checked(projection, &self.offsets, &self.segments))
    }

    /// Bytes that are allocated.
    pub fn memory_bytes(&self) -> u64 {
        4 * self.offsets.capacity() as u64 + 12 * self.segments.capacity() as u64
    }

    /// Writes the number of each texel's segments to `offsets`, and 0 behind them.
    fn count(
        &mut self,
        source: &dyn TranslucentSource,
        projection: &MapProjection,
        texels: usize,
    ) -> Result<(), MapError> {
        self.offsets.clear();
        self.offsets.resize(texels + 1, 0);
        let width = projection.size()[0] as usize;
        let failure = FirstFailure::default();
        parallel::for_each_row(&mut self.offsets[..texels], BAND * width, |band, counts| {
            let tile = tile_of(projection, band * BAND, counts.len() / width);
            let captured = source.capture(projection, tile, &mut |texel, _| {
                let count = &mut counts[texel as usize];
                *count = count.saturating_add(1);
            });
            failure.note(band, captured);
        });
        failure.into_result()
    }

    /// Turns counts into the places where texels begin; returns how many segments there are.
    fn make_prefix_sums(&mut self) -> u64 {
        let mut sum = 0u64;
        for offset in &mut self.offsets {
            let count = u64::from(*offset);
            // What does not fit is over the limit, and never read.
            *offset = sum.min(u64::from(u32::MAX)) as u32;
            sum += count;
        }
        sum
    }

    fn fill(&mut self, source: &dyn TranslucentSource, projection: &MapProjection) -> Result<(), MapError> {
        let height = projection.size()[1] as usize;
        let texels = self.offsets.len() - 1;
        let failure = FirstFailure::default();
        let job = Fill { source, projection, failure: &failure };
        // Every texel's offset serves as the place of its next segment, and so ends as the place where the next texel begins.
        job.rows(0, height, 0, &mut self.offsets[..texels], &mut self.segments);
        self.offsets.copy_within(..texels, 1);
        self.offsets[0] = 0;
        failure.into_result()
    }
}

/// `[x0, y0, x1, y1]` of `rows` whole rows.
fn tile_of(projection: &MapProjection, first_row: usize, rows: usize) -> [u32; 4] {
    [0, first_row as u32, projection.size()[0], (first_row + rows) as u32]
}

/// The second pass over the source.
struct Fill<'a> {
    source: &'a dyn TranslucentSource,
    projection: &'a MapProjection,
    failure: &'a FirstFailure,
}

impl Fill<'_> {
    /// Fills rows `first..first + rows`, whose segments are `segments`, the first of which has index `base`. Halves the rows
    /// until they are a band, so that bands run side by side without a list of them.
    fn rows(
        &self,
        first: usize,
        rows: usize,
        base: u32,
        offsets: &mut [u32],
        segments: &mut [TranslucentSegment],
    ) {
        if rows <= BAND {
            return self.band(first, rows, base, offsets, segments);
        }
        let upper = (rows / 2).next_multiple_of(BAND);
        let (upper_offsets, lower_offsets) = offsets.split_at_mut(upper * self.projection.size()[0] as usize);
        let lower_base = lower_offsets[0];
        let (upper_segments, lower_segments) = segments.split_at_mut((lower_base - base) as usize);
        parallel::join(
            || self.rows(first, upper, base, upper_offsets, upper_segments),
            || self.rows(first + upper, rows - upper, lower_base, lower_offsets, lower_segments),
        );
    }

    fn band(
        &self,
        first: usize,
        rows: usize,
        base: u32,
        offsets: &mut [u32],
        segments: &mut [TranslucentSegment],
    ) {
        let mut bad = None;
        let captured = self.source.capture(
            self.projection,
            tile_of(self.projection, first, rows),
            &mut |texel, segment| {
                let place = &mut offsets[texel as usize];
                match segments.get_mut((*place - base) as usize) {
                    Some(free) if segment.is_sane() => *free = segment,
                    _ => bad = bad.or(Some((texel, segment))),
                }
                *place = place.saturating_add(1);
            },
        );
        let captured = captured.and_then(|()| match bad {
            None => Ok(()),
            Some((texel, segment)) => {
                let width = self.projection.size()[0];
                let (x, y) = (texel % width, first as u32 + texel / width);
                Err(MapError::Source(format!(
                    "the source of translucent occluders gave {segment:?} for texel ({x}, {y}), which is not sane or was \
                     not there when they were counted; give finite depths in order and optical depths ≥ 0, the same \
                     at every call"
                )))
            }
        });
        self.failure.note(first, captured);
    }
}

/// The failure of the first band that failed, so that the message does not depend on the threads.
#[derive(Default)]
struct FirstFailure(Mutex<Option<(usize, MapError)>>);

impl FirstFailure {
    fn note(&self, place: usize, result: Result<(), MapError>) {
        let Err(error) = result else { return };
        let mut first = self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if first.as_ref().is_none_or(|(earlier, _)| place < *earlier) {
            *first = Some((place, error));
        }
    }

    fn into_result(self) -> Result<(), MapError> {
        let first = self.0.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        first.map_or(Ok(()), |(_, error)| Err(error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texel (x, y) of a map has (x + 2·y) % 4 hairs, hair k at depth k.
    struct Hairs {
        opacity: f32,
    }

    impl TranslucentSource for Hairs {
        fn capture(
            &self,
            _: &MapProjection,
            [x0, y0, x1, y1]: [u32; 4],
            sink: &mut dyn FnMut(u32, TranslucentSegment),
        ) -> Result<(), MapError> {
            for hair in 0..3 {
                for (y, x) in (y0..y1).flat_map(|y| (x0..x1).map(move |x| (y, x))) {
                    if hair < (x + 2 * y) % 4 {
                        let texel = (y - y0) * (x1 - x0) + (x - x0);
                        sink(texel, TranslucentSegment::hair(hair as f32, self.opacity));
                    }
                }
            }
            Ok(())
        }

        fn bounds(&self) -> Option<[[f64; 3]; 2]> {
            Some([[-1.0; 3], [1.0; 3]])
        }

        fn memory_bytes(&self) -> u64 {
            4
        }
    }

    fn map(size: [u32; 2]) -> MapProjection {
        MapProjection::orthographic([0.0; 3], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [3.0, 1.0], size).unwrap()
    }

    #[test]
    fn every_texel_holds_its_segments_in_order_of_submission() {
        let mut capture = TranslucentCapture::new();
        // Rows that do and do not fill the bands.
        for size in [[5, 3], [7, 16], [6, 50], [1, 1]] {
            let layer = capture.capture(&Hairs { opacity: 0.5 }, &map(size), u64::MAX).unwrap();
            for (x, y) in (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y))) {
                let depths: Vec<f32> = layer.at(x, y).iter().map(|segment| segment.entry).collect();
                let expected: Vec<f32> = (0..(x + 2 * y) % 4).map(|hair| hair as f32).collect();
                assert_eq!(depths, expected, "({x}, {y}) of {size:?}");
            }
            assert!(TranslucentLayer::new(map(size), layer.offsets(), layer.segments()).is_ok());
        }
    }

    #[test]
    fn what_is_over_the_limit_is_an_error_before_it_is_allocated() {
        let mut capture = TranslucentCapture::new();
        // 4·16 texels have 16·(0 + 1 + 2 + 3) segments: 65·4 + 96·12 bytes.
        let need = 65 * 4 + 96 * 12;
        let message =
            capture.capture(&Hairs { opacity: 0.5 }, &map([4, 16]), need - 1).unwrap_err().to_string();
        assert!(message.contains("96 segments") && message.contains("the limit is 1411"), "{message}");
        assert!(capture.layer().is_none() && capture.memory_bytes() < need);
        assert!(capture.capture(&Hairs { opacity: 0.5 }, &map([4, 16]), need).is_ok());
        assert_eq!(capture.layer().unwrap().segments().len(), 96);
        assert_eq!(capture.memory_bytes(), need);
    }

    #[test]
    fn a_source_that_names_nonsense_is_told_so_with_the_first_texel() {
        let mut capture = TranslucentCapture::new();
        let message =
            capture.capture(&Hairs { opacity: 2.0 }, &map([4, 40]), u64::MAX).unwrap_err().to_string();
        assert!(message.contains("texel (1, 0)") && message.contains("not sane"), "{message}");
        assert!(capture.layer().is_none());
    }
}
