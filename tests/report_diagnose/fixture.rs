//! A diagnosis as the tests read it: friction of the motor, found.

use eixo::diagnose::location::{
    Appearance, Bin, Dependence, FrequencyPart, PartOf, Shape, Side, Spread, StateCurve, StateVariable, TimeSlot,
};
use eixo::diagnose::{
    AxisParameter, BaseParameter, Cause, ClosureOf, Confusable, Diagnosis, Estimate, Figures, GapReport, HeldOut,
    Hypothesis, Levels, Location, Overlay, Ranked, Remainder, Rounding, RoundingRole, Site, Verdict, Way, Where,
};
use eixo::effects::{Effect, Place};

pub fn figures(before: f64, reidentified: f64, after: f64) -> Figures {
    Figures {
        combined: Levels { before, reidentified, after, noise_floor: 0.008 },
        signals: Vec::new(),
        multiples: [before / 0.008, reidentified / 0.008, after / 0.008],
    }
}

fn way(of: ClosureOf, [before, reidentified, after]: [f64; 3], closure: f64) -> Way {
    let levels = Levels { before, reidentified, after, noise_floor: 0.008 };
    Way { of, levels, closure, closure_of_effect: 0.5 * closure, interval: [closure - 0.003, 1.0] }
}

/// What the friction of the motor leaves.
pub fn shown() -> Location {
    let slot = |k: f64| TimeSlot { start: k, end: k + 1.0, r1: 4e-3, r2: Some(1e-5), at_place: 4e-3 };
    let part = |of: PartOf, share| FrequencyPart {
        residual: Side::Motor,
        of,
        from: 1.0,
        to: 2.0,
        rms: 1e-3,
        share,
        peak: 1.5,
        peak_rms: 1e-3,
    };
    Location {
        site: Site::At(Place::Motor),
        rms: 4e-3,
        looks: looks(),
        by_time: (0..8).map(|k| slot(f64::from(k))).collect(),
        by_frequency: vec![part(PartOf::Odd, 0.8), part(PartOf::Turn(6), 0.1), part(PartOf::Mean, 1e-4)],
        by_state: vec![StateCurve {
            residual: Side::Motor,
            against: StateVariable::Omega1,
            bins: (-5..5)
                .map(|k| Bin { x: f64::from(k), mean: -4e-3 * f64::from(k).signum(), std: 2e-4, count: 100 })
                .collect(),
            explained: 0.93,
        }],
    }
}

pub fn looks() -> Appearance {
    let dependence = Dependence { shape: Shape::Step, against: StateVariable::Omega1, explained: 0.93 };
    Appearance { dependence: Some(dependence), frequency: None, spread: Spread::Throughout }
}

/// Friction at the motor, hidden from the nominal model.
pub fn friction(machine: &str) -> Diagnosis {
    let ranked = |effects: &[Effect], probability, delta_bic, chi2, closure_holdout| Ranked {
        hypothesis: if effects.is_empty() { Hypothesis::NoGap } else { Hypothesis::Effects(effects.to_vec()) },
        site: (!effects.is_empty()).then_some(Site::At(Place::Motor)),
        probability,
        delta_bic,
        chi2,
        closure_holdout,
    };
    let motor = Site::At(Place::Motor);
    Diagnosis {
        machine: machine.into(),
        verdict: Verdict::Effect,
        chosen: Hypothesis::Effects(vec![Effect::CoulombMotor]),
        causes: vec![Cause {
            effect: Effect::CoulombMotor,
            site: motor,
            variant: "",
            probability: 0.9991,
            share_of_gap: 0.97,
            parameters: vec![(0, Estimate { value: 4.003e-3, std: Some(1.3e-5), unit: "N.m" })],
        }],
        ranking: vec![
            ranked(&[Effect::CoulombMotor], 0.9991, 0.0, 1.004, 0.991),
            ranked(&[Effect::PreslidingMotor], 8e-4, 14.2, 1.006, 0.9905),
            ranked(&[Effect::TorqueRipple, Effect::Backlash], 0.0, 41_322.0, 17.0, 0.21),
            ranked(&[], 0.0, 160_322.0, 145.0, 0.0),
        ],
        confusable: vec![Confusable { named: Effect::CoulombMotor, other: Effect::PreslidingMotor, difference: 7.1 }],
        undecided: None,
        location: Where {
            site: Some(motor),
            shares: vec![
                (Site::At(Place::Input), 0.004),
                (motor, 0.913),
                (Site::At(Place::Coupling), 0.051),
                (Site::At(Place::Table), 0.03),
                (Site::At(Place::Sensor), 0.002),
            ],
            shown: shown(),
        },
        remainder: Remainder { torque_rms: 1e-5, share: 1e-3, noise_multiple: 1.0, site: motor, looks: looks() },
        gap: GapReport {
            closure_of: ClosureOf::Windows,
            ways: [
                way(ClosureOf::FreeRun, [3.1, 2.2, 1.9], 0.62),
                way(ClosureOf::Windows, [0.184, 0.097, 0.0084], 0.991),
                way(ClosureOf::Torque, [0.31, 0.12, 0.009], 0.998),
            ],
            train: figures(0.182, 0.094, 0.0081),
            holdout: figures(0.184, 0.097, 0.0084),
            closure: 0.991,
            closure_of_effect: 0.979,
            interval: [0.988, 0.993],
            holdout_is: HeldOut::SecondRecord,
        },
        parameters: vec![AxisParameter {
            parameter: BaseParameter::I1,
            nominal: 2.3e-4,
            reidentified: 2.5e-4,
            fitted: Estimate { value: 2.3701e-4, std: Some(1.2e-7), unit: "kg.m2" },
        }],
        rounding: Some(Rounding { step: 1e-3, channels: vec!["theta1"], role: RoundingRole::Noise }),
        cut_short: false,
        motion_is_given: false,
        closed_loop: None,
    }
}

/// The held-out signal and the models' runs over it.
pub fn overlay() -> Overlay {
    let x: Vec<f64> = (0..400).map(|k| f64::from(k) * 1e-3).collect();
    let wave = |gain: f64| -> Vec<f64> {
        x.iter().enumerate().map(|(k, t)| if k == 200 { f64::NAN } else { gain * (20.0 * t).sin() }).collect()
    };
    Overlay {
        channel: "theta1",
        measured: wave(1.0),
        before: wave(0.8),
        after: wave(1.0),
        noise: 1e-3,
        time: x.clone(),
    }
}
