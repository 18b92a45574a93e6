//! Least squares, recursive least squares and reading a trace, on a million rows.
//!
//! `scripts/bench_peers.py` runs these beside numpy, padasip and polars on the same data and prints the ratios. With
//! EIXO_PEERS set to its folder the regressors (`regressors.f64`, rows of five and the left side) and the trace
//! (`trace.csv`) are read from there; otherwise they are made here.

use std::path::PathBuf;

use divan::{Bencher, black_box};
use eixo::identify::lsq::triangularise;
use eixo::identify::recursive::Rls;
use eixo::trace::Table;

/// Rows of the regression and of the trace.
const ROWS: usize = 1_000_000;
/// Regressors, and the left side.
const WIDTH: usize = 6;
/// Samples of one run of the recursive estimator.
const SAMPLES: usize = 20_000;

fn main() {
    divan::main();
}

fn peers(name: &str) -> Option<PathBuf> {
    std::env::var_os("EIXO_PEERS").map(|folder| PathBuf::from(folder).join(name))
}

/// Row-major rows of five regressors and the left side.
fn regressors() -> Vec<f64> {
    if let Some(path) = peers("regressors.f64") {
        let bytes = std::fs::read(path).expect("the peers' regressors");
        return bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect();
    }
    let mut x = 1_u64;
    (0..ROWS * WIDTH)
        .map(|_| {
            x = x.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (x >> 11) as f64 / 2f64.powi(53) - 0.5
        })
        .collect()
}

#[divan::bench]
fn ls_million_rows(bencher: Bencher) {
    let data = regressors();
    bencher.bench(|| {
        triangularise(ROWS, WIDTH - 1, 1, |k, row| row.copy_from_slice(&data[k * WIDTH..(k + 1) * WIDTH]))
            .solve()
            .expect("full rank")
    });
}

#[divan::bench]
fn rls_twenty_thousand_samples(bencher: Bencher) {
    let data = regressors();
    bencher.bench(|| {
        let mut rls = Rls::<5, 1>::new(0.999, 1e6);
        for row in data.chunks_exact(WIDTH).take(SAMPLES) {
            let f = nalgebra::SVector::<f64, 5>::from_column_slice(&row[..5]);
            black_box(rls.update(&f, &[row[5]].into()));
        }
        rls.theta
    });
}

#[divan::bench]
fn read_million_rows(bencher: Bencher) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = peers("trace.csv").unwrap_or_else(|| {
        let data = regressors();
        let mut text = String::from("time [s],T [N.m],theta1 [rad],omega1 [rad/s],theta2 [rad],omega2 [rad/s]\n");
        for (k, row) in data.chunks_exact(WIDTH).enumerate() {
            let time = k as f64 * 1e-3;
            text.push_str(&format!("{time},{},{},{},{},{}\n", row[0], row[1], row[2], row[3], row[4]));
        }
        let path = folder.path().join("trace.csv");
        std::fs::write(&path, text).expect("the trace");
        path
    });
    bencher.bench(|| Table::read(&path).expect("the trace"));
}
