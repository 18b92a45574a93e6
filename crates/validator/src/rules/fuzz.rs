//! The readers of archives and descriptions on malformed input: no panic, no hang, no position outside the file.
//! The number of cases is proptest's default, or `PROPTEST_CASES`.

use std::io::{Cursor, Write};

use proptest::prelude::*;
use zip::{ZipWriter, write::SimpleFileOptions};

use super::super::archive::{Archive, Limits};
use super::super::xml::Document;
use super::{Static, check_archive, check_description};

const DESCRIPTION: &str = include_str!("../../../../tests/corpus/modelDescription.xml");
const DESCRIPTION3: &str = include_str!("../../../../tests/corpus/modelDescription3.xml");

/// One of the two versions of FMI.
fn descriptions() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![DESCRIPTION, DESCRIPTION3])
}

fn archive() -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in [("modelDescription.xml", DESCRIPTION), ("binaries/linux64/corpus.so", "\x7fELF\x02")] {
        zip.start_file(name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// Cuts, copies and overwrites parts of a text.
fn mutate(bytes: &mut Vec<u8>, edits: &[(usize, usize, usize, Vec<u8>)]) {
    for (at, length, to, new) in edits {
        let at = at % (bytes.len() + 1);
        let end = (at + length % 40).min(bytes.len());
        let part: Vec<u8> = bytes.splice(at..end, new.iter().copied()).collect();
        let to = to % (bytes.len() + 1);
        if to.is_multiple_of(2) {
            bytes.splice(to..to, part);
        }
    }
}

fn edits() -> impl Strategy<Value = Vec<(usize, usize, usize, Vec<u8>)>> {
    let word = prop_oneof![
        proptest::collection::vec(any::<u8>(), 0..6),
        prop::sample::select(vec![
            "<",
            ">",
            "/>",
            "\"",
            "&",
            "&#0;",
            "]]>",
            "<![CDATA[",
            "<!--",
            "99999999999",
            "-1",
            "NaN",
            "="
        ])
        .prop_map(|s| s.as_bytes().to_vec()),
    ];
    proptest::collection::vec((any::<usize>(), any::<usize>(), any::<usize>(), word), 1..6)
}

fn places_are_inside(result: &Static) {
    for finding in &result.findings.list {
        if let Some(position) = finding.place.as_ref().and_then(|p| p.position) {
            assert!(position.line >= 1 && position.column >= 1);
            assert!(position.line as usize <= result.source.len() + 1, "{finding:?}");
        }
    }
}

proptest! {
    #[test]
    fn any_bytes_are_read_as_xml_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = Document::parse(&bytes);
    }

    #[test]
    fn a_mangled_description_is_checked_or_refused(of in descriptions(), edits in edits()) {
        let mut bytes = of.as_bytes().to_vec();
        mutate(&mut bytes, &edits);
        let mut result = Static::empty();
        let _ = check_description(&bytes, &mut result);
        places_are_inside(&result);
    }

    #[test]
    fn a_mangled_archive_is_checked_or_refused(edits in edits()) {
        let mut bytes = archive();
        mutate(&mut bytes, &edits);
        if let Ok(mut archive) = Archive::from_bytes(bytes, Limits { total: 1 << 24, ..Limits::default() }) {
            let _ = archive.extract();
            places_are_inside(&check_archive(archive));
        }
    }

    #[test]
    fn swapped_values_of_attributes_are_checked(
        of in descriptions(),
        pairs in proptest::collection::vec((any::<prop::sample::Index>(), any::<prop::sample::Index>()), 1..4)
    ) {
        let mut parts: Vec<&str> = of.split('"').collect();
        for (a, b) in pairs {
            // Every second part is a value.
            let count = parts.len() / 2;
            parts.swap(2 * a.index(count) + 1, 2 * b.index(count) + 1);
        }
        let mut result = Static::empty();
        let _ = check_description(parts.join("\"").as_bytes(), &mut result);
        places_are_inside(&result);
    }
}
