//! What lies behind the handles of an FMU of FMI 3.0, and how a list of them goes in calls.
//!
//! What is asked for by handle, a scalar or an element of an array ([`Cell`]), goes to the FMU in one call for each run of
//! handles of one type.

use std::collections::HashMap;
use std::sync::Arc;

use crate::description::{Cell, Description, Fmi, Kind, Value};

/// What lies behind the handles of a description of FMI 3.0.
#[derive(Debug, Default)]
pub struct Layout {
    cells: HashMap<u32, Cell>,
    /// Start values of arrays.
    pub(super) starts: HashMap<u32, Vec<Option<Value>>>,
}

impl Layout {
    /// The layout of a description; none for FMI 2.0.
    #[must_use]
    pub fn of(d: &Description) -> Option<Arc<Self>> {
        if d.fmi != Fmi::Three {
            return None;
        }
        let mut layout = Self::default();
        for v in &d.variables {
            let Some(cell) = v.cell else { continue };
            // An alias has the handle of its variable.
            if layout.cells.contains_key(&v.value_reference) {
                continue;
            }
            layout.cells.insert(v.value_reference, cell);
            if cell.of > 1 {
                let starts = layout.starts.entry(cell.reference).or_insert_with(|| vec![None; cell.of]);
                if let Some(start) = starts.get_mut(cell.at) {
                    start.clone_from(&v.start);
                }
            }
        }
        Some(Arc::new(layout))
    }

    /// The cell of a handle; a handle that no variable has is tried as a scalar of the type.
    fn cell(&self, handle: u32, kind: Kind) -> Cell {
        self.cells.get(&handle).copied().unwrap_or(Cell { reference: handle, kind, at: 0, of: 1 })
    }
}

/// Handles of one type that go in one call.
#[derive(Debug, Clone)]
pub(super) struct Run {
    pub kind: Kind,
    pub references: Vec<u32>,
    /// Number of elements of each reference.
    pub counts: Vec<usize>,
    /// Place of each handle among the values.
    pub places: Vec<usize>,
    pub total: usize,
}

/// How a list of handles was last taken apart.
#[derive(Debug, Default)]
pub(super) struct Plan {
    handles: Vec<u32>,
    runs: Arc<[Run]>,
}

/// Takes a list of handles apart; a handle that no variable has is tried as a scalar of the type.
pub(super) fn runs(layout: &Layout, handles: &[u32], kind: Kind) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for &handle in handles {
        let cell = layout.cell(handle, kind);
        // Enumerations go by the functions of 64 bits.
        let kind = if cell.kind == Kind::Enumeration { Kind::Int64 } else { cell.kind };
        if runs.last().is_none_or(|run| run.kind != kind) {
            runs.push(Run { kind, references: vec![], counts: vec![], places: vec![], total: 0 });
        }
        let Some(run) = runs.last_mut() else { continue };
        // Elements of one array that stand together are one reference.
        let base = match run.references.last() {
            Some(&last) if last == cell.reference && cell.of > 1 => run.total - cell.of,
            _ => {
                run.references.push(cell.reference);
                run.counts.push(cell.of);
                run.total += cell.of;
                run.total - cell.of
            }
        };
        run.places.push(base + cell.at);
    }
    runs
}

impl Plan {
    /// The calls for a list of handles; a list like the last is not taken apart again.
    pub(super) fn runs(&mut self, layout: &Layout, handles: &[u32], kind: Kind) -> Arc<[Run]> {
        if self.handles != handles {
            *self = Self { handles: handles.to_vec(), runs: runs(layout, handles, kind).into() };
        }
        Arc::clone(&self.runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_that_stand_together_go_as_one_array() {
        let mut layout = Layout::default();
        for at in 0..3 {
            let handle = if at == 0 { 7 } else { 100 + at };
            layout.cells.insert(handle, Cell { reference: 7, kind: Kind::Float64, at: at as usize, of: 3 });
        }
        layout.cells.insert(1, Cell { reference: 1, kind: Kind::Float64, at: 0, of: 1 });
        layout.cells.insert(2, Cell { reference: 2, kind: Kind::Float32, at: 0, of: 1 });
        let runs = runs(&layout, &[1, 102, 7, 2, 9], Kind::Float64);
        assert_eq!(runs.len(), 3);
        assert_eq!(
            (runs[0].references.as_slice(), runs[0].places.as_slice(), runs[0].total),
            (&[1, 7][..], &[0, 3, 1][..], 4)
        );
        assert_eq!((runs[1].kind, runs[2].kind), (Kind::Float32, Kind::Float64));
    }
}
