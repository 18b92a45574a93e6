//! `eixo init`: from a foreign log to the axis.toml that reads it.

use std::fmt::Write as _;
use std::io::{BufRead, Write as _};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;

use super::examined::Part;
use super::names::{offering, signals_equal};
use super::outputs;
use super::stdout::{WIDTH, layout, out, out_line};
use crate::axis::Structure;
use crate::examine::{Examination, Input, examine};
use crate::identify::run::{Request, identify};
use crate::report::driven::Driven;
use crate::report::examine::{Inspected, findings, report, verdict};
use crate::report::{Block, Cell, Table as Shown, html, terminal};
use crate::trace::guess::{Guess, Role, SURE, guess};
use crate::trace::{COUNTS, Machine, Motion, Quantity, Signal, Table, Trace, Unit, from_table, nearest, write_text};

/// Arguments of `eixo init`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  eixo init log.csv
  eixo init servo.xlsx --yes -o x.toml")]
pub struct Args {
    /// The log: CSV, Excel, Parquet, MATLAB, NumPy, JSON Lines, halscope, ...
    log: PathBuf,
    /// The axis file to write; axis.toml beside the log without
    #[arg(short, long, alias = "axis", value_name = "FILE")]
    output: Option<PathBuf>,
    /// The plot of the log to write; beside the axis file without
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Ask nothing: take what the names, units and numbers say
    #[arg(long, short)]
    yes: bool,
    /// What a column is: time, T, theta1, theta2, x2, omega1, omega2 or reference; nothing behind the = for none. May be given many
    /// times; what is not given is guessed
    #[arg(long, value_name = "SIGNAL=COLUMN", value_parser = offering(pair, signals_equal), hide_possible_values = true)]
    column: Vec<(String, String)>,
    /// The unit of a signal whose column has none in its header, as in theta1=deg
    #[arg(long, value_name = "SIGNAL=UNIT", value_parser = offering(pair, signals_equal), hide_possible_values = true)]
    unit: Vec<(String, String)>,
    /// How many N.m (N on a linear axis) one of the torque's column is, where that is a current or counts
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true, value_parser = super::examined::finite)]
    torque_constant: Option<f64>,
    /// The sampling interval of a log without a column of time, s
    #[arg(long, value_name = "S", value_parser = super::examined::positive)]
    dt: Option<f64>,
    /// Write over files that are there
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    part: Part,
}

/// What was made of a log.
struct Made {
    guesses: Vec<Guess>,
    motion: Motion,
    dt: Option<f64>,
    /// From the drive's unit to the torque.
    torque_scale: f64,
}

impl Made {
    fn of(&self, signal: Signal) -> Option<&Guess> {
        self.guesses.iter().find(|g| g.role == Role::Signal(signal))
    }

    /// Whether the torque is a number of the drive: no unit, no constant, and no name of a torque.
    fn counts(&self) -> bool {
        let named = |column: &str| {
            let column = column.to_lowercase();
            column == "t" || ["torque", "force", "moment", "drehm", "kraft"].iter().any(|word| column.contains(word))
        };
        self.of(Signal::T).is_some_and(|g| g.unit.is_none() && self.torque_scale == 1.0 && !named(&g.column))
    }

    fn is_rigid(&self) -> bool {
        self.of(Signal::Theta1).is_none() || (self.of(Signal::Theta2).is_none() && self.of(Signal::X2).is_none())
    }
}

/// Runs the command.
///
/// # Errors
/// When the log cannot be read, holds no torque and position, or the axis file cannot be written.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let folder = args.log.parent().unwrap_or(Path::new(""));
    let axis = args.output.clone().unwrap_or_else(|| folder.join("axis.toml"));
    let page = args.report.clone().unwrap_or_else(|| axis.with_extension("html"));
    outputs::check([args.log.as_path()], [], [Some(&axis), Some(&page)])?;
    for path in [&axis, &page] {
        anyhow::ensure!(
            args.force || !path.is_file(),
            "{}: it is there already; give another name (-o, --report) or say --force to write over it",
            path.display()
        );
    }
    let table = Table::read(&args.log)?;
    let file = args.log.display().to_string();
    let mut asker = Asker { yes: args.yes };
    let made = make(&table, &args, &mut asker)?;
    let text = write(&made, &table, &Read::default(), &file);
    let mut machine =
        Machine::parse(&text, &axis.display().to_string()).context("the axis file that was made does not read back")?;
    let mut loaded = from_table(&table, &args.part.of(machine.signals.clone()))?;
    let rho = lead(&loaded.trace);
    if let Some(rho) = rho {
        machine.parameters.rho = rho;
    }
    let shown = loaded.trace.clone();
    super::examined::table_as_angle(&mut loaded.trace, &machine)?;
    // A first idea of the parameters, from the log itself: it shows whether units and signs are right.
    let examination = examine(&Input::of(&loaded.trace, loaded.stamps.as_deref()).against(&machine, false));
    // Of a log that cannot be believed no number is written.
    let rough = if examination.refuses() { None } else { rough(&loaded.trace, &machine, &examination) };
    let text = write(&made, &table, &Read { rough, rho, refused: examination.refuses() }, &file);
    let machine =
        Machine::parse(&text, &axis.display().to_string()).context("the axis file that was made does not read back")?;
    let seen = Inspected {
        examination: &examination,
        trace: &shown,
        file: &file,
        motion: machine.signals.motion,
        warnings: &loaded.warnings,
    };
    let driven = Driven { motion: machine.signals.motion, unit: loaded.drive.clone() };
    // The page is the larger: where there is no room for it, no axis file stands in the way of the next try.
    write_text(&page, html::page(&driven.report(report(&seen))).as_bytes())?;
    write_text(&axis, text.as_bytes())?;

    let mut blocks = vec![Block::Table(chosen(&made, &table)), Block::Summary(verdict(&examination))];
    if let (Some(dt), None) = (made.dt, args.dt) {
        let word = format!(
            "No column is a time: {dt} s from row to row is assumed. All that is read from the log depends on it; give it with --dt."
        );
        blocks.push(Block::Warning(word));
    }
    blocks.extend(loaded.warnings.iter().cloned().map(Block::Warning));
    blocks.extend(findings(&examination).into_iter().filter(|b| !matches!(b, Block::Table(_))));
    out!("{}", terminal::blocks(&driven.blocks(blocks), layout(WIDTH)))?;
    out_line!("\n{}: the axis file; look at [signals] and [parameters]", axis.display())?;
    out_line!("{}: the log, drawn", page.display())?;
    let what = format!("{} --axis {}", quoted(&file), quoted(&axis.display().to_string()));
    if examination.refuses() {
        out_line!(
            "first: mend what is told above, in the log or in [signals] of {}; until then no verdict is given",
            axis.display()
        )?;
    } else if rough.is_none() {
        out_line!("first: put the inertia into [parameters], which the log does not tell")?;
    }
    out_line!("next: eixo identify {what}")?;
    out_line!("or:   eixo diagnose {what}")?;
    Ok(ExitCode::SUCCESS)
}

/// A name as a shell takes it.
fn quoted(name: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./,:+".contains(c);
    if name.chars().all(plain) && !name.is_empty() {
        name.to_owned()
    } else {
        format!("'{}'", name.replace('\'', "'\\''"))
    }
}

/// Asks a person, or takes the default.
struct Asker {
    yes: bool,
}

impl Asker {
    fn ask(&mut self, question: &str, offered: &str) -> String {
        if self.yes {
            return offered.to_owned();
        }
        let shown = if offered.is_empty() { "none".to_owned() } else { offered.to_owned() };
        eprint!("{question} [{shown}] ");
        let _ = std::io::stderr().flush();
        let mut answer = String::new();
        match std::io::stdin().lock().read_line(&mut answer) {
            Ok(n) if n > 0 && !answer.trim().is_empty() => answer.trim().to_owned(),
            Ok(0) => {
                // End of input: nothing is asked again.
                self.yes = true;
                eprintln!();
                offered.to_owned()
            }
            _ => offered.to_owned(),
        }
    }

    /// A column by name; none for an empty answer or "none".
    fn column(&mut self, question: &str, offered: Option<&str>, table: &Table) -> Option<String> {
        loop {
            let answer = self.ask(question, offered.unwrap_or_default());
            if answer.is_empty() || answer == "none" || answer == "-" {
                return None;
            }
            if table.position(&answer).is_some() {
                return Some(answer);
            }
            if self.yes {
                return None;
            }
            eprintln!("there is no column {answer:?}; the columns are: {}", table.names());
        }
    }
}

/// The roles of the columns, asking where names and units leave them open.
fn make(table: &Table, args: &Args, asker: &mut Asker) -> anyhow::Result<Made> {
    let mut guesses = guess(table);
    given(table, args, &mut guesses)?;
    let told = |role: Role| args.column.iter().any(|(s, _)| role_of(s).ok() == Some(role));
    for (role, question) in [
        (Role::Signal(Signal::T), "Which column is the torque, force or motor current?"),
        (Role::Signal(Signal::Theta1), "Which column is the position of the motor?"),
    ] {
        let there = guesses.iter().position(|g| g.role == role);
        let table_side = guesses.iter().any(|g| matches!(g.role, Role::Signal(Signal::Theta2 | Signal::X2)));
        if told(role)
            || there.is_some_and(|k| guesses[k].score >= SURE)
            || (role == Role::Signal(Signal::Theta1) && there.is_none() && table_side)
        {
            continue;
        }
        let offered = there.map(|k| guesses[k].column.clone());
        match asker.column(question, offered.as_deref(), table) {
            Some(column) => {
                guesses.retain(|g| g.role != role && g.column != column);
                let unit = crate::trace::guess::suffix(&column).map(|(_, u)| u);
                guesses.push(Guess { role, column, unit, score: SURE });
            }
            None => guesses.retain(|g| g.role != role),
        }
    }
    let has = |s: Signal| guesses.iter().any(|g| g.role == Role::Signal(s));
    anyhow::ensure!(
        has(Signal::T),
        "{}: no column looks like a torque, a force or a current; the columns are: {}. Name it when asked (without --yes), with \
         --column T=..., or write T = \"...\" into [signals] of an axis file{}",
        table.file,
        table.names(),
        unreadable(table)
    );
    anyhow::ensure!(
        has(Signal::Theta1) || has(Signal::Theta2) || has(Signal::X2),
        "{}: no column looks like a position; the columns are: {}. Name it when asked (without --yes), with --column theta1=..., or \
         write theta1 = \"...\" into [signals] of an axis file{}",
        table.file,
        table.names(),
        unreadable(table)
    );
    let quantity =
        |s: Signal| guesses.iter().find(|g| g.role == Role::Signal(s)).and_then(|g| g.unit).map(|u| u.quantity);
    let length = quantity(Signal::Theta1) == Some(Quantity::Length)
        || (!has(Signal::Theta1) && quantity(Signal::Theta2) == Some(Quantity::Length))
        || quantity(Signal::T) == Some(Quantity::Force);
    let motion = if length { Motion::Linear } else { Motion::Rotary };
    // The position of a table in metres, where the motor's is in radians, is x2.
    if motion == Motion::Rotary {
        for g in &mut guesses {
            if g.role == Role::Signal(Signal::Theta2) && g.unit.is_some_and(|u| u.quantity == Quantity::Length) {
                g.role = Role::Signal(Signal::X2);
            }
        }
    }
    // The only position is that of a rigid axis, whose one encoder is called theta1 whatever side it sits on.
    if !guesses.iter().any(|g| matches!(g.role, Role::Signal(Signal::Theta1 | Signal::Omega1 | Signal::X2))) {
        for g in &mut guesses {
            g.role = match g.role {
                Role::Signal(Signal::Theta2) => Role::Signal(Signal::Theta1),
                Role::Signal(Signal::Omega2) => Role::Signal(Signal::Omega1),
                other => other,
            };
        }
    }
    // A column in a unit that its signal cannot have is dropped.
    let fits = |g: &Guess| match (g.role, g.unit) {
        (Role::Signal(s), Some(u)) => {
            let needed = s.quantity(motion);
            u.quantity == needed
                || (u.quantity == Quantity::Drive && matches!(needed, Quantity::Torque | Quantity::Force))
        }
        (Role::Time, Some(u)) => u.quantity == Quantity::Time,
        (_, None) => true,
    };
    guesses.retain(fits);
    if args.dt.is_none() && !guesses.iter().any(|g| g.role == Role::Time) {
        // A column that is called as times are and does not rise is no reason to take any interval: what reads it names the row.
        guesses.extend(crate::trace::guess::time_by_name(table));
    }
    if let Some(time) = guesses.iter_mut().find(|g| g.role == Role::Time && g.unit.is_none()) {
        time.unit = unit_of_time(table, &time.column, asker);
        time.score = if time.unit.is_some() { 0 } else { time.score };
    }
    let mut dt = None;
    if !guesses.iter().any(|g| g.role == Role::Time) {
        let answer = args.dt.map_or_else(
            || asker.ask("No column is a time. What is the sampling interval in seconds?", "0.001"),
            |s| s.to_string(),
        );
        let given = answer.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
        dt = Some(given.with_context(|| format!("the sampling interval is {answer:?}: give seconds, as in 0.001"))?);
    }
    let mut torque_scale = 1.0;
    let torque = guesses.iter().find(|g| g.role == Role::Signal(Signal::T)).context("no torque")?;
    if !torque.unit.is_some_and(|u| matches!(u.quantity, Quantity::Torque | Quantity::Force)) {
        let unit = Signal::T.unit(motion);
        let question =
            format!("{} is no torque by its unit. How many {unit} is one of it (the torque constant)?", torque.column);
        let answer = args.torque_constant.map_or_else(|| asker.ask(&question, "1"), |k| k.to_string());
        let given = answer.parse::<f64>().ok().filter(|v| v.is_finite() && *v != 0.0);
        torque_scale =
            given.with_context(|| format!("the torque constant is {answer:?}: give a number, as in 0.52"))?;
    }
    Ok(Made { guesses, motion, dt, torque_scale })
}

/// The unit of a column of time that names none, where its steps are too long for a drive's log in seconds.
fn unit_of_time(table: &Table, column: &str, asker: &mut Asker) -> Option<&'static Unit> {
    let values = table.column(table.position(column)?).ok()?;
    let first = *values.first()?;
    let step = (values.last()? - first) / (values.len().max(2) - 1) as f64;
    // Stamps of a calendar have units of their own.
    let offered = match step {
        _ if first > 1e8 => return None,
        s if (0.1..50.0).contains(&s) => "ms",
        s if (50.0..5e4).contains(&s) => "us",
        s if (5e4..1e9).contains(&s) => "ns",
        _ => return None,
    };
    let question = format!(
        "The steps of column {column} are {step} and no unit is given: no drive is logged that slowly in s. Which unit is it?"
    );
    Unit::parse(&asker.ask(&question, offered)).filter(|u| u.quantity == Quantity::Time)
}

/// Of columns whose cells are mostly no numbers: the first of them, in words.
fn unreadable(table: &Table) -> String {
    let mut errors = (0..table.headers.len()).filter_map(|k| table.column(k).err());
    errors.next().map_or_else(String::new, |e| format!(". Columns of text are left out: {e}"))
}

/// `NAME=VALUE` as two words.
fn pair(text: &str) -> Result<(String, String), String> {
    let cut = text.split_once('=').map(|(a, b)| (a.trim().to_owned(), b.trim().to_owned()));
    cut.filter(|(a, _)| !a.is_empty()).ok_or_else(|| "give NAME=VALUE".to_owned())
}

/// The role that a name stands for.
fn role_of(name: &str) -> anyhow::Result<Role> {
    if name == "time" {
        return Ok(Role::Time);
    }
    let all = || std::iter::once("time").chain(Signal::ALL.iter().map(|s| s.name()));
    let near = || {
        format!("there is no such signal{}; they are {}", nearest(name, all()), all().collect::<Vec<_>>().join(", "))
    };
    Signal::from_name(name).map(Role::Signal).with_context(|| format!("{name}: {}", near()))
}

/// Replaces guesses by what the user gives.
fn given(table: &Table, args: &Args, guesses: &mut Vec<Guess>) -> anyhow::Result<()> {
    for (name, column) in &args.column {
        let role = role_of(name).context("--column")?;
        guesses.retain(|g| g.role != role && g.column != *column);
        if column.is_empty() {
            continue;
        }
        let at = table.position(column).with_context(|| {
            let near = nearest(column, table.headers.iter().map(|h| h.name.as_str()));
            format!(
                "--column {name}={column}: {} has no such column{near}; its columns are: {}",
                table.file,
                table.names()
            )
        })?;
        let header = &table.headers[at];
        let unit = header
            .unit
            .as_deref()
            .and_then(Unit::parse)
            .or_else(|| crate::trace::guess::suffix(&header.name).map(|(_, u)| u));
        guesses.push(Guess { role, column: header.name.clone(), unit, score: SURE });
    }
    for (name, symbol) in &args.unit {
        let role = role_of(name).context("--unit")?;
        let unit = Unit::parse(symbol)
            .with_context(|| format!("--unit {name}={symbol}: the unit is not known, as rad, deg, N.m, A or ms are"))?;
        let guess = guesses.iter_mut().find(|g| g.role == role);
        let guess =
            guess.with_context(|| format!("--unit {name}: no column is taken for it; name one with --column"))?;
        let own = table.position(&guess.column).and_then(|k| table.headers[k].unit.as_deref()).and_then(Unit::parse);
        anyhow::ensure!(
            own.is_none_or(|u| u == unit),
            "--unit {name}={symbol}: the header says {}; where that is wrong, mend it there",
            own.map_or("", |u| u.symbol)
        );
        guess.unit = Some(unit);
    }
    Ok(())
}

/// Inertias, damping and stiffness as the log has them, roughly; None where they cannot be estimated.
fn rough(trace: &Trace, machine: &Machine, examination: &Examination) -> Option<[f64; 4]> {
    let piece = examination.longest().map(|p| trace.slice(p));
    let found = identify(piece.as_ref().unwrap_or(trace), machine, &Request::default(), "", &mut |_| ()).ok();
    // Estimates that are not earned are those of what the model lacks: a weight, friction.
    let earned = found.as_ref().filter(|f| f.identifiability.identified);
    let best = earned.and_then(|f| Some(&f.methods[f.recommended.as_ref()?.method]));
    let value = |name: &str| {
        let e = best?.parameters.iter().find(|e| e.name == name)?;
        (e.value > 0.0 && e.value.is_finite() && e.std.is_none_or(|s| s < 0.5 * e.value)).then_some(e.value)
    };
    if machine.structure == Structure::Rigid {
        return value("I").or(examination.inertia).map(|i| [i, 0.0, 0.0, 0.0]);
    }
    if let (Some(i1), Some(i2), Some(k)) = (value("I1"), value("I2"), value("K")) {
        return Some([i1, i2, value("B").unwrap_or(0.02 * (k * i2).sqrt()), k]);
    }
    // Where noise rules the coupling, the inertia is still known: half to each side, a coupling that swings at a fiftieth of
    // the sampling rate, 2 % of the critical damping.
    let half = 0.5 * examination.inertia?;
    let w = std::f64::consts::TAU / (50.0 * trace.dt);
    let k = 0.5 * half * w * w;
    Some([half, half, 0.02 * (k * half).sqrt(), k])
}

/// The lead of the screw over 2*pi, m/rad, where the table's position follows the motor's angle: the ratio of their ways.
fn lead(trace: &Trace) -> Option<f64> {
    let (theta, x) = (trace.get(Signal::Theta1)?, trace.get(Signal::X2)?);
    let apart = (theta.len() / 64).max(1);
    let (mut tt, mut tx, mut xx) = (0.0, 0.0, 0.0);
    for k in apart..theta.len() {
        let (a, b) = (theta[k] - theta[k - apart], x[k] - x[k - apart]);
        tt += a * a;
        tx += a * b;
        xx += b * b;
    }
    // Of two that are not proportional nothing is read.
    let rho = tx / tt;
    (rho > 0.0 && rho.is_finite() && tx * tx > 0.5 * tt * xx).then_some(rho)
}

/// Number with four digits, as a person would write it into the file.
fn four(value: f64) -> String {
    let text = format!("{value:.3e}");
    text.parse::<f64>()
        .map_or(text, |v| if (1e-3..1e4).contains(&v.abs()) || v == 0.0 { v.to_string() } else { format!("{v:e}") })
}

/// What is estimated of the axis from the numbers of the log.
#[derive(Default)]
struct Read {
    /// Inertias, damping and stiffness, roughly.
    rough: Option<[f64; 4]>,
    /// The lead of the screw over 2*pi, m/rad.
    rho: Option<f64>,
    /// The log cannot be believed as it is.
    refused: bool,
}

/// The axis file, with comments.
fn write(made: &Made, table: &Table, read: &Read, file: &str) -> String {
    let Read { rough, rho, refused } = *read;
    let mut out = String::new();
    let text = |s: &str| toml::Value::String(s.to_owned()).to_string();
    let plain = |s: &str| s.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
    let stem = Path::new(file).file_stem().map_or_else(|| "axis".to_owned(), |s| plain(&s.to_string_lossy()));
    let folder = Path::new(file).parent().and_then(Path::file_name).map(|s| plain(&s.to_string_lossy()));
    // A log that is called by its date is one of a machine that its folder is called by.
    let name = if stem.chars().any(char::is_alphabetic) { stem } else { folder.unwrap_or(stem) };
    let linear = made.motion == Motion::Linear;
    let [inertia, damping, stiffness, torque] =
        if linear { ["kg", "N.s/m", "N/m", "N"] } else { ["kg.m2", "N.m.s/rad", "N.m/rad", "N.m"] };
    // A current without its torque constant, or a number of the drive, has units of its own.
    let own =
        made.of(Signal::T).filter(|g| made.torque_scale == 1.0 && g.unit.is_none_or(|u| u.quantity == Quantity::Drive));
    let own = own.filter(|g| g.column != Signal::T.name()).map(|g| match g.unit {
        Some(unit) => unit.symbol.to_owned(),
        None if made.counts() => COUNTS.to_owned(),
        None => plain(&g.column),
    });
    let angle = if linear { "m" } else { "rad" };
    let of_own =
        |si: &str, times: &str| own.as_ref().map_or_else(|| si.to_owned(), |own| format!("{own}{times}/{angle}"));
    let (inertia, damping, stiffness) = (of_own(inertia, ".s2"), of_own(damping, ".s"), of_own(stiffness, ""));
    let _ = writeln!(out, "# Made by `eixo init` from {}.", plain(file));
    let _ = writeln!(out, "name = {}", text(&name));
    let [i1, i2, b, k] = rough.unwrap_or([1.0, 1.0, 1.0, 1000.0]);
    let origin = if refused {
        "# Placeholders: the log has a defect that `eixo inspect` names. Put in the values of the data sheet."
    } else if rough.is_some() {
        "# Rough values, read from the log itself: put in those of the data sheet where you have them."
    } else {
        "# Placeholders: the log did not say. Put in the values of the data sheet, or those that `eixo identify` finds."
    };
    if made.is_rigid() {
        let _ =
            writeln!(out, "structure = \"rigid\"               # one encoder: the flexible mode is out of its reach");
        let _ = writeln!(
            out,
            "\n[parameters]\n{origin}\n{:<34} # {inertia}, motor and all that it moves",
            format!("I1 = {}", four(i1))
        );
    } else {
        let _ = writeln!(out, "\n[parameters]\n{origin}");
        let _ = writeln!(out, "{:<34} # {inertia}, motor side", format!("I1 = {}", four(i1)));
        let _ = writeln!(out, "{:<34} # {inertia}, table side", format!("I2 = {}", four(i2)));
        let _ = writeln!(out, "{:<34} # {damping}, damping of the coupling", format!("B = {}", four(b)));
        let _ = writeln!(out, "{:<34} # {stiffness}, stiffness of the coupling", format!("K = {}", four(k)));
    }
    if made.of(Signal::X2).is_some() {
        let _ = match rho {
            Some(rho) => writeln!(
                out,
                "{:<34} # m/rad, the lead of the screw over 2*pi, as the log has it: x2 = rho*theta2",
                format!("rho = {}", four(rho))
            ),
            None => writeln!(
                out,
                "{:<34} # m/rad, the lead of the screw over 2*pi: x2 = rho*theta2. PUT IT IN",
                "rho = 1.0"
            ),
        };
    }
    let _ = writeln!(out, "\n[units]\nmotion = \"{}\"", if linear { "linear" } else { "rotary" });
    let _ = writeln!(out, "\n[signals]                          # column of the log for each signal; \"\" for none");
    match (made.guesses.iter().find(|g| g.role == Role::Time), made.dt) {
        (Some(time), _) => {
            let _ = writeln!(out, "time = {}", entry(time, table, 1.0, &text, ""));
        }
        (None, dt) => {
            let _ = writeln!(out, "{:<34} # s, sampling interval", format!("dt = {}", dt.unwrap_or(1e-3)));
        }
    }
    for signal in Signal::ALL {
        let Some(g) = made.of(signal) else { continue };
        if signal == Signal::Reference {
            let _ = writeln!(
                out,
                "# {} looks like the reference of the drive: with its gains it belongs into [controller].",
                g.column
            );
            continue;
        }
        let scale = if signal == Signal::T { made.torque_scale } else { 1.0 };
        let hold = match signal {
            Signal::T if made.counts() => format!(", unit = \"{COUNTS}\", hold = \"zoh\""),
            Signal::T => ", hold = \"zoh\"".to_owned(),
            _ => String::new(),
        };
        let _ = writeln!(out, "{} = {}", signal.name(), entry(g, table, scale, &text, &hold));
        if signal == Signal::T && g.unit.is_none_or(|u| u.quantity == Quantity::Drive) && scale == 1.0 {
            let unit = match g.unit {
                Some(unit) => unit.symbol.to_owned(),
                None if made.counts() => format!("{COUNTS} (the column {} has no unit)", g.column),
                None => format!("the unit of the column {}", g.column),
            };
            let _ = writeln!(out, "# scale is 1: all inertias and stiffnesses come out in {unit} instead of {torque}.");
        }
    }
    out
}

/// The entry of one column.
fn entry(g: &Guess, table: &Table, scale: f64, text: &dyn Fn(&str) -> String, hold: &str) -> String {
    let in_header = table.position(&g.column).and_then(|k| table.headers[k].unit.as_ref()).is_some();
    let column = text(&g.column);
    let needs_unit = g.unit.filter(|u| !in_header && u.factor != 1.0);
    if needs_unit.is_none() && scale == 1.0 && hold.is_empty() {
        return column;
    }
    let unit = needs_unit.map_or_else(String::new, |u| format!(", unit = {}", text(u.symbol)));
    let scale = if scale == 1.0 { String::new() } else { format!(", scale = {scale}") };
    format!("{{ column = {column}{unit}{scale}{hold} }}")
}

/// The table of what was made of the columns.
fn chosen(made: &Made, table: &Table) -> Shown {
    let mut shown = Shown::new("What the columns are taken for", ["signal", "column", "unit", ""]);
    let mut used = Vec::new();
    for g in &made.guesses {
        let name = match g.role {
            Role::Time => "time",
            Role::Signal(s) => s.name(),
        };
        used.push(g.column.as_str());
        let counts = g.role == Role::Signal(Signal::T) && made.counts();
        let unit = g.unit.map_or(if counts { "not given: counts" } else { "not given: SI" }, |u| u.symbol);
        let sure = if g.score >= SURE { "" } else { "please check" };
        shown.row(vec![Cell::text(name), Cell::text(g.column.as_str()), Cell::text(unit), Cell::text(sure)]);
    }
    for header in table.headers.iter().filter(|h| !used.contains(&h.name.as_str())) {
        shown.row(vec![Cell::text("not used"), Cell::text(header.name.as_str()), Cell::Empty, Cell::Empty]);
    }
    shown
}
