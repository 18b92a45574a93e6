//! `fmi2DoStep` of the library that `eixo export` packs, called in a tight loop with one internal step a call.
//!
//! `cargo bench --bench do_step`. The linear model first, with and without setting the torque and reading all outputs;
//! then each effect of the list switched on alone, and the same of the step itself without the FMU around it.

#![allow(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use eixo::axis::{Axis, Parameters, Scheme, Structure};
use eixo::effects::{EFFECTS, Effect, Ramp, Settings};
use eixo::fmu::host::{Fmu, Instance};
use eixo::fmu::package::Package;
use eixo::variables::{Slot, at, first_of};

const DT: f64 = 5.626e-4;
const T: u32 = Slot::Torque as u32;
const OUTPUTS: [u32; 7] = [1, 2, 3, 4, 5, 6, 7];

fn main() {
    divan::main();
}

fn instance(settings: &[(u32, f64)]) -> Instance {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("axis.fmu");
    Package::default().write(&file).unwrap();
    let mut instance = Fmu::open(&file).unwrap().instantiate("axis").unwrap();
    settings.iter().for_each(|(reference, value)| instance.set_real(&[*reference], &[*value]).unwrap());
    instance.initialize(0.0, None).unwrap();
    instance
}

/// A torque that reverses, so that friction and backlash have something to do.
fn torque(k: u64) -> f64 {
    (k % 37) as f64 * 1e-3 - 0.018
}

#[divan::bench]
fn step(bencher: divan::Bencher) {
    let (mut i, mut k) = (instance(&[]), 0_u64);
    bencher.bench_local(|| {
        i.do_step(k as f64 * DT, DT).unwrap();
        k += 1;
    });
}

#[divan::bench]
fn set_step_get(bencher: divan::Bencher) {
    let (mut i, mut k, mut outputs) = (instance(&[]), 0_u64, [0.0; 7]);
    bencher.bench_local(|| {
        i.set_real(&[T], &[torque(k)]).unwrap();
        i.do_step(k as f64 * DT, DT).unwrap();
        i.get_real_into(&OUTPUTS, &mut outputs).unwrap();
        k += 1;
    });
}

/// An effect at a size that shows: its parameters by their place in its info.
fn shown(effect: Effect) -> Vec<(usize, f64)> {
    let size = effect.info().parameters[0].nominal;
    match effect {
        Effect::TorqueGain => vec![(0, 1.1)],
        Effect::Saturation => vec![(0, 0.01)],
        // A stop far away does nothing, so bring it near.
        Effect::EndStop => vec![(0, 1.0), (1, 0.01)],
        _ => vec![(0, (0.5 * size).min(0.01))],
    }
}

fn named(id: &str) -> Effect {
    Effect::from_id(id).unwrap()
}

#[divan::bench(args = EFFECTS.iter().map(|e| e.info().id))]
fn set_step_with(bencher: divan::Bencher, id: &str) {
    let effect = named(id);
    let settings: Vec<(u32, f64)> =
        shown(effect).into_iter().map(|(i, value)| (at(first_of(effect) + i).reference, value)).collect();
    let (mut i, mut k) = (instance(&settings), 0_u64);
    bencher.bench_local(|| {
        i.set_real(&[T], &[torque(k)]).unwrap();
        i.do_step(k as f64 * DT, DT).unwrap();
        k += 1;
    });
}

/// One sample of the axis in the program itself; input and sensor effects act outside of it. Aim: 100 ns.
#[divan::bench(sample_size = 5000, args = EFFECTS.iter().filter(|e| e.is_force() || e.is_dry()).map(|e| e.info().id))]
fn advance_with(bencher: divan::Bencher, id: &str) {
    let mut settings = Settings::default();
    shown(named(id)).into_iter().for_each(|(i, value)| settings.of_mut(named(id))[i] = value);
    let axis = Axis::new(Parameters::PAPER, Structure::TwoInertia, settings, Scheme::NEWMARK, DT);
    let (mut state, mut k) = (axis.state(0.0, 0.0, 0.0, 0.0, 0.0), 0_u64);
    bencher.bench_local(|| {
        state = axis.advance(&state, Ramp::held(torque(k)), k as f64 * DT);
        k += 1;
    });
}
