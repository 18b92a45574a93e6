//! Torque against motion, at the spectral lines where the two are coherent:
//!
//! ```text
//! T(t) = M1*a1 + M2*a2 + c*v1 + F*sign(v1) + k*x1      M1, M2, c, F >= 0; the motion may be late by tau
//! ```
//!
//! M2 belongs to the table's encoder where there is one; else to a resonance `a1/(1 - (w/wa)^2)` whose frequency is tried.
//! With the table's encoder alone the motor shows as `M2*a2''`. Least squares over the lines' averaged cross spectra, the
//! coefficients kept from below zero (C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, 1974, ch. 23; here by
//! coordinates, the problem has six).

mod conditions;
mod equation;
mod lines;
mod torque;

use super::encoders::{compare_encoders, encoder_ratio, slow_motion_finding};
use super::finding::{Finding, Severity};
use super::motion::Direction;
use super::rigid::{self, NominalFit};
use super::spectra::Spectra;
use super::{Inertia, Input};
use conditions::{check_band, check_directions, check_time_scale};
use lines::coherent_lines;
use torque::torque_findings;

/// Least coherence of a line, where the number of averages does not require more.
pub(super) const COHERENT: f64 = 0.4;

/// Columns of the spectra.
pub(super) const T: usize = 0;
pub(super) const MAIN: usize = 1;
const SIGN: usize = 2;
pub(super) const TABLE: usize = 3;

/// The rates of motor and table that are compared with the torque, rad/s (m/s), between two samples each.
struct Rates {
    /// The motor's, or, where `collocated` is false, the table's.
    main: Vec<f64>,
    /// Its sign; zero where it is small.
    sign: Vec<f64>,
    /// The table's beside the motor's.
    table: Option<Vec<f64>>,
    collocated: bool,
}

impl Rates {
    /// None where no motion is measured.
    fn of(input: &Input<'_>) -> Option<Self> {
        let rate = |x: Option<&[f64]>, v: Option<&[f64]>| -> Option<Vec<f64>> {
            match (x, v) {
                (Some(x), _) => Some(x.windows(2).map(|w| (w[1] - w[0]) / input.dt).collect()),
                (None, Some(v)) => Some(v.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect()),
                (None, None) => None,
            }
        };
        let (one, two) = rayon::join(|| rate(input.theta1, input.omega1), || rate(input.theta2, input.omega2));
        let collocated = one.is_some();
        let (main, table) = match (one, two) {
            (Some(one), two) => (one, two),
            (None, two) => (two?, None),
        };
        let direction = Direction::of(main.iter().copied());
        let sign = main.iter().map(|v| direction.at(*v)).collect();
        Some(Self { main, sign, table, collocated })
    }

    /// The columns of the spectra.
    fn columns<'a>(&'a self, torque: &'a [f64]) -> Vec<&'a [f64]> {
        let mut columns: Vec<&[f64]> = vec![&torque[..self.main.len()], &self.main, &self.sign];
        columns.extend(self.table.as_deref());
        columns
    }
}

/// Averaged spectra with coherent lines, of segments as short as they can be, and those lines; None where there are none.
fn of_segments(columns: &[&[f64]], dt: f64) -> Option<(Spectra, Vec<usize>)> {
    let n = columns[0].len();
    let lengths = [power_of_two(n / 8).clamp(32, 8192), power_of_two(n / 3).clamp(32, 65_536)];
    lengths.into_iter().find_map(|length| {
        let spectra = Spectra::new(columns, length, dt);
        let found = coherent_lines(&spectra);
        (!found.is_empty()).then_some((spectra, found))
    })
}

/// Looks at torque and motion. Gives the band in which they are coherent, Hz, and sets the inertia that moves, where it is
/// positive.
pub(super) fn examine(
    input: &Input<'_>,
    inertia: &mut Option<Inertia>,
    findings: &mut Vec<Finding>,
) -> Option<[f64; 2]> {
    let torque = input.torque?;
    check_time_scale(input, findings);
    let rates = || {
        let rates = Rates::of(input)?;
        let found = of_segments(&rates.columns(torque), input.dt);
        Some((rates, found))
    };
    let (nominal, rates) = rayon::join(|| rigid::compare_with_nominal(input), rates);
    let (rates, found) = rates?;
    let collocated = rates.collocated;
    check_directions(&rates.main, findings);
    let Some((spectra, lines)) = found else {
        single_spectrum(input, &rates.columns(torque), collocated, nominal, inertia, findings);
        return None;
    };
    // A single line without neighbours may pass by chance.
    let adjacent: Vec<usize> = lines.windows(3).filter(|w| w[2] - w[0] == 2).map(|w| w[1]).collect();
    let [first, last] = match (adjacent.first(), adjacent.last()) {
        (Some(first), Some(last)) => [*first, *last],
        _ => [lines[0], lines[lines.len() - 1]],
    };
    let band = [first, last].map(|f| spectra.omega(f) / std::f64::consts::TAU);
    if spectra.has(TABLE) {
        compare_encoders(input, &spectra, &lines, findings);
    }
    *inertia = merge_with_nominal(nominal, torque_findings(input, &spectra, &lines, collocated), findings);
    check_band(input.nominal, band, findings);
    Some(band)
}

/// A record without coherent lines: too short for its slow motion, or with another axis' torque. The momentum equation is fitted to a single
/// spectrum of the whole record, at the lines with 98 % of the speed's power; too few lines determine nothing.
fn single_spectrum(
    input: &Input<'_>,
    columns: &[&[f64]],
    collocated: bool,
    nominal: Option<NominalFit>,
    inertia: &mut Option<Inertia>,
    findings: &mut Vec<Finding>,
) {
    let spectra = Spectra::new(columns, fft_length(columns[0].len()), input.dt);
    // Above the motion's band the acceleration is noise: the lowest lines, with nearly all of the speed's power.
    let total: f64 = (0..spectra.lines).map(|f| spectra.power(MAIN, f)).sum();
    let mut sum = 0.0;
    let lines: Vec<usize> = (0..spectra.lines)
        .take_while(|f| {
            let take = sum < 0.98 * total;
            sum += spectra.power(MAIN, *f);
            take
        })
        .collect();
    if lines.len() < LEAST_LINES {
        findings.extend(slow_motion_finding(input));
        let nothing = if nominal.is_some() { Vec::new() } else { vec![too_short(lines.len())] };
        merge_with_nominal(nominal, (None, nothing), findings);
        return;
    }
    if spectra.has(TABLE) {
        findings.extend(encoder_ratio(input, &spectra, &lines).1);
    }
    *inertia = merge_with_nominal(nominal, torque_findings(input, &spectra, &lines, collocated), findings);
}

/// Even number of samples, all of `n` or, of a long record, a little fewer: a length with a large prime factor is transformed several
/// times as slowly.
fn fft_length(n: usize) -> usize {
    if n < 1 << 16 {
        return n / 2 * 2;
    }
    let odd = (0..6).flat_map(|threes| (0..6).map(move |fives| 3_usize.pow(threes) * 5_usize.pow(fives)));
    odd.filter(|odd| 2 * odd <= n).map(|odd| odd << (n / odd).ilog2()).max().unwrap_or(n / 2 * 2)
}

/// Findings of the fit with free coefficients; those on sign and unit are replaced by the comparison with the nominal axis, where there is
/// one. Gives the inertia.
fn merge_with_nominal(
    nominal: Option<NominalFit>,
    (inertia, found): (Option<Inertia>, Vec<Finding>),
    findings: &mut Vec<Finding>,
) -> Option<Inertia> {
    let known = nominal.is_some();
    findings.extend(found.into_iter().filter(|f| !(known && ["sign", "units", "inertia"].contains(&f.id))));
    // A table encoder in another unit changes the inertia too: that finding is the cause.
    let of_the_table = findings.iter().any(|f| f.severity == Severity::Refuse && f.signal == "theta2");
    match nominal {
        Some(NominalFit::Inconsistent(finding)) if !of_the_table => {
            let kept = inertia.filter(|_| finding.id != "sign");
            findings.push(finding);
            kept
        }
        _ => inertia,
    }
}

/// The note that too few lines have the motion's power for a statement on the torque.
fn too_short(lines: usize) -> Finding {
    Finding::new(
        "too_short",
        Severity::Note,
        "T",
        format!("The motion is so slow, or the record so short, that {} lines of its spectrum hold it.", lines),
        "Whether the torque is this axis' own cannot be told from so few.",
        "Record longer, with more reversals.",
    )
}

/// Least number of lines for a fit to a single spectrum: each of the six coefficients takes half a line.
const LEAST_LINES: usize = 12;

fn power_of_two(n: usize) -> usize {
    if n.is_power_of_two() { n } else { n.next_power_of_two() / 2 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_record_is_cut_to_a_length_of_small_factors() {
        for n in [100_003, 999_999, 3_000_017] {
            let length = fft_length(n);
            assert!(length <= n && length > n - n / 50 && length.is_multiple_of(2), "{n}: {length}");
            let mut rest = length;
            for factor in [2, 3, 5] {
                while rest.is_multiple_of(factor) {
                    rest /= factor;
                }
            }
            assert_eq!(rest, 1, "{n}: {length}");
        }
        assert_eq!(fft_length(4001), 4000);
    }
}
