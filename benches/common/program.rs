//! Runs of the program: wall time, and the processor time of it and its children, which a busy machine does not stretch.

use std::process::Command;
use std::time::Instant;

/// Processor time of all children that were waited for, s; zero where the system does not tell.
fn children() -> f64 {
    // Fields 16 and 17 of proc(5), in hundredths of a second; the name before them may hold blanks.
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = text.rsplit(')').next().unwrap_or_default().split_whitespace().skip(13).take(2);
    fields.filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Runs `eixo` with what is typed and prints the times; a run that ends otherwise than well ends the benchmark.
pub fn row(name: &str, runs: usize, typed: &[&str]) {
    let begin = children();
    let mut times: Vec<f64> = (0..runs)
        .map(|_| {
            let begin = Instant::now();
            let output = Command::new(env!("CARGO_BIN_EXE_eixo")).args(typed).output().expect("eixo");
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
            begin.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    let processor = (children() - begin) * 1e3 / runs as f64;
    times.sort_by(f64::total_cmp);
    let [min, median, max] = [0, runs / 2, runs - 1].map(|at| times[at]);
    println!(
        "{name:<22} min {min:8.1} ms   median {median:8.1} ms   max {max:8.1} ms   processor {processor:8.1} ms   ({runs} runs)"
    );
}
