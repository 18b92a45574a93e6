//! `diagnosis.json`: names and order of the fields are a contract with programs.

use eixo::control::LoopErrors;
use eixo::diagnose::{ClosedLoop, Commands, Hypothesis, LoopRanked};
use eixo::report::diagnose::json::value;
use serde_json::Value;

use crate::fixture::friction;

/// Names of an object's fields, in order.
fn fields(of: &Value) -> String {
    of.as_object().expect("an object").keys().map(String::as_str).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_fields_stand_in_their_order() {
    let d = value(&friction("x-axis"), &[]);
    for (path, expected) in [
        (
            "",
            "schema machine verdict sentence causes ranking confusable next_experiment where remainder gap parameters warnings",
        ),
        ("/causes/0", "id family place variant probability share_of_gap parameters"),
        ("/causes/0/parameters", "level"),
        ("/causes/0/parameters/level", "value std unit"),
        ("/ranking/2", "id family place probability delta_bic chi2 closure_holdout"),
        ("/where", "place by_place by_time by_frequency by_state summary"),
        ("/where/by_place", "input motor coupling table sensor"),
        ("/where/by_time/0", "start end r1 r2 at_place"),
        ("/where/by_frequency/0", "residual kind from to rms share peak peak_rms"),
        ("/where/by_state/0", "residual unit against against_unit bins explained"),
        ("/where/by_state/0/bins/0", "x mean std count"),
        ("/remainder", "torque_rms share noise_multiple place summary"),
        ("/gap", "train holdout closure closure_of_effect interval closure_of holdout_is ways"),
        ("/gap/ways", "free_run windows torque"),
        ("/gap/ways/torque", "before reidentified after noise_floor closure closure_of_effect interval"),
        ("/gap/train", "before reidentified after noise_floor signals multiples"),
        ("/parameters/I1", "nominal reidentified fitted std unit"),
    ] {
        assert_eq!(fields(d.pointer(path).expect(path)), expected, "{path}");
    }
    for (path, expected) in [
        ("/schema", "eixo.diagnosis/1"),
        ("/verdict", "effect"),
        ("/causes/0/family", "dry_friction"),
        ("/ranking/2/id", "torque_ripple+backlash"),
        ("/ranking/3/id", "no_gap"),
        ("/ranking/3/place", "none"),
        ("/ranking/3/family", "none"),
        ("/where/by_frequency/1/kind", "turn_order_6"),
        ("/where/by_state/0/against_unit", "rad/s"),
        ("/gap/closure_of", "windows"),
        ("/gap/holdout_is", "a second record"),
    ] {
        assert_eq!(d.pointer(path).and_then(Value::as_str), Some(expected), "{path}");
    }
}

#[test]
fn what_is_not_finite_or_not_known_is_null_and_no_loop_is_no_field() {
    let mut d = friction("x-axis");
    d.causes[0].parameters[0].1.std = None;
    d.ranking[0].delta_bic = f64::INFINITY;
    let errors = LoopErrors { command: 0.1, position: f64::NAN };
    let ranking = vec![LoopRanked { hypothesis: Hypothesis::Parameters, errors, closure: 0.5 }];
    let commands = Commands::default();
    let told = value(&d, &[]);
    assert!(told.get("closed_loop").is_none());
    assert!(told["causes"][0]["parameters"]["level"]["std"].is_null() && told["ranking"][0]["delta_bic"].is_null());
    d.closed_loop = Some(ClosedLoop {
        before: errors,
        reidentified: errors,
        after: errors,
        closure: 0.5,
        ranking,
        commands,
        agrees: true,
    });
    let told = &value(&d, &[])["closed_loop"];
    assert_eq!(fields(told), "before reidentified after closure ranking agrees");
    assert_eq!(fields(&told["ranking"][0]), "id command position closure");
    assert!(told["ranking"][0]["id"] == "parameters" && told["after"]["position"].is_null());
}
