//! Real machines under the diagnosis: traces from `EIXO_DATA` (default `../shared/data`); without them each test says so
//! and passes.

use eixo::axis::{AxisKind, Parameters, Structure};
use eixo::diagnose::{Case, Model, NoiseEstimate, Record, diagnose, estimate_noise};
use eixo::effects::{EFFECTS, Settings};
use eixo::trace::{Hold, Table};

#[path = "program/run.rs"]
mod run;
#[path = "program/skip.rs"]
mod skip;

use run::answered_in;
use serde_json::Value;

/// Columns of a file as a record, and its noise.
fn record(file: &str, torque: &str, channels: [Option<&str>; 4]) -> Option<(Record, NoiseEstimate)> {
    let table = Table::read(&skip::traces(file)?).expect("the file is a table");
    let column = |name: &str| {
        let at = table.position(name).unwrap_or_else(|| panic!("{file} has a column {name}"));
        table.column(at).expect("numbers").to_vec()
    };
    let time = column("t_s");
    let dt = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let torque = column(torque);
    let channels = channels.map(|c| c.map(column));
    let noise = estimate_noise(&torque, &[0, 1, 2, 3].map(|c: usize| channels[c].as_deref()), None);
    let std = noise.std.map(|s| s.max(1e-12));
    let plain = Record::new(dt, Hold::Zoh, torque, channels);
    let corner = noise.corner.map(|c| c / dt);
    Some((Record { start: time[0], noise: std, corner, common_noise: noise.common, ..plain }, noise))
}

/// What `diagnose` answers to a measured log, by the axis file that `init` writes of it or by the one given.
fn told(log: &str, axis: Option<&str>) -> Option<Value> {
    let log = skip::traces(log)?;
    let folder = tempfile::tempdir().expect("a folder");
    let log = log.to_str().expect("a name in Unicode");
    match axis {
        Some(axis) => std::fs::write(folder.path().join("axis.toml"), axis).expect("written"),
        None => drop(answered_in(folder.path(), &["init", log, "--yes", "-o", "axis.toml"])),
    }
    answered_in(folder.path(), &["diagnose", log, "--axis", "axis.toml", "--json", "told.json"]);
    let told = std::fs::read(folder.path().join("told.json")).expect("an answer");
    Some(serde_json::from_slice(&told).expect("JSON"))
}

/// Families of the causes that are told as likely as this or more.
fn families(told: &Value, least: f64) -> Vec<&str> {
    let causes = told["causes"].as_array().expect("causes");
    let is_likely = |c: &&Value| c["probability"].as_f64().expect("a probability") >= least;
    causes.iter().filter(is_likely).map(|c| c["family"].as_str().expect("a family")).collect()
}

/// The diagnosis of the bench by both encoders, from the nominal values of an outside analysis.
fn bench(torque: &str) -> Option<eixo::diagnose::Diagnosis> {
    let channels = [Some("theta_motor_rad"), None, Some("theta_load_rad"), None];
    let (record, noise) = record("two_inertia_bench/schroeder.csv", torque, channels)?;
    assert_eq!(noise.period, Some(2500), "one second at 2.5 kHz");
    let parameters = Parameters { i1: 4.8e-3, i2: 4.8e-3, b: 0.032, k: 532.0, rho: 1.0 };
    let record = record.part(0..5000);
    let case = Case {
        machine: "bench".to_owned(),
        nominal: Model::new(parameters, Structure::TwoInertia, Settings::default()),
        motion: AxisKind::Rotary,
        train: &record,
        noise: &noise,
        holdout: None,
        suspects: EFFECTS.to_vec(),
    };
    Some(diagnose(&case, &|_| ()).diagnosis)
}

/// From the same record by scipy (scripts/oracles/bench_lines.py): command to measured current 0.49 ms (delay) or 0.53 ms (lag); command
/// to positions 0.41 or 0.435 ms.
#[test]
fn on_the_bench_the_commanded_current_is_late_by_what_the_measured_one_shows() {
    let Some(told) = bench("iq_ref_A") else { return };
    let late: f64 = told
        .causes
        .iter()
        .filter(|c| ["delay", "actuator_lag"].contains(&c.effect.info().id))
        .flat_map(|c| c.parameters.iter().map(|(_, p)| p.value))
        .sum();
    assert!((0.37e-3..0.55e-3).contains(&late), "{late}: {:?}", told.causes);
}

#[test]
fn on_the_bench_the_measured_current_is_not_late_and_nothing_is_hit() {
    let Some(told) = bench("iq_meas_A") else { return };
    let never = ["delay", "actuator_lag", "end_stop"];
    let named = told.causes.iter().any(|c| never.contains(&c.effect.info().id) && c.probability >= 0.5);
    assert!(!named, "{:?}", told.causes);
}

/// EMPS, a ball-screw axis, diagnosed from the published inertia alone. What is known of it: Coulomb friction of 20.4 N (a presliding
/// reach below 20 um at most), viscous friction of 203 N.s/m that is less forwards than backwards, or a bias (Janot, Gautier, Brunot, 2019;
/// an inverse dynamic identification outside this project: 20 to 22 N, 193 to 208 N.s/m, asymmetry -0.18).
#[test]
fn on_emps_and_on_its_parts_friction_and_viscosity_are_named_with_their_published_sizes() {
    let Some((whole, _)) = record("emps/train.csv", "force_cmd_N", [Some("q_meas_m"), None, None, None]) else {
        return;
    };
    let n = whole.len();
    for part in [0..n, 0..n / 2, n / 2..n, 0..8000] {
        let record = whole.part(part.clone());
        let noise = estimate_noise(&record.torque, &[record.channels[0].as_deref(), None, None, None], None);
        let case = Case {
            machine: "EMPS".to_owned(),
            nominal: Model::new(
                Parameters { i1: 95.1, i2: 0.0, b: 0.0, k: 0.0, rho: 1.0 },
                Structure::Rigid,
                Settings::default(),
            ),
            motion: AxisKind::Linear,
            train: &record,
            noise: &noise,
            holdout: None,
            suspects: EFFECTS.to_vec(),
        };
        let found = diagnose(&case, &|_| ());
        let causes = &found.diagnosis.causes;
        let value = |family: &str, name: &str| {
            let cause = causes.iter().find(|c| c.effect.info().family.as_str() == family)?;
            cause.named().find(|(n, _)| *n == name).map(|(_, p)| p.value)
        };
        let told = || format!("{part:?}: {causes:?}");
        let level = value("dry_friction", "level").unwrap_or_else(|| panic!("{}", told()));
        assert!((level / 20.4 - 1.0).abs() < 0.07, "{}", told());
        assert!(value("dry_friction", "reach").is_none_or(|r| r < 2e-5), "{}", told());
        let viscous = value("viscous_friction", "coefficient").unwrap_or_else(|| panic!("{}", told()));
        assert!((viscous / 203.0 - 1.0).abs() < 0.08, "{}", told());
        assert!(causes.iter().all(|c| ["axis", "input"].contains(&c.site.as_str())), "{}", told());
        let inertia = found.improved.parameters.i1;
        assert!((inertia / 95.1 - 1.0).abs() < 0.02, "{inertia}");
        // Friction is the half of it; what is named beside must be small.
        let others = causes.iter().filter(|c| {
            !["dry_friction", "viscous_friction", "load_torque"].contains(&c.effect.info().family.as_str())
        });
        assert!(others.map(|c| c.share_of_gap).sum::<f64>() < 0.02, "{}", told());
    }
}

/// A hobby servo that turns a pendulum: an outside analysis finds its weight, viscous friction and, by the servo's published model, friction
/// that grows with the load (Rhoban, arXiv 2410.08650). No end stop, no limit of its torque, no flexible mode is part of what is known.
#[test]
fn the_weight_of_a_servos_pendulum_is_named_and_nothing_that_it_has_not() {
    for log in ["lift_and_drop", "sin_sin", "sin_time_square", "up_and_down"] {
        let Some(told) = told(&format!("bam_xl330/{log}.csv"), None) else { return };
        let named = families(&told, 0.5);
        let known = ["gravity", "dry_friction", "viscous_friction"];
        assert!(named.contains(&"gravity") && named.iter().all(|f| known.contains(f)), "{log}: {}", told["causes"]);
    }
}

/// The arm of a Quanser QUBE with a free pendulum on it, which the library has no law for: a large remainder, and no mode in its place.
#[test]
fn of_an_arm_with_a_free_pendulum_no_mode_is_invented_and_what_is_left_is_told() {
    for log in ["prbs_1", "prbs_2"] {
        let Some(told) = told(&format!("qube/{log}.csv"), None) else { return };
        let friction = ["dry_friction", "viscous_friction"];
        assert!(families(&told, 0.5).iter().all(|f| friction.contains(f)), "{log}: {}", told["causes"]);
        assert!(families(&told, 0.9).is_empty(), "{log}: {}", told["causes"]);
        let left = told["remainder"]["noise_multiple"].as_f64().expect("a number");
        assert!(left > 30.0, "{log}: {}", told["remainder"]);
    }
}

/// The bench by its motor's encoder and a rigid model of both inertias: what is missing is the inertia behind the spring, whose
/// antiresonance in the record's own lines is at 53 Hz.
#[test]
fn a_rigid_model_of_the_bench_lacks_the_inertia_behind_its_coupling() {
    let axis = "structure = \"rigid\"\n[parameters]\nI1 = 9.6e-3\n[signals]\ntime = \"t_s\"\n\
                T = { column = \"iq_meas_A\", hold = \"zoh\" }\ntheta1 = \"theta_motor_rad\"\n";
    let Some(told) = told("two_inertia_bench/schroeder.csv", Some(axis)) else { return };
    let causes = told["causes"].as_array().expect("causes");
    let mode = causes.iter().find(|c| ["flexible_mode", "motor_mode"].contains(&c["id"].as_str().expect("an id")));
    let mode = mode.unwrap_or_else(|| panic!("{causes:?}"));
    assert!(mode["probability"].as_f64().expect("a probability") >= 0.5, "{mode}");
    let of = |name: &str| mode["parameters"][name]["value"].as_f64().expect("a value");
    let own = (of("stiffness") / of("inertia")).sqrt() / std::f64::consts::TAU;
    assert!((own / 53.0 - 1.0).abs() < 0.05, "{own} Hz: {mode}");
}
