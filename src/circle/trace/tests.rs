//! Traces drawn from the machine's errors themselves, as displacements of the table, and each found again in its size.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

const R: f64 = 0.1;
const FEED: f64 = 1.0 / 60.0;

/// A machine's errors, SI.
#[derive(Debug, Clone, Copy, Default)]
struct Machine {
    backlash: [f64; 2],
    /// Heights at +X, +Y, -X, -Y.
    spikes: [f64; 4],
    /// Lean of Y towards X, rad: squareness is its negative.
    squareness: f64,
    /// X longer, Y shorter by this share.
    scale: f64,
    /// X late, s.
    late: f64,
    /// Amplitude, pitch, phase along X and Y.
    cyclic: [(f64, f64, f64); 2],
    lateral: [f64; 2],
    bow: [f64; 2],
    /// Amplitude and frequency, radial.
    vibration: (f64, f64),
    /// Jerks of X while it creeps, m.
    jerks: f64,
    centre: (f64, f64),
    noise: f64,
}

impl Machine {
    fn path(&self, clockwise: bool, points: usize, seed: u64) -> Path {
        let sense = if clockwise { -1.0 } else { 1.0 };
        let rate = FEED / R;
        let mut draws = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut draws) };
        let mut jerk = 0.0;
        let place = |k: usize| {
            let t = TAU / rate * k as f64 / points as f64;
            let a = sense * rate * t;
            let (x0, y0) = (R * (rate * (t - self.late)).cos(), R * a.sin());
            let (vx, vy) = (-sense * a.sin().signum(), sense * a.cos().signum());
            let along = [x0, y0];
            let ripple = |i: usize| {
                let (size, pitch, phase) = self.cyclic[i];
                if pitch > 0.0 { size * (TAU * along[i] / pitch + phase).sin() } else { 0.0 }
            };
            let x = x0 * (1.0 + self.scale) + self.squareness * y0 + ripple(0) - 0.5 * vx * self.backlash[0]
                + 0.5 * vy * self.lateral[1]
                + self.bow[1] * (y0 / R).powi(2);
            let y = y0 * (1.0 - self.scale) + ripple(1) - 0.5 * vy * self.backlash[1]
                + 0.5 * vx * self.lateral[0]
                + self.bow[0] * (x0 / R).powi(2);
            // A spike rises within half a degree behind the reversal and falls with two.
            let spike: f64 = (0..4)
                .map(|q| {
                    let u = (sense * super::wrapped(a - FRAC_PI_2 * q as f64)).to_degrees();
                    let shape = if u > 0.0 { (u / 1.5) * (1.0 - u / 1.5).exp() } else { 0.0 };
                    self.spikes[q] * shape
                })
                .sum();
            if k.is_multiple_of(23) {
                jerk = if a.sin().abs() < 0.5 { self.jerks * normal() } else { 0.0 };
            }
            let vibration = self.vibration.0 * (TAU * self.vibration.1 * t).sin();
            let out = spike + vibration + jerk * a.cos().abs() + self.noise * normal();
            (x + self.centre.0 + out * a.cos(), y + self.centre.1 + out * a.sin())
        };
        let (x, y) = (0..points).map(place).unzip();
        Path { x, y }
    }

    fn analysis(&self) -> Analysis {
        let paths = [(false, self.path(false, 3600, 1)), (true, self.path(true, 3600, 2))];
        let (turns, _) = turns(&paths, R).expect("a circle");
        analyse(&turns, R, Some(FEED)).expect("an analysis")
    }
}

/// Size in um (um/m) of a kind; of the first where there are more.
fn size(a: &Analysis, kind: Kind) -> f64 {
    1e6 * effect(a, kind).size
}

fn effect(a: &Analysis, kind: Kind) -> &Effect {
    a.effects.iter().find(|e| e.kind == kind).unwrap_or_else(|| panic!("no {kind:?}: {:?}", a.effects))
}

fn near(found: f64, true_one: f64, within: f64, what: &str) {
    assert!((found - true_one).abs() <= within, "{what}: {found} against {true_one}, within {within}");
}

const ALL: Machine = Machine {
    backlash: [6e-6, 3e-6],
    spikes: [8e-6, 5e-6, 6e-6, 4e-6],
    squareness: 30e-6,
    scale: 20e-6,
    late: 0.4e-3,
    cyclic: [(1.5e-6, 0.010, 0.3), (0.8e-6, 0.005, 1.0)],
    lateral: [2e-6, -3e-6],
    bow: [4e-6, -2e-6],
    vibration: (0.0, 0.0),
    jerks: 0.0,
    centre: (80e-6, -45e-6),
    noise: 0.2e-6,
};

#[test]
fn every_deviation_of_a_machine_that_has_them_all_is_found_in_its_size() {
    let a = ALL.analysis();
    near(size(&a, Kind::Backlash(Axis::X)), 6.0, 0.2, "backlash X");
    near(size(&a, Kind::Backlash(Axis::Y)), 3.0, 0.2, "backlash Y");
    for (q, height) in [8.0, 5.0, 6.0, 4.0].into_iter().enumerate() {
        let axis = if q.is_multiple_of(2) { Axis::X } else { Axis::Y };
        // The step of the play and a spike in it add up: what stands out beyond both is told of the spike.
        for turn in &effect(&a, Kind::Spikes(axis)).heights {
            near(1e6 * turn[q], height, 0.6, &format!("spike {q}"));
        }
    }
    near(size(&a, Kind::Squareness), -30.0, 0.6, "squareness");
    near(size(&a, Kind::Scaling), 40.0, 0.6, "scaling");
    near(1e3 * effect(&a, Kind::Servo).late.expect("a feed"), 0.4, 0.012, "servo mismatch in ms");
    near(size(&a, Kind::Servo), 1e6 * FEED * 0.4e-3 / 2.0, 0.1, "servo mismatch in um");
    near(size(&a, Kind::Lateral(Axis::X)), 2.0, 0.3, "lateral play X");
    near(size(&a, Kind::Lateral(Axis::Y)), -3.0, 0.3, "lateral play Y");
    near(size(&a, Kind::Straightness(Axis::X)), 4.0, 0.2, "bow X");
    near(size(&a, Kind::Straightness(Axis::Y)), -2.0, 0.2, "bow Y");
    for (axis, amplitude, pitch) in [(Axis::X, 1.5, 10.0), (Axis::Y, 0.8, 5.0)] {
        let e = effect(&a, Kind::Cyclic(axis));
        near(1e6 * e.size, amplitude, 0.1, "cyclic error");
        near(1e3 * e.pitch.expect("a pitch"), pitch, 0.02, "pitch in mm");
    }
    near(1e6 * a.left, 0.2, 0.03, "what is left is the noise");
}

#[test]
fn the_standard_errors_cover_what_is_off() {
    let a = ALL.analysis();
    for (kind, value) in [
        (Kind::Backlash(Axis::X), 6.0),
        (Kind::Squareness, -30.0),
        (Kind::Scaling, 40.0),
        (Kind::Lateral(Axis::X), 2.0),
        (Kind::Straightness(Axis::X), 4.0),
    ] {
        let e = effect(&a, kind);
        let error = 1e6 * e.error.expect("an error");
        assert!((1e6 * e.size - value).abs() < 4.0 * error + 0.02 && error < 0.5, "{e:?}");
    }
}

#[test]
fn one_deviation_alone_takes_the_whole_circularity_and_the_others_are_nothing() {
    let single: [(Machine, Kind); 7] = [
        (Machine { backlash: [6e-6, 0.0], ..Machine::default() }, Kind::Backlash(Axis::X)),
        (Machine { squareness: 40e-6, ..Machine::default() }, Kind::Squareness),
        (Machine { scale: 25e-6, ..Machine::default() }, Kind::Scaling),
        (Machine { late: 1e-3, ..Machine::default() }, Kind::Servo),
        (Machine { lateral: [0.0, 5e-6], ..Machine::default() }, Kind::Lateral(Axis::Y)),
        (Machine { bow: [6e-6, 0.0], ..Machine::default() }, Kind::Straightness(Axis::X)),
        (Machine { cyclic: [(0.0, 0.0, 0.0), (2e-6, 0.008, 0.0)], ..Machine::default() }, Kind::Cyclic(Axis::Y)),
    ];
    for (machine, kind) in single {
        let a = machine.analysis();
        assert_eq!(a.effects[0].kind, kind, "{:?}", a.effects);
        assert!(a.effects[0].without < 0.02 * a.circularity, "{:?} of {}", a.effects[0], a.circularity);
        for e in &a.effects[1..] {
            assert!(e.contribution.abs() < 0.02 * a.circularity, "{kind:?}: {e:?}");
        }
    }
}

#[test]
fn the_share_of_each_is_what_the_circularity_loses_without_it() {
    // A play that hides in larger spikes is still found, in place of nothing at all beside them.
    let machine = Machine { backlash: [6e-6, 0.0], spikes: [12e-6, 12e-6, 12e-6, 12e-6], ..Machine::default() };
    let a = machine.analysis();
    near(size(&a, Kind::Backlash(Axis::X)), 6.0, 0.1, "backlash");
    let without = Machine { backlash: [0.0; 2], ..machine }.analysis();
    let e = effect(&a, Kind::Backlash(Axis::X));
    near(1e6 * e.without, 1e6 * without.circularity, 0.5, "the circularity without the play");
}

#[test]
fn vibration_has_its_frequency_and_jerks_their_axis() {
    let a = Machine { vibration: (1e-6, 12.5), noise: 0.1e-6, ..Machine::default() }.analysis();
    let e = effect(&a, Kind::Vibration);
    near(1e6 * e.size, 1.0, 0.05, "amplitude");
    near(e.frequency.expect("a feed"), 12.5, 0.01, "frequency");
    let a = Machine { jerks: 2e-6, noise: 0.2e-6, ..Machine::default() }.analysis();
    let (x, y) = (size(&a, Kind::StickSlip(Axis::X)), size(&a, Kind::StickSlip(Axis::Y)));
    assert!(x > 1.0 && y == 0.0, "{x} {y}");
    let without_stick_slip = Machine { noise: 0.5e-6, ..Machine::default() }.analysis();
    assert_eq!(size(&without_stick_slip, Kind::StickSlip(Axis::X)), 0.0);
    assert!(
        without_stick_slip.effects.iter().all(|e| !matches!(e.kind, Kind::Vibration | Kind::Cyclic(_))),
        "{:?}",
        without_stick_slip.effects
    );
    near(1e6 * without_stick_slip.left, 0.5, 0.05, "noise");
}

#[test]
fn one_direction_leaves_the_diagonal_ellipse_open() {
    let machine = Machine { squareness: 30e-6, backlash: [4e-6, 0.0], noise: 0.1e-6, ..Machine::default() };
    let (turns, _) = turns(&[(false, machine.path(false, 3600, 1))], R).expect("a circle");
    let a = analyse(&turns, R, None).expect("an analysis");
    near(size(&a, Kind::Diagonal), 1.5, 0.05, "diagonal");
    near(size(&a, Kind::Backlash(Axis::X)), 4.0, 0.1, "backlash");
    assert!(a.effects.iter().all(|e| !matches!(e.kind, Kind::Servo | Kind::Squareness | Kind::Lateral(_))));
}

#[test]
fn a_late_crossing_of_the_play_is_no_spike() {
    // The table stands for two degrees before it crosses.
    let late = |sense: f64| {
        let path = |k: usize| {
            let a = sense * TAU * f64::from(u32::try_from(k).unwrap_or(0)) / 3600.0;
            let before = a - sense * 2.0 * PI / 180.0;
            (R * a.cos() + 0.5 * sense * before.sin().signum() * 6e-6, R * a.sin())
        };
        let (x, y) = (0..3600).map(path).unzip();
        Path { x, y }
    };
    let (turns, _) = turns(&[(false, late(1.0)), (true, late(-1.0))], R).expect("a circle");
    let a = analyse(&turns, R, None).expect("an analysis");
    near(size(&a, Kind::Backlash(Axis::X)), 6.0, 0.05, "backlash");
    assert!(size(&a, Kind::Spikes(Axis::X)).abs() < 0.2, "{:?}", a.effects);
}

#[test]
fn too_few_points_are_no_trace() {
    let few = Machine::default().path(false, 20, 1);
    let (turns, _) = turns(&[(false, few)], R).expect("a circle");
    assert_eq!(analyse(&turns, R, None), None);
}

#[test]
fn hysteresis_is_the_largest_difference_of_the_directions() {
    let machine = Machine { lateral: [0.0, 5e-6], ..Machine::default() };
    let (turns, _) =
        turns(&[(false, machine.path(false, 3600, 1)), (true, machine.path(true, 3599, 1))], R).expect("a circle");
    near(1e6 * hysteresis(&turns[0], &turns[1]).expect("points"), 5.0, 0.01, "hysteresis");
    assert_eq!(hysteresis(&turns[0], &Turn::default()), None);
}
