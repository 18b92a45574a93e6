//! Mutations of the archive.

use super::corpus::{BINARY, DESCRIPTION, Files, Mutant, files, pack};

fn mutant(name: &str, rule: &'static str, change: impl Fn(&mut Files) + Send + Sync + 'static) -> Mutant {
    Mutant::new(name, rule, move || {
        let mut files = files(DESCRIPTION);
        change(&mut files);
        pack(&files)
    })
}

fn add(name: &str, bytes: &[u8]) -> (String, Vec<u8>) {
    (name.to_owned(), bytes.to_vec())
}

/// Replaces every occurrence of a byte string by one of the same length.
fn patch(mut bytes: Vec<u8>, from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let places: Vec<usize> = (0..bytes.len() - from.len()).filter(|&i| &bytes[i..i + from.len()] == from).collect();
    assert!(!places.is_empty());
    for at in places {
        bytes[at..at + to.len()].copy_from_slice(to);
    }
    bytes
}

/// Offsets of the local and the central header of an entry.
fn headers(bytes: &[u8], name: &str) -> (usize, usize) {
    let find = |signature: &[u8], length: usize| {
        (0..bytes.len())
            .find(|&i| bytes[i..].starts_with(signature) && bytes[i + length..].starts_with(name.as_bytes()))
            .unwrap()
    };
    (find(b"PK\x03\x04", 30), find(b"PK\x01\x02", 46))
}

pub fn mutants() -> Vec<Mutant> {
    vec![
        Mutant::new("not an archive", "archive-readable", || b"this is no archive".to_vec()),
        Mutant::new("empty file", "archive-readable", Vec::new),
        Mutant::new("cut archive", "archive-readable", || {
            let whole = pack(&files(DESCRIPTION));
            whole[..whole.len() / 2].to_vec()
        }),
        Mutant::new("path upwards", "archive-path", || {
            let mut files = files(DESCRIPTION);
            files.push(add("resources/up/evil.txt", b"x"));
            patch(pack(&files), b"resources/up/evil", b"../../../../.evil")
        }),
        Mutant::new("absolute path", "archive-path", || {
            let mut files = files(DESCRIPTION);
            files.push(add("resources/evil.txt", b"x"));
            patch(pack(&files), b"resources/evil", b"/tmp/eixo/evil")
        }),
        Mutant::new("drive letter", "archive-path", || {
            let mut files = files(DESCRIPTION);
            files.push(add("resources/evil.txt", b"x"));
            patch(pack(&files), b"resources/evil", b"C:/windows/new")
        }),
        Mutant::new("symbolic link", "archive-path", || {
            use std::io::Write;
            use zip::write::SimpleFileOptions;
            let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
            for (name, bytes) in files(DESCRIPTION) {
                zip.start_file(name, SimpleFileOptions::default()).unwrap();
                zip.write_all(&bytes).unwrap();
            }
            zip.add_symlink("resources/link", "/etc/passwd", SimpleFileOptions::default()).unwrap();
            zip.finish().unwrap().into_inner()
        }),
        Mutant::new("backslash", "archive-backslash", || {
            let mut files = files(DESCRIPTION);
            files.push(add("resources/a/b.txt", b"x"));
            patch(pack(&files), b"resources/a/b.txt", b"resources\\a\\b.txt")
        }),
        Mutant::new("unknown compression", "archive-method", || {
            let mut bytes = pack(&files(DESCRIPTION));
            let (local, central) = headers(&bytes, "resources/data.txt");
            // Method 14, LZMA (APPNOTE.TXT 4.4.5).
            bytes[local + 8] = 14;
            bytes[central + 10] = 14;
            bytes
        }),
        Mutant::new("encrypted", "archive-method", || {
            let mut bytes = pack(&files(DESCRIPTION));
            let (local, central) = headers(&bytes, "resources/data.txt");
            bytes[local + 6] |= 1;
            bytes[central + 8] |= 1;
            bytes
        }),
        Mutant::new("entry twice", "archive-duplicate", || {
            let mut files = files(DESCRIPTION);
            files.push(add("resources/dato.txt", b"x"));
            patch(pack(&files), b"resources/dato.txt", b"resources/data.txt")
        }),
        mutant("names that differ in case", "archive-duplicate", |f| f.push(add("resources/DATA.txt", b"x"))),
        Mutant::new("damaged entry", "archive-damaged", || {
            let mut bytes = pack(&files(DESCRIPTION));
            let (local, _) = headers(&bytes, "resources/data.txt");
            bytes[local + 30 + "resources/data.txt".len() + 6] ^= 0x55;
            bytes
        }),
        mutant("a file that is a folder too", "archive-duplicate", |f| {
            f.push(add("resources/data.txt/more.txt", b"x"))
        }),
        mutant("zip bomb", "archive-bomb", |f| f.push(add("resources/zeros", &vec![0; 16 << 20]))),
        mutant("no description", "archive-description", |f| {
            f.remove(0);
        }),
        mutant("everything in a folder", "archive-description", |f| {
            for (name, _) in f {
                *name = format!("model/{name}");
            }
        }),
        mutant("description misspelt", "archive-description", |f| f[0].0 = "ModelDescription.xml".into()),
        mutant("no binary", "binary-missing", |f| {
            f.remove(1);
        }),
        mutant("platform misspelt", "binary-folder", |f| f[1].0 = "binaries/Linux64/corpus.so".into()),
        mutant("binary without a platform", "binary-folder", |f| f[1].0 = "binaries/corpus.so".into()),
        mutant("binary with a prefix", "binary-name", |f| f[1].0 = "binaries/linux64/libcorpus.so".into()),
        mutant("binary with another extension", "binary-name", |f| f[1].0 = "binaries/win64/corpus.so".into()),
        mutant("empty binary", "binary-format", |f| f[1].1.clear()),
        mutant("32-bit binary", "binary-format", |f| f[1].1[4] = 1),
        mutant("Windows folder with a Linux binary", "binary-format", |f| {
            let copy = f[1].1.clone();
            assert_eq!(f[1].0, BINARY);
            f.push(("binaries/win64/corpus.dll".into(), copy));
        }),
    ]
}
