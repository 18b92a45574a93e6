//! Parquet, MATLAB and HDF5 files as other programs write them (pyarrow, scipy, h5py; `scripts/fixtures/formats.py`).

use std::path::{Path, PathBuf};

use eixo::trace::{Column, Mapping, Signal, Table, TraceError, load};

#[path = "program/skip.rs"]
mod skip;

use skip::{Lack, skipped};

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/formats").join(name)
}

/// The formula of `scripts/fixtures/formats.py`: time, T, theta1, counts of row k.
fn row(k: usize) -> [f64; 4] {
    let torque = [0.0, 0.5, 0.25, -0.125, -0.5, -0.75, 1.0];
    [k as f64 / 1000.0, torque[k % 7], (k * k % 997) as f64 / 64.0, (k % 50) as f64]
}

fn column<'a>(table: &'a Table, name: &str) -> &'a [f64] {
    let index = table.position(name).unwrap_or_else(|| panic!("{name} of {}", table.names()));
    table.column(index).unwrap_or_else(|e| panic!("{e}"))
}

fn refusal(table: &Table, name: &str) -> String {
    table.column(table.position(name).expect("the column")).expect_err("a fault").to_string()
}

#[test]
#[cfg(feature = "parquet")]
fn parquet_files_of_every_codec_and_encoding_hold_the_numbers_that_were_written() {
    for name in ["none", "snappy", "gzip", "zstd", "lz4", "version2", "checked"] {
        let table = Table::read(&data(&format!("{name}.parquet"))).unwrap();
        assert_eq!(table.rows(), 200, "{name}");
        for k in 0..200 {
            for (c, column_name) in ["time", "T", "theta1", "counts"].into_iter().enumerate() {
                assert_eq!(column(&table, column_name)[k], row(k)[c], "{name}, {column_name}, row {k}");
            }
        }
    }
}

#[test]
#[cfg(feature = "parquet")]
fn a_parquet_page_that_is_not_the_one_that_was_written_is_refused_by_its_checksum() {
    let folder = tempfile::tempdir().unwrap();
    // A byte in the middle of the mantissa of one number of the column's only page.
    let flipped = |name: &str| {
        let mut bytes = std::fs::read(data(name)).unwrap();
        let value = row(61)[2].to_le_bytes();
        let at = bytes.windows(8).position(|w| w == value).expect("the number as it was written");
        bytes[at + 5] ^= 0x10;
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Table::read(&path)
    };
    let error = flipped("checked.parquet").unwrap_err().to_string();
    assert!(error.contains("checked.parquet") && error.contains("CRC") && error.contains("Write it again"), "{error}");
    // The same byte of a file without checksums is another number, and nothing tells.
    let table = flipped("none.parquet").unwrap();
    assert!(column(&table, "theta1")[61] != row(61)[2]);
}

#[test]
#[cfg(feature = "parquet")]
fn a_parquet_trace_has_its_units_in_its_column_names_as_csv_does() {
    let trace = load(&data("snappy.parquet"), &Mapping::default()).unwrap().trace;
    assert_eq!(trace.len(), 200);
    assert!((trace.dt() - 1e-3).abs() < 1e-15);
    assert_eq!(trace.get(Signal::Theta1).unwrap()[61], row(61)[2]);
}

#[test]
#[cfg(feature = "parquet")]
fn time_stamps_decimals_and_whole_numbers_are_numbers_and_nulls_and_text_are_told_only_when_used() {
    let table = Table::read(&data("types.parquet")).unwrap();
    for k in 0..200 {
        assert_eq!(column(&table, "time")[k], row(k)[0]);
        assert_eq!(column(&table, "T")[k], row(k)[1]);
        assert_eq!(column(&table, "theta1")[k], row(k)[2]);
        assert_eq!(column(&table, "large")[k], (k as u64 + (1 << 63)) as f64);
        assert_eq!(column(&table, "moving")[k], f64::from(u8::from(k % 2 == 0)));
    }
    // A single null between numbers is bridged, and said where the column is used.
    let gaps = column(&table, "gaps");
    assert_eq!(gaps[37], 0.5 * (gaps[36] + gaps[38]));
    let mapping = Mapping {
        time: Column::named("time"),
        signals: vec![(Signal::T, Column::named("gaps"))],
        ..Mapping::default()
    };
    let said = load(&data("types.parquet"), &mapping).unwrap().warnings.join("\n");
    assert!(said.contains("column gaps has no number in 1 of 200 rows, the first row 38 (\"null\")"), "{said}");
    assert!(refusal(&table, "note").contains("column note"));
    // Nanoseconds since 1970 would have left no digit of the millisecond in a double.
    assert!((load(&data("types.parquet"), &Mapping::default()).unwrap().trace.dt() - 1e-3).abs() < 1e-15);
}

#[test]
fn matlab_vectors_are_columns_plain_or_compressed() {
    for name in ["plain.mat", "compressed.mat"] {
        let table = Table::read(&data(name)).unwrap();
        for k in 0..200 {
            for (c, column_name) in ["time", "T", "theta1"].into_iter().enumerate() {
                assert_eq!(column(&table, column_name)[k], row(k)[c], "{name}, {column_name}, row {k}");
            }
        }
    }
    let table = Table::read(&data("plain.mat")).unwrap();
    assert_eq!(column(&table, "counts")[149], 49.0);
    assert!(table.position("fs").is_none() && table.position("note").is_none(), "{}", table.names());
    let short = refusal(&table, "short");
    assert!(short.contains("column short") && short.contains("5 values") && short.contains("200"), "{short}");
}

#[test]
fn fields_of_a_matlab_structure_are_columns_and_a_matrix_one_column_each() {
    let table = Table::read(&data("struct.mat")).unwrap();
    let expected = |c: usize| (0..200).map(|k| row(k)[c]).collect::<Vec<_>>();
    assert_eq!(column(&table, "time"), expected(0));
    assert_eq!(column(&table, "T"), expected(1));
    assert_eq!(column(&table, "both(1,:)"), expected(2));
    assert_eq!(column(&table, "both(2,:)"), expected(1));
    assert!(refusal(&table, "wave").contains("complex"));
    let mapping = Mapping {
        signals: vec![(Signal::T, Column { unit: Some("mN.m".into()), ..Column::named("T") })],
        ..Mapping::default()
    };
    let trace = load(&data("struct.mat"), &mapping).unwrap().trace;
    assert_eq!(trace.get(Signal::T).unwrap()[6], 1e-3);
}

/// The files that scipy tests its own reader with, most of them written by MATLAB: 6.1 on a big-endian machine to 7.4.
#[test]
fn files_that_matlab_wrote_hold_what_matlab_put_there() {
    let pattern =
        concat!(env!("CARGO_MANIFEST_DIR"), "/.venv/lib/python3*/site-packages/scipy/io/matlab/tests/data/*.mat");
    let files: Vec<PathBuf> = glob::glob(pattern).unwrap().map(Result::unwrap).collect();
    if files.is_empty() {
        return skipped(Lack::Python, "no scipy in .venv; scripts/venv.sh installs it");
    }
    let (mut doubles, mut matrices) = (0, 0);
    for path in &files {
        let name = path.file_name().unwrap().to_str().unwrap();
        let read = Table::read(path);
        if let Err(error) = &read {
            assert!(error.to_string().contains(name), "{error}");
        }
        let level_5 = ["6.1_SOL2", "6.5.1_GLNX86", "7.1_GLNX86", "7.4_GLNX86"].iter().any(|v| name.contains(v));
        if name.starts_with("testdouble_") && level_5 {
            // testdouble = 0:pi/4:2*pi
            let expected: Vec<f64> = (0..9).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4).collect();
            assert_eq!(column(read.as_ref().unwrap(), "testdouble"), expected, "{name}");
            doubles += 1;
        }
        if name.starts_with("testhdf5") {
            // Laid out as HDF5 was before 2008.
            let error = read.as_ref().unwrap_err().to_string();
            assert!(error.contains("HDF5") && error.contains("-v7"), "{error}");
        }
        if name.starts_with("testmatrix_") && level_5 {
            // A 3 x 5 matrix of zeros with 1..5 in its first row and 1..3 in its first column, stored in bytes.
            let table = read.as_ref().unwrap();
            assert_eq!(column(table, "testmatrix(1,:)"), [1.0, 2.0, 3.0, 4.0, 5.0], "{name}");
            assert_eq!(column(table, "testmatrix(2,:)"), [2.0, 0.0, 0.0, 0.0, 0.0], "{name}");
            assert_eq!(column(table, "testmatrix(3,:)"), [3.0, 0.0, 0.0, 0.0, 0.0], "{name}");
            matrices += 1;
        }
    }
    assert_eq!((doubles, matrices), (4, 4));
}

/// `matlab73.mat` is laid out as MATLAB 7.3 does it, `python.h5` by h5py; both hold what `row` says.
#[test]
#[cfg(feature = "hdf5")]
fn hdf5_files_of_matlab_and_python_are_columns() {
    for name in ["matlab73.mat", "python.h5"] {
        let table = Table::read(&data(name)).unwrap();
        let expected = |c: usize| (0..200).map(|k| row(k)[c]).collect::<Vec<_>>();
        for (c, column_name) in ["time", "T", "theta1"].into_iter().enumerate() {
            assert_eq!(column(&table, column_name), expected(c), "{name}, {column_name}");
        }
        assert_eq!(column(&table, "both(:,1)"), expected(1), "{name}");
        assert_eq!(column(&table, "both(:,2)"), expected(2), "{name}");
        assert_eq!(column(&table, "counts")[149], 49.0, "{name}: a field of a structure, stored in two bytes");
        assert!(refusal(&table, "wave").contains("complex"), "{name}");
        assert!(refusal(&table, "short").contains("5 values"), "{name}");
        for other in ["note", "cells", "fs", "sparse"] {
            assert!(table.position(other).is_none(), "{name}: {}", table.names());
        }
    }
}

#[test]
#[cfg(feature = "hdf5")]
fn an_hdf5_file_that_asks_for_more_than_it_can_hold_is_refused() {
    let whole = std::fs::read(data("python.h5")).unwrap();
    // The size of time, 200, in its data space: rank, version and flags stand before it.
    let size = 200_u64.to_le_bytes();
    let mut refused = 0;
    for at in (0..whole.len() - 8).filter(|at| whole[*at..at + 8] == size) {
        let mut bytes = whole.clone();
        bytes[at..at + 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
        if let Err(error) = Table::parse(&bytes, "bomb.h5") {
            let error = error.to_string();
            assert!(error.contains("bomb.h5") && error.contains("-v7"), "{error}");
            refused += usize::from(error.contains("more numbers than the file can hold"));
        }
    }
    assert!(refused > 0, "no size was altered");
}

#[test]
fn an_hdf5_file_that_cannot_be_read_is_refused_with_the_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.mat");
    std::fs::write(&path, b"\x89HDF\r\n\x1a\n and so on").unwrap();
    let error = Table::read(&path).unwrap_err().to_string();
    assert!(error.contains("log.mat") && error.contains("-v7"), "{error}");
}

/// Cuts and single flipped bytes: an error that names the file, or a table of as many rows; never a panic, and never more
/// memory than the file can account for.
#[test]
fn damaged_files_are_errors_that_name_them() {
    let folder = tempfile::tempdir().unwrap();
    std::panic::set_hook(Box::new(|_| {}));
    for name in ["zstd.parquet", "types.parquet", "plain.mat", "compressed.mat", "struct.mat", "matlab73.mat"] {
        let whole = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name);
        let check = |bytes: &[u8], what: &str| {
            std::fs::write(&path, bytes).unwrap();
            match Table::read(&path) {
                Ok(table) => assert!(table.rows() <= 1 << 16, "{name}, {what}: {} rows", table.rows()),
                Err(TraceError::Read { reason, .. }) => panic!("{name}, {what}: {reason}"),
                Err(error) => assert!(error.to_string().contains(name), "{name}, {what}: {error}"),
            }
        };
        for k in 0..64 {
            check(&whole[..whole.len() * k / 64], &format!("cut at {k}/64"));
        }
        for k in (0..whole.len()).step_by(whole.len() / 400 + 1) {
            let mut bytes = whole.clone();
            bytes[k] ^= 1 << (k % 8);
            check(&bytes, &format!("byte {k}"));
        }
    }
}

#[test]
fn a_small_file_that_unfolds_to_gigabytes_is_refused_before_it_does() {
    use std::io::Write;
    // A compressed element that announces 3.9 GB of zeros.
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    packed.write_all(&14_u32.to_le_bytes()).unwrap();
    packed.write_all(&3_900_000_000_u32.to_le_bytes()).unwrap();
    packed.write_all(&vec![0; 1 << 20]).unwrap();
    let packed = packed.finish().unwrap();
    let mut bytes = b"MATLAB 5.0 MAT-file".to_vec();
    bytes.resize(124, b' ');
    bytes.extend([0, 1, b'I', b'M']);
    bytes.extend(15_u32.to_le_bytes());
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend(packed);
    let error = Table::parse(&bytes, "bomb.mat").unwrap_err().to_string();
    assert!(error.contains("bomb.mat") && error.contains("unfolds"), "{error}");
}

/// The trace of a file of `scripts/fixtures/machine_logs.py`, its columns named as in that form.
fn log(name: &str, mapping: &Mapping) -> eixo::trace::Loaded {
    load(&data("logs").join(name), mapping).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn logs_of_machines_and_programs_hold_the_same_motion_in_every_form() {
    let mapped = |t: &str, x: &str| Mapping {
        signals: vec![(Signal::T, Column::named(t)), (Signal::Theta1, Column::named(x))],
        ..Mapping::default()
    };
    let own = Mapping::default();
    let sampler = Mapping { dt: Some(1e-3), ..mapped("column 2", "column 3") };
    for (name, mapping) in [
        ("sheet.xlsx", &own),
        ("arrays.npz", &own),
        ("lines.jsonl", &own),
        ("utf16.csv", &own),
        ("stamps.csv", &own),
        ("halscope.log", &mapped("pid.0.output", "joint.0.pos-fb")),
        ("halsampler.txt", &sampler),
        ("twincat.csv", &mapped("Torque", "ActPos")),
        ("sinumerik.xml", &mapped("Torque X1", "Position X1")),
        ("tncscope.sco", &mapped("i ist X", "s actual X")),
    ] {
        let trace = log(name, mapping).trace;
        assert_eq!(trace.len(), 200, "{name}");
        assert!((trace.dt() - 1e-3).abs() < 1e-9, "{name}: {}", trace.dt());
        for k in 0..200 {
            let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
            assert!(near(trace.get(Signal::T).unwrap()[k], row(k)[1]), "{name}, T, row {k}");
            assert!(near(trace.get(Signal::Theta1).unwrap()[k], row(k)[2]), "{name}, theta1, row {k}");
        }
    }
}

#[test]
fn what_a_controls_trace_does_not_hold_is_named() {
    // A signal that is sampled more slowly is missing in most records: it is a fault where it is used, and there alone.
    let table = Table::read(&data("logs/sinumerik.xml")).unwrap();
    assert_eq!(table.names(), "time, Torque X1, Position X1, Temperature X1");
    assert!(refusal(&table, "Temperature X1").contains("sinumerik.xml"), "{}", refusal(&table, "Temperature X1"));
    let sco = std::fs::read_to_string(data("logs/tncscope.sco")).unwrap();
    assert_eq!(Table::read(&data("logs/tncscope.sco")).unwrap().headers[1].unit.as_deref(), Some("A"));
    for (text, says) in [
        ("<traceDataRoot><other/></traceDataRoot>".to_owned(), "traceData/dataFrame"),
        ("<?xml version=\"1.0\"?><traceDataRoot><traceData>".to_owned(), "not well-formed"),
        ("<traceDataRoot><traceData><dataFrame/></traceData></traceDataRoot>".to_owned(), "no dataSignal"),
        (sco.replace("%CYCLETIME=1000", "%CYCLETIME=fast"), "number of microseconds"),
        (sco.replace("%[DATA]", "%[END]"), "without %[DATA]"),
        (sco.split("%[DATA]").next().unwrap().to_owned() + "%[DATA]\r\n", "no sample"),
        (sco.clone() + "1;2;3;4;5;\r\n", "5 cells where the time and 2 curves are expected"),
    ] {
        let error = Table::parse(text.as_bytes(), "log").unwrap_err().to_string();
        assert!(error.contains(says), "{says}: {error}");
    }
}

#[test]
fn a_controls_trace_that_ends_in_the_middle_is_read_up_to_its_last_whole_sample_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    for (name, sample, cuts, columns) in [
        (
            "logs/sinumerik.xml",
            "<rec time=\"0.199\"",
            &["<rec time=\"0.1", "<rec", "<"][..],
            ["Torque X1", "Position X1"],
        ),
        ("logs/tncscope.sco", "199000;", &["199000;-0.125;11.2", "199000;", "19"], ["i ist X", "s actual X"]),
    ] {
        let [torque, angle] = columns.map(Column::named);
        let mapping = Mapping { signals: vec![(Signal::T, torque), (Signal::Theta1, angle)], ..Mapping::default() };
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let loaded = load(&path, &mapping).unwrap();
            (loaded.trace.len(), loaded.warnings.join("\n"))
        };
        let whole = std::fs::read_to_string(data(name)).unwrap();
        let (before, _) = whole.split_once(sample).unwrap();
        let row = before.matches('\n').count() + 1;
        for cut in cuts {
            let (rows, said) = read(&format!("{before}{cut}"));
            assert_eq!(rows, 199, "{name}, {cut}");
            assert!(said.contains(&format!("log: row {row}, the last, is cut off ({cut:?})")), "{name}: {said}");
        }
        // One that only lacks its end has lost no sample; one that is damaged in the middle is an error.
        let end = whole.trim_end().trim_end_matches("</traceDataRoot>");
        let (rows, said) = read(end);
        assert!(rows == 200 && !said.contains("cut off"), "{name}: {said}");
        let damaged =
            whole.replacen("<rec time=\"0.011\"", "<rec time=0.011", 1).replacen("\n11000;", "\n11000;1;2;", 1);
        let at = damaged.lines().zip(whole.lines()).position(|(a, b)| a != b).unwrap() + 1;
        let error = Table::parse(damaged.as_bytes(), "log").unwrap_err().to_string();
        assert!(error.starts_with("log: ") && error.contains(&format!(" {at}: ")), "{name}, {at}: {error}");
    }
}

#[test]
fn forms_that_are_not_read_say_how_to_save_them() {
    for (bytes, says) in [
        (&b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1rest"[..], ".xlsx or CSV"),
        (b"\x89HDF\r\n\x1a\n", "-v7"),
        (b"PK\x03\x04 not an archive", "copy it again"),
    ] {
        let error = Table::parse(bytes, "log").unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
    }
}

#[test]
fn counters_that_wrap_go_on_and_calendar_stamps_count_from_the_first() {
    let text: String = (0..400_i64)
        .map(|k| {
            let torque = ((k as f64 * 0.07).sin() * 30.0).round() as i64;
            let count = (k * k * 3) % 65_536;
            format!("{},{},{count}\n", 1_700_000_000_000_i64 + 2 * k, (torque + 65_536) % 65_536)
        })
        .collect();
    let table = Table::parse(format!("timestamp,T,theta1\n{text}").as_bytes(), "log.csv").unwrap();
    let loaded = eixo::trace::from_table(&table, &Mapping::default()).unwrap();
    assert!((loaded.trace.dt() - 2e-3).abs() < 1e-12 && loaded.trace.start == 0.0);
    for k in 0..400_i64 {
        let at = k as usize;
        assert_eq!(loaded.trace.get(Signal::T).unwrap()[at], ((k as f64 * 0.07).sin() * 30.0).round());
        assert_eq!(loaded.trace.get(Signal::Theta1).unwrap()[at], (k * k * 3) as f64);
    }
    let said = loaded.warnings.join(" ");
    assert!(said.contains("milliseconds of a calendar") && said.contains("unwrapped"), "{said}");
}

#[test]
fn the_longest_piece_between_gaps_is_used_and_from_and_to_take_another() {
    let rows: String = (0..300)
        .map(|k| {
            let t = f64::from(k) * 1e-3 + if k >= 100 { 0.5 } else { 0.0 };
            format!("{t:.6},{},{k}\n", k % 7)
        })
        .collect();
    let table = Table::parse(format!("time,T,theta1\n{rows}").as_bytes(), "log.csv").unwrap();
    let loaded = eixo::trace::from_table(&table, &Mapping::default()).unwrap();
    assert_eq!((loaded.trace.len(), loaded.trace.get(Signal::Theta1).unwrap()[0]), (200, 100.0));
    assert!(loaded.warnings[0].contains("2 pieces") && loaded.warnings[0].contains("row 102"), "{:?}", loaded.warnings);
    let first = Mapping { to: Some(0.0991), ..Mapping::default() };
    assert_eq!(eixo::trace::from_table(&table, &first).unwrap().trace.len(), 100);
    let none = Mapping { from: Some(9.0), ..Mapping::default() };
    let error = eixo::trace::from_table(&table, &none).unwrap_err().to_string();
    assert!(error.contains("--from and --to leave 0 samples of 300"), "{error}");
    // A bad cell in the part that is left out is none of the record's.
    let bad = rows.replacen("0.002000,2,2", "0.002000,x,2", 1);
    let table = Table::parse(format!("time,T,theta1\n{bad}").as_bytes(), "log.csv").unwrap();
    assert!(eixo::trace::from_table(&table, &Mapping::default()).is_ok());
    assert!(eixo::trace::from_table(&table, &first).unwrap_err().to_string().contains("row 4, column T"));
}
