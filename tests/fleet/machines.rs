//! Logs of two machines over three days, made in the process: no FMU, no other program.

use std::path::{Path, PathBuf};

use eixo::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
use eixo::effects::{Effect, Settings};
use eixo::identify::excitation::{Kind, Multisine};
use eixo::trace::{AxisKind, Machine, Signal, Trace, write_csv};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const DT: f64 = 1e-3;

/// A record of an axis of this stiffness and dry friction, with noise on the angles.
fn log(path: &Path, stiffness: f64, friction: f64, seed: u64) {
    let torque: Vec<f64> =
        Multisine::new(Kind::Odd, 1000, 1, 80, 0.03, 0.0, seed).expect("the excitation").period().repeat(2);
    let parameters = Parameters { k: stiffness, ..Parameters::PAPER };
    let mut effects = Settings::default();
    let coulomb = Effect::from_id("coulomb_motor").expect("the effect");
    effects.of_mut(coulomb)[coulomb.parameter("level").expect("its level")] = friction;
    let options = SimulateOptions { start: 0.0, dt: DT, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 4 };
    let response = simulate(&parameters, Structure::TwoInertia, &effects, [0.0; 4], &torque, &options);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut noisy = |values: Vec<f64>| -> Vec<f64> {
        values
            .into_iter()
            .map(|v| {
                let e: f64 = StandardNormal.sample(&mut rng);
                v + 2e-6 * e
            })
            .collect()
    };
    let trace = Trace::new(0.0, DT, Hold::Zoh)
        .with(Signal::T, torque)
        .and_then(|t| t.with(Signal::Theta1, noisy(response.readings.iter().map(|r| r.theta1).collect())))
        .and_then(|t| t.with(Signal::Theta2, noisy(response.readings.iter().map(|r| r.theta2).collect())))
        .expect("the trace");
    write_csv(path, &trace, AxisKind::Rotary).expect("the file");
}

/// Two machines of three days each: the first one's stiffness falls by 2 % a day, the second has friction; and two files that
/// are no traces.
pub fn machines(root: &Path) -> PathBuf {
    let folder = root.join("machines");
    for name in ["press", "mill"] {
        std::fs::create_dir_all(folder.join(name)).expect("the folder");
        let axis = Machine { name: format!("{name} X"), parameters: Parameters::PAPER, ..Machine::default() };
        std::fs::write(folder.join(name).join("axis.toml"), axis.to_toml()).expect("the axis file");
    }
    for day in 0..3_u32 {
        let date = format!("2026-03-{:02}.csv", 9 + day);
        let k = Parameters::PAPER.k;
        log(&folder.join("press").join(&date), k * (1.0 - 0.02 * f64::from(day)), 0.0, 1 + u64::from(day));
        log(&folder.join("mill").join(&date), k, 0.004, 11 + u64::from(day));
    }
    std::fs::write(folder.join("mill/2026-03-12.csv"), "time,T,theta1\n0,1,2\n0.1,x\n0.2,1,2\n").expect("the file");
    let unknown =
        format!("time,<img src=x onerror=alert(1)>\n{}", (0..20).map(|k| format!("{k},1\n")).collect::<String>());
    std::fs::write(folder.join("press/2026-03-12 <b>&.csv"), unknown).expect("the file");
    folder
}
