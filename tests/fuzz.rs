//! Every reader of untrusted files on input that nobody meant: a bounded, seeded run over a corpus, on the stable compiler.
//!
//! Each target starts from the files of `tests/fuzz/corpus/TARGET` and the fixtures of other tests, and changes, cuts, copies and
//! joins them. Nothing may panic, and an error names the file. A file that once made a reader fail belongs into the corpus:
//! every one of it is also read as it is.
//!
//! `EIXO_FUZZ_RUNS` sets the number of inputs a target, `EIXO_FUZZ_SEED` the seed: `EIXO_FUZZ_RUNS=1000000 cargo test --test
//! fuzz`. The C ABI has its own: random call sequences against a model of the standard's state machine, `tests/fmi2_sequence.rs`.

use std::path::{Path, PathBuf};

use eixo::fleet::When;
use eixo::fmu::archive::{Archive, Limits};
use eixo::fmu::description::Description;
use eixo::trace::stream::Stream;
use eixo::trace::{Machine, Mapping, Table, from_table};
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};

const RUNS: usize = 3000;

fn variable(name: &str, otherwise: usize) -> usize {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(otherwise)
}

/// The corpus of a target, and these files of other tests.
fn corpus(target: &str, others: &[&str]) -> Vec<(PathBuf, Vec<u8>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join("tests/fuzz/corpus").join(target);
    let mut paths: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.expect("an entry").path())
        .chain(others.iter().map(|name| root.join(name)))
        .collect();
    paths.sort();
    paths.into_iter().map(|path| (path.clone(), std::fs::read(&path).expect("the file"))).collect()
}

/// A change or several: of a byte, a run of bytes, a number; a cut; a piece of another file; a word of the format.
fn mutate(bytes: &mut Vec<u8>, rng: &mut impl Rng, others: &[(PathBuf, Vec<u8>)], words: &[&[u8]]) {
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..=bytes.len());
        let end = (at + rng.random_range(0..32)).min(bytes.len());
        match rng.random_range(0..8) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.random_range(0..8),
            1 if at < bytes.len() => bytes[at] = rng.random(),
            2 => drop(bytes.drain(at..end)),
            3 => bytes.truncate(at),
            4 => {
                let piece = bytes[at..end].to_vec();
                let to = rng.random_range(0..=bytes.len());
                bytes.splice(to..to, piece);
            }
            5 => {
                if let Some((_, other)) = others.choose(rng) {
                    let from = rng.random_range(0..=other.len());
                    let to = (from + rng.random_range(0..200)).min(other.len());
                    bytes.splice(at..end, other[from..to].iter().copied());
                }
            }
            6 => drop(bytes.splice(at..at, words.choose(rng).copied().unwrap_or_default().iter().copied())),
            // A length or a count, large or just off.
            _ => {
                let number = *[0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, u32::MAX, u32::MAX - 7].choose(rng).unwrap_or(&0);
                let four = (at + 4).min(bytes.len());
                bytes.splice(at..four, number.to_le_bytes());
            }
        }
    }
}

/// Reads the corpus as it is, then inputs made of it.
fn fuzz(target: &str, others: &[&str], words: &[&[u8]], read: impl Fn(&[u8])) {
    let seeds = corpus(target, others);
    for (path, bytes) in &seeds {
        eprintln!("{}", path.display());
        read(bytes);
    }
    let seed = variable("EIXO_FUZZ_SEED", 1) as u64;
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    for run in 0..variable("EIXO_FUZZ_RUNS", RUNS) {
        let (_, bytes) = seeds.choose(&mut rng).expect("a corpus");
        let mut bytes = bytes.clone();
        mutate(&mut bytes, &mut rng, &seeds, words);
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| read(&bytes)));
        if let Err(reason) = outcome {
            let kept = std::env::temp_dir().join(format!("eixo-fuzz-{target}"));
            std::fs::write(&kept, &bytes).expect("the input that fails");
            eprintln!("{target}: run {run} of seed {seed} fails; the input is in {}", kept.display());
            std::panic::resume_unwind(reason);
        }
    }
}

/// A table that was read keeps its promises, and is taken or refused as a trace.
fn use_table(table: &Table) {
    assert!(table.headers.len() <= 4096);
    for k in 0..table.headers.len() {
        match table.column(k) {
            Ok(values) => {
                assert_eq!(values.len(), table.rows());
                assert!(values.iter().all(|v| v.is_finite()));
            }
            Err(error) => assert!(error.to_string().starts_with("fuzz: "), "{error}"),
        }
    }
    if let Err(error) = from_table(table, &Mapping::default()) {
        assert!(error.to_string().starts_with("fuzz: "), "{error}");
    }
}

#[test]
fn csv_is_read_or_refused() {
    let words: [&[u8]; 14] = [
        b",",
        b";",
        b"\t",
        b"\n",
        b"\r\n",
        b"\"",
        b"#",
        b"nan",
        b"1e999",
        b"-0",
        b"[rad]",
        b"theta1",
        b"\xef\xbb\xbf",
        b"\0",
    ];
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fuzz");
    fuzz("csv", &[], &words, |bytes| {
        let whole = Table::parse(bytes, "fuzz");
        match &whole {
            Ok(table) => use_table(table),
            Err(error) => assert!(error.to_string().starts_with("fuzz: "), "{error}"),
        }
        // Piece by piece the same is read, or refused.
        std::fs::write(&path, bytes).expect("the file");
        if let Ok(stream) = Stream::open(&path, &Mapping::default()) {
            let mut samples = 0;
            let read = stream.each(|first, piece| {
                assert_eq!(first, samples);
                samples += piece.len();
                Ok(())
            });
            let table = whole.expect("a streamed file is read whole too");
            assert!(read.is_err() || samples == table.rows());
        }
    });
}

#[test]
fn an_axis_file_is_read_or_refused() {
    let words: [&[u8]; 14] = [
        b"[",
        b"]",
        b"=",
        b"\"",
        b"{",
        b"}",
        b"\n",
        b"1e400",
        b"nan",
        b"-1",
        b"[effects.backlash]",
        b"I1",
        b"rho",
        b"\\u0000",
    ];
    fuzz("toml", &["tests/data/emps.toml", "tests/data/two_inertia_bench.toml"], &words, |bytes| {
        let text = String::from_utf8_lossy(bytes);
        match Machine::parse(&text, "fuzz") {
            // What was read is written and read again as the same.
            Ok(machine) => assert_eq!(Machine::parse(&machine.to_toml(), "again").expect("our own file"), machine),
            Err(error) => assert!(error.to_string().starts_with("fuzz"), "{error}"),
        }
    });
}

#[test]
fn matlab_files_are_read_or_refused() {
    let fixtures = ["plain", "compressed", "struct"].map(|n| format!("tests/data/formats/{n}.mat"));
    fuzz(
        "mat",
        &fixtures.each_ref().map(String::as_str),
        &[b"\x0e\0\0\0", b"\x0f\0\0\0", b"\x06\0\0\0\x08\0\0\0"],
        |bytes| match Table::parse(bytes, "fuzz") {
            Ok(table) => use_table(&table),
            Err(error) => assert!(error.to_string().starts_with("fuzz: "), "{error}"),
        },
    );
}

#[test]
#[cfg(feature = "hdf5")]
fn hdf5_files_are_read_or_refused() {
    let fixtures = ["tests/data/formats/matlab73.mat", "tests/data/formats/python.h5"];
    let words: [&[u8]; 6] =
        [b"OHDR", b"TREE", b"SNOD", b"HEAP", b"\xff\xff\xff\xff\xff\xff\xff\xff", b"\0\0\0\x01\0\0\0\0"];
    fuzz("hdf5", &fixtures, &words, |bytes| match Table::parse(bytes, "fuzz") {
        Ok(table) => use_table(&table),
        Err(error) => assert!(error.to_string().starts_with("fuzz: "), "{error}"),
    });
}

#[test]
#[cfg(feature = "parquet")]
fn parquet_files_are_read_or_refused() {
    let fixtures = ["types", "version2", "zstd"].map(|n| format!("tests/data/formats/{n}.parquet"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("fuzz");
    // The library's own panics are errors of the file: they are caught, and need not be shown.
    std::panic::set_hook(Box::new(|_| {}));
    fuzz("parquet", &fixtures.each_ref().map(String::as_str), &[b"PAR1"], |bytes| {
        std::fs::write(&path, bytes).expect("the file");
        match Table::read(&path) {
            Ok(table) => assert!(table.rows() < 1 << 20),
            Err(error) => assert!(error.to_string().starts_with(&path.display().to_string()), "{error}"),
        }
    });
}

#[test]
fn descriptions_are_read_or_refused() {
    let words: [&[u8]; 12] =
        [b"<", b">", b"/>", b"\"", b"&", b"&#0;", b"]]>", b"<![CDATA[", b"<!--", b"<!DOCTYPE", b"99999999999", b"NaN"];
    let fixtures = ["tests/corpus/modelDescription.xml", "modelDescription/modelDescription.xml"];
    fuzz("xml", &fixtures, &words, |bytes| {
        let _ = Description::parse(bytes);
    });
}

#[test]
fn archives_are_read_or_refused() {
    let limits = Limits { total: 1 << 24, entry: 1 << 24, ..Limits::default() };
    fuzz("zip", &[], &[b"PK\x03\x04", b"PK\x01\x02", b"PK\x05\x06", b"../"], |bytes| {
        if let Ok(mut archive) = Archive::from_bytes(bytes.to_vec(), limits) {
            let _ = archive.test();
            if let Ok(folder) = archive.extract() {
                // Nothing but what the archive may write, and nothing outside.
                assert!(folder.path().is_dir());
            }
        }
    });
}

#[test]
fn dates_in_file_names_are_found_or_not() {
    fuzz("csv", &[], &[b"2026-01-31", b"20260131", b"T083000", b"_", b"-"], |bytes| {
        let text = String::from_utf8_lossy(bytes);
        for part in text.split(',') {
            if let Some(when) = When::parse(part) {
                assert!((0.0..84_006.0).contains(&when.days), "{part}");
            }
        }
    });
}
