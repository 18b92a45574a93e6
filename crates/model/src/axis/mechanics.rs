//! The axis and its effects over one kind of numbers: laws at an instant, and what a step of some length does.

use super::axis_model::State;
use super::oscillator::Scheme;
use super::parameters::{Parameters, Structure};
use super::propagator::{Compliance, Linear, Propagator};
use crate::effects::{ActiveEffects, Base, Effect, Internal, Kinematics, Place, Settings, Slip, StepMotion};
use crate::scalar::Scalar;

const PLACES: [Place; 2] = [Place::Motor, Place::Table];

/// Everything about the axis that does not change from step to step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mechanics<S> {
    pub parameters: Parameters<S>,
    pub structure: Structure,
    pub scheme: Scheme,
    pub effects: Settings<S>,
    pub on: ActiveEffects,
    pub base: Base<S>,
    /// The only effect on the motion, where there is no other and it does not grow with the torque transmitted.
    pub single_law: Option<Effect>,
    /// Whether dry friction acts on motor and table.
    pub dry: [bool; 2],
    /// Half of the coupling's play, rad; zero without one.
    half_play: S,
    /// Whether the coupling has play.
    pub backlash: bool,
    /// The step that nothing ends early.
    pub whole: Length<S>,
}

/// What a step of one length does to the linear axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Length<S> {
    pub step: Propagator<S>,
    /// Prepared for the step that nothing ends early.
    pub compliance: Option<Compliance>,
    /// What one N.m less of the single law's torque at the end of the step adds to the state there, rad and rad/s.
    pub response: Linear<S>,
}

impl<S: Scalar> Mechanics<S> {
    pub fn new(
        parameters: Parameters<S>,
        structure: Structure,
        effects: Settings<S>,
        on: ActiveEffects,
        scheme: Scheme,
        h: f64,
    ) -> Self {
        let base = base(&parameters, structure);
        let dry = PLACES.map(|place| on.dry().iter().any(|e| e.info().place == place));
        let half_play = on.forces().iter().find_map(|e| Some(effects.of(*e)[e.play_parameter()?])).unwrap_or_default();
        let backlash = half_play.re() > 0.0;
        let single_law = match (on.forces(), on.dry()) {
            (&[one], []) | ([], &[one]) => Some(one),
            _ => None,
        };
        // A friction that grows with the transmitted torque depends on the motion of both inertias.
        let single_law = single_law.filter(|&one| base.rigid || !effects.is_loaded(one));
        let step = Propagator::new(&parameters, structure, scheme, h.into());
        let whole = Length { compliance: Some(step.compliance()), ..Length::new(step, single_law) };
        Self { parameters, structure, scheme, effects, on, base, single_law, dry, half_play, backlash, whole }
    }

    /// A step of that length.
    pub fn length(&self, h: S) -> Length<S> {
        Length::new(self.whole.step.of_length(h), self.single_law)
    }

    /// The same without derivatives.
    pub fn primal(&self) -> Mechanics<f64> {
        let h = self.whole.step.h().re();
        Mechanics::new(self.parameters.primal(), self.structure, self.effects.primal(), self.on, self.scheme, h)
    }

    /// Level up to which dry friction holds inertia `i` of a state against a push that way under a `load`, N.m.
    pub fn rest_level(&self, i: usize, direction: f64, s: &State<S>, load: S, time: f64) -> S {
        let position = Kinematics::of(&s.linear, PLACES[i].coordinate()).x;
        let slip = Slip { direction, speed: S::default(), position, load, time };
        self.effects.dry_level(&self.on, PLACES[i], &slip)
    }

    /// The torque transmitted at a state, as an absolute value, N.m; zero where nothing grows with it.
    pub fn load(&self, s: &State<S>, time: f64) -> S {
        if !self.effects.counts_load(&self.on) {
            return S::default();
        }
        self.effects.transmitted(&self.on, &self.base, &self.instant(s, time)).torque[0].abs()
    }

    /// A step of no length.
    fn instant(&self, s: &State<S>, time: f64) -> StepMotion<S> {
        StepMotion { start: s.linear, end: s.linear, time, h: S::default(), modes: s.modes }
    }

    /// Which inertias dry friction holds at rest.
    pub fn sticks(&self, s: &State<S>) -> [bool; 2] {
        let [motor, table] = s.modes.dry;
        [motor == 0 && self.dry[0], table == 0 && self.dry[1]]
    }

    /// Whether a step may end early: something that sticks or opens.
    pub fn has_events(&self) -> bool {
        self.dry != [false, false] || self.backlash
    }

    /// Contact torque of a side, N.m: positive while it pushes.
    pub fn pressure(&self, side: i8, s: &State<S>) -> S {
        let side = f64::from(side);
        ((s.linear[2] - self.half_play * side) * self.base.k + s.linear[3] * self.base.b) * side
    }

    /// Distance of a side from contact, rad: negative where the twist is beyond the gap's end and the contact would not
    /// pull. A contact that has opened while compressed closes again only when both conditions hold.
    pub fn clearance(&self, side: i8, s: &State<S>) -> S {
        let gap = self.half_play - s.linear[2] * f64::from(side);
        let pull = -(self.pressure(side, s) / self.base.k);
        if pull.re() > gap.re() { pull } else { gap }
    }

    /// Sets the side of contact by the twist: the end of the gap that the twist is beyond, if the contact pushes there.
    pub fn set_contact(&self, s: &mut State<S>) {
        if self.backlash {
            let side = s.linear[2].re().signum() as i8;
            s.modes.contact = if self.clearance(side, s).re() < 0.0 { side } else { 0 };
        }
    }

    /// Recomputes the effects' torques at the state, as its modes are.
    pub fn refresh_force(&self, s: &mut State<S>, time: f64) {
        let mut memory = s.memory.map(Internal::at);
        s.force = self.effects.forces(&self.on, &self.base, &self.instant(s, time), &mut memory).torque;
        for i in (0..2).filter(|i| s.modes.dry[*i] != 0 && self.dry[*i]) {
            s.friction[i] = S::default();
        }
    }
}

/// What effects must know of the axis.
pub(super) fn base<S: Scalar>(parameters: &Parameters<S>, structure: Structure) -> Base<S> {
    match structure {
        Structure::TwoInertia => Base { k: parameters.k, b: parameters.b, rigid: false },
        // A rigid axis has no coupling for an effect to act on.
        Structure::Rigid => Base { k: S::default(), b: S::default(), rigid: true },
    }
}

impl<S: Scalar> Length<S> {
    fn new(step: Propagator<S>, single_law: Option<Effect>) -> Self {
        let still = [S::default(); 4];
        let push = single_law.map_or([0.0; 2], |effect| effect.info().place.coordinate().push());
        let response = step.less(&still, push.map(S::from)).map(|x| -x);
        Self { step, compliance: None, response }
    }
}
