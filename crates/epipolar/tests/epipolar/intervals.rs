//! Sets of numbers as sorted disjoint intervals: what a ray sees lit.

/// A union of disjoint intervals in ascending order.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Intervals(pub Vec<(f64, f64)>);

impl Intervals {
    /// Adds an interval behind all others; touching ones become one.
    pub fn push(&mut self, start: f64, end: f64) {
        if !(end > start) {
            return;
        }
        match self.0.last_mut() {
            Some((_, last)) if start <= *last => *last = last.max(end),
            _ => self.0.push((start, end)),
        }
    }

    /// Whether `x` lies in the set.
    pub fn contains(&self, x: f64) -> bool {
        self.0.iter().any(|&(start, end)| start <= x && x < end)
    }

    /// Where intervals start and end.
    pub fn ends(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().flat_map(|&(start, end)| [start, end])
    }
}

/// The measure of where `one` differs from all of `others`: from every set of numbers that `others` agree on.
pub fn outside_of_all(one: &Intervals, others: &[Intervals]) -> f64 {
    let mut cuts: Vec<f64> = one.ends().chain(others.iter().flat_map(Intervals::ends)).collect();
    cuts.sort_unstable_by(f64::total_cmp);
    cuts.windows(2)
        .filter(|pair| {
            let middle = 0.5 * (pair[0] + pair[1]);
            let lit = one.contains(middle);
            others.iter().all(|other| other.contains(middle) != lit)
        })
        .map(|pair| pair[1] - pair[0])
        .sum()
}
