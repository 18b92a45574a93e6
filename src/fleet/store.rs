//! Finished results, one file a trace, each with the key of its making.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::{FleetError, Item, Plan, Row};
use crate::trace::write_text;

const SCHEMA: &str = "eixo.fleet/1";
/// Largest kept result that is read back, bytes.
const LARGEST: u64 = 64 << 20;

/// The folder of kept results.
pub(super) struct Store {
    results: PathBuf,
    reports: PathBuf,
    /// What every key begins with: program, command, settings.
    base: Sha256,
}

/// A kept result.
#[derive(Serialize, Deserialize)]
struct Kept<R, V> {
    schema: String,
    key: String,
    row: R,
    result: V,
}

impl Store {
    /// Makes the folders.
    pub fn open(plan: &Plan) -> Result<Self, FleetError> {
        let results = plan.output.join("results");
        let reports = plan.output.join("reports");
        for path in [&results, &reports] {
            std::fs::create_dir_all(path).map_err(|reason| FleetError::Folder { path: path.clone(), reason })?;
        }
        let mut base = Sha256::new();
        field(&mut base, SCHEMA.as_bytes());
        field(&mut base, env!("CARGO_PKG_VERSION").as_bytes());
        // The program itself: a change of its code that is not a new version makes other results too.
        let program = std::env::current_exe().and_then(|path| digest(&path));
        field(&mut base, program.unwrap_or_default().as_bytes());
        field(&mut base, plan.command.as_bytes());
        field(&mut base, plan.settings.as_bytes());
        Ok(Self { results, reports, base })
    }

    /// The key of a trace's result.
    ///
    /// # Errors
    /// In words, when the trace or its axis file cannot be read.
    pub fn key(&self, item: &Item) -> Result<String, String> {
        let read = |path: &Path| digest(path).map_err(|e| format!("{}: cannot read: {e}", path.display()));
        let mut key = self.base.clone();
        field(&mut key, item.name().as_bytes());
        field(&mut key, read(&item.path)?.as_bytes());
        let axis = item.axis.as_deref().map(read).transpose()?;
        field(&mut key, axis.unwrap_or_default().as_bytes());
        Ok(hex(&key.finalize()))
    }

    fn result(&self, item: &Item) -> PathBuf {
        self.results.join(format!("{}.json", slug(item)))
    }

    /// The row that was kept under this key.
    pub fn kept(&self, item: &Item, key: &str) -> Option<Row> {
        let path = self.result(item);
        if std::fs::metadata(&path).ok()?.len() > LARGEST {
            return None;
        }
        let kept: Kept<Row, serde::de::IgnoredAny> = serde_json::from_slice(&std::fs::read(&path).ok()?).ok()?;
        let report = !kept.row.done || self.reports.join(report(item)).is_file();
        (kept.schema == SCHEMA && kept.key == key && report).then_some(kept.row)
    }

    /// Keeps a result: the report first, so that a result that is there has its report.
    pub fn keep(
        &self,
        item: &Item,
        key: &str,
        row: &Row,
        result: &Value,
        page: Option<&str>,
    ) -> Result<(), FleetError> {
        if let Some(page) = page {
            write_text(&self.reports.join(report(item)), page.as_bytes())?;
        }
        let kept = Kept { schema: SCHEMA.to_owned(), key: key.to_owned(), row, result };
        let mut text = serde_json::to_vec_pretty(&kept).unwrap_or_default();
        text.push(b'\n');
        write_text(&self.result(item), &text)?;
        Ok(())
    }
}

/// The file name of a trace's report.
pub(super) fn report(item: &Item) -> String {
    format!("{}.html", slug(item))
}

/// A file name for a trace: its own name, plain letters only, and a hash of the path it was found by.
fn slug(item: &Item) -> String {
    let stem = item.path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let plain: String =
        stem.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).take(60).collect();
    let hash = hex(&Sha256::digest(item.path.to_string_lossy().as_bytes()));
    format!("{plain}-{}", &hash[..10])
}

/// One field of a key: its length, then its bytes, so that no two lists of fields are the same text.
fn field(key: &mut Sha256, bytes: &[u8]) {
    key.update((bytes.len() as u64).to_le_bytes());
    key.update(bytes);
}

/// SHA-256 of a file, a piece at a time.
fn digest(path: &Path) -> std::io::Result<String> {
    let mut file = File::open(path)?;
    let mut hash = Sha256::new();
    let mut piece = vec![0; 1 << 18];
    loop {
        match file.read(&mut piece)? {
            0 => return Ok(hex(&hash.finalize())),
            n => hash.update(&piece[..n]),
        }
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}
