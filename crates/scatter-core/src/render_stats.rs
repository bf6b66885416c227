//! What a render did: the time of each stage, memory, counts that do not depend on the machine, what was modelled.
//!
//! All lists have a fixed capacity inside of the struct, so that returning them allocates nothing.

use std::time::Duration;

/// Most entries that a list of [`RenderStats`] holds; further ones are counted ([`NamedList::left_out`]).
pub const STATS_CAPACITY: usize = 12;

/// A short list of named values, in the order in which they were added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NamedList<T> {
    entries: [Option<(&'static str, T)>; STATS_CAPACITY],
    left_out: u32,
}

/// The report of one render.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RenderStats {
    /// Time of each stage, in the order of the pipeline. Zero on targets without a clock.
    pub stages: NamedList<Duration>,
    /// Machine-independent counts: shadow-map fetches, tree updates, queries, segments.
    pub counts: NamedList<u64>,
    /// What was modelled, as the scene required it: `transmittance`, `rgb-extinction`, `phase`, …
    pub modelled: NamedList<()>,
    /// Bytes that the technique holds between frames, its output not counted.
    pub memory_bytes: u64,
    /// Of the call's time, what moved the maps to another device and the image back: an engine there has both. Zero on the CPU.
    pub transfer: Duration,
}

impl<T: Copy> Default for NamedList<T> {
    fn default() -> Self {
        Self { entries: [None; STATS_CAPACITY], left_out: 0 }
    }
}

impl<T: Copy> NamedList<T> {
    /// Appends a value, or counts it as left out if the list is full.
    pub fn push(&mut self, name: &'static str, value: T) {
        match self.entries.iter_mut().find(|entry| entry.is_none()) {
            Some(free) => *free = Some((name, value)),
            None => self.left_out += 1,
        }
    }

    /// How many values did not fit: 0, or the list tells less than what was done.
    pub fn left_out(&self) -> u32 {
        self.left_out
    }

    /// All entries in order.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, T)> + '_ {
        self.entries.iter().copied().flatten()
    }

    /// The value of the first entry with that name.
    pub fn get(&self, name: &str) -> Option<T> {
        self.iter().find(|(n, _)| *n == name).map(|(_, value)| value)
    }
}

impl RenderStats {
    /// How many entries did not fit, over all lists.
    pub fn left_out(&self) -> u32 {
        self.stages.left_out + self.counts.left_out + self.modelled.left_out
    }

    /// Sum over all stages.
    pub fn total_time(&self) -> Duration {
        self.stages.iter().map(|(_, time)| time).sum()
    }
}

/// Measures the stages of a render. On wasm there is no clock: all times are zero.
#[derive(Debug)]
pub struct StageClock {
    #[cfg(not(target_family = "wasm"))]
    last: std::time::Instant,
}

impl StageClock {
    /// Starts the first stage.
    pub fn start() -> Self {
        Self {
            #[cfg(not(target_family = "wasm"))]
            last: std::time::Instant::now(),
        }
    }

    /// Ends the current stage, writes its time under `name` and starts the next one.
    pub fn lap(&mut self, stats: &mut RenderStats, name: &'static str) {
        stats.stages.push(name, self.restart());
    }

    /// Ends the current stage, which did several things in turn, on any number of threads: writes each part's share of its time. `parts`
    /// are what they took, over all threads.
    pub fn lap_of_parts<const N: usize>(
        &mut self,
        stats: &mut RenderStats,
        parts: [(&'static str, Duration); N],
    ) {
        let whole = self.restart();
        let sum: Duration = parts.iter().map(|(_, time)| *time).sum();
        for (name, time) in parts {
            let share = if sum.is_zero() { 1.0 / N as f64 } else { time.as_secs_f64() / sum.as_secs_f64() };
            stats.stages.push(name, whole.mul_f64(share));
        }
    }

    /// Ends the current stage and starts the next one; returns how long it took.
    pub fn restart(&mut self) -> Duration {
        #[cfg(not(target_family = "wasm"))]
        {
            let now = std::time::Instant::now();
            let time = now - self.last;
            self.last = now;
            time
        }
        #[cfg(target_family = "wasm")]
        Duration::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_keep_their_order_and_add_up() {
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        clock.lap(&mut stats, "rectify");
        clock.lap(&mut stats, "integrate");
        assert_eq!(stats.stages.iter().map(|(name, _)| name).collect::<Vec<_>>(), ["rectify", "integrate"]);
        let sum = stats.stages.get("rectify").unwrap() + stats.stages.get("integrate").unwrap();
        assert_eq!(stats.total_time(), sum);
    }

    #[test]
    fn parts_of_a_stage_have_its_time_by_what_they_took() {
        let mut stats = RenderStats::default();
        let mut clock = StageClock::start();
        std::thread::sleep(Duration::from_millis(2));
        let [few, many] = [1, 3].map(Duration::from_secs);
        clock.lap_of_parts(&mut stats, [("filter", few), ("answer", many)]);
        let [filter, answer] = ["filter", "answer"].map(|name| stats.stages.get(name).unwrap().as_secs_f64());
        // Nanoseconds are whole.
        assert!((answer - 3.0 * filter).abs() < 4e-9, "{filter} {answer}");
        assert!(filter + answer >= 2e-3 - 2e-9, "two milliseconds were slept");
        // Without times they are alike.
        clock.lap_of_parts(&mut stats, [("a", Duration::ZERO), ("b", Duration::ZERO)]);
        assert_eq!(stats.stages.get("a"), stats.stages.get("b"));
    }

    #[test]
    fn a_full_list_counts_what_comes_after() {
        let mut counts = NamedList::default();
        for value in 0..100u64 {
            counts.push("n", value);
        }
        assert_eq!(counts.iter().count(), STATS_CAPACITY);
        assert_eq!(counts.left_out() as usize, 100 - STATS_CAPACITY);
        let stats = RenderStats { counts, ..RenderStats::default() };
        assert_eq!(stats.left_out() as usize, 100 - STATS_CAPACITY);
    }
}
