//! What an effect of given parameters does along a known motion: extra torques, or a change of the readings.

use super::model::Model;
use super::record::Record;
use super::response::{Column, Responder, States, Torques};
use crate::axis::Structure;
use crate::effects::{
    ActiveEffects, Base, Effect, MEMORY, Modes, Motion, Place, Ramp, Reading, Settings, Slip, StepMotion, TorqueHistory,
};

/// The regression's column of one effect as set in `settings` (every other effect off).
#[must_use]
pub fn column(
    effect: Effect,
    settings: &Settings,
    model: &Model,
    record: &Record,
    states: &States,
    responder: &Responder<'_>,
) -> Column {
    let on = settings.active_with(&[effect]);
    if effect.is_input() {
        responder.torques(&input_torques(settings, &on, record))
    } else if effect.is_sensor() {
        let change = sensor_change(settings, &on, record, states);
        responder.readings(|k| change[k])
    } else {
        responder.torques(&force_torques(effect, settings, &on, model, record, states))
    }
}

/// The columns of a flexible mode that was already swinging when the record began: its free decay from a unit twist
/// and from a unit rate.
#[must_use]
pub fn free_decay(settings: &Settings, record: &Record, responder: &Responder<'_>) -> Vec<Column> {
    let on = settings.active_with(&[Effect::FlexibleMode]);
    [[1.0, 0.0], [0.0, 1.0]]
        .into_iter()
        .map(|[twist, rate]| {
            let mut memory = [0.0; MEMORY];
            settings.set_mode(&mut memory, twist, rate);
            let still = [Motion::default(); 3];
            let at: Vec<[f64; 2]> = (0..record.len())
                .map(|k| {
                    let h = if k == 0 { 0.0 } else { record.dt };
                    let step =
                        StepMotion { start: still, end: still, time: record.time(k), h, modes: Modes::default() };
                    let forces = settings.forces_along(&on, &Base { k: 0.0, b: 0.0, rigid: true }, &step, &mut memory);
                    [-forces.torque[0], -forces.torque[1]]
                })
                .collect();
            responder.torques(&ramps(&at))
        })
        .collect()
}

fn input_torques(settings: &Settings, on: &ActiveEffects, record: &Record) -> Torques {
    let mut history = TorqueHistory::settled(record.torque.first().copied().unwrap_or_default());
    (0..record.len())
        .map(|k| {
            let given: Ramp<f64> = record.hold.ramp(&record.torque, k);
            let got = settings.transform_input(on, given, record.dt, &mut history);
            [Ramp { start: got.start - given.start, end: got.end - given.end }, Ramp::default()]
        })
        .collect()
}

fn sensor_change(settings: &Settings, on: &ActiveEffects, record: &Record, states: &States) -> Vec<[f64; 4]> {
    let reading = |k: usize| {
        let [theta1, omega1, theta2, omega2] = states.motion[k];
        Reading { theta1, omega1, theta2, omega2 }
    };
    let mut history = settings.settle_sensors(on, reading(0), record.dt);
    (0..record.len())
        .map(|k| {
            if k > 0 {
                settings.push_sensors(on, &mut history, reading(k));
            }
            let got = settings.transform_sensor(on, &history, record.dt);
            let was = reading(k);
            [got.theta1 - was.theta1, got.omega1 - was.omega1, got.theta2 - was.theta2, got.omega2 - was.omega2]
        })
        .collect()
}

/// Motion of motor, table and twist at a sample.
fn motions(states: &States, k: usize) -> [Motion<f64>; 3] {
    let [theta1, omega1, theta2, omega2] = states.motion[k];
    [
        Motion { x: theta1, v: omega1 },
        Motion { x: theta2, v: omega2 },
        Motion { x: theta1 - theta2, v: omega1 - omega2 },
    ]
}

fn force_torques(
    effect: Effect,
    settings: &Settings,
    on: &ActiveEffects,
    model: &Model,
    record: &Record,
    states: &States,
) -> Torques {
    let base = match model.structure {
        Structure::TwoInertia => Base { k: model.parameters.k, b: model.parameters.b, rigid: false },
        Structure::Rigid => Base { k: 0.0, b: 0.0, rigid: true },
    };
    let mut memory = [0.0; MEMORY];
    let place = effect.info().place;
    let at: Vec<[f64; 2]> = (0..record.len())
        .map(|k| {
            let time = record.time(k);
            let end = motions(states, k);
            if effect.is_dry() {
                let coordinate = usize::from(place == Place::Table);
                let v = end[coordinate].v;
                let direction = v.signum();
                let instant = StepMotion { start: end, end, time, h: 0.0, modes: Modes::default() };
                let load = model.effects.transmitted(&model.effects.active(), &base, &instant).torque[0].abs();
                let slip = Slip { direction, speed: v.abs(), position: end[coordinate].x, load, time };
                let level = settings.dry_level(on, place, &slip);
                let mut torque = [0.0; 2];
                torque[coordinate] = -level * direction;
                return torque;
            }
            let start = motions(states, k.saturating_sub(1));
            let contact = contact(&base, settings.of(Effect::Backlash)[0], &end[2]);
            let step = StepMotion {
                start,
                end,
                time,
                h: if k == 0 { 0.0 } else { record.dt },
                modes: Modes { contact, ..Modes::default() },
            };
            let forces = settings.forces_along(on, &base, &step, &mut memory);
            [-forces.torque[0], -forces.torque[1]]
        })
        .collect();
    ramps(&at)
}

/// Torques known at the samples, straight lines between.
#[must_use]
pub fn ramps(at: &[[f64; 2]]) -> Torques {
    (0..at.len())
        .map(|k| {
            let next = at.get(k + 1).unwrap_or(&at[k]);
            [Ramp { start: at[k][0], end: next[0] }, Ramp { start: at[k][1], end: next[1] }]
        })
        .collect()
}

/// The side on which a gap is in contact and pushes.
fn contact(base: &Base<f64>, gap: f64, twist: &Motion<f64>) -> i8 {
    let side = twist.x.signum();
    let beyond = twist.x * side - gap;
    let pushes = base.k * beyond + base.b * twist.v * side > 0.0;
    if beyond > 0.0 && pushes { side as i8 } else { 0 }
}
