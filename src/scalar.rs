//! Numbers the physics is written over: `f64` and forward-mode duals.
