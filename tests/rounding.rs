//! Rounded readings under the diagnosis: a cause when nothing else makes the noise, no noise when it may not be named, and no
//! gap when the model rounds alike.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use serde_json::Value;

#[path = "program/run.rs"]
mod run;

use run::answered_in;

const AXIS: &str = "[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\n";
const ROUNDING: &str = "[effects.encoder_quantisation]\nstep = 2e-3\n";

#[test]
fn rounding_is_named_where_it_may_be_and_is_no_gap_where_the_model_knows_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let done = |arguments: &[&str]| answered_in(at, arguments);
    std::fs::write(at.join("axis.toml"), AXIS).unwrap();
    std::fs::write(at.join("rounding.toml"), format!("{AXIS}{ROUNDING}")).unwrap();
    done(&["export", "axis.fmu"]);
    done(&["excite", "-o", "u.csv", "--samples", "2048"]);
    let rounds = ["--set", "encoder_quantisation.step=2e-3"];
    done(
        &[&["simulate", "axis.fmu", "-i", "u.csv", "-o", "y.csv", "--outputs", "theta1,theta2"][..], &rounds].concat(),
    );
    let diagnose = |axis: &str, more: &[&str]| {
        let said = done(&[&["diagnose", "y.csv", "--axis", axis, "--json", "found.json"][..], more].concat());
        let found: Value = serde_json::from_slice(&std::fs::read(at.join("found.json")).unwrap()).unwrap();
        (found, said)
    };

    let (named, _) = diagnose("axis.toml", &[]);
    assert_eq!(named["verdict"], "effect");
    assert_eq!(named["causes"][0]["id"], "encoder_quantisation");
    let step = named["causes"][0]["parameters"]["step"]["value"].as_f64().unwrap();
    assert!((step - 2e-3).abs() < 1e-6, "{step}");

    let (withheld, said) = diagnose("axis.toml", &["--without", "encoder_quantisation"]);
    assert_eq!((&withheld["verdict"], &withheld["where"]["place"]), (&"unexplained".into(), &"sensor".into()));
    let sentence = withheld["sentence"].as_str().unwrap();
    assert!(sentence.contains("rounding of the readings"), "{sentence}");
    assert!(!said.contains("The nearest"), "{said}");

    let (known, _) = diagnose("rounding.toml", &[]);
    assert_eq!(known["verdict"], "no_gap", "{}", known["sentence"]);
}
