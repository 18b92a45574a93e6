//! Requests that need more than the free memory, or more than an hour, are refused before the work.

/// Bytes of a number in memory and as text of a file that is made of it.
const BYTES: f64 = 8.0 + 20.0;
/// Rows of a simulation an hour, at a microsecond a row and column group: more is not waited for.
const AN_HOUR: f64 = 3.6e9;

/// Memory that is free, bytes; None where the system does not report it.
fn free() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    Some(1024.0 * line.split_whitespace().next()?.parse::<f64>().ok()?)
}

/// Whether a table of so many rows and columns can be made here.
///
/// # Errors
/// When it needs more memory than is free, or more than an hour.
pub fn bearable(rows: f64, columns: usize) -> anyhow::Result<()> {
    let needed = rows * columns as f64 * BYTES;
    let giga = |bytes: f64| bytes / f64::from(1 << 30);
    if let Some(free) = free() {
        anyhow::ensure!(
            needed < 0.9 * free,
            "{} rows of {columns} columns need about {:.3e} GB of memory, {:.1} GB are free: take a shorter time or a longer \
             step",
            if rows < 1e12 { format!("{rows:.0}") } else { format!("{rows:.3e}") },
            giga(needed),
            giga(free)
        );
    }
    anyhow::ensure!(rows < AN_HOUR, "{rows:.3e} rows take more than an hour: take a shorter time or a longer step");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_machine_bears_is_refused_with_the_way_out() {
        assert!(bearable(1e4, 10).is_ok());
        let error = bearable(1e15, 10).unwrap_err().to_string();
        assert!(error.contains("longer step"), "{error}");
        let error = bearable(1e300, 10).unwrap_err().to_string();
        assert!(error.len() < 200, "{error}");
    }
}
