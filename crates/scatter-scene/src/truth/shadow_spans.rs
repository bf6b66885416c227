//! The union of shadow intervals on one view ray, kept sorted and disjoint while it grows.

/// Shadowed spans within `[0, end]`: sorted, disjoint, never touching.
///
/// The union is exact: ends are compared, never computed. So the order in which intervals come, and whether one that
/// lies within the union comes at all, does not change a bit of it.
#[derive(Debug, Default)]
pub(crate) struct ShadowSpans {
    spans: Vec<(f64, f64)>,
    end: f64,
    /// Where the last interval went.
    near: usize,
    /// For [`Self::add_all`].
    merged: Vec<(f64, f64)>,
}

/// Intervals from which on one pass over both lists is cheaper than to look each of them up.
const MANY: usize = 32;

impl ShadowSpans {
    /// Starts an empty union on `[0, end]`, `end` ≥ 0 or ∞.
    pub fn reset(&mut self, end: f64) {
        self.spans.clear();
        self.near = 0;
        self.end = end;
    }

    /// Adds `[low, high]`, cut to `[0, end]`. Whether the union grew.
    #[inline]
    pub fn add(&mut self, low: f64, high: f64) -> bool {
        let (low, high) = (low.max(0.0), high.min(self.end));
        if !(low < high) {
            return false;
        }
        let first = self.reaching(low);
        self.near = first;
        let reached = self.spans[first..].iter().position(|span| span.0 > high);
        let behind = reached.map_or(self.spans.len(), |count| first + count);
        if first == behind {
            self.spans.insert(first, (low, high));
            return true;
        }
        let merged = (low.min(self.spans[first].0), high.max(self.spans[behind - 1].1));
        if behind - first == 1 && merged == self.spans[first] {
            return false;
        }
        self.spans[first] = merged;
        if behind - first > 1 {
            self.spans.copy_within(behind.., first + 1);
            self.spans.truncate(self.spans.len() - (behind - first - 1));
        }
        true
    }

    /// The first span that ends at `low` or behind it. Intervals come in clusters, so it is looked for next to the last
    /// one: a step or two, where a search from the middle takes the logarithm of their number and guesses wrong at each.
    #[inline]
    fn reaching(&self, low: f64) -> usize {
        let mut index = self.near.min(self.spans.len());
        while index > 0 && self.spans[index - 1].1 >= low {
            index -= 1;
        }
        while index < self.spans.len() && self.spans[index].1 < low {
            index += 1;
        }
        index
    }

    /// Adds intervals that ascend, neither end before that of the interval before. Whether the union grew. Linear in both
    /// lists: a fence of a million slats is no million insertions.
    pub fn add_all(&mut self, intervals: &[(f64, f64)]) -> bool {
        if intervals.len() < MANY {
            return intervals.iter().fold(false, |grew, &(low, high)| self.add(low, high) || grew);
        }
        self.merged.clear();
        let end = self.end;
        let cut = intervals.iter().map(|&(low, high)| (low.max(0.0), high.min(end)));
        let mut new = cut.filter(|(low, high)| low < high).peekable();
        let mut old = self.spans.iter().copied().peekable();
        loop {
            let take_new = match (new.peek(), old.peek()) {
                (Some(new), Some(old)) => new.0 < old.0,
                (Some(_), None) => true,
                (None, Some(_)) => false,
                (None, None) => break,
            };
            let Some((low, high)) = (if take_new { new.next() } else { old.next() }) else { break };
            match self.merged.last_mut() {
                Some(last) if low <= last.1 => last.1 = last.1.max(high),
                _ => self.merged.push((low, high)),
            }
        }
        let grew = self.merged != self.spans;
        std::mem::swap(&mut self.merged, &mut self.spans);
        grew
    }

    /// The part of `[low, high]`, cut to `[0, end]`, from its first lit point to its last; `None` if none is lit.
    pub fn uncovered(&self, low: f64, high: f64) -> Option<(f64, f64)> {
        let (mut low, mut high) = (low.max(0.0), high.min(self.end));
        // The span that holds an end moves it to its own.
        let at = self.spans.partition_point(|span| span.1 < low);
        if let Some(span) = self.spans.get(at).filter(|span| span.0 <= low) {
            low = span.1;
        }
        let at = self.spans.partition_point(|span| span.1 < high);
        if let Some(span) = self.spans.get(at).filter(|span| span.0 <= high) {
            high = span.0;
        }
        (low < high).then_some((low, high))
    }

    /// Whether `[low, high]`, cut to `[0, end]`, lies within the union (an empty rest does).
    #[inline]
    pub fn covers(&self, low: f64, high: f64) -> bool {
        let (low, high) = (low.max(0.0), high.min(self.end));
        if !(low <= high) {
            return true;
        }
        let index = self.reaching(low);
        self.spans.get(index).is_some_and(|span| span.0 <= low && high <= span.1)
    }

    /// Whether all of `[0, end]` is shadowed.
    pub fn is_full(&self) -> bool {
        self.spans.first() == Some(&(0.0, self.end))
    }

    /// The lit rest of `[0, end]`, in order.
    pub fn lit(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let starts = std::iter::once(0.0).chain(self.spans.iter().map(|span| span.1));
        let ends = self.spans.iter().map(|span| span.0).chain(std::iter::once(self.end));
        starts.zip(ends).filter(|(a, b)| a < b)
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> u64 {
        ((self.spans.capacity() + self.merged.capacity()) * size_of::<(f64, f64)>()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn touching_intervals_leave_no_light_between_them() {
        let mut spans = ShadowSpans::default();
        spans.reset(10.0);
        assert!(spans.add(4.0, 6.0) && spans.add(-1.0, 2.5) && spans.add(2.5, 4.0));
        assert_eq!(spans.lit().collect::<Vec<_>>(), [(6.0, 10.0)]);
        assert!(spans.covers(-5.0, 6.0) && !spans.covers(5.0, 6.1));
        assert!(!spans.add(3.0, 5.0) && !spans.is_full());
        assert!(spans.add(6.0, f64::INFINITY) && spans.is_full());
        assert_eq!(spans.lit().count(), 0);
    }

    #[test]
    fn an_endless_ray_is_full_only_with_an_endless_shadow() {
        let mut spans = ShadowSpans::default();
        spans.reset(f64::INFINITY);
        spans.add(f64::NEG_INFINITY, 1e300);
        assert!(!spans.is_full());
        spans.add(1.0, f64::INFINITY);
        assert!(spans.is_full());
    }

    proptest! {
        /// Small integers, so that intervals often touch; a cell is shadowed if an interval holds its middle.
        #[test]
        fn the_union_is_that_of_the_cells(intervals in prop::collection::vec((0i32..20, 0i32..20), 0..20)) {
            let mut spans = ShadowSpans::default();
            spans.reset(16.0);
            for &(a, b) in &intervals {
                spans.add(f64::from(a - 2), f64::from(b - 2));
            }
            for cell in 0..16 {
                let middle = f64::from(cell) + 0.5;
                let shadowed = intervals.iter().any(|&(a, b)| f64::from(a - 2) < middle && middle < f64::from(b - 2));
                let lit = spans.lit().any(|(a, b)| a < middle && middle < b);
                prop_assert_eq!(lit, !shadowed);
                prop_assert_eq!(spans.covers(f64::from(cell), f64::from(cell + 1)), shadowed);
            }
            let lit: Vec<_> = spans.lit().collect();
            prop_assert!(lit.windows(2).all(|pair| pair[0].1 < pair[1].0));
        }

        /// Many at once are the same as one after the other, and what is uncovered is what the lit rest says.
        #[test]
        fn many_intervals_are_the_union_of_each(
            before in prop::collection::vec((0i32..400, 1i32..40), 0..30),
            steps in prop::collection::vec((1i32..6, 1i32..6), 0..120),
            asked in (0i32..400, 0i32..400),
        ) {
            let (mut one, mut all) = (ShadowSpans::default(), ShadowSpans::default());
            for spans in [&mut one, &mut all] {
                spans.reset(300.0);
                for &(low, length) in &before {
                    spans.add(f64::from(low), f64::from(low + length));
                }
            }
            // Ascending, and some overlap.
            let mut low = -20;
            let intervals: Vec<_> = steps.iter().map(|&(step, length)| {
                low += step;
                (f64::from(low), f64::from(low + length.min(step + 1)))
            }).collect();
            let mut grew = false;
            for &(low, high) in &intervals {
                grew |= one.add(low, high);
            }
            prop_assert_eq!(all.add_all(&intervals), grew);
            prop_assert_eq!(&one.spans, &all.spans);
            let (low, high) = (f64::from(asked.0.min(asked.1)), f64::from(asked.0.max(asked.1)));
            let lit = one.lit().map(|(a, b)| (a.max(low), b.min(high))).filter(|(a, b)| a < b);
            let hull = lit.reduce(|(first, _), (_, last)| (first, last));
            prop_assert_eq!(one.uncovered(low, high), hull);
        }
    }
}
