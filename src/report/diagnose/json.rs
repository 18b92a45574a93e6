//! `diagnosis.json`: the contract, field by field, of the typed diagnosis and its sentences.

use serde_json::{Map, Value, json};

use super::naming::{RESIDUAL, held_out, variable};
use super::sentences;
use crate::control::LoopErrors;
use crate::diagnose::location::{FrequencyPart, PartOf, Side, StateCurve, TimeSlot};
use crate::diagnose::{
    AxisParameter, Cause, ClosedLoop, ClosureOf, Diagnosis, Estimate, Figures, GapReport, Levels, Ranked, Remainder,
    Site, Verdict, Where,
};

/// Name and version of the format.
pub const SCHEMA: &str = "eixo.diagnosis/1";

/// The diagnosis as it is written to the file, with the warnings about the record. A number that is not finite is `null`.
#[must_use]
pub fn value(d: &Diagnosis, of_the_record: &[String]) -> Value {
    let confusable = d.confusable.iter().map(|c| json!([c.named.info().id, c.other.info().id, sentences::alike(c)]));
    let mut all = json!({
        "schema": SCHEMA,
        "machine": d.machine,
        "verdict": verdict(d.verdict),
        "sentence": sentences::sentence(d),
        "causes": list(&d.causes, cause),
        "ranking": list(&d.ranking, ranked),
        "confusable": confusable.collect::<Vec<_>>(),
        "next_experiment": sentences::next_experiment(d),
        "where": location(&d.location),
        "remainder": remainder(&d.remainder),
        "gap": gap(&d.gap),
        "parameters": map(d.parameters.iter().map(|p| (p.parameter.name(), parameter(p)))),
        "warnings": of_the_record.iter().cloned().chain(sentences::warnings(d, None)).collect::<Vec<_>>(),
    });
    if let Some(open) = &d.undecided {
        let ids: Vec<&str> = open.effects.iter().map(|e| e.info().id).collect();
        all["undecided"] = json!({ "effects": ids, "share_of_gap": open.share_of_gap });
    }
    if let Some(l) = &d.closed_loop {
        all["closed_loop"] = closed_loop(l);
    }
    all
}

/// The name of a site, `none` without one.
#[must_use]
pub fn site(site: Option<Site>) -> &'static str {
    site.map_or("none", Site::as_str)
}

/// The name of a verdict.
#[must_use]
pub const fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Effect => "effect",
        Verdict::Parameters => "parameters",
        Verdict::NoGap => "no_gap",
        Verdict::Unexplained => "unexplained",
    }
}

const fn residual(side: Side) -> &'static str {
    match side {
        Side::Motor => "r1",
        Side::Table => "r2",
    }
}

fn list<T>(items: &[T], of: fn(&T) -> Value) -> Value {
    items.iter().map(of).collect()
}

fn map(fields: impl Iterator<Item = (&'static str, Value)>) -> Value {
    Value::Object(fields.map(|(name, value)| (name.to_owned(), value)).collect::<Map<_, _>>())
}

fn cause(c: &Cause) -> Value {
    let estimate = |e: &Estimate| json!({ "value": e.value, "std": e.std, "unit": e.unit });
    json!({
        "id": c.effect.info().id,
        "family": c.effect.info().family.as_str(),
        "place": c.site.as_str(),
        "variant": c.variant,
        "probability": c.probability,
        "share_of_gap": c.share_of_gap,
        "parameters": map(c.named().map(|(name, e)| (name, estimate(e)))),
    })
}

fn ranked(r: &Ranked) -> Value {
    json!({
        "id": r.hypothesis.to_string(),
        "family": r.hypothesis.effects().first().map_or("none", |e| e.info().family.as_str()),
        "place": site(r.site),
        "probability": r.probability,
        "delta_bic": r.delta_bic,
        "chi2": r.chi2,
        "closure_holdout": r.closure_holdout,
    })
}

fn location(w: &Where) -> Value {
    json!({
        "place": site(w.site),
        "by_place": map(w.shares.iter().map(|(site, share)| (site.as_str(), json!(share)))),
        "by_time": list(&w.shown.by_time, slot),
        "by_frequency": list(&w.shown.by_frequency, part),
        "by_state": list(&w.shown.by_state, curve),
        "summary": sentences::gap_shows(&w.shown, None),
    })
}

fn slot(s: &TimeSlot) -> Value {
    json!({ "start": s.start, "end": s.end, "r1": s.r1, "r2": s.r2, "at_place": s.at_place })
}

fn part(p: &FrequencyPart) -> Value {
    let kind = match p.of {
        PartOf::Mean => "mean".to_owned(),
        PartOf::Excited => "excited_lines".to_owned(),
        PartOf::Even => "even_lines".to_owned(),
        PartOf::Odd => "odd_lines".to_owned(),
        PartOf::Foreign => "foreign".to_owned(),
        PartOf::Turn(order) => format!("turn_order_{order}"),
        PartOf::Band => "band".to_owned(),
    };
    json!({
        "residual": residual(p.residual),
        "kind": kind,
        "from": p.from,
        "to": p.to,
        "rms": p.rms,
        "share": p.share,
        "peak": p.peak,
        "peak_rms": p.peak_rms,
    })
}

fn curve(c: &StateCurve) -> Value {
    let (against, against_unit) = variable(c.against);
    let bins = c.bins.iter().map(|b| json!({ "x": b.x, "mean": b.mean, "std": b.std, "count": b.count }));
    json!({
        "residual": residual(c.residual),
        "unit": RESIDUAL,
        "against": against,
        "against_unit": against_unit,
        "bins": bins.collect::<Vec<_>>(),
        "explained": c.explained,
    })
}

fn remainder(r: &Remainder) -> Value {
    json!({
        "torque_rms": r.torque_rms,
        "share": r.share,
        "noise_multiple": r.noise_multiple,
        "place": r.site.as_str(),
        "summary": sentences::looks(&r.looks),
    })
}

fn gap(g: &GapReport) -> Value {
    let ways = g.ways.iter().map(|w| {
        let mut all = levels(&w.levels);
        all["closure"] = json!(w.closure);
        all["closure_of_effect"] = json!(w.closure_of_effect);
        all["interval"] = json!(w.interval);
        (way(w.of), all)
    });
    json!({
        "train": figures(&g.train),
        "holdout": figures(&g.holdout),
        "closure": g.closure,
        "closure_of_effect": g.closure_of_effect,
        "interval": g.interval,
        "closure_of": way(g.closure_of),
        "holdout_is": held_out(g.holdout_is),
        "ways": map(ways),
    })
}

/// The name of a way of measuring the gap.
const fn way(of: ClosureOf) -> &'static str {
    match of {
        ClosureOf::FreeRun => "free_run",
        ClosureOf::Windows => "windows",
        ClosureOf::Torque => "torque",
    }
}

fn figures(f: &Figures) -> Value {
    let mut all = levels(&f.combined);
    all["signals"] = map(f.signals.iter().map(|(name, l)| (*name, levels(l))));
    all["multiples"] = json!(f.multiples);
    all
}

fn levels(l: &Levels) -> Value {
    json!({ "before": l.before, "reidentified": l.reidentified, "after": l.after, "noise_floor": l.noise_floor })
}

fn parameter(p: &AxisParameter) -> Value {
    json!({
        "nominal": p.nominal,
        "reidentified": p.reidentified,
        "fitted": p.fitted.value,
        "std": p.fitted.std,
        "unit": p.fitted.unit,
    })
}

fn closed_loop(l: &ClosedLoop) -> Value {
    let errors = |e: &LoopErrors| json!({ "command": e.command, "position": e.position });
    let ranking = l.ranking.iter().map(|r| {
        json!({
            "id": r.hypothesis.to_string(),
            "command": r.errors.command,
            "position": r.errors.position,
            "closure": r.closure,
        })
    });
    json!({
        "before": errors(&l.before),
        "reidentified": errors(&l.reidentified),
        "after": errors(&l.after),
        "closure": l.closure,
        "ranking": ranking.collect::<Vec<_>>(),
        "agrees": l.agrees,
    })
}
