//! A block's crossings, ray by ray in order, and the lit intervals between them.
//!
//! Along a ray each layer has a count: 1 in its shadow, 0 outside, moved by the signs of the crossings. Of a ray with several
//! layers the first whose map it is inside of decides (MODEL.md); where it enters and leaves their maps is an event like a
//! crossing. A count that is anything else over more than a millionth of the ray is a violation: counted, and the ray is
//! walked in f64 instead.

use super::block_rays::RAYS;
use scatter_core::MAX_CASCADES;

/// Closer crossings may be in any order, as a share of the ray.
const SWAPS: f64 = 1e-6;

/// Sign of an event that is no crossing: the ray gets into the rectangle of a layer's map.
pub const ENTERS: i8 = 2;
/// The ray leaves the rectangle of a layer's map.
pub const LEAVES: i8 = -2;

/// A crossing of a ray of a block.
#[derive(Debug, Clone, Copy, Default)]
pub struct Crossing {
    /// The camera's depth there.
    pub depth: f64,
    /// The ray's parameter there, as faces compare it.
    pub s: f32,
    /// The ray.
    pub ray: u8,
    /// The layer.
    pub layer: u8,
    /// +1 into the shadow, −1 out of it; [`ENTERS`], [`LEAVES`].
    pub sign: i8,
    /// The axis of the face: of crossings at one parameter columns come first, then rows, then depths.
    pub axis: u8,
}

impl Crossing {
    /// Whether it comes before another one of its ray. Those of one layer stand in the order in which faces compare them, by
    /// which signs alternate; depths in f64 may swap where that rounds.
    #[inline(always)]
    fn comes_before(&self, other: &Self) -> bool {
        let is_border = |crossing: &Self| crossing.sign.abs() == ENTERS;
        if self.layer != other.layer || is_border(self) || is_border(other) {
            return self.depth < other.depth;
        }
        self.s < other.s || (self.s == other.s && self.axis < other.axis)
    }
}

/// How the rays of a block start in a layer: a bit a ray.
#[derive(Debug, Clone, Copy, Default)]
pub struct Starts {
    /// In its shadow.
    pub dark: u64,
    /// Inside of its map's rectangle.
    pub inside: u64,
}

/// Crossings of the rays of a block.
#[derive(Debug, Clone)]
pub struct Crossings {
    found: Vec<Crossing>,
    /// How each layer's rays start.
    pub starts: [Starts; MAX_CASCADES],
    /// Rays that are to be walked in f64.
    pub walked: u64,
}

impl Default for Crossings {
    fn default() -> Self {
        let starts = [Starts::default(); MAX_CASCADES];
        Self { found: Vec::new(), starts, walked: 0 }
    }
}

impl Crossings {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.found.clear();
        self.starts = [Starts::default(); MAX_CASCADES];
        self.walked = 0;
    }

    /// One more.
    #[inline(always)]
    pub fn push(&mut self, crossing: Crossing) {
        self.found.push(crossing);
    }

    /// Makes room for twice as many.
    pub fn make_room(&mut self, most: usize) {
        make_room(&mut self.found, most);
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.found.len()
    }

    /// Bytes that it holds.
    pub fn memory_bytes(&self) -> u64 {
        (self.found.capacity() * size_of::<Crossing>()) as u64
    }

    /// Marks rays of a cube to be walked that are in none of its faces over more than a millionth of their way: faces meet
    /// without a gap, but for rays within the plane that two of them share.
    #[inline(always)]
    pub fn walk_gaps(&mut self, ends: &[f64; RAYS]) {
        let (mut covered, mut open) = ([0.0; RAYS], [0i32; RAYS]);
        for (ray, open) in open.iter_mut().enumerate() {
            *open = self.starts.iter().map(|start| (start.inside >> ray & 1) as i32).sum();
        }
        for event in &self.found {
            let (way, more) = match event.sign {
                ENTERS => (-event.depth, 1),
                LEAVES => (event.depth, -1),
                _ => (0.0, 0),
            };
            covered[event.ray as usize] += way;
            open[event.ray as usize] += more;
        }
        for (ray, &end) in ends.iter().enumerate() {
            // Faces that are left at the end have no event for it.
            let covered = covered[ray] + f64::from(open[ray]) * end.min(1e30);
            if end > 0.0 && !(covered >= end.min(1e30) * (1.0 - SWAPS)) {
                self.walked |= 1 << ray;
            }
        }
    }

    /// Calls `lit(ray, from, to)` for the lit intervals of all rays that end at the camera's depths `ends`, each ray's in
    /// order. `cuts` says that several layers decide; `sorted` is room for them. Rays whose signs do not add up are marked to be walked, and have none;
    /// returns how many they are.
    #[inline(always)]
    pub fn lit_intervals(
        &mut self,
        ends: &[f64; RAYS],
        (layer_count, cuts): (usize, bool),
        sorted: &mut Vec<Crossing>,
        mut lit: impl FnMut(usize, f64, f64),
    ) -> u64 {
        let offsets = self.sort(sorted);
        let mut violations = 0;
        for ray in 0..RAYS {
            let end = ends[ray];
            if !(end > 0.0) || self.walked >> ray & 1 != 0 {
                continue;
            }
            let events = &sorted[offsets[ray] as usize..offsets[ray + 1] as usize];
            let counts = Counts::new(&self.starts, ray, layer_count, cuts);
            if !counts.clone().add_up(events, end) {
                self.walked |= 1 << ray;
                violations += 1;
                continue;
            }
            counts.follow(events, end, |from, to| lit(ray, from, to));
        }
        violations
    }

    /// Sorts all by ray and depth; returns where each ray's begin.
    #[inline(always)]
    fn sort(&self, sorted: &mut Vec<Crossing>) -> [u32; RAYS + 1] {
        let mut offsets = [0u32; RAYS + 1];
        for crossing in &self.found {
            offsets[crossing.ray as usize + 1] += 1;
        }
        for ray in 0..RAYS {
            offsets[ray + 1] += offsets[ray];
        }
        let mut next = offsets;
        sorted.clear();
        sorted.resize(self.found.len(), Crossing::default());
        for crossing in &self.found {
            let ray = crossing.ray as usize;
            // Into its place among the ray's, which are few.
            let mut at = next[ray] as usize;
            let first = offsets[ray] as usize;
            while at > first && crossing.comes_before(&sorted[at - 1]) {
                sorted[at] = sorted[at - 1];
                at -= 1;
            }
            sorted[at] = *crossing;
            next[ray] += 1;
        }
        offsets
    }
}

/// Makes room in a list for twice as many, unless it has a quarter to spare: the next frame's list is about as long as this one's, and
/// should allocate nothing.
pub fn make_room<T>(list: &mut Vec<T>, most: usize) {
    if list.capacity() < most + most / 4 {
        list.reserve((2 * most).saturating_sub(list.len()));
    }
}

/// The counts of a ray's layers.
#[derive(Clone)]
struct Counts {
    dark: [i8; MAX_CASCADES],
    inside: u32,
    cuts: bool,
}

impl Counts {
    #[inline(always)]
    fn new(starts: &[Starts; MAX_CASCADES], ray: usize, layer_count: usize, cuts: bool) -> Self {
        let mut counts = Self { dark: [0; MAX_CASCADES], inside: 0, cuts };
        for (layer, start) in starts.iter().enumerate().take(layer_count) {
            counts.dark[layer] = (start.dark >> ray & 1) as i8;
            counts.inside |= ((start.inside >> ray & 1) as u32) << layer;
        }
        counts
    }

    /// Whether light reaches the ray.
    #[inline(always)]
    fn is_lit(&self) -> bool {
        if !self.cuts {
            return self.dark[0] <= 0;
        }
        let first = self.inside.trailing_zeros() as usize;
        first >= MAX_CASCADES || self.dark[first] <= 0
    }

    #[inline(always)]
    fn pass(&mut self, event: &Crossing) {
        let layer = event.layer as usize;
        match event.sign {
            ENTERS => self.inside |= 1 << layer,
            LEAVES => self.inside &= !(1 << layer),
            sign => self.dark[layer] += sign,
        }
    }

    /// Whether every layer's count is 0 or 1 all along.
    #[inline(always)]
    fn add_up(mut self, events: &[Crossing], end: f64) -> bool {
        // A layer whose count is wrong, and since when.
        let mut wrong: Option<(u8, f64)> = None;
        for event in events {
            self.pass(event);
            let is_right = |layer: u8| (0..=1).contains(&self.dark[layer as usize]);
            match wrong {
                Some((layer, since)) if layer == event.layer => {
                    if event.depth - since > SWAPS * end {
                        return false;
                    }
                    if is_right(layer) {
                        wrong = None;
                    }
                }
                Some(_) if !is_right(event.layer) => return false,
                None if !is_right(event.layer) => wrong = Some((event.layer, event.depth)),
                _ => {}
            }
        }
        wrong.is_none_or(|(_, since)| end - since <= SWAPS * end)
    }

    #[inline(always)]
    fn follow(mut self, events: &[Crossing], end: f64, mut lit: impl FnMut(f64, f64)) {
        let mut from = self.is_lit().then_some(0.0);
        for event in events {
            self.pass(event);
            let at = event.depth.min(end);
            match (from, self.is_lit()) {
                (None, true) => from = Some(at),
                (Some(start), false) => {
                    if start < at {
                        lit(start, at);
                    }
                    from = None;
                }
                _ => {}
            }
        }
        if let Some(start) = from
            && start < end
        {
            lit(start, end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn crossing(ray: u8, layer: u8, depth: f64, sign: i8) -> Crossing {
        Crossing { depth, s: depth as f32, ray, layer, sign, axis: 0 }
    }

    fn intervals(crossings: &mut Crossings, layers: usize, cuts: bool) -> (Vec<(usize, f64, f64)>, u64) {
        let mut found = Vec::new();
        let mut ends = [0.0; RAYS];
        (ends[3], ends[5]) = (10.0, 8.0);
        let violations = crossings
            .lit_intervals(&ends, (layers, cuts), &mut Vec::new(), |ray, a, b| found.push((ray, a, b)));
        (found, violations)
    }

    #[test]
    fn lit_intervals_lie_between_crossings_in_whatever_order_they_come() {
        let mut all = Crossings::default();
        all.starts[0].dark = 1 << 5;
        for event in
            [crossing(3, 0, 4.0, -1), crossing(5, 0, 2.0, -1), crossing(3, 0, 1.0, 1), crossing(3, 0, 9.0, 1)]
        {
            all.push(event);
        }
        let (found, violations) = intervals(&mut all, 1, false);
        assert_eq!(found, [(3, 0.0, 1.0), (3, 4.0, 9.0), (5, 2.0, 8.0)]);
        assert_eq!(violations, 0);
    }

    #[test]
    fn the_first_layer_that_a_ray_is_inside_of_decides() {
        let mut all = Crossings::default();
        // Layer 1 is dark from 2 to 9, layer 0 is lit and covers 4 to 6.
        all.starts[1].inside = 1 << 3;
        for event in [
            crossing(3, 1, 2.0, 1),
            crossing(3, 1, 9.0, -1),
            crossing(3, 0, 4.0, ENTERS),
            crossing(3, 0, 6.0, LEAVES),
        ] {
            all.push(event);
        }
        let (found, violations) = intervals(&mut all, 2, true);
        assert_eq!(found, [(3, 0.0, 2.0), (3, 4.0, 6.0), (3, 9.0, 10.0), (5, 0.0, 8.0)]);
        assert_eq!(violations, 0);
    }

    #[test]
    fn a_face_that_is_missing_is_a_violation() {
        let mut all = Crossings::default();
        all.push(crossing(3, 0, 2.0, -1));
        let (found, violations) = intervals(&mut all, 1, false);
        assert_eq!((found, violations, all.walked), (vec![(5, 0.0, 8.0)], 1, 1 << 3));
        // Two that are as good as one point may be swapped.
        let mut all = Crossings::default();
        all.push(crossing(3, 0, 2.0, -1));
        all.push(crossing(3, 0, 2.0 + 1e-7, 1));
        assert_eq!(intervals(&mut all, 1, false).1, 0);
    }
}
