//! `fmi2DoStep` of the library that `eixo export` packs, called in a tight loop with one internal step a call.
//!
//! `cargo bench --bench do_step`. The linear model first, with and without setting the torque and reading all outputs;
//! then each effect of the list switched on alone.

#![allow(clippy::unwrap_used, reason = "a benchmark fails by panicking")]

use eixo::effects::EFFECTS;
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

#[divan::bench(args = EFFECTS.iter().map(|e| e.info().id))]
fn set_step_with(bencher: divan::Bencher, id: &str) {
    let effect = *EFFECTS.iter().find(|e| e.info().id == id).unwrap();
    let size = at(first_of(effect));
    let value = match id {
        "torque_gain" => 1.1,
        "saturation" => 0.01,
        // The rest are sizes with a typical magnitude; a stop far away does nothing, so bring it near.
        _ => (0.5 * size.nominal).min(0.01),
    };
    let mut settings = vec![(size.reference, value)];
    if id == "end_stop" {
        settings = vec![(size.reference, 1.0), (at(first_of(effect) + 1).reference, 0.01)];
    }
    let (mut i, mut k) = (instance(&settings), 0_u64);
    bencher.bench_local(|| {
        i.set_real(&[T], &[torque(k)]).unwrap();
        i.do_step(k as f64 * DT, DT).unwrap();
        k += 1;
    });
}
