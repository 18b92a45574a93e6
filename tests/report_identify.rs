//! The identification report: every figure of the result reaches the page, failures are told in words.

use eixo::identify::result::*;
use eixo::report::terminal::{self, Layout};
use eixo::report::{html, identify};
use eixo::trace::Signal;

fn curve(name: &str, x_unit: &'static str, y_unit: &'static str, n: usize, f: impl Fn(f64) -> f64) -> Series {
    let x: Vec<f64> = (0..n).map(|k| k as f64).collect();
    Series { name: name.into(), x_unit, y_unit, y: x.iter().map(|x| f(*x)).collect(), x }
}

fn method(method: &'static str, title: &str, scale: f64) -> MethodResult {
    let estimate =
        |name, unit, value: f64| Estimate::new(name, unit, value * (1.0 + scale), Some(value * 1e-4), Some(value));
    MethodResult {
        method,
        title: title.into(),
        formulation: "S4: torque balance of both inertias at midpoints".into(),
        parameters: vec![
            estimate("I1", "kg.m2", 2.37e-4),
            estimate("I2", "kg.m2", 6.07e-6),
            estimate("B", "N.m.s/rad", 5.4e-4),
            estimate("K", "N.m/rad", 1.76e-2),
        ],
        modal: vec![
            estimate("wn", "rad/s", 54.5323),
            estimate("wd", "rad/s", 29.8757),
            estimate("zeta", "1", 0.836_574),
        ],
        outputs: [Signal::Theta1, Signal::Theta2]
            .into_iter()
            .map(|signal| OutputFit {
                signal,
                rms: 1.0,
                rms_error: 1e-3,
                fit_percent: 99.9 - scale,
                whiteness: Whiteness { q: 20.0, lags: 20, p_value: 0.46, white: true },
                residual: curve("", "s", "rad", 500, |x| 1e-3 * (x * 7.7).sin()),
            })
            .collect(),
        history: Some(History {
            time: (0..2000).map(|k| f64::from(k) * 5.6e-4).collect(),
            parameters: [("I1", 2.37e-4), ("I2", 6.07e-6), ("B", 5.4e-4), ("K", 1.76e-2)]
                .map(|(n, v)| {
                    let h = (0..2000).map(|k| {
                        if k < 4 {
                            f64::NAN
                        } else {
                            v * (1.0 + 30.0 * (-f64::from(k) / 40.0).exp() * (f64::from(k) * 0.3).sin() + scale)
                        }
                    });
                    (n, h.collect())
                })
                .to_vec(),
        }),
        excitation: Some(ExcitationEstimate {
            formulation: "momentum",
            error_percent: 100.0 * scale,
            estimate: curve("", "s", "N.m", 500, |x| 0.03 * (x * 0.1).sin()),
            error: curve("", "s", "N.m", 500, |x| scale * 0.03 * (x * 0.1).sin()),
            spectrum: curve(
                "",
                "Hz",
                "N.m",
                200,
                |x| if x > 0.0 && x < 100.0 { 4e-3 * (1.0 + scale * x) } else { 0.0 },
            ),
        }),
        termination: None,
        iterations: None,
        notes: vec![],
        failure: None,
    }
}

fn example(name: &str) -> Identification {
    let f: Vec<f64> = (11..250).map(f64::from).collect();
    let g = |f: f64| {
        40.0 / (f * f) * ((1.0 - (f / 53.0_f64).powi(2)).powi(2) + 1e-3).sqrt()
            / ((1.0 - (f / 77.0_f64).powi(2)).powi(2) + 1e-3).sqrt()
    };
    let failed = MethodResult {
        failure: Some("K is not excited".into()),
        parameters: vec![],
        modal: vec![],
        outputs: vec![],
        history: None,
        excitation: None,
        ..method("iv", "Instrumental variables", 0.0)
    };
    Identification {
        identifiability: eixo::identify::identifiability::Identifiability::yes(),
        schema: SCHEMA,
        machine: name.into(),
        structure: "two_inertia",
        trace: TraceSummary {
            file: name.into(),
            samples: 2048,
            dt: 5.626e-4,
            start: 0.0,
            duration: 1.152,
            hold: "zoh",
            signals: vec![Signal::T, Signal::Theta1, Signal::Theta2],
            period: Some(2048),
            pieces: 1,
        },
        methods: vec![
            method("ls", "Least squares", -0.2),
            method("rls", "Recursive least squares", 1e-9),
            method("els", "Extended least squares", 1e-3),
            failed,
        ],
        recommended: Some(Recommendation { method: 1, why: "The smallest residual of those that are white.".into() }),
        torque: curve("T", "s", "N.m", 2048, |x| 0.03 * (x * x * 1e-3).sin()),
        torque_spectrum: curve("T", "Hz", "N.m", 200, |x| if x > 0.0 && x < 100.0 { 4e-3 } else { 0.0 }),
        frequency_response: Some(FrequencyResponse {
            outputs: vec![ResponseOf {
                signal: Signal::Theta1,
                magnitude: f.iter().map(|f| g(*f) * (1.0 + 0.05 * (f * 0.9).sin())).collect(),
                phase: f.iter().map(|f| -3.0 + 0.1 * (f * 0.9).sin()).collect(),
                std: f.iter().map(|f| g(*f) * 0.05).collect(),
                model_magnitude: f.iter().map(|f| g(*f)).collect(),
                model_phase: f.iter().map(|_| -3.0).collect(),
                error_percent: 11.0,
                antiresonance: Some(53.0),
                resonance: Some(77.0),
            }],
            frequency: f,
            periods: 20,
            period: 2500,
        }),
        warnings: vec![format!("Velocities of {name} are differentiated.")],
    }
}

#[test]
fn every_table_and_figure_of_the_result_is_on_the_page() {
    let page = html::page(&identify::report(&example("x-axis"), None));
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/identify.html"), &page)
        .expect("the tests' folder can be written");
    for needle in [
        "Recursive least squares identifies the axis",
        "K as it is estimated",
        "antiresonance 53.0 Hz",
        "no estimate: K is not excited",
        "Error of the torque estimated by Extended least squares",
        "The smallest residual of those that are white.",
    ] {
        assert!(page.contains(needle), "{needle}");
    }
    assert!(!page.contains("NaN"));
    let text = terminal::blocks(&identify::short(&example("x-axis")), Layout::default());
    println!("{text}");
    assert!(text.lines().all(|l| l.chars().count() <= 100), "{text}");
}

#[test]
fn a_trace_that_no_method_can_use_is_told_so() {
    let mut found = example("x-axis");
    found.methods.retain(|m| m.failure.is_some());
    found.recommended = None;
    let page = html::page(&identify::report(&found, None));
    assert!(page.contains("No method could identify the axis from this trace.") && page.contains("K is not excited"));
}

#[test]
fn a_hostile_file_name_stays_text() {
    let page = html::page(&identify::report(&example("<img src=x onerror=alert(1)>"), None));
    assert!(!page.contains("<img") && page.contains("&lt;img"));
}
