//! What an effect changes of what a model lacks, linear in its sizes.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use super::fit::Term;
use super::likelihood::{C, Spectra};
use super::problem::Problem;
use super::scales::Scales;
use crate::effects::{Effect, Role, Settings, Start};

/// Shares of a size among the shapes that were tried that an effect may begin at.
const LEAST_SHARE: f64 = 0.2;
const LARGEST_SHARE: f64 = 5.0;
/// Share of the record's torque that an effect is looked at with.
const TRIAL: f64 = 0.05;
/// Largest unlikeness of two directions at which a fit begins.
const UNLIKE: f64 = 0.9;

/// An effect in a form at some shapes, beside a fit.
pub struct Candidate {
    term: Term,
    /// The effect at the sizes that its columns were made with.
    trial: Settings,
    /// What each of its sizes changes, and each shape that enters linearly.
    pub columns: Vec<[Vec<C>; 2]>,
    /// Whether the coefficient of a column may be negative.
    pub signed: Vec<bool>,
    /// Sizes with a column of their own.
    sizes: Vec<usize>,
    /// Shapes that enter linearly beside the first size, and the steps of them.
    extra: Vec<(usize, f64)>,
}

impl Candidate {
    /// The effect beside `lacked`, what the model without it lacks; `rows_of` tells what the model lacks with it. `None` where it changes
    /// nothing or cannot be run.
    pub fn new(
        problem: &Problem<'_>,
        lacked: &Spectra,
        scales: &Scales,
        term: Term,
        shapes: &Settings,
        rows_of: impl Fn(&Settings) -> Option<Arc<Spectra>>,
    ) -> Option<Self> {
        let (effect, form) = term;
        let info = effect.info();
        let free = info.variants[form].free;
        let changed = |settings: &Settings| Some(difference(rows_of(settings)?.as_ref(), lacked));
        let guessed = |i: usize| TRIAL * guess(info.parameters[i].unit, scales, info.place.side());
        let has_column =
            |i: &usize| info.parameters[*i].role == Role::Size && matches!(info.parameters[*i].start, Start::Linear);
        let sizes: Vec<usize> = free.iter().copied().filter(has_column).collect();
        let mut candidate =
            Self { term, trial: *shapes, columns: Vec::new(), signed: Vec::new(), sizes, extra: Vec::new() };
        for &i in &candidate.sizes {
            let q = &info.parameters[i];
            let mut v = guessed(i).clamp(q.min, q.max);
            let at = |v: f64| with(shapes, effect, i, v);
            let mut column = changed(&at(v))?;
            let ratio = TRIAL * scales.torque / torque_of(&column, problem.band.n);
            if !ratio.is_finite() {
                return None;
            }
            // One of another order of magnitude is looked at once more.
            if !(0.1..10.0).contains(&ratio) {
                v = (v * ratio).clamp(q.min, q.max);
                column = changed(&at(v))?;
            }
            candidate.columns.push(column);
            candidate.signed.push(q.min < 0.0);
            candidate.trial.of_mut(effect)[i] = v;
        }
        if candidate.sizes.is_empty() {
            // The size is among the shapes tried.
            candidate.columns.push(changed(shapes)?);
            candidate.signed.push(false);
        }
        let first = (candidate.sizes.len() == 1).then(|| candidate.columns[0].clone());
        for &i in free {
            let q = &info.parameters[i];
            let step = match q.start {
                Start::Share => 0.3,
                Start::Phase => FRAC_PI_2,
                // A damping.
                Start::Linear if q.role == Role::Shape => guessed(i).clamp(q.min, q.max),
                _ => continue,
            };
            let total = changed(&with(&candidate.trial, effect, i, q.off + step))?;
            let is_alone = matches!(q.start, Start::Phase);
            candidate.columns.push(if is_alone { total } else { difference(&total, first.as_ref()?) });
            candidate.signed.push(true);
            candidate.extra.push((i, step));
        }
        Some(candidate)
    }

    /// What the coefficient of each column may be beside others': a size that is among the shapes is the one that was tried (two limits of
    /// the torque of any size would be a smaller torque), others have a sign at most.
    pub fn within(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let of = |signed: &bool| match (self.sizes.is_empty(), signed) {
            (true, _) => [1.0; 2],
            (false, true) => [f64::NEG_INFINITY, f64::INFINITY],
            (false, false) => [0.0, f64::INFINITY],
        };
        self.signed.iter().map(of)
    }

    /// Puts the effect into settings, its columns at some coefficients.
    pub fn put(&self, c: &[f64], settings: &mut Settings) {
        let (effect, form) = self.term;
        let info = effect.info();
        let within = |i: usize, v: f64| v.clamp(info.parameters[i].min, info.parameters[i].max);
        let trial = self.trial.of(effect);
        let own = settings.of_mut(effect);
        own.copy_from_slice(trial);
        if self.sizes.is_empty() {
            // Only the first size follows the factor.
            let is_size = |i: &&usize| info.parameters[**i].role == Role::Size;
            if let Some(&i) = info.variants[form].free.iter().find(is_size) {
                own[i] = within(i, trial[i] * c[0].clamp(LEAST_SHARE, LARGEST_SHARE));
            }
        }
        for (c, &i) in c.iter().zip(&self.sizes) {
            own[i] = within(i, trial[i] * c);
        }
        for (b, &(i, step)) in c[c.len() - self.extra.len()..].iter().zip(&self.extra) {
            let linear = within(i, info.parameters[i].off + step * b / c[0]);
            match info.parameters[i].start {
                // a*sin(x) + b*cos(x).
                Start::Phase => {
                    let first = self.sizes[0];
                    own[first] = trial[first] * c[0].hypot(*b);
                    own[i] = b.atan2(c[0]);
                }
                Start::Share => own[i] = linear.clamp(-UNLIKE, UNLIKE),
                _ => own[i] = linear,
            }
        }
    }
}

/// Settings with one parameter of an effect at a value.
fn with(settings: &Settings, effect: Effect, i: usize, value: f64) -> Settings {
    let mut settings = *settings;
    settings.of_mut(effect)[i] = value;
    settings
}

fn difference(a: &Spectra, b: &Spectra) -> Spectra {
    [0, 1].map(|e| a[e].iter().zip(&b[e]).map(|(a, b)| a - b).collect())
}

/// Root mean square of the torque with a spectrum of a record of so many samples, N.m.
fn torque_of(spectra: &Spectra, samples: usize) -> f64 {
    (spectra.iter().flatten().map(|c| c.norm_sqr()).sum::<f64>() * 2.0 / samples as f64).sqrt()
}

/// A size that makes about the record's torque, by its unit.
fn guess(unit: &str, s: &Scales, side: usize) -> f64 {
    let (t, w, x) = (s.torque, s.speed[side].max(1e-12), s.rotation[side].max(1e-12));
    match unit {
        "N.m" => t,
        "N.m.s/rad" => t / w,
        "N.m.s2/rad2" => t / (w * w),
        "N.m/rad" => t / x,
        "N.m/s" => t / s.length,
        "1/s" => 1.0 / s.length,
        "1/rad2" => 1.0 / (s.twist * s.twist),
        "rad" => s.twist,
        "1" => 1.0,
        _ => t,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A candidate whose effect stands at `trial`, its columns told by their number alone.
    fn candidate(term: Term, trial: &[f64], sizes: &[usize], extra: &[(usize, f64)]) -> Candidate {
        let columns = (sizes.len() + extra.len()).max(1);
        let mut settings = Settings::default();
        settings.of_mut(term.0).copy_from_slice(trial);
        let (sizes, extra) = (sizes.to_vec(), extra.to_vec());
        let columns = vec![[Vec::new(), Vec::new()]; columns];
        Candidate { term, trial: settings, signed: vec![false; columns.len()], columns, sizes, extra }
    }

    fn put(candidate: &Candidate, c: &[f64]) -> Vec<f64> {
        let mut settings = Settings::default();
        candidate.put(c, &mut settings);
        settings.of(candidate.term.0).to_vec()
    }

    #[test]
    fn a_sine_and_its_quarter_are_put_as_amplitude_and_phase() {
        let ripple = candidate((Effect::TorqueRipple, 0), &[0.02, 5.0, 0.0], &[0], &[(2, FRAC_PI_2)]);
        // 3*sin(x) + 4*cos(x) = 5*sin(x + atan2(4, 3)).
        let [amplitude, order, phase] = put(&ripple, &[3.0, 4.0])[..] else { panic!() };
        assert!((amplitude - 0.1).abs() < 1e-15 && order == 5.0 && (phase - 4.0_f64.atan2(3.0)).abs() < 1e-15);
    }

    #[test]
    fn an_unlikeness_is_what_its_column_has_of_the_size_and_no_more_than_a_fit_may_begin_at() {
        let friction = candidate((Effect::CoulombMotor, 1), &[0.01, 0.0, 1.0, 0.0, 0.0], &[0], &[(3, 0.3)]);
        let own = put(&friction, &[4.0, 2.0]);
        assert!((own[0] - 0.04).abs() < 1e-15 && (own[3] - 0.15).abs() < 1e-15, "{own:?}");
        assert_eq!(put(&friction, &[4.0, -40.0])[3], -UNLIKE);
    }

    #[test]
    fn a_size_among_the_shapes_is_a_share_of_the_one_that_was_tried() {
        let gap = candidate((Effect::DeadZone, 0), &[0.01], &[], &[]);
        assert_eq!(put(&gap, &[0.5]), [0.005]);
        assert_eq!(put(&gap, &[90.0]), [0.01 * LARGEST_SHARE]);
        assert_eq!(gap.within().collect::<Vec<_>>(), [[1.0; 2]]);
        let friction = candidate((Effect::CoulombMotor, 0), &[0.01, 0.0, 1.0, 0.0, 0.0], &[0], &[]);
        assert_eq!(friction.within().collect::<Vec<_>>(), [[0.0, f64::INFINITY]]);
    }
}
