//! Memory, files and threads that stay behind (FMI 2.0.4, sections 2.1.5 and 2.1.8).

use std::time::{Duration, Instant};

use super::super::host::HostError;
use super::measure;
use super::probe::{Probe, Stop, Tested, not_applicable, not_tested};

/// Cycles of a window, and of a slow FMU.
const CYCLES: usize = 10;
const SLOW_CYCLES: usize = 2;
/// Windows that must all grow.
const WINDOWS: usize = 4;
/// Bytes a cycle, and a window, from which a growth counts: the C library's own bookkeeping moves by less.
const GROWTH: i64 = 16;
const WINDOW_GROWTH: i64 = 300;

/// Repeats something until the heap is warm, then measures windows of cycles: bytes per cycle, where every window grows.
fn grows(slow: Duration, mut cycle: impl FnMut() -> Result<(), HostError>) -> Result<Option<i64>, Stop> {
    let mut sizes = Vec::with_capacity(WINDOWS + 1);
    let begin = Instant::now();
    cycle()?;
    cycle()?;
    if begin.elapsed() > 30 * slow {
        return not_tested(format!("a cycle takes {:.1} s", begin.elapsed().as_secs_f64() / 2.0));
    }
    let cycles = if begin.elapsed() > 2 * slow { SLOW_CYCLES } else { CYCLES };
    for _ in 0..cycles {
        cycle()?;
    }
    // Every window must grow.
    let mut each = None;
    for longer in [1, if cycles == CYCLES { 3 } else { 2 }] {
        sizes.clear();
        sizes.push(heap()?);
        for _ in 0..WINDOWS {
            for _ in 0..longer * cycles {
                cycle()?;
            }
            sizes.push(heap()?);
        }
        let least = sizes.windows(2).map(|w| w[1] - w[0]).min().unwrap_or(0);
        each = Some(least / (longer * cycles) as i64).filter(|&each| least >= WINDOW_GROWTH && each >= GROWTH);
        if each.is_none() {
            break;
        }
    }
    Ok(each)
}

fn heap() -> Result<i64, Stop> {
    measure::heap().ok_or_else(|| Stop::NotTested("the C library here does not tell how much memory is in use".into()))
}

/// Bytes an instance from which a leak is large.
const LARGE: i64 = 32 << 10;

/// What making, running and freeing an instance leaves behind: bytes, files, threads.
fn left_behind(p: &Probe) -> Result<(Option<i64>, bool, bool), Stop> {
    let (mut files, mut threads) = (0, 0);
    let mut cycle = 0;
    let growth = grows(Duration::from_millis(15), || {
        let mut instance = p.ready()?;
        p.run(&mut instance, 0, p.steps().min(3))?;
        instance.terminate()?;
        instance.free();
        cycle += 1;
        if cycle == 2 {
            (files, threads) = (measure::open_files(), measure::threads());
        }
        Ok(())
    })?;
    let more = |now: usize, before: usize| now > before && (now - before) * 2 > cycle;
    Ok((growth, more(measure::open_files(), files), more(measure::threads(), threads)))
}

pub(in super::super) fn instance_leak(p: &Probe) -> Tested {
    let (growth, files, threads) = left_behind(p)?;
    let growth = growth.filter(|&bytes| bytes < LARGE && !files && !threads);
    Ok(growth
        .map(|bytes| format!("each instance made, run and freed leaves {bytes} bytes of memory allocated"))
        .into_iter()
        .collect())
}

pub(in super::super) fn instance_leak_large(p: &Probe) -> Tested {
    let (growth, files, threads) = left_behind(p)?;
    let mut problems = Vec::new();
    if let Some(growth) = growth.filter(|&bytes| bytes >= LARGE) {
        problems.push(format!("each instance made, run and freed leaves {growth} bytes of memory allocated"));
    }
    if files {
        problems.push("each instance made, run and freed leaves a file open".into());
    }
    if threads {
        problems.push("each instance made, run and freed leaves a thread running".into());
    }
    Ok(problems)
}

pub(in super::super) fn step_leak(p: &Probe) -> Tested {
    let mut instance = p.ready()?;
    let mut k = 0;
    let growth = grows(Duration::from_millis(15), || {
        for _ in 0..10 {
            instance.do_step(p.time(k), p.step)?;
            k += 1;
        }
        // What the host keeps of the log is no leak of the FMU's.
        drop(instance.take_log());
        Ok(())
    });
    let growth = match growth {
        Err(Stop::Host(error)) => return not_tested(format!("no run is long enough: {error}")),
        other => other?,
    };
    if let Some(bytes) = growth {
        return Ok(vec![format!("each fmi2DoStep leaves {} bytes of memory allocated", bytes / 10)]);
    }
    Ok(step_mapped(p)?.into_iter().collect())
}

/// Memory that steps take from the system itself: what the process has mapped must not grow with every window of steps.
fn step_mapped(p: &Probe) -> Result<Option<String>, Stop> {
    let mut instance = p.ready()?;
    let mut sizes = vec![measure::mapped()];
    for window in 0..WINDOWS {
        for k in 0..CYCLES {
            let k = window * CYCLES + k;
            if instance.do_step(p.time(k), p.step).is_err() {
                return Ok(None);
            }
        }
        drop(instance.take_log());
        sizes.push(measure::mapped());
    }
    let least = sizes.windows(2).map(|w| w[1].saturating_sub(w[0])).min().unwrap_or(0);
    let each = least / CYCLES;
    Ok((each >= 4096).then(|| format!("each fmi2DoStep leaves {each} bytes of memory mapped")))
}

/// Getting, serialising, setting and freeing a state again and again.
pub(in super::super) fn state_leak(p: &Probe) -> Tested {
    if !p.interface().can_get_and_set_state {
        return not_applicable("canGetAndSetFMUstate is false");
    }
    let mut instance = p.ready()?;
    p.run(&mut instance, 0, 2)?;
    let serialises = p.interface().can_serialize_state;
    let growth = grows(Duration::from_millis(15), || {
        for _ in 0..5 {
            let state = instance.get_state()?;
            if serialises {
                let bytes = instance.serialize_state(&state)?;
                let copy = instance.deserialize_state(&bytes)?;
                instance.free_state(copy)?;
            }
            instance.set_state(&state)?;
            instance.free_state(state)?;
        }
        drop(instance.take_log());
        Ok(())
    })?;
    Ok(growth
        .map(|bytes| format!("each state got, set and freed leaves {} bytes of memory allocated", bytes / 5))
        .into_iter()
        .collect())
}
