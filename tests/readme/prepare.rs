//! What a reader of README.md brings: logs and files that it names and does not make.

use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Runs a command.
type Shell<'a> = &'a dyn Fn(&Path, &str) -> (Option<i32>, String);

/// Makes what a command needs; why it is skipped, where that is not there.
pub fn before(folder: &Path, command: &str, shown: &[String], shell: Shell) -> Option<String> {
    let at = |name: &str| folder.join(name);
    let needs = |name: &str| command.split_whitespace().any(|w| w == name) && !at(name).exists();
    if let Some(name) = command.strip_prefix("cat ") {
        // The file of the reader is the one that is shown.
        fs::write(at(name), shown.join("\n") + "\n").unwrap();
    }
    let measured = [("schroeder.csv", "two_inertia_bench/schroeder.csv"), ("train.csv", "emps/train.csv")];
    for (name, file) in measured.iter().filter(|(name, _)| needs(name)) {
        let Some(path) = data(file) else {
            return Some(format!("no {file}; set EIXO_DATA to the folder of measured data"));
        };
        fs::copy(path, at(name)).unwrap();
    }
    if needs("broken.fmu") {
        broken(&at("axis.fmu"), &at("broken.fmu"));
    }
    if needs("model.fmu") {
        for (from, to) in
            [("axis.fmu", "model.fmu"), ("trace.csv", "model_ref.csv"), ("excitation.csv", "model_in.csv")]
        {
            fs::copy(at(from), at(to)).unwrap();
        }
    }
    if needs("log.csv") {
        // Its table encoder counts the other way round.
        log(folder, shell, "log", "", -1.0);
    }
    if needs("servo.csv") {
        log(folder, shell, "servo", "--set coulomb_motor.level=0.004", 1.0);
    }
    for name in ["ballbar_ccw.txt", "ballbar_cw.txt"].into_iter().filter(|name| needs(name)) {
        fs::copy(at("tests/data").join(name), at(name)).unwrap();
    }
    if needs("year.parquet") {
        made(folder, shell, "eixo export year.fmu && eixo excite -o year_in.csv --periods 8");
        made(
            folder,
            shell,
            "eixo simulate year.fmu --input year_in.csv -o year.parquet --outputs theta1,omega1,theta2,omega2",
        );
    }
    if needs("bad.csv") {
        let rows = (0..64).map(|k| format!("{},{},{}\n", k as f64 * 1e-3, if k == 1 { "abc" } else { "0.1" }, k % 7));
        fs::write(at("bad.csv"), "time,T,theta1\n".to_owned() + &rows.collect::<String>()).unwrap();
    }
    for name in ["x", "y"] {
        if needs(&format!("{name}.toml")) {
            let parameters = "[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n";
            fs::write(at(&format!("{name}.toml")), format!("name = \"{name}\"\n{parameters}")).unwrap();
        }
    }
    None
}

/// A file of the measured traces.
fn data(file: &str) -> Option<PathBuf> {
    let root = std::env::var_os("EIXO_DATA")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = root.join(file);
    path.is_file().then_some(path)
}

#[track_caller]
fn made(folder: &Path, shell: Shell, command: &str) {
    let (code, said) = shell(folder, command);
    assert_eq!(code, Some(0), "{command}: {said}");
}

/// The FMU with an XML that was edited after its binary was built: another start value of B.
fn broken(sound: &Path, broken: &Path) {
    let mut archive = zip::ZipArchive::new(fs::File::open(sound).unwrap()).unwrap();
    let mut out = zip::ZipWriter::new(fs::File::create(broken).unwrap());
    for k in 0..archive.len() {
        let mut entry = archive.by_index(k).unwrap();
        if entry.is_dir() {
            continue;
        }
        let name = entry.name().unwrap().into_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).unwrap();
        if name == "modelDescription.xml" {
            let text = String::from_utf8(bytes).unwrap();
            assert!(text.contains("start=\"0.00054\""), "B starts elsewhere");
            bytes = text.replace("start=\"0.00054\"", "start=\"0.00064\"").into_bytes();
        }
        out.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        out.write_all(&bytes).unwrap();
    }
    out.finish().unwrap();
}

/// The log NAME.csv of a machine with what its model leaves out, with a logger's own header.
fn log(folder: &Path, shell: Shell, name: &str, left_out: &str, sign_of_table: f64) {
    made(folder, shell, &format!("eixo export {name}.fmu && eixo excite -o {name}_in.csv --periods 2 --kind odd"));
    made(
        folder,
        shell,
        &format!(
            "eixo simulate {name}.fmu --input {name}_in.csv -o {name}_trace.csv --outputs theta1,theta2 \
             --noise theta1=1e-4,theta2=1e-4 {left_out}"
        ),
    );
    let text = fs::read_to_string(folder.join(format!("{name}_trace.csv"))).unwrap();
    let mut log = String::from("t (s);Torque (N.m);Motor position (rad);Table position (rad)\n");
    for row in text.lines().skip(1) {
        let cells: Vec<f64> = row.split(',').map(|c| c.parse().unwrap()).collect();
        let _ = writeln!(log, "{:.7};{:.6};{:.6};{:.6}", cells[0], cells[1], cells[2], sign_of_table * cells[3]);
    }
    fs::write(folder.join(format!("{name}.csv")), log).unwrap();
}
