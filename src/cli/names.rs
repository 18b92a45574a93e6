//! Names that the program knows, for completion and for what is misspelt: effects, their parameters, signals.

use std::ffi::OsStr;
use std::sync::OnceLock;

use clap::builder::{PossibleValue, PossibleValuesParser, StringValueParser, TypedValueParser};

use crate::effects::EFFECTS;
use crate::trace::{Hold, Signal};

/// One of the effects.
pub fn effect() -> PossibleValuesParser {
    PossibleValuesParser::new(EFFECTS.iter().map(|e| e.info().id))
}

/// What completion offers where more than that may be given.
type Offered = fn() -> &'static [String];

/// `NAME=` of each parameter of the axis and of its effects.
pub fn settings() -> &'static [String] {
    static NAMES: OnceLock<Vec<String>> = OnceLock::new();
    NAMES.get_or_init(|| {
        let axis = ["I1", "I2", "B", "K", "rho"].into_iter().map(|n| format!("{n}="));
        let of = |e: &'static crate::effects::EffectInfo| e.parameters.iter().map(|p| format!("{}.{}=", e.id, p.name));
        axis.chain(EFFECTS.iter().flat_map(|e| of(e.info()))).collect()
    })
}

/// The signals.
pub fn signals() -> &'static [String] {
    static NAMES: OnceLock<Vec<String>> = OnceLock::new();
    NAMES.get_or_init(|| Signal::ALL.iter().map(|s| s.name().to_owned()).collect())
}

/// `SIGNAL=` of each, and of the time.
pub fn signals_equal() -> &'static [String] {
    static NAMES: OnceLock<Vec<String>> = OnceLock::new();
    NAMES.get_or_init(|| std::iter::once("time=".to_owned()).chain(signals().iter().map(|s| format!("{s}="))).collect())
}

/// A parser that offers names to completion and takes others too.
#[derive(Clone)]
pub struct Offering<P> {
    parser: P,
    offered: Offered,
}

/// What a signal does between samples: `zoh` or `linear`, each with its line of the help.
pub fn hold(zoh: &'static str, linear: &'static str) -> impl TypedValueParser<Value = Hold> {
    let values = [PossibleValue::new("zoh").help(zoh), PossibleValue::new("linear").help(linear)];
    PossibleValuesParser::new(values).map(|name| if name == "linear" { Hold::Linear } else { Hold::Zoh })
}

/// Offers names beside what a parser takes.
pub fn offering<P: TypedValueParser>(parser: P, offered: Offered) -> Offering<P> {
    Offering { parser, offered }
}

/// Text, with names offered.
pub fn text(offered: Offered) -> Offering<StringValueParser> {
    offering(StringValueParser::new(), offered)
}

impl<P: TypedValueParser> TypedValueParser for Offering<P> {
    type Value = P::Value;

    fn parse_ref(
        &self,
        command: &clap::Command,
        argument: Option<&clap::Arg>,
        value: &OsStr,
    ) -> Result<P::Value, clap::Error> {
        self.parser.parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.offered)().iter().map(|n| PossibleValue::new(n.as_str()))))
    }
}
