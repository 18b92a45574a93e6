//! Each channel by itself, and what the others do meanwhile: constant, stuck, clipped, jumps, spikes, held samples, counters
//! that wrapped.

use std::fmt::Write;
use std::ops::Range;

use rayon::prelude::*;

use super::ceiling::{self, AppliedTorque};
use super::finding::{Finding, Severity};
use super::robust::{self, quantile, span, step};
use super::{Channel, Input};
use crate::numerics::level::{deviation, rms};

/// Least samples of a stretch that counts as stuck.
const STUCK: usize = 20;
/// Deceleration at the begin or end of a constant stretch, over the 99.9th percentile of the record, from which the sensor stopped and not the
/// axis.
const ABRUPT: f64 = 3.0;
/// Step from sample to sample, over the 98th percentile of the record, from which it is a jump where the steps beside it are small.
const JUMP: f64 = 8.0;
/// Share of samples that repeat the one before, from which a channel may be written by a slower loop.
const HELD: f64 = 0.3;
/// Share of the samples at the ends of the range above which a torque is at its limit most of the time.
const MOSTLY: f64 = 0.5;

/// Looks at every channel. Gives the stretches of samples that are not usable.
pub(super) fn examine(input: &Input<'_>, findings: &mut Vec<Finding>) -> Vec<Range<usize>> {
    let channels: Vec<Channel<'_>> = input.channels().collect();
    let of_each: Vec<_> = channels.into_par_iter().map(|channel| one(input, channel)).collect();
    let (found, bad): (Vec<_>, Vec<_>) = of_each.into_iter().unzip();
    findings.extend(found.into_iter().flatten());
    bad.concat()
}

/// The findings on one channel, and its stretches of samples that are not usable.
fn one(input: &Input<'_>, channel: Channel<'_>) -> (Vec<Finding>, Vec<Range<usize>>) {
    let (mut findings, mut bad) = (Vec::new(), Vec::new());
    let n = input.len();
    if span(channel.values) <= 1e-12 * channel.values[0].abs() {
        return (vec![constant(channel)], bad);
    }
    let position = channel.name.starts_with("theta");
    if position || channel.name == "T" {
        bad.extend(jumps(input, channel, &mut findings));
    }
    let stuck = if channel.name == "T" { stuck_torque(input, channel) } else { stuck_motion(input, channel) };
    // A drive that is off logs no torque at all, and the axis may swing on: what is left of the record is sound.
    let is_off = |r: &Range<usize>| channel.name == "T" && channel.values[r.clone()].iter().all(|v| v.abs() == 0.0);
    let (off, stuck): (Vec<_>, Vec<_>) = stuck.into_iter().partition(is_off);
    for (ranges, id, severity, seen, means, way_out) in [
        (
            off,
            "drive_off",
            Severity::Warn,
            "is zero",
            "The drive is off and the axis moves on by itself, or the channel is dead there.",
            "These stretches are left out.",
        ),
        (
            stuck,
            "stuck",
            Severity::Refuse,
            "keeps one value",
            "The sensor, its cable or the logger stopped; the axis did not.",
            "Use a part without these stretches (--from, --to), or leave the column out of [signals].",
        ),
    ] {
        if ranges.is_empty() {
            continue;
        }
        let total: usize = ranges.iter().map(Range::len).sum();
        let share = 100.0 * total as f64 / n as f64;
        let seen =
            format!("{} {seen} for {total} samples ({share:.1} % of the record) while the axis moves.", channel.name);
        findings.push(Finding::new(id, severity, channel.name, seen, means, way_out).at(input, ranges.clone()));
        bad.extend(ranges);
    }
    held(channel, &mut findings);
    clipped(input, channel, &mut findings);
    (findings, bad)
}

fn constant(channel: Channel<'_>) -> Finding {
    let value = channel.values[0];
    let (means, remedy) = if channel.name == "T" {
        (
            "A torque that never changes excites nothing: no parameter can be read from this record.",
            "Log the drive's torque or current command while it moves the axis, or map another column in [signals].",
        )
    } else {
        (
            "The sensor is dead, not connected, or the column is another one than it is taken for.",
            "Leave the column out of [signals] of the axis file, or map the right one.",
        )
    };
    let name = channel.name;
    Finding::new("constant", Severity::Refuse, name, format!("{name} is {value:e} in every sample."), means, remedy)
}

/// Stretches of at least `least` samples with one value.
fn flat(values: &[f64], least: usize) -> Vec<Range<usize>> {
    let mut out = Vec::new();
    let mut start = 0;
    for k in 1..=values.len() {
        if k == values.len() || values[k] != values[start] {
            if k - start >= least {
                out.push(start..k);
            }
            start = k;
        }
    }
    out
}

/// Stretches where an angle or a speed is constant although the axis is not at rest.
fn stuck_motion(input: &Input<'_>, channel: Channel<'_>) -> Vec<Range<usize>> {
    let x = channel.values;
    let n = x.len();
    let runs = flat(x, STUCK);
    if runs.is_empty() {
        return runs;
    }
    let position = channel.name.starts_with("theta");
    let d = |k: usize| if k + 1 < n { x[k + 1] - x[k] } else { 0.0 };
    let inside = |k: usize| runs.iter().any(|r| r.start <= k + 2 && k < r.end + 1);
    let moving: Vec<usize> = (0..n.saturating_sub(2)).step_by((n / 200_000).max(1)).filter(|k| !inside(*k)).collect();
    if moving.len() < 16 {
        return Vec::new();
    }
    let braking = quantile(moving.iter().map(|k| d(k + 1) - d(*k)), 0.999).max(step(x));
    let usual = quantile(moving.iter().map(|k| d(*k)), 0.5);
    // The other channels of the same motion.
    let others: Vec<(&[f64], f64)> = input
        .channels()
        .filter(|c| c.name != channel.name && c.name != "T" && span(c.values) > 0.0)
        .map(|c| (c.values, deviation(c.values)))
        .collect();
    let same_side = |name: &str| name.ends_with('1') == channel.name.ends_with('1');
    let twin = input.channels().find(|c| c.name != channel.name && c.name != "T" && same_side(c.name));
    runs.into_iter()
        .filter(|r| {
            let by_twin = twin.is_some_and(|c| {
                moves(c, r, input.dt, position, &Stuck { value: x[r.start], step: step(x), size: deviation(x) })
            });
            let by_other = others.iter().any(|(v, size)| {
                let part = &v[r.clone()];
                r.len() >= 2 * STUCK && deviation(part) > 0.5 * size && flat(part, part.len() / 4).is_empty()
            });
            // A position that moves at full speed up to one sample and is constant from the next on.
            let before = if r.start >= 2 {
                d(r.start - 2).abs().min(d(r.start - 1).abs().max(d(r.start - 2).abs()))
            } else {
                0.0
            };
            let after = if r.end < n { d(r.end - 1).abs() } else { 0.0 };
            let abrupt = position && before.max(after) > ABRUPT * braking && before.max(after) > usual;
            by_twin || by_other || abrupt
        })
        .collect()
}

/// A channel in a constant stretch, in its unit: the value, its quantisation step, its standard deviation over the record.
struct Stuck {
    value: f64,
    step: f64,
    size: f64,
}

/// Whether the other channel of the same side (motor or table) moves during a stretch by much more than the constant one's quantisation step;
/// `dt` in s.
fn moves(other: Channel<'_>, stretch: &Range<usize>, dt: f64, stuck_is_position: bool, stuck: &Stuck) -> bool {
    let &Stuck { value, step, size } = stuck;
    let part = &other.values[stretch.clone()];
    if stuck_is_position {
        // The distance is the integral of the speed.
        let way = part.iter().scan(0.0, |sum, v| {
            *sum += v * dt;
            Some(*sum)
        });
        let way: Vec<f64> = way.collect();
        rms(part) > 0.3 * rms(other.values) && span(&way) > 20.0 * step
    } else {
        // A constant speed while the position moves at another one: mean speeds over sixteenths of the stretch.
        let length = (part.len() / 16).max(4);
        let speeds: Vec<f64> =
            part.chunks_exact(length).map(|c| (c[c.len() - 1] - c[0]) / ((c.len() - 1) as f64 * dt)).collect();
        let off: Vec<f64> = speeds.iter().map(|v| v - value).collect();
        let coarse = 4.0 * robust::step(other.values) / ((length - 1) as f64 * dt);
        rms(&off) > (0.3 * size).max(coarse)
    }
}

/// Stretches where the torque is constant within its range although the motion continues as elsewhere.
fn stuck_torque(input: &Input<'_>, channel: Channel<'_>) -> Vec<Range<usize>> {
    let x = channel.values;
    let n = x.len();
    let repeats = x.windows(2).filter(|w| w[0] == w[1]).count() as f64 / n as f64;
    let runs = flat(x, (n / 50).max(2 * STUCK));
    let long: usize = runs.iter().map(Range::len).sum();
    // A torque of steps is constant in stretches by nature.
    if runs.is_empty() || repeats - long as f64 / n as f64 > 0.2 {
        return Vec::new();
    }
    let (low, high) = x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    let Some(motion) = input.channels().find(|c| c.name != "T" && span(c.values) > 0.0) else { return Vec::new() };
    let speed: Vec<f64> = if motion.name.starts_with("theta") {
        // Over several samples, so that a slow motion exceeds the encoder's noise.
        let apart = STUCK / 2;
        motion.values.windows(apart + 1).map(|w| w[apart] - w[0]).collect()
    } else {
        motion.values.to_vec()
    };
    let usual = deviation(&speed);
    runs.into_iter()
        .filter(|r| x[r.start] > low && x[r.start] < high)
        .filter(|r| {
            let late = r.start + r.len() / 2..r.end.min(speed.len());
            late.len() >= STUCK && deviation(&speed[late]) > 0.5 * usual
        })
        .collect()
}

/// Jumps, spikes and wrapped counters of a position, spikes of a torque; gives the samples of the jumps.
fn jumps(input: &Input<'_>, channel: Channel<'_>, findings: &mut Vec<Finding>) -> Vec<Range<usize>> {
    let x = channel.values;
    let n = x.len();
    let d = |k: usize| x[k + 1] - x[k];
    let usual = quantile((0..n - 1).map(d), 0.98).max(3.0 * step(x));
    let mut isolated: Vec<(usize, f64)> = Vec::new();
    let mut spikes = Vec::new();
    for k in 2..n.saturating_sub(4) {
        let size = d(k);
        if size.abs() <= JUMP * usual {
            continue;
        }
        // The steps beside it are small: neither a fast motion nor the return from a spike.
        let near = [k - 2, k - 1, k + 1, k + 2].map(|i| d(i).abs()).into_iter().fold(0.0, f64::max);
        if near < 0.4 * size.abs() && channel.name != "T" {
            isolated.push((k + 1, size));
        } else if near >= 0.4 * size.abs() && (d(k + 1) + size).abs() < 0.4 * size.abs() {
            spikes.push(k + 1..k + 2);
        }
    }
    let unit = super::AxisKind::unit(input.motion, "rad");
    if !spikes.is_empty() {
        findings.push(
            Finding::new(
                "spikes",
                Severity::Warn,
                channel.name,
                format!("{} has {} samples far off their neighbours.", channel.name, spikes.len()),
                if channel.name == "T" {
                    "Lost bits of a bus or a disturbed cable; the axis did not feel them, and a model that does is off."
                } else {
                    "Lost bits of a bus or a disturbed cable; each reads as a blow to the axis."
                },
                "Screen the cable; a fit weighs them like any sample, so use a part without them where there are many.",
            )
            .at(input, spikes),
        );
    }
    if isolated.is_empty() {
        return Vec::new();
    }
    let sizes: Vec<f64> = isolated.iter().map(|(_, s)| s.abs()).collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let alike = isolated.len() >= 2 && sizes.iter().all(|s| *s > 0.9 * largest);
    let at: Vec<Range<usize>> = isolated.iter().map(|(k, _)| *k..*k + 1).collect();
    let first = isolated[0];
    let finding = if alike {
        Finding::new(
            "wrapped",
            Severity::Refuse,
            channel.name,
            format!("{} jumps {} times by {largest:.6} {unit}.", channel.name, isolated.len()),
            "A counter of limited width, or an angle within one turn, that starts anew.",
            "Unwrap the column, or log the position that counts turns.",
        )
    } else {
        Finding::new(
            "jump",
            Severity::Refuse,
            channel.name,
            format!(
                "{} jumps by {:.6} {unit} at {:.6} s{}.",
                channel.name,
                first.1,
                input.time(first.0),
                if isolated.len() > 1 { format!(", and {} times more", isolated.len() - 1) } else { String::new() }
            ),
            "Counts were lost or the zero was set anew: no torque moved the axis there.",
            "Use the part before or after (--from, --to).",
        )
    };
    findings.push(finding.at(input, at.clone()));
    at
}

/// Channels that a slower loop writes: most samples repeat the one before, while the record goes on.
fn held(channel: Channel<'_>, findings: &mut Vec<Finding>) {
    let x = channel.values;
    let n = x.len();
    let changes: Vec<usize> = (1..n).filter(|k| x[*k] != x[k - 1]).collect();
    let repeats = 1.0 - changes.len() as f64 / (n - 1) as f64;
    if changes.len() < 16 || repeats < HELD {
        return;
    }
    // A slow motion repeats values because of the quantisation and then changes by one step; a held channel changes by many.
    let size = quantile(changes.iter().map(|k| x[*k] - x[k - 1]), 0.5);
    let steps = size / step(x);
    let gaps: Vec<f64> = changes.windows(2).map(|w| (w[1] - w[0]) as f64).collect();
    let usual = quantile(gaps.iter().copied(), 0.5);
    let regular = gaps.iter().filter(|g| (**g - usual).abs() < 0.5).count() as f64 / gaps.len() as f64;
    if usual >= 2.0 && regular > 0.8 && steps > 3.0 {
        findings.push(Finding::new(
            "held",
            Severity::Warn,
            channel.name,
            format!("{} changes only every {usual:.0} samples.", channel.name),
            "It was sampled more slowly than the record: on average it is late by half as much.",
            "Log all channels at one rate, or keep every so many-th row.",
        ));
    }
}

/// Torques and speeds that are at an end of their range in several stretches.
fn clipped(input: &Input<'_>, channel: Channel<'_>, findings: &mut Vec<Finding>) {
    let x = channel.values;
    if !(channel.name == "T" || channel.name.starts_with("omega")) {
        return;
    }
    let mut at_end = ceiling::limited_stretches(x);
    if at_end.is_empty() {
        return;
    }
    let count: usize = at_end.iter().map(Range::len).sum();
    let share = count as f64 / x.len() as f64;
    let mut seen = format!(
        "{} stands at its largest or smallest value for {count} samples ({:.1} % of the record).",
        channel.name,
        100.0 * share
    );
    let limit = "A model of the machine needs that limit: see `eixo effects saturation`.";
    let (severity, means, remedy) = if channel.name == "T" {
        match ceiling::applied_torque(input, x) {
            AppliedTorque::Larger(share) => {
                let _ = write!(seen, " The axis moves there as under {:.1} % more.", 100.0 * share);
                (
                    Severity::Refuse,
                    "The log holds no more than that, the drive gave more: its column or converter is at the end of its range.",
                    "Widen the range of the column in the logger, or record a motion that needs less torque.",
                )
            }
            AppliedTorque::AsLogged => (Severity::Note, "The drive's limit is reached.", limit),
            AppliedTorque::Unknown if share > MOSTLY => (
                Severity::Warn,
                "The drive's limit is reached, or that of the log, most of the time: what more was asked for, or given, this record does not tell.",
                "Record a motion that needs less torque, or widen the range of the column in the logger; where it is the drive that gives no \
                 more, a model of the machine needs that limit: see `eixo effects saturation`.",
            ),
            AppliedTorque::Unknown => (
                Severity::Note,
                "The drive's limit is reached, or that of the log: which of the two, this record does not tell.",
                limit,
            ),
        }
    } else {
        (
            Severity::Warn,
            "The sensor or its converter reached the end of its range; the speed went on.",
            "Widen its range, or leave the column out of [signals].",
        )
    };
    at_end.sort_by_key(|r| r.start);
    findings.push(Finding::new("clipped", severity, channel.name, seen, means, remedy).at(input, at_end));
}
