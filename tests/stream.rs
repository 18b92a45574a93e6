//! `eixo identify --stream`: the memory it takes does not grow with the record.

use rustfft::num_complex::Complex;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

#[path = "program/memory.rs"]
mod memory;
#[path = "program/skip.rs"]
mod skip;

use skip::{Lack, skipped};

/// A record of so many rows: a table of 1000 rows of the paper's axis under a multisine, in closed form (the equations of motion at
/// each frequency), time after time.
fn long(path: &Path, rows: usize) {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path).expect("the file"));
    let period: Vec<[f64; 3]> = (0..1000)
        .map(|k| {
            let (mut torque, mut theta1, mut theta2) = (0.0, 0.0, 0.0);
            for h in 1..40_u32 {
                let w = f64::from(h) * std::f64::consts::TAU;
                let phase = f64::from(k) * w / 1000.0 + f64::from(h * h);
                // K + j*w*B; I1*a1 + c*(th1 - th2) = T, I2*a2 = c*(th1 - th2).
                let c = Complex::new(1.76e-2, 5.4e-4 * w);
                let (motor, table) = (c - 2.37e-4 * w * w, c - 6.07e-6 * w * w);
                let answer = Complex::from_polar(1.0, phase) / (motor * table - c * c);
                torque += phase.sin();
                theta1 += 1e-2 * (answer * table).im;
                theta2 += 1e-2 * (answer * c).im;
            }
            [1e-2 * torque, theta1, theta2]
        })
        .collect();
    let mut text = String::from("time,T,theta1,theta2\n");
    for k in 0..rows {
        let [torque, theta1, theta2] = period[k % 1000];
        writeln!(text, "{:.4},{torque:.12},{theta1:.12},{theta2:.12}", k as f64 * 1e-3).expect("text");
        if text.len() > 1 << 20 || k + 1 == rows {
            std::io::Write::write_all(&mut file, text.as_bytes()).expect("the file");
            text.clear();
        }
    }
}

/// Largest resident memory of `eixo identify --stream`, bytes.
fn peak(path: &Path) -> u64 {
    let mut program = Command::new(env!("CARGO_BIN_EXE_eixo"));
    let (ended, peak) = memory::peak(program.args(["identify", "--stream", "--method", "ls,rls"]).arg(path));
    // Fine, or findings: a record made up in closed form is no axis.
    assert!(matches!(ended.code(), Some(0 | 1)), "{ended}");
    peak
}

#[test]
fn the_report_of_a_streamed_record_has_no_empty_tables_or_plots() {
    let folder = tempfile::tempdir().unwrap();
    long(&folder.path().join("log.csv"), 3000);
    let run = Command::new(env!("CARGO_BIN_EXE_eixo"))
        .args(["identify", "log.csv", "--stream", "--trust", "--report", "report.html", "--json", "found.json"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(matches!(run.status.code(), Some(0 | 1)), "{}", String::from_utf8_lossy(&run.stderr));
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("Recursive least squares") && page.contains("streamed"));
    for empty in ["<tbody></tbody>", "How well the model follows", "Spectrum of the excitation"] {
        assert!(!page.contains(empty), "{empty}");
    }
    let found = std::fs::read_to_string(folder.path().join("found.json")).unwrap();
    assert!(found.contains("\"samples\": 3000"));
    let refused = Command::new(env!("CARGO_BIN_EXE_eixo"))
        .args(["identify", "log.csv", "--stream", "--method", "oe"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("--method ls and rls"));
}

#[test]
fn memory_stays_the_same_where_the_record_is_five_times_as_long() {
    if !Path::new("/proc/self/status").exists() {
        return skipped(Lack::Processes, "no /proc to read the memory of a process from");
    }
    let folder = tempfile::tempdir().unwrap();
    let measured = |name: &str, rows: usize| {
        let path = folder.path().join(name);
        long(&path, rows);
        (std::fs::metadata(&path).unwrap().len(), peak(&path))
    };
    let (short_file, short) = measured("short.csv", 400_000);
    let (long_file, long) = measured("long.csv", 2_000_000);
    eprintln!(
        "{} MB of file: {} MB of memory; {} MB of file: {} MB of memory",
        short_file >> 20,
        short >> 20,
        long_file >> 20,
        long >> 20
    );
    let more = long_file - short_file;
    assert!(more > 70 << 20);
    assert!(short > 1 << 20 && long < short + more / 8, "{short} bytes, then {long} bytes");
    assert!(long < long_file, "{long} bytes for a file of {long_file}");
}
