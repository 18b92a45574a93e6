//! THE variable table of the FMU: nothing lists variables twice.
