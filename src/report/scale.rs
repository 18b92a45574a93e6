//! From data to pixels: limits, ticks and the text of an axis.

use super::chart::{Axis, Range};
use super::format::{self, Medium};

/// A tick: where, as a share of the axis, and its label (none for a minor one).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    pub share: f64,
    pub label: Option<String>,
}

/// An axis with its limits fixed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Scale {
    low: f64,
    high: f64,
    log: bool,
    pub ticks: Vec<Tick>,
    /// The power of ten that is taken out of the ticks, and the unit that carries it.
    pub exponent: i32,
    pub unit: String,
    /// Label and unit with the power of ten or the offset taken out of the ticks.
    pub title: String,
}

impl Scale {
    /// The scale for finite `values`, with about `wanted` ticks. `pad` widens automatic limits on both sides.
    pub fn new(axis: &Axis, values: impl Iterator<Item = f64> + Clone, wanted: usize, pad: f64) -> Self {
        Self::holding(axis, values, &[], wanted, pad)
    }

    /// The same, widened to hold the values of reference lines too, but for those so far off that the data would shrink to
    /// nothing: below a quarter of the axis.
    pub fn holding(
        axis: &Axis,
        values: impl Iterator<Item = f64> + Clone,
        lines: &[f64],
        wanted: usize,
        pad: f64,
    ) -> Self {
        // Numbers near the ends of the floating point have no room for ticks around them.
        let usable = values.filter(|v| v.abs() < 1e150 && (!axis.log || *v > 1e-150));
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        match axis.range {
            Range::Fixed(a, b) => (low, high) = (a.min(b), a.max(b)),
            Range::Robust => (low, high) = robust(usable.collect()),
            Range::Auto | Range::WithZero => {
                for v in usable {
                    low = low.min(v);
                    high = high.max(v);
                }
                if axis.range == Range::WithZero && !axis.log {
                    low = low.min(0.0);
                    high = high.max(0.0);
                }
            }
        }
        if low < high && !matches!(axis.range, Range::Fixed(..)) {
            let (a, b) = if axis.log { (low.ln(), high.ln()) } else { (low, high) };
            for line in lines.iter().copied().filter(|v| v.is_finite() && (!axis.log || *v > 0.0)) {
                let at = if axis.log { line.ln() } else { line };
                if at > b - 4.0 * (b - a) && at < a + 4.0 * (b - a) {
                    low = low.min(line);
                    high = high.max(line);
                }
            }
        }
        if !(low.is_finite() && high.is_finite()) {
            (low, high) = if axis.log { (0.1, 1.0) } else { (0.0, 1.0) };
        }
        let fixed = matches!(axis.range, Range::Fixed(..));
        if axis.log {
            Self::log(axis, low, high, wanted, if fixed { 0.0 } else { pad })
        } else {
            Self::linear(axis, low, high, wanted, if fixed { 0.0 } else { pad })
        }
    }

    /// What the page's script needs to read a value off the axis.
    pub fn reading(&self, axis: &Axis) -> serde_json::Value {
        serde_json::json!({
            "lo": self.low,
            "hi": self.high,
            "log": self.log,
            "e": self.exponent,
            "u": self.unit,
            "u0": axis.unit,
            "n": axis.label,
        })
    }

    /// Where a value lies, as a share of the axis; not a number when the axis cannot show it.
    pub fn share(&self, value: f64) -> f64 {
        if self.log {
            if value > 0.0 { (value / self.low).ln() / (self.high / self.low).ln() } else { f64::NAN }
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    fn linear(axis: &Axis, mut low: f64, mut high: f64, wanted: usize, pad: f64) -> Self {
        let size = low.abs().max(high.abs());
        // Below f64's resolution there is nothing to see: show a band about the value instead.
        let least = if size == 0.0 { 1.0 } else { 1e-13 * size };
        if high - low < least {
            let half = if high == low && size > 0.0 { 0.05 * size } else { 0.5 * least };
            let middle = 0.5 * (low + high);
            (low, high) = (middle - half, middle + half);
        }
        let margin = pad * (high - low);
        (low, high) = (low - margin, high + margin);
        let ends = |step: f64| ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
        // Two ticks are the least that show a scale.
        let room = (high - low) / wanted.max(1) as f64;
        let own = axis.steps.iter().copied().find(|s| *s >= room * (1.0 - 1e-9));
        let steps = own.into_iter().chain((wanted.max(1)..).map(|n| nice_step((high - low) / n as f64)));
        let step = steps.take(8).find(|s| ends(*s).1 > ends(*s).0).unwrap_or((high - low) / 4.0);
        let (first, last) = ends(step);
        let values: Vec<f64> = (first..=last.min(first + 50)).map(|i| i as f64 * step).collect();

        let biggest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let offset = if biggest / step > 2e4 { round_near(values[values.len() / 2], step) } else { 0.0 };
        let shown: Vec<f64> = values.iter().map(|v| ((v - offset) / step).round() * step).collect();
        let (factor_exponent, unit) = factor(shown.iter().fold(0.0, |m: f64, v| m.max(v.abs())), &axis.unit);
        let factor = 10f64.powi(factor_exponent);
        let decimals = usize::try_from(-(step / factor * (1.0 + 1e-9)).log10().floor() as i64).unwrap_or(0);
        let ticks = values
            .iter()
            .zip(&shown)
            .map(|(v, s)| {
                let value = s / factor;
                let text =
                    if value == 0.0 { "0".to_owned() } else { format!("{value:.decimals$}").replace('-', "−") };
                Tick { share: (v - low) / (high - low), label: Some(text) }
            })
            .collect();
        let mut label = axis.label.clone();
        if offset != 0.0 {
            let sign = if offset < 0.0 { '+' } else { '−' };
            label = format!("{label} {sign} {}", shortest(offset.abs()));
        }
        let title = titled(&label, &unit);
        Self { low, high, log: false, ticks, exponent: factor_exponent, unit, title }
    }

    fn log(axis: &Axis, mut low: f64, mut high: f64, wanted: usize, pad: f64) -> Self {
        low = low.max(1e-300);
        high = high.max(low);
        if high / low < 1.5 {
            let middle = low.sqrt() * high.sqrt();
            (low, high) = (middle / 1.25, middle * 1.25);
        }
        let widen = (high / low).powf(pad);
        (low, high) = (low / widen, high * widen);
        let decades = (high / low).log10();
        let stride = (decades / wanted.max(1) as f64).ceil().max(1.0) as i32;
        // The fewer decades, the more ticks inside each carry a label.
        let labelled: &[i32] = match decades {
            d if d > 3.0 => &[1],
            d if d > 1.5 => &[1, 3],
            d if d > 0.8 => &[1, 2, 5],
            _ => &[1, 2, 3, 4, 5, 6, 7, 8, 9],
        };
        let mut ticks = Vec::new();
        for exponent in (low.log10().floor() as i32)..=(high.log10().ceil() as i32) {
            for digit in 1..10 {
                let value = f64::from(digit) * 10f64.powi(exponent);
                if value < low * (1.0 - 1e-9) || value > high * (1.0 + 1e-9) {
                    continue;
                }
                let has_label = if decades > 3.0 {
                    digit == 1 && exponent.rem_euclid(stride) == 0
                } else {
                    labelled.contains(&digit)
                };
                if !has_label && decades > 8.0 {
                    continue;
                }
                let share = (value / low).ln() / (high / low).ln();
                ticks.push(Tick { share, label: has_label.then(|| log_label(digit, exponent)) });
            }
        }
        let unit = format::unit(&axis.unit, Medium::Page);
        Self { low, high, log: true, ticks, exponent: 0, title: titled(&axis.label, &unit), unit }
    }
}

/// The number with the fewest digits within fifty steps of `value`.
fn round_near(value: f64, step: f64) -> f64 {
    let candidates = (0..17).filter_map(|digits| format!("{value:.digits$e}").parse::<f64>().ok());
    candidates.into_iter().find(|c| (c - value).abs() <= 50.0 * step).unwrap_or(value)
}

/// A number with just the digits it has.
fn shortest(value: f64) -> String {
    let digits = (1..17).find(|d| format!("{value:.*e}", d - 1).parse() == Ok(value)).unwrap_or(17);
    format::number(value, digits, Medium::Page)
}

/// The text of a tick at `digit * 10^exponent`.
fn log_label(digit: i32, exponent: i32) -> String {
    match exponent {
        0..=3 => format!("{}", i64::from(digit) * 10i64.pow(exponent.unsigned_abs())),
        -2..=-1 => format!("{:.*}", exponent.unsigned_abs() as usize, f64::from(digit) * 10f64.powi(exponent)),
        _ if digit == 1 => format::power_of_ten(exponent),
        _ => format!("{digit}×{}", format::power_of_ten(exponent)),
    }
}

fn titled(label: &str, unit: &str) -> String {
    match (label.is_empty(), unit.is_empty()) {
        (_, true) => label.to_owned(),
        (true, false) => format!("[{unit}]"),
        (false, false) => format!("{label} [{unit}]"),
    }
}

/// Limits that leave out the outermost hundredth at each end, widened to five times the spread of the middle half at
/// the least: a start-up transient does not flatten what follows.
fn robust(mut values: Vec<f64>) -> (f64, f64) {
    if values.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    values.sort_by(f64::total_cmp);
    let at = |q: f64| values[((values.len() - 1) as f64 * q).round() as usize];
    let (q1, q3) = (at(0.25), at(0.75));
    let fence = 2.0 * (q3 - q1);
    let low = values[0].max((q1 - fence).min(at(0.02)));
    let high = values[values.len() - 1].min((q3 + fence).max(at(0.98)));
    (low, high)
}

/// The step of 1, 2 or 5 times a power of ten nearest above.
fn nice_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    let lead = raw / power;
    power
        * if lead <= 1.0 + 1e-9 {
            1.0
        } else if lead <= 2.0 {
            2.0
        } else if lead <= 5.0 {
            5.0
        } else {
            10.0
        }
}

/// The power of ten taken out of the ticks, and the unit that carries it: a prefix where the unit takes one.
pub(super) fn factor(biggest: f64, unit: &str) -> (i32, String) {
    let typeset = format::unit(unit, Medium::Page);
    if biggest == 0.0 || (0.05..1e4).contains(&biggest) {
        return (0, typeset);
    }
    let exponent = 3 * ((biggest.log10() + 1e-9) / 3.0).floor() as i32;
    if exponent == 0 {
        return (0, typeset);
    }
    let first = unit.split(['.', '/', '*']).next().unwrap_or("");
    let prefix = match exponent {
        -12 => "p",
        -9 => "n",
        -6 => "µ",
        -3 => "m",
        3 => "k",
        6 => "M",
        _ => "",
    };
    let takes_prefix = if exponent < 0 {
        matches!(first, "s" | "m" | "rad" | "N" | "A" | "V")
    } else {
        matches!(first, "N" | "Hz" | "A" | "V")
    };
    if takes_prefix && !prefix.is_empty() {
        return (exponent, format!("{prefix}{typeset}"));
    }
    let power = format::power_of_ten(exponent);
    (exponent, if typeset.is_empty() { power } else { format!("{power} {typeset}") })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(scale: &Scale) -> Vec<&str> {
        scale.ticks.iter().filter_map(|t| t.label.as_deref()).collect()
    }

    fn scale(axis: &Axis, values: &[f64]) -> Scale {
        Scale::new(axis, values.iter().copied(), 5, 0.0)
    }

    #[test]
    fn linear_ticks_are_round_and_inside_the_axis() {
        let s = scale(&Axis::linear("time", "s"), &[0.0, 1.1522]);
        assert_eq!(labels(&s), ["0", "0.5", "1.0"]);
        assert!(s.ticks.iter().all(|t| (0.0..=1.0).contains(&t.share)));
        assert_eq!(s.title, "time [s]");
    }

    #[test]
    fn small_values_move_their_power_of_ten_into_the_unit() {
        let s = scale(&Axis::linear("theta1", "rad"), &[-2e-3, 2e-3]);
        assert_eq!(s.title, "theta1 [mrad]");
        assert_eq!(labels(&s), ["−2", "−1", "0", "1", "2"]);
        let s = scale(&Axis::linear("I2", "kg.m2"), &[0.0, 6.07e-6]);
        assert_eq!(s.title, "I2 [10⁻⁶ kg·m²]");
    }

    #[test]
    fn a_converged_history_shows_its_last_digits_behind_an_offset() {
        let s = scale(&Axis::linear("K", "N.m/rad"), &[0.0176 - 1e-9, 0.0176 + 1e-9]);
        assert!(s.title.starts_with("K − 0.0176 ["), "{}", s.title);
        assert!(s.title.ends_with("[nN·m/rad]"), "{}", s.title);
        let mut seen = labels(&s);
        seen.dedup();
        assert_eq!(seen.len(), s.ticks.len(), "every tick has its own label: {seen:?}");
    }

    #[test]
    fn a_tick_stands_at_the_value_its_label_says() {
        // Ranges of every size and position, from a fixed sequence.
        let mut u = (1..).map(|k| (f64::from(k) * 0.754_877_666_246_693).fract());
        let mut next = || u.next().unwrap_or(0.5);
        for _ in 0..2000 {
            let size = 10f64.powf(6.0 * next() - 3.0);
            let (low, width) = (size * (2.0 * next() - 1.0), size * (0.01 + next()));
            let s = scale(&Axis::linear("a", ""), &[low, low + width]);
            // Without a power of ten or an offset in the title the labels are the values themselves.
            if s.title != "a" {
                continue;
            }
            assert!((2..=11).contains(&s.ticks.len()), "{low} {width}: {:?}", labels(&s));
            let step = s.ticks[1].share - s.ticks[0].share;
            for t in &s.ticks {
                let value: f64 = t.label.as_deref().unwrap_or("").replace('−', "-").parse().expect("a number");
                assert!((s.share(value) - t.share).abs() < 1e-6 * step, "{low} {width}: {value}");
            }
        }
    }

    #[test]
    fn a_small_axis_still_has_two_ticks_to_read_a_scale_from() {
        for (low, high) in [(3.1, 4.6), (-0.37, 0.34), (0.6, 1.9), (99.0, 101.0), (-1.0, 4.9)] {
            let s = Scale::new(&Axis::linear("a", "s"), [low, high].into_iter(), 2, 0.05);
            assert!(s.ticks.len() >= 2, "{low} to {high}: {:?}", labels(&s));
        }
    }

    #[test]
    fn reference_lines_stand_inside_the_axis_but_for_those_far_off() {
        let data = [-1.0, 1.0];
        for axis in [Axis::linear("a", "m"), Axis::linear("a", "m").over(Range::WithZero)] {
            let s = Scale::holding(&axis, data.into_iter(), &[3.0, -2.5, f64::NAN], 5, 0.05);
            assert!(s.share(3.0) < 1.0 && s.share(-2.5) > 0.0, "{s:?}");
            // A line a hundred times as far as the data would leave nothing to be seen of them.
            let s = Scale::holding(&axis, data.into_iter(), &[100.0], 5, 0.05);
            assert!(s.share(100.0) > 1.0 && s.share(1.0) > 0.9, "{s:?}");
        }
        let s = Scale::holding(&Axis::log("a", "m"), [1.0, 10.0].into_iter(), &[100.0, -1.0], 5, 0.05);
        assert!(s.share(100.0) < 1.0, "{s:?}");
    }

    #[test]
    fn degenerate_data_still_give_an_axis() {
        for values in
            [&[][..], &[f64::NAN], &[0.0], &[3.5, 3.5], &[1.0, 1.0 + 1e-16], &[f64::INFINITY, -1.0], &[1e300, -1e300]]
        {
            for axis in [Axis::linear("a", "m"), Axis::log("a", "m")] {
                let s = scale(&axis, values);
                assert!(!s.ticks.is_empty(), "{values:?}");
                assert!(s.ticks.iter().all(|t| t.share.is_finite()), "{values:?}");
            }
        }
    }

    #[test]
    fn log_ticks_mark_decades_and_leave_out_what_has_no_logarithm() {
        let s = scale(&Axis::log("frequency", "Hz"), &[0.0, -1.0, 1.0, 1000.0]);
        assert_eq!(labels(&s), ["1", "3", "10", "30", "100", "300", "1000"]);
        assert!((s.share(10.0) - 1.0 / 3.0).abs() < 1e-12);
        assert!(s.share(0.0).is_nan());
        let s = scale(&Axis::log("power", ""), &[1e-18, 1.0]);
        assert!(labels(&s).len() <= 6 && labels(&s).contains(&"10⁻¹²"), "{:?}", labels(&s));
    }

    #[test]
    fn a_robust_range_is_not_ruled_by_a_start_up_transient() {
        let mut axis = Axis::linear("K", "");
        axis.range = Range::Robust;
        let values: Vec<f64> = (0..1000).map(|k| if k < 5 { 1e6 } else { 1.0 + 1e-3 * f64::from(k % 7) }).collect();
        let s = scale(&axis, &values);
        assert!(s.share(1.0) >= 0.0 && s.share(1.006) <= 1.0);
        assert!(s.share(1e6) > 100.0);
    }
}
