//! The result of `eixo circle` for programs: lengths in um, angles in um/m, pitches in mm.

use serde_json::{Map, Value, json};

use crate::circle::trace::{Analysis, Effect, remedy};
use crate::report::ballbar;
use crate::report::circle::{Findings, Run};

/// Name and version of the form.
pub(super) const SCHEMA: &str = "eixo.circle/1";

const fn way(clockwise: bool) -> &'static str {
    if clockwise { "clockwise" } else { "counter_clockwise" }
}

fn um(metres: f64) -> Value {
    json!(1e6 * metres)
}

fn effect(e: &Effect, a: &Analysis) -> Value {
    let mut out = Map::new();
    let mut put = |name: &str, value: Value| out.insert(name.to_owned(), value);
    put("id", json!(e.kind.id()));
    put("name", json!(e.kind.name()));
    put("size", um(e.size));
    put("unit", json!(e.kind.measure().unit()));
    put("measure", json!(e.kind.measure().name()));
    put("standard_error", e.error.map_or(Value::Null, um));
    put("takes_um", um(e.contribution));
    put("without_um", um(e.without));
    if let Some(both) = e.pair {
        put("takes_with_other_axis_um", um(both));
    }
    put("share", if a.circularity > 0.0 { json!(e.contribution / a.circularity) } else { json!(0.0) });
    if let Some([plus, minus]) = e.ends {
        put("at_positive_end_um", um(plus));
        put("at_negative_end_um", um(minus));
    }
    if !e.heights.is_empty() {
        let each =
            a.turns.iter().zip(&e.heights).map(|(t, h)| (way(t.clockwise).to_owned(), json!(h.map(|v| 1e6 * v))));
        put("heights_um", Value::Object(each.collect()));
    }
    for (name, value, factor) in [
        ("pitch_mm", e.pitch, 1e3),
        ("per_turn", e.per_turn, 1.0),
        ("frequency_hz", e.frequency, 1.0),
        ("x_later_by_ms", e.late, 1e3),
    ] {
        if let Some(value) = value {
            put(name, json!(factor * value));
        }
    }
    put("remedy", json!(remedy(e.kind)));
    Value::Object(out)
}

fn ranking(a: &Analysis) -> Value {
    json!({
        "circularity_um": 1e6 * a.circularity,
        "not_explained_rms_um": 1e6 * a.left,
        "ranking": a.effects.iter().map(|e| effect(e, a)).collect::<Vec<_>>(),
    })
}

/// A measured test.
pub(super) fn measured(f: &ballbar::Findings) -> Value {
    let n = &f.norm;
    let turns = n.clockwise.iter().zip(&n.deviation).zip(&n.radial).map(|((clockwise, g), (high, low))| {
        json!({ "direction": way(*clockwise), "g_um": 1e6 * g, "f_max_um": 1e6 * high, "f_min_um": 1e6 * low })
    });
    json!({
        "schema": SCHEMA,
        "kind": "measured",
        "files": f.name,
        "radius_mm": 1e3 * f.measured.radius,
        "feed_mm_min": f.measured.feed.map(|v| 6e4 * v),
        "centre_mm": [1e3 * f.measured.centre.0, 1e3 * f.measured.centre.1],
        "turns": turns.collect::<Vec<_>>(),
        "g_b_um": n.both.map(|v| 1e6 * v),
        "hysteresis_um": n.hysteresis.map(|v| 1e6 * v),
        "d_um": 1e6 * n.mean,
        "trace": ranking(&f.analysis),
        "model": f.model.as_ref().map(ranking),
        "as_parameters": f.as_parameters,
        "notes": f.measured.notes,
    })
}

fn run(r: &Run, clockwise: bool) -> Value {
    let one = |i: usize| {
        let g = &r.roundness[i];
        json!({
            "direction": way(clockwise == (i == 0)),
            "g_um": 1e6 * g.deviation,
            "f_max_um": 1e6 * g.largest,
            "f_min_um": 1e6 * g.smallest,
        })
    };
    json!({
        "name": r.name,
        "g_b_um": 1e6 * r.both,
        "d_um": 5e5 * (r.roundness[0].mean + r.roundness[1].mean),
        "turns": [one(0), one(1)],
    })
}

/// A simulated test.
pub(super) fn simulated(f: &Findings) -> Value {
    let each = |runs: &[Run]| runs.iter().map(|r| run(r, f.test.clockwise)).collect::<Vec<_>>();
    json!({
        "schema": SCHEMA,
        "kind": "simulated",
        "machine": f.machine,
        "radius_mm": 1e3 * f.test.radius,
        "feed_mm_min": 6e4 * f.test.feed,
        "runs": each(&f.runs),
        "without": each(&f.without),
        "effects": f.effects,
        "trace": f.analysis.as_ref().map(ranking),
    })
}
