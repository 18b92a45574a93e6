//! FMU archives from the outside: packaging, import host, validation rules, simulation.
