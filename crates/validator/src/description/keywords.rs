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

keywords! {
    /// The types of FMI 3.0 (section 2.4.7), in the order of the standard.
    Kind {
        /// 32-bit floating point.
        Float32 = "Float32",
        /// 64-bit floating point.
        Float64 = "Float64",
        /// Signed, 8 bits.
        Int8 = "Int8",
        /// Unsigned, 8 bits.
        UInt8 = "UInt8",
        /// Signed, 16 bits.
        Int16 = "Int16",
        /// Unsigned, 16 bits.
        UInt16 = "UInt16",
        /// Signed, 32 bits.
        Int32 = "Int32",
        /// Unsigned, 32 bits.
        UInt32 = "UInt32",
        /// Signed, 64 bits.
        Int64 = "Int64",
        /// Unsigned, 64 bits.
        UInt64 = "UInt64",
        /// `fmi3Boolean`.
        Boolean = "Boolean",
        /// UTF-8 text.
        String = "String",
        /// Bytes.
        Binary = "Binary",
        /// A 64-bit integer with named values.
        Enumeration = "Enumeration",
        /// Ticks or not.
        Clock = "Clock",
    }
}

impl Kind {
    /// The type of FMI 2.0 that it is treated as; bytes are texts of hexadecimal digits, as the XML has them.
    #[must_use]
    pub fn base(self) -> BaseType {
        match self {
            Self::Float32 | Self::Float64 => BaseType::Real,
            Self::Boolean | Self::Clock => BaseType::Boolean,
            Self::String | Self::Binary => BaseType::String,
            Self::Enumeration => BaseType::Enumeration,
            _ => BaseType::Integer,
        }
    }

    /// Smallest and largest value of an integer type.
    #[must_use]
    pub fn range(self) -> Option<(i128, i128)> {
        Some(match self {
            Self::Int8 => (i8::MIN.into(), i8::MAX.into()),
            Self::UInt8 => (0, u8::MAX.into()),
            Self::Int16 => (i16::MIN.into(), i16::MAX.into()),
            Self::UInt16 => (0, u16::MAX.into()),
            Self::Int32 => (i32::MIN.into(), i32::MAX.into()),
            Self::UInt32 => (0, u32::MAX.into()),
            Self::Int64 | Self::Enumeration => (i64::MIN.into(), i64::MAX.into()),
            Self::UInt64 => (0, u64::MAX.into()),
            _ => return None,
        })
    }
}
