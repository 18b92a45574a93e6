//! The role and the unit of each column: guessed, given on the command line, or asked for.

use anyhow::Context;

use super::args::Args;
use super::asker::Asker;
use crate::trace::guess::{Guess, Role, SURE, guess};
use crate::trace::{AxisKind, Quantity, Signal, Table, Unit, nearest};

/// What was made of a log.
pub(super) struct Made {
    pub guesses: Vec<Guess>,
    pub motion: AxisKind,
    pub dt: Option<f64>,
    /// From the drive's unit to the torque.
    pub torque_scale: f64,
}

impl Made {
    pub fn of(&self, signal: Signal) -> Option<&Guess> {
        self.guesses.iter().find(|g| g.role == Role::Signal(signal))
    }

    /// Whether the torque is a number of the drive: no unit, no constant, and no name of a torque.
    pub fn counts(&self) -> bool {
        let named = |column: &str| {
            let column = column.to_lowercase();
            column == "t" || ["torque", "force", "moment", "drehm", "kraft"].iter().any(|word| column.contains(word))
        };
        self.of(Signal::T).is_some_and(|g| g.unit.is_none() && self.torque_scale == 1.0 && !named(&g.column))
    }

    pub fn is_rigid(&self) -> bool {
        self.of(Signal::Theta1).is_none() || (self.of(Signal::Theta2).is_none() && self.of(Signal::X2).is_none())
    }
}

/// The roles of the columns, asking where names and units leave them open.
pub(super) fn make(table: &Table, args: &Args, asker: &mut Asker) -> anyhow::Result<Made> {
    let mut guesses = guess(table);
    given(table, args, &mut guesses)?;
    let named = |role: Role| args.column.iter().any(|(s, _)| role_of(s).ok() == Some(role));
    for (role, question) in [
        (Role::Signal(Signal::T), "Which column is the torque, force or motor current?"),
        (Role::Signal(Signal::Theta1), "Which column is the position of the motor?"),
    ] {
        let there = guesses.iter().position(|g| g.role == role);
        let table_side = guesses.iter().any(|g| matches!(g.role, Role::Signal(Signal::Theta2 | Signal::X2)));
        if named(role)
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
    let motion = if length { AxisKind::Linear } else { AxisKind::Rotary };
    // The position of a table in metres, where the motor's is in radians, is x2.
    if motion == AxisKind::Rotary {
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
        let reply = args.dt.map_or_else(
            || asker.ask("No column is a time. What is the sampling interval in seconds?", "0.001"),
            |s| s.to_string(),
        );
        let given = reply.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
        dt = Some(given.with_context(|| format!("the sampling interval is {reply:?}: give seconds, as in 0.001"))?);
    }
    let mut torque_scale = 1.0;
    let torque = guesses.iter().find(|g| g.role == Role::Signal(Signal::T)).context("no torque")?;
    if !torque.unit.is_some_and(|u| matches!(u.quantity, Quantity::Torque | Quantity::Force)) {
        let unit = Signal::T.unit(motion);
        let question =
            format!("{} is no torque by its unit. How many {unit} is one of it (the torque constant)?", torque.column);
        let reply = args.torque_constant.map_or_else(|| asker.ask(&question, "1"), |k| k.to_string());
        let given = reply.parse::<f64>().ok().filter(|v| v.is_finite() && *v != 0.0);
        torque_scale = given.with_context(|| format!("the torque constant is {reply:?}: give a number, as in 0.52"))?;
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
