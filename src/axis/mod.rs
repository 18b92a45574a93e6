//! The two-inertia axis: parameters, state and the Newmark step.
