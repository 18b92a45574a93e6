//! Where the gap lies, whatever its cause.

mod kalman;
mod plant;
