//! A logarithmic axis: where values stand, where lines and labels are.

/// What an axis shows.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
}

/// A line across the field at a value of the horizontal axis.
#[derive(Debug, Clone)]
pub struct Guide {
    /// Where.
    pub at: f64,
    /// What it is, in a word.
    pub name: String,
}

/// A range of values on a range of places.
pub(super) struct Scale {
    /// Decimal logarithms of the ends.
    from: f64,
    to: f64,
    places: [f64; 2],
}

/// Room beyond the outermost values, in the logarithm: a marker is not cut off.
const MARGIN: f64 = 0.08;
/// From here on labels stand at whole decades alone.
const MANY_DECADES: f64 = 2.1;

impl Scale {
    /// A scale that shows all of the values, at least two thirds of a decade; values that are not positive and finite do
    /// not count.
    pub(super) fn new(values: impl Iterator<Item = f64>, places: [f64; 2]) -> Self {
        let logs = values.filter(|&v| v > 0.0 && v.is_finite()).map(f64::log10);
        let (low, high) =
            logs.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        // Nothing to show: one to ten.
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let missing = (0.67 - (high - low)).max(0.0);
        let margin = MARGIN * (high - low).max(0.67);
        Self { from: low - 0.5 * missing - margin, to: high + 0.5 * missing + margin, places }
    }

    /// The place of a value.
    pub(super) fn place(&self, value: f64) -> f64 {
        let share = (value.log10() - self.from) / (self.to - self.from);
        self.places[0] + share * (self.places[1] - self.places[0])
    }

    /// Whether the scale shows a value.
    pub(super) fn contains(&self, value: f64) -> bool {
        (self.from..=self.to).contains(&value.log10())
    }

    /// Where lines stand: at the decades, or between them at 2 to 9 times.
    pub(super) fn lines(&self, minor: bool) -> Vec<f64> {
        let factors = if minor { 2..=9 } else { 1..=1 };
        factors.flat_map(|factor| self.multiples(factor)).collect()
    }

    /// Where labels stand: at decades, and with few of them at 2 and 5 times as well.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let factors: &[u32] = if self.to - self.from > MANY_DECADES { &[1] } else { &[1, 2, 5] };
        let ticks: Vec<f64> = factors.iter().flat_map(|&factor| self.multiples(factor)).collect();
        // More than eight labels would touch: every second decade then, every third, …
        let stride = ticks.len().div_ceil(8).max(1);
        if factors.len() == 1 { ticks.into_iter().step_by(stride).collect() } else { ticks }
    }

    /// `factor` times the powers of ten in range.
    fn multiples(&self, factor: u32) -> impl Iterator<Item = f64> + use<> {
        let shift = f64::from(factor).log10();
        let (from, to) = ((self.from - shift).ceil() as i32, (self.to - shift).floor() as i32);
        (from..=to).map(move |power| f64::from(factor) * 10f64.powi(power))
    }
}

/// A value on an axis: plain digits, or a power of ten where there would be many.
pub(super) fn label(value: f64) -> String {
    let power = value.log10().floor();
    // A power of ten may lie just below a whole logarithm.
    let power = if (value / 10f64.powf(power + 1.0) - 1.0).abs() < 1e-9 { power + 1.0 } else { power };
    if (-3.0..=4.0).contains(&power) {
        let decimals = (-power).max(0.0) as usize;
        return format!("{value:.decimals$}");
    }
    let digits = format!("{power}").chars().map(superscript).collect::<String>();
    match (value / 10f64.powf(power)).round() {
        1.0 => format!("10{digits}"),
        factor => format!("{factor}·10{digits}"),
    }
}

fn superscript(character: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    character.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decade_is_as_long_everywhere() {
        let scale = Scale::new([1.0, 1000.0].into_iter(), [100.0, 400.0]);
        let places = [1.0, 10.0, 100.0, 1000.0].map(|v| scale.place(v));
        let steps = [places[1] - places[0], places[2] - places[1], places[3] - places[2]];
        assert!(steps.iter().all(|step| (step - steps[0]).abs() < 1e-9), "{places:?}");
        assert!(places[0] > 100.0 && places[3] < 400.0, "a margin on both sides");
        assert!((scale.place(f64::sqrt(10.0)) - 0.5 * (places[0] + places[1])).abs() < 1e-9);
    }

    #[test]
    fn labels_stand_at_decades_and_with_few_of_them_between() {
        let ticks = |low: f64, high: f64| {
            let mut ticks = Scale::new([low, high].into_iter(), [0.0, 1.0]).ticks();
            ticks.sort_by(f64::total_cmp);
            ticks.into_iter().map(label).collect::<Vec<_>>()
        };
        assert_eq!(ticks(0.02, 40.0), ["0.1", "1", "10"]);
        assert_eq!(ticks(3.0, 30.0), ["5", "10", "20"]);
        assert!(ticks(1e-9, 1e9).len() <= 8);
        assert!(!ticks(3.0, 3.0).is_empty(), "one value has an axis too");
    }

    #[test]
    fn labels_are_short() {
        let labels = [0.001, 0.02, 0.5, 1.0, 20.0, 10_000.0, 1e5, 1e-4, 2e-5].map(label);
        assert_eq!(labels, ["0.001", "0.02", "0.5", "1", "20", "10000", "10⁵", "10⁻⁴", "2·10⁻⁵"]);
    }

    #[test]
    fn what_a_logarithm_cannot_show_is_left_out() {
        let scale = Scale::new([f64::NAN, 0.0, -1.0, f64::INFINITY].into_iter(), [0.0, 1.0]);
        assert!(scale.place(3.0).is_finite() && !scale.ticks().is_empty());
        assert!(scale.contains(3.0) && !scale.contains(0.0) && !scale.contains(f64::NAN));
    }
}
