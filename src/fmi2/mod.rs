//! The FMI 2.0 C ABI: exported symbols behind one gate.
