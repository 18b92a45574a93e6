//! The result of a simulation: inputs and outputs over the communication points.

use super::inputs;
use crate::trace::{AxisKind, Hold, Signal, Trace, TraceError};

/// What was recorded: the inputs, then the outputs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SimulationResult {
    /// Communication points, s.
    pub time: Vec<f64>,
    /// Communication step, s.
    pub step: f64,
    /// Each column.
    pub columns: Vec<Column>,
    /// What the user should know, in sentences.
    pub notes: Vec<String>,
}

/// A column of a record.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name of the variable.
    pub name: String,
    /// Its unit, where it has one.
    pub unit: Option<String>,
    /// One value a row.
    pub values: Vec<f64>,
    /// Whether it is an input.
    pub input: bool,
}

impl SimulationResult {
    /// The values of a variable.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
    }

    /// The columns that are signals of the axis, as a trace.
    ///
    /// # Errors
    /// Never, as long as all columns have one length.
    pub fn trace(&self, hold: Hold) -> Result<Trace, TraceError> {
        let start = self.time.first().copied().unwrap_or(0.0);
        let mut trace = Trace::new(start, self.step, hold);
        for column in &self.columns {
            if let Some(signal) = Signal::from_name(&column.name) {
                trace.set(signal, column.values.clone())?;
            }
        }
        Ok(trace)
    }

    /// Whether the columns are those of a linear axis.
    #[must_use]
    pub fn motion(&self) -> AxisKind {
        let linear = |c: &Column| c.name == "T" && c.unit.as_deref() == Some("N");
        if self.columns.iter().any(linear) { AxisKind::Linear } else { AxisKind::Rotary }
    }

    /// Headers and values of all columns with the time, for a CSV file.
    #[must_use]
    pub fn table(&self) -> Vec<(String, &[f64])> {
        let mut table = vec![("time [s]".to_owned(), self.time.as_slice())];
        for c in &self.columns {
            let name = inputs::column_name(&c.name);
            let header = match &c.unit {
                Some(unit) => format!("{name} [{unit}]"),
                None => name,
            };
            table.push((header, &c.values));
        }
        table
    }
}
