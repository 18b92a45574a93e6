//! A sound record of the paper's axis, and what is done to it.

use std::fmt::Write;
use std::path::Path;

use eixo::axis::{Hold, Parameters, Scheme, SimulateOptions, Structure, simulate};
use eixo::effects::{Effect, Settings};
use eixo::identify::excitation::{Kind, Multisine};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};

const NAMES: [&str; 6] = ["time", "T", "theta1", "omega1", "theta2", "omega2"];

/// All columns.
pub const ALL: &[usize] = &[0, 1, 2, 3, 4, 5];
/// Time, torque and the two encoders.
pub const POSITIONS: &[usize] = &[0, 1, 2, 4];

/// time, T, theta1, omega1, theta2, omega2.
#[derive(Clone)]
pub struct Log(pub Vec<Vec<f64>>);

impl Log {
    /// The paper's axis with a little Coulomb friction under a multisine, noise on its encoders.
    pub fn new(seed: u64) -> Self {
        Self::with_friction(seed, 0.001)
    }

    pub fn with_friction(seed: u64, level: f64) -> Self {
        let dt = 1e-3;
        let torque = Multisine::new(Kind::RandomPhase, 3000, 1, 200, 0.03, 0.0, seed).unwrap().period().repeat(2);
        let options = SimulateOptions { start: 0.0, dt, hold: Hold::Zoh, scheme: Scheme::Exact, substeps: 4 };
        let mut settings = Settings::default();
        let friction = Effect::from_id("coulomb_motor").unwrap();
        settings.of_mut(friction)[friction.parameter("level").unwrap()] = level;
        let run = simulate(&Parameters::PAPER, Structure::TwoInertia, &settings, [0.0; 4], &torque, &options);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut e = |size: f64| -> f64 {
            let e: f64 = StandardNormal.sample(&mut rng);
            size * e
        };
        let mut columns = vec![(0..torque.len()).map(|k| k as f64 * dt).collect(), torque];
        let r = &run.readings;
        columns.push(r.iter().map(|r| r.theta1 + e(1e-4)).collect());
        columns.push(r.iter().map(|r| r.omega1 + e(1e-2)).collect());
        columns.push(r.iter().map(|r| r.theta2 + e(1e-4)).collect());
        columns.push(r.iter().map(|r| r.omega2 + e(1e-2)).collect());
        Self(columns)
    }

    pub fn scale(&mut self, columns: &[usize], factor: f64) {
        columns.iter().for_each(|c| self.0[*c].iter_mut().for_each(|v| *v *= factor));
    }

    pub fn hold(&mut self, column: usize, range: std::ops::Range<usize>) {
        let value = self.0[column][range.start];
        self.0[column][range].fill(value);
    }

    /// Loses every so many-th row; the stamps go on evenly.
    pub fn lose(&mut self, every: usize) {
        for column in &mut self.0[1..] {
            let kept: Vec<f64> = column.iter().enumerate().filter(|(k, _)| k % every != 50).map(|(_, v)| *v).collect();
            *column = kept;
        }
        let rows = self.0[1].len();
        self.0[0].truncate(rows);
    }

    /// Keeps the torque between shares of its largest value.
    pub fn clip(&mut self, low: f64, high: f64) {
        let largest = self.0[1].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        self.0[1].iter_mut().for_each(|v| *v = v.clamp(low * largest, high * largest));
    }

    /// Writes the columns that `keep` names.
    pub fn write(&self, path: &Path, keep: &[usize]) {
        let mut text = keep.iter().map(|c| NAMES[*c]).collect::<Vec<_>>().join(",");
        text.push('\n');
        for k in 0..self.0[0].len() {
            let cells: Vec<String> = keep.iter().map(|c| format!("{:e}", self.0[*c][k])).collect();
            writeln!(text, "{}", cells.join(",")).unwrap();
        }
        std::fs::write(path, text).unwrap();
    }
}
