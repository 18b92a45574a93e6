//! A record diagnosed by the torque that its model lacks to follow it.
//!
//! [`super::search`] is the search for the hypothesis, top to bottom, [`super::material`] what counts as a cause in it,
//! [`super::conclusion`] its end, [`super::gap`] how far the gap shrinks on data that no fit has seen; the one evidence is
//! [`crate::hypothesis`]'s. A machine's log is made under control, its model never complete: its verdict must not be sought at the noise
//! floor of a simulation (Gautier, Khalil, and the inverse dynamics of robot identification; Kennedy, O'Hagan, JRSS B 63(3), 2001, for
//! the discrepancy).
//!
//! On a rigid axis motor, coupling and table are one place, called `axis`.

use super::assess::{Case, HELD_OUT, Outcome, Replay};
use super::decision::Decision;
use super::diagnosis::ClosureOf;
use super::gap::{self, Gaps};
use super::location::without_offset;
use super::material::{DISTINCT, NEGLIGIBLE, is_materially_less};
use super::prepared::{Prepared, prepared};
use super::quantisation;
use super::residual::located;
use super::search::{Search, decide, decide_further};
use super::summary::{build, overlays};
use super::verdict::Verdict;
use crate::axis::Structure;
use crate::conditioning::{Record, bridged};
use crate::effects::{Effect, Place};
use crate::hypothesis::band::Reach;
use crate::hypothesis::fit::Fit;
use crate::hypothesis::problem::Work;

/// Share of the torque that an account of a rigid axis leaves at most where the band that its motion rules is understood so far that what
/// it lacks may be the edge of a cause that lies beyond.
const UNDERSTOOD: f64 = 0.1;

/// Diagnoses a record.
#[must_use]
pub fn diagnose(case: &Case<'_>, progress: &(dyn Fn(&str) + Sync)) -> Outcome {
    let (train, held) = split(case);
    let (searched, decision) = Looks::new(case, progress).decided(&train);
    progress("held-out data");
    let fits = [&decision.given, &decision.parameters, &decision.chosen];
    let models = fits.map(|f| f.model);
    let seen = searched.alike(&held, &models[2]);
    let on_train = Gaps::measure(&searched.record, &searched, fits);
    let on_held = Gaps::measure(&held, &seen, fits);
    progress("where");
    let located = located(&searched, &models[1], decision.parameters.bandwidth);
    let closure = |of, fit: &Fit| gap::closure_by(on_held.by(of), &held, &seen, [fits[0], fits[1], fit]);
    let mut diagnosis = build(case, &decision, &searched, &closure, &on_train, &on_held, located);
    quantisation::attribute(case, &mut diagnosis);
    let mut overlays = overlays(&held, on_held.shown());
    let of_torque = seen.torque_overlay(on_held.by(ClosureOf::Torque));
    let first = if on_held.headline().of == ClosureOf::Torque { 0 } else { overlays.len() };
    overlays.insert(first, of_torque);
    let replay = Replay { initial: on_held.shown().initial, record: held };
    Outcome { diagnosis, improved: models[2], models, decision, overlays, replay }
}

/// The looks that are taken at one record: in its band, at its own rate, in a wider band, further on in it.
struct Looks<'a> {
    case: &'a Case<'a>,
    /// Effects that may be named.
    suspects: Vec<Effect>,
    /// What all of them have simulated.
    work: Work,
    /// Whether the motion is given, and not the torque.
    motion_is_given: bool,
    progress: &'a (dyn Fn(&str) + Sync),
}

impl<'a> Looks<'a> {
    fn new(case: &'a Case<'a>, progress: &'a (dyn Fn(&str) + Sync)) -> Self {
        let may = |e: &Effect| e.may_be_named(case.nominal.structure, case.motion) && !case.nominal.effects.is_on(*e);
        let suspects = case.suspects.iter().copied().filter(may).collect();
        Self { case, suspects, work: Work::default(), motion_is_given: false, progress }
    }

    /// The same with the motion given: an encoder's own effect is none of its torque, of a torque that is swallowed any other would have done
    /// as well, and a friction that changes is what any foreign torque does to one that does not.
    fn with_motion_given(self) -> Self {
        let is_told = |e: &Effect| e.info().place != Place::Sensor && !e.bends_torque() && !e.is_changing_friction();
        Self { suspects: self.suspects.iter().copied().filter(is_told).collect(), motion_is_given: true, ..self }
    }

    /// A record ready for a look at it.
    fn prepared(&self, record: &Record, reach: Reach) -> (Prepared, Option<Prepared>) {
        let nominal = &self.case.nominal;
        let (searched, own) = prepared(record, nominal, reach);
        if !self.motion_is_given {
            return (searched, own);
        }
        (searched.with_motion_given(nominal), own.map(|own| own.with_motion_given(nominal)))
    }

    /// A search for every effect that may be named.
    fn search<'p>(&'p self, prepared: &'p Prepared) -> Search<'p> {
        prepared.search(self.case, self.suspects.clone(), &self.work, self.progress)
    }

    /// The decision on a record, and the look that it was made in. With the torque given an axis is the heavier the less of its torque the
    /// motion needs: where nothing is told of it so the motion is given.
    fn decided(self, train: &Record) -> (Prepared, Decision) {
        let found = self.looked(train);
        let nominal = &self.case.nominal;
        // A known effect of an encoder leaves the motion to be told.
        let is_measured = nominal.effects.active().sensors().is_empty();
        let is_explained = found.1.verdict != Verdict::Unexplained;
        if nominal.structure != Structure::Rigid || !is_measured || is_explained {
            return found;
        }
        (self.progress)("with the motion given");
        self.with_motion_given().looked(train)
    }

    /// The decision of all looks, with the torque given or the motion.
    fn looked(&self, train: &Record) -> (Prepared, Decision) {
        // A rigid axis is taken to be under control.
        let rigid = self.case.nominal.structure == Structure::Rigid;
        let (searched, own) = self.prepared(train, if rigid { Reach::Ruled } else { Reach::Shown });
        let decision = decide(self.search(&searched), None);
        let (mut searched, mut decision) = self.at_own_rate(searched, own, decision);
        if let Some(wide) = rigid.then(|| self.beyond_the_band(train, &searched, &decision)).flatten() {
            (searched, decision) = wide;
        }
        self.further_on(train, &searched, &decision.chosen).unwrap_or((searched, decision))
    }

    /// What leaves so little that the error of the band's rate counts is settled at the record's own: that error is a share of the torque, of
    /// which fine encoders show hundreds of noises.
    fn at_own_rate(&self, searched: Prepared, own: Option<Prepared>, decision: Decision) -> (Prepared, Decision) {
        let chosen = &decision.chosen;
        let is_near = !chosen.terms.is_empty()
            && (searched.band.is_near_the_noise(&chosen.rows) || searched.left(chosen) < DISTINCT);
        let Some(own) = own.filter(|_| is_near) else { return (searched, decision) };
        (self.progress)("at the record's own rate");
        let search = own.search(self.case, likely(&decision), &self.work, self.progress);
        let other = decide(search, Some(&decision.chosen));
        let [left, own_left] = [searched.left(&decision.chosen), own.left(&other.chosen)];
        let leaves_more = is_materially_less(left * left, own_left * own_left);
        // A closer look has no more to explain.
        if own_left > NEGLIGIBLE && leaves_more { (searched, decision) } else { (own, other) }
    }

    /// What joins the causes of a rigid axis where the band is whole, and leaves less there.
    fn beyond_the_band(
        &self,
        train: &Record,
        searched: &Prepared,
        decision: &Decision,
    ) -> Option<(Prepared, Decision)> {
        let left = searched.left(&decision.chosen);
        if !(NEGLIGIBLE..UNDERSTOOD).contains(&left) || searched.band.at_floor(&decision.chosen.rows) {
            return None;
        }
        (self.progress)("beyond the band that the motion rules");
        let (wide, own) = self.prepared(train, Reach::Whole);
        let further = decide_further(self.search(&wide), &decision.chosen)?;
        let (wide, other) = self.at_own_rate(wide, own, further);
        // More to explain and less left of it: what was missing is there.
        (wide.left(&other.chosen) < left).then_some((wide, other))
    }

    /// What joins the causes of the searched part of a record where their model lacks materially more, further on in it.
    fn further_on(&self, train: &Record, searched: &Prepared, chosen: &Fit) -> Option<(Prepared, Decision)> {
        let (part, lacks) = searched.worst_beyond(train, self.case, &chosen.model)?;
        let search = self.search(&part);
        if !search.leaves_materially_less(&lacks, chosen) {
            return None;
        }
        (self.progress)("a later part of the record");
        let other = decide_further(search, chosen)?;
        Some((part, other))
    }
}

/// The record that the fits see, and the one that they do not.
fn split(case: &Case<'_>) -> (Record, Record) {
    let n = case.train.len();
    let own = |r: &Record| without_offset(&bridged(r).0, &case.nominal.parameters, case.nominal.structure);
    match case.holdout {
        Some(other) => (own(case.train), own(other)),
        None => {
            let split = n - (n as f64 * HELD_OUT) as usize;
            let whole = own(case.train);
            (whole.part(0..split), whole.part(split..n))
        }
    }
}

/// The effects of the likeliest hypotheses.
fn likely(decision: &Decision) -> Vec<Effect> {
    let mut effects: Vec<Effect> = decision.ranking.iter().flat_map(|w| w.fit.terms.iter().map(|t| t.0)).collect();
    effects.sort_unstable();
    effects.dedup();
    effects
}
