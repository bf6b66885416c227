//! What a machine takes for the units of work that techniques count: the constants of every predicted time.

use crate::parallel::worker_count;

/// What one unit of a technique's work takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnitCost {
    /// Kebab-case name of the unit: a node, a texel, a query.
    pub name: &'static str,
    /// Time of one on the machine that the built-in constants were measured on \[ns\], ≥ 0.
    pub nanoseconds: f64,
}

/// The units that a technique's time is made of.
#[derive(Debug, Clone, Copy)]
pub struct CostModel {
    /// Each kind of work.
    pub units: &'static [UnitCost],
    /// What each further thread adds to the speed of the first one, 0 to 1, as far as the machine has cores.
    pub thread_gain: f64,
}

/// The speed of one machine, relative to the one that built-in constants come from, a factor a technique.
///
/// The proportions of a technique's units are those of its crate ([`CostModel`]); what differs between machines, as far as a
/// calibration of seconds can tell, is how fast each technique runs as a whole: the marcher waits for arithmetic, a walk for
/// memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    name: String,
    is_built_in: bool,
    threads: usize,
    slowness: Vec<TechniqueSpeed>,
}

/// How a technique runs on a machine.
#[derive(Debug, Clone, PartialEq)]
pub struct TechniqueSpeed {
    /// The technique's id.
    pub id: String,
    /// Its time over what the built-in constants predict, > 0.
    pub slowness: f64,
    /// What each further thread adds, in place of [`CostModel::thread_gain`]; `None` where it was not measured.
    pub thread_gain: Option<f64>,
}

impl Machine {
    /// The machine that the built-in constants were measured on, with the threads of the caller's pool.
    pub fn built_in() -> Self {
        Self {
            name: "built-in (AMD EPYC, AVX-512, 2 cores)".into(),
            is_built_in: true,
            threads: worker_count(),
            slowness: Vec::new(),
        }
    }

    /// A machine whose techniques were timed; a technique that is not in the list runs as on the built-in one. Slowness
    /// and gains must be finite, slowness > 0 and gains in \[0, 1\]; others are taken as the nearest such number.
    pub fn measured(name: impl Into<String>, mut slowness: Vec<TechniqueSpeed>) -> Self {
        for speed in &mut slowness {
            let is_sane = speed.slowness.is_finite();
            speed.slowness = if is_sane { speed.slowness.clamp(1e-3, 1e3) } else { 1.0 };
            speed.thread_gain =
                speed.thread_gain.filter(|gain| gain.is_finite()).map(|gain| gain.clamp(0.0, 1.0));
        }
        Self { name: name.into(), is_built_in: false, slowness, ..Self::built_in() }
    }

    /// The same machine with so many threads, ≥ 1, on as many cores.
    pub fn with_threads(self, threads: usize) -> Self {
        Self { threads: threads.max(1), ..self }
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether nobody measured it.
    pub fn is_built_in(&self) -> bool {
        self.is_built_in
    }

    /// Threads that predictions are for.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// What was measured, a technique each.
    pub fn speeds(&self) -> &[TechniqueSpeed] {
        &self.slowness
    }

    /// Milliseconds of so much work of a technique: what one thread does alone, and what is divided among all \[ns on the
    /// built-in machine\].
    pub fn milliseconds(&self, id: &str, model: &CostModel, alone: f64, shared: f64) -> f64 {
        let own = self.slowness.iter().find(|speed| speed.id == id);
        let gain = own.and_then(|own| own.thread_gain).unwrap_or(model.thread_gain);
        let further = self.threads.saturating_sub(1) as f64;
        let slowness = own.map_or(1.0, |own| own.slowness);
        1e-6 * slowness * (alone + shared / (1.0 + gain * further))
    }
}

impl Default for Machine {
    fn default() -> Self {
        Self::built_in()
    }
}

impl CostModel {
    /// Nanoseconds of so many units, in the order of [`Self::units`].
    pub fn nanoseconds<const N: usize>(&self, counts: [f64; N]) -> f64 {
        debug_assert_eq!(self.units.len(), N, "a count for each unit");
        self.units.iter().zip(counts).map(|(unit, count)| unit.nanoseconds * count).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODEL: CostModel = CostModel {
        units: &[UnitCost { name: "node", nanoseconds: 2.0 }, UnitCost { name: "texel", nanoseconds: 0.5 }],
        thread_gain: 0.75,
    };

    #[test]
    fn work_is_divided_among_threads_as_far_as_it_can_be() {
        let work = MODEL.nanoseconds([1e6, 4e6]);
        assert_eq!(work, 4e6);
        let machine = Machine::built_in().with_threads(1);
        assert_eq!(machine.milliseconds("m", &MODEL, 1e6, work), 5.0);
        let two = machine.with_threads(2);
        assert!((two.milliseconds("m", &MODEL, 1e6, work) - (1.0 + 4.0 / 1.75)).abs() < 1e-12);
    }

    #[test]
    fn a_measured_technique_has_its_own_speed_and_others_the_built_in_one() {
        let speed = |slowness| TechniqueSpeed { id: "m".into(), slowness, thread_gain: Some(f64::INFINITY) };
        let machine = Machine::measured("here", vec![speed(2.0)]).with_threads(1);
        assert_eq!(machine.milliseconds("m", &MODEL, 0.0, 1e6), 2.0);
        assert_eq!(machine.milliseconds("other", &MODEL, 0.0, 1e6), 1.0);
        assert!(!machine.is_built_in());
        // No number makes a time that is not one.
        for slowness in [f64::NAN, 0.0, -1.0, f64::INFINITY] {
            let time = Machine::measured("odd", vec![speed(slowness)]).milliseconds("m", &MODEL, 1e3, 1e6);
            assert!(time.is_finite() && time > 0.0, "{slowness} {time}");
        }
    }
}
