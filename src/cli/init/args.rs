//! The arguments of `eixo init`.

use std::path::PathBuf;

use crate::cli::examined::{self, Part};
use crate::cli::names::{offering, signals_equal};

/// Arguments of `eixo init`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  eixo init log.csv
  eixo init servo.xlsx --yes -o x.toml")]
pub struct Args {
    /// The log: CSV, Excel, Parquet, MATLAB, NumPy, JSON Lines, halscope, ...
    pub log: PathBuf,
    /// The axis file to write; axis.toml beside the log without
    #[arg(short, long, alias = "axis", value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// The plot of the log to write; beside the axis file without
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Ask nothing: take what the names, units and numbers say
    #[arg(long, short)]
    pub yes: bool,
    /// What a column is: time, T, theta1, theta2, x2, omega1, omega2 or reference; nothing behind the = for none. May be given many
    /// times; what is not given is guessed
    #[arg(long, value_name = "SIGNAL=COLUMN", value_parser = offering(pair, signals_equal), hide_possible_values = true)]
    pub column: Vec<(String, String)>,
    /// The unit of a signal whose column has none in its header, as in theta1=deg
    #[arg(long, value_name = "SIGNAL=UNIT", value_parser = offering(pair, signals_equal), hide_possible_values = true)]
    pub unit: Vec<(String, String)>,
    /// How many N.m (N on a linear axis) one of the torque's column is, where that is a current or counts
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, value_parser = examined::finite)]
    pub torque_constant: Option<f64>,
    /// The sampling interval of a log without a column of time, s
    #[arg(long, value_name = "S", value_parser = examined::positive)]
    pub dt: Option<f64>,
    /// Write over files that are there
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub part: Part,
}

/// `NAME=VALUE` as two words.
fn pair(text: &str) -> Result<(String, String), String> {
    let cut = text.split_once('=').map(|(a, b)| (a.trim().to_owned(), b.trim().to_owned()));
    cut.filter(|(a, _)| !a.is_empty()).ok_or_else(|| "give NAME=VALUE".to_owned())
}
