//! Wall and processor time of `eixo inspect` on a million rows: `cargo bench --bench inspect`.
//!
//! Time, torque and two encoders of an axis under a multisine, as CSV and as Parquet, and beside a machine's file, whose
//! units are checked then. Aim: under 0.5 s.

use std::fmt::Write;

use eixo::axis::Parameters;

#[path = "common/program.rs"]
mod program;

use program::row;

const ROWS: usize = 1_000_000;
const DT: f64 = 1e-3;

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (csv, axis) = (at("log.csv"), at("axis.toml"));
    let columns = record();
    let mut text = String::from("time [s],T [N.m],theta1 [rad],theta2 [rad]\n");
    let [time, torque, theta1, theta2] = &columns;
    for (((time, torque), theta1), theta2) in time.iter().zip(torque).zip(theta1).zip(theta2) {
        writeln!(text, "{time},{torque},{theta1},{theta2}").expect("a row");
    }
    std::fs::write(&csv, text).expect("the log");
    let p = Parameters::PAPER;
    let file = format!(
        "name = \"axis\"\n[parameters]\nI1 = {:e}\nI2 = {:e}\nB = {:e}\nK = {:e}\nrho = {:e}\n",
        p.i1, p.i2, p.b, p.k, p.rho
    );
    std::fs::write(&axis, file).expect("the machine's file");
    row("CSV", 7, &["inspect", &csv]);
    row("CSV, units checked", 7, &["inspect", &csv, "--axis", &axis]);
    #[cfg(feature = "parquet")]
    {
        let parquet = at("log.parquet");
        let names = ["time [s]", "T [N.m]", "theta1 [rad]", "theta2 [rad]"];
        let named: Vec<(&str, &[f64])> = names.into_iter().zip(columns.iter().map(Vec::as_slice)).collect();
        eixo::trace::write_columns(std::path::Path::new(&parquet), &named).expect("the log");
        row("Parquet", 7, &["inspect", &parquet]);
    }
}

/// Time, torque, and the angles of motor and table.
fn record() -> [Vec<f64>; 4] {
    use eixo::axis::{Hold, Scheme, SimulateOptions, Structure, simulate};
    use eixo::effects::{Reading, Settings};
    use eixo::identify::excitation::{Kind, Multisine};
    let period = Multisine::new(Kind::RandomPhase, 10_000, 1, 600, 0.03, 0.0, 1).expect("a multisine").period();
    let torque = period.repeat(ROWS / 10_000);
    let options = SimulateOptions { start: 0.0, dt: DT, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 1 };
    let run = simulate(&Parameters::PAPER, Structure::TwoInertia, &Settings::default(), [0.0; 4], &torque, &options);
    // Encoders of 20 bits.
    let step = std::f64::consts::TAU / f64::from(1 << 20);
    let counted = |of: fn(&Reading<f64>) -> f64| run.readings.iter().map(|r| (of(r) / step).round() * step).collect();
    [(0..ROWS).map(|k| k as f64 * DT).collect(), torque, counted(|r| r.theta1), counted(|r| r.theta2)]
}
