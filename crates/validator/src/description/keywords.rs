//! The enumerations of attribute values of FMI 2.0 and 3.0.

use std::str::FromStr;

/// An enumeration whose values the standard spells as keywords.
macro_rules! keywords {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal),* $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum $name { $($(#[$vdoc])* $variant),* }

        impl $name {
            /// Every value.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// The keyword as the XML spells it.
            #[must_use]
            pub fn keyword(self) -> &'static str {
                match self { $(Self::$variant => $text),* }
            }
        }

        impl FromStr for $name {
            type Err = ();
            fn from_str(text: &str) -> Result<Self, ()> {
                match text { $($text => Ok(Self::$variant),)* _ => Err(()) }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.pad(self.keyword())
            }
        }
    };
}

keywords! {
    /// What a variable is to its environment.
    Causality {
        /// Constant during the simulation, set by the environment before it.
        Parameter = "parameter",
        /// Computed from parameters.
        CalculatedParameter = "calculatedParameter",
        /// FMI 3.0: the size of arrays, set in configuration mode.
        StructuralParameter = "structuralParameter",
        /// Set by the environment.
        Input = "input",
        /// Read by the environment.
        Output = "output",
        /// Neither.
        Local = "local",
        /// The independent variable, usually time.
        Independent = "independent",
    }
}

keywords! {
    /// When a variable may change.
    Variability {
        /// Never.
        Constant = "constant",
        /// Not after initialisation.
        Fixed = "fixed",
        /// Between communication points, set by the environment.
        Tunable = "tunable",
        /// At events only.
        Discrete = "discrete",
        /// At any time.
        Continuous = "continuous",
    }
}

keywords! {
    /// How a variable is initialised.
    Initial {
        /// From its start value.
        Exact = "exact",
        /// Iterated from its start value.
        Approx = "approx",
        /// Computed.
        Calculated = "calculated",
    }
}

keywords! {
    /// The five types of variables.
    BaseType {
        /// `fmi2Real`.
        Real = "Real",
        /// `fmi2Integer`.
        Integer = "Integer",
        /// `fmi2Boolean`.
        Boolean = "Boolean",
        /// `fmi2String`.
        String = "String",
        /// An integer with named values.
        Enumeration = "Enumeration",
    }
}

keywords! {
    /// How an unknown depends on a known.
    DependencyKind {
        /// In no known way.
        Dependent = "dependent",
        /// Linear with a constant factor.
        Constant = "constant",
        /// Linear with a fixed factor.
        Fixed = "fixed",
        /// Linear with a tunable factor.
        Tunable = "tunable",
        /// Linear with a discrete factor.
        Discrete = "discrete",
    }
}
