//! The law of an effect on the motion as the step solves for it: one torque along one coordinate, whatever the shape.

use std::marker::PhantomData;

use super::shapes::{Base, Coordinate, DryFriction, Force, Internal, Moment, Reaction, Slip};
use crate::scalar::Scalar;

/// A torque along the coordinate of its effect.
pub trait Law {
    /// What it sees and acts on.
    const COORDINATE: Coordinate;
    /// Number of internal states.
    const MEMORY: usize;
    /// Whether it may depend on the torque transmitted.
    const LOADED: bool = false;

    /// The torque at the end of the step and its tangent; it sets the end of the internal states, with their tangents.
    fn react<S: Scalar>(p: &[S], base: &Base<S>, moment: &Moment<S>, memory: &mut [Internal<S>]) -> Reaction<S>;
}

/// An operation on the law of an effect, compiled for each law.
pub trait WithLaw {
    /// Its result.
    type Output;

    /// Runs it for the law `L`.
    fn with<L: Law>(self) -> Self::Output;
}

/// No torque: of an effect that does not act on the motion.
pub(super) struct Absent;

impl Law for Absent {
    const COORDINATE: Coordinate = Coordinate::Motor;
    const MEMORY: usize = 0;

    fn react<S: Scalar>(_p: &[S], _base: &Base<S>, _moment: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        Reaction::given(S::default())
    }
}

/// A force from the motion.
pub(super) struct Forced<F>(PhantomData<F>);

impl<F: Force> Law for Forced<F> {
    const COORDINATE: Coordinate = F::INFO.place.coordinate();
    const MEMORY: usize = F::INFO.memory;

    #[inline]
    fn react<S: Scalar>(p: &[S], base: &Base<S>, moment: &Moment<S>, memory: &mut [Internal<S>]) -> Reaction<S> {
        F::torque(p, base, moment, memory)
    }
}

/// Dry friction while it slides.
pub(super) struct Sliding<D>(PhantomData<D>);

impl<D: DryFriction> Law for Sliding<D> {
    const COORDINATE: Coordinate = D::INFO.place.coordinate();
    const MEMORY: usize = D::INFO.memory;
    const LOADED: bool = D::LOAD.is_some();

    #[inline]
    fn react<S: Scalar>(p: &[S], _base: &Base<S>, moment: &Moment<S>, _memory: &mut [Internal<S>]) -> Reaction<S> {
        // On trial the velocity may have passed zero: the sliding law continues there until the event is found.
        let slides = moment.slides;
        let found = D::level(p, &slip(moment));
        // A level that depends on the slip may do so in any way.
        let curvature = if found.constant { 0.0 } else { f64::INFINITY };
        Reaction {
            torque: found.level * slides,
            stiffness: found.per_position * slides,
            damping: found.per_speed,
            curvature,
        }
    }
}

/// The slip at the end of a step over which dry friction slides.
#[inline]
pub(super) fn slip<S: Scalar>(moment: &Moment<S>) -> Slip<S> {
    Slip {
        direction: moment.slides,
        speed: moment.end.v * moment.slides,
        position: moment.end.x,
        load: moment.load,
        time: moment.time,
    }
}
