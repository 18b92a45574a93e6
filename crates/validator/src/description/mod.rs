//! `modelDescription.xml` as types (FMI 2.0.4, section 2.2; FMI 3.0, section 2.4: see [`three`]), each with its line and
//! column.
//!
//! Reading is tolerant: a value that cannot be understood falls back to its default, so that the rules can go on and
//! report it (see `rules::schema`, which checks every attribute). [`Description::parse`] fails only on a document that
//! is not well-formed or whose root is not a model description of FMI 2.0 or 3.0.

mod keywords;
mod read;
pub mod three;

use super::xml::{Document, Position, XmlError};

pub use keywords::*;
use read::*;
pub use read::{parse_boolean, parse_integer, parse_real};
pub use three::{Cell, Clock};

/// Why no description could be read.
#[derive(Debug, thiserror::Error)]
pub enum DescriptionError {
    /// Not well-formed.
    #[error("modelDescription.xml:{0}")]
    Xml(#[from] XmlError),
    /// Some other document, or another version of FMI.
    #[error("modelDescription.xml: {0}")]
    NotFmi(String),
}

/// A version of FMI that is understood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Fmi {
    /// FMI 2.0, and 2.0.1 to 2.0.5.
    #[default]
    Two,
    /// FMI 3.0, and 3.0.1 and later.
    Three,
}

impl Fmi {
    /// The version of the standard whose sections are named.
    #[must_use]
    pub fn standard(self) -> &'static str {
        match self {
            Self::Two => "FMI 2.0.4",
            Self::Three => "FMI 3.0",
        }
    }

    /// Of the `fmiVersion` of a description; none of another version.
    #[must_use]
    pub fn of(version: &str) -> Option<Self> {
        match version.trim() {
            "2.0" => Some(Self::Two),
            three if three == "3" || three.starts_with("3.") => Some(Self::Three),
            _ => None,
        }
    }
}

/// A start value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Of a Real.
    Real(f64),
    /// Of an integer of any size, or an Enumeration; of 64 bits without a sign, by its bits.
    Integer(i64),
    /// Of a Boolean.
    Boolean(bool),
    /// Of a String.
    String(String),
}

impl std::fmt::Display for Value {
    /// Numbers as Rust writes them, a text in quotes.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Real(x) => x.fmt(f),
            Self::Integer(x) => x.fmt(f),
            Self::Boolean(x) => x.fmt(f),
            Self::String(x) => write!(f, "{x:?}"),
        }
    }
}

/// The `ModelExchange` or `CoSimulation` element.
#[derive(Debug, Clone)]
pub struct Interface {
    /// Prefix of the platform binary's file name.
    pub model_identifier: String,
    /// Needs a tool outside the FMU to run.
    pub needs_execution_tool: bool,
    /// `fmi2DoStep` with any step size.
    pub can_handle_variable_step_size: bool,
    /// Inputs interpolate through `fmi2SetRealInputDerivatives`.
    pub can_interpolate_inputs: bool,
    /// Order of the derivatives from `fmi2GetRealOutputDerivatives`; 0 is none.
    pub max_output_derivative_order: u32,
    /// `fmi2DoStep` may return `fmi2Pending`.
    pub can_run_asynchronuously: bool,
    /// One instance a process.
    pub only_once: bool,
    /// The FMU does not use the memory callbacks.
    pub no_memory_callbacks: bool,
    /// `fmi2GetFMUstate` and friends work.
    pub can_get_and_set_state: bool,
    /// `fmi2SerializeFMUstate` and friends work.
    pub can_serialize_state: bool,
    /// `fmi2GetDirectionalDerivative` works.
    pub provides_directional_derivative: bool,
    /// Names of source files, for FMUs with sources.
    pub source_files: Vec<(String, Position)>,
    /// FMI 3.0: `hasEventMode`.
    pub has_event_mode: bool,
    /// FMI 3.0: `mightReturnEarlyFromDoStep`.
    pub might_return_early: bool,
    /// FMI 3.0: `fixedInternalStepSize`, s.
    pub fixed_step: Option<f64>,
    /// FMI 3.0: what it declares to offer and no rule tests, with its section.
    pub untested: Vec<&'static str>,
    /// Where.
    pub position: Position,
}

/// The exponents of a unit in SI base units, with its factor and offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseUnit {
    /// Exponents of kg, m, s, A, K, mol, cd, rad.
    pub exponents: [i32; 8],
    /// Value in base units is `factor*value + offset`.
    pub factor: f64,
    /// See `factor`.
    pub offset: f64,
}

/// SI base units in the order of [`BaseUnit::exponents`].
pub const SI_BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

/// A display unit of a unit.
#[derive(Debug, Clone)]
pub struct DisplayUnit {
    /// Name.
    pub name: String,
    /// Displayed value is `factor*value + offset`.
    pub factor: f64,
    /// See `factor`.
    pub offset: f64,
    /// Where.
    pub position: Position,
}

/// A unit definition.
#[derive(Debug, Clone)]
pub struct Unit {
    /// Name.
    pub name: String,
    /// In SI base units, where given.
    pub base: Option<BaseUnit>,
    /// Display units.
    pub display: Vec<DisplayUnit>,
    /// Where.
    pub position: Position,
}

/// The attributes that a variable's type element and a type definition share.
#[derive(Debug, Clone)]
pub struct TypeAttributes {
    /// Which type.
    pub base: BaseType,
    /// Physical quantity.
    pub quantity: Option<String>,
    /// Unit name.
    pub unit: Option<String>,
    /// Display unit name.
    pub display_unit: Option<String>,
    /// The offset of a display unit is ignored.
    pub relative_quantity: bool,
    /// Smallest allowed value.
    pub min: Option<f64>,
    /// Largest allowed value.
    pub max: Option<f64>,
    /// Typical magnitude.
    pub nominal: Option<f64>,
    /// Values of an enumeration: name and value.
    pub items: Vec<(String, i64, Position)>,
    /// Where.
    pub position: Position,
}

/// A type definition.
#[derive(Debug, Clone)]
pub struct SimpleType {
    /// Name.
    pub name: String,
    /// What it fixes.
    pub attributes: TypeAttributes,
    /// Where.
    pub position: Position,
}

/// A scalar variable.
#[derive(Debug, Clone)]
pub struct Variable {
    /// Unique name.
    pub name: String,
    /// Handle of the value; the same for all aliases.
    pub value_reference: u32,
    /// Description.
    pub description: Option<String>,
    /// Causality, `local` when not given.
    pub causality: Causality,
    /// Variability, `continuous` when not given.
    pub variability: Variability,
    /// Initial as declared; see [`Variable::initial`].
    pub declared_initial: Option<Initial>,
    /// May be set several times at one time instant (model exchange).
    pub can_handle_multiple_set: Option<bool>,
    /// The type element's attributes; of the type element alone, see [`Description::resolved`].
    pub attributes: TypeAttributes,
    /// Name of the type definition.
    pub declared_type: Option<String>,
    /// Start value, when there and understood.
    pub start: Option<Value>,
    /// Whether a start attribute is there at all.
    pub has_start: bool,
    /// One-based index of the variable that this is the derivative of.
    pub derivative: Option<u32>,
    /// Model exchange: the state may be reinitialised.
    pub reinit: bool,
    /// FMI 3.0: the variable and element that this is.
    pub cell: Option<Cell>,
    /// Where.
    pub position: Position,
}

impl Variable {
    /// The type.
    #[must_use]
    pub fn base(&self) -> BaseType {
        self.attributes.base
    }

    /// The effective `initial`: as declared, else the default of the table in section 2.2.7.
    #[must_use]
    pub fn initial(&self) -> Option<Initial> {
        self.declared_initial.or_else(|| default_initial(self.causality, self.variability))
    }
}

/// The default of `initial` for a causality and variability (FMI 2.0.4, section 2.2.7); none for inputs, the
/// independent variable and combinations that are not allowed.
#[must_use]
pub fn default_initial(causality: Causality, variability: Variability) -> Option<Initial> {
    use {Causality as C, Variability as V};
    match (causality, variability) {
        (C::Output | C::Local, V::Constant) | (C::Parameter | C::StructuralParameter, V::Fixed | V::Tunable) => {
            Some(Initial::Exact)
        }
        (C::CalculatedParameter | C::Local, V::Fixed | V::Tunable)
        | (C::Output | C::Local, V::Discrete | V::Continuous) => Some(Initial::Calculated),
        _ => None,
    }
}

/// An entry of the model structure.
#[derive(Debug, Clone)]
pub struct Unknown {
    /// One-based index into the variables; 0 when it could not be understood.
    pub index: u32,
    /// As it stands in the XML: the index, or in FMI 3.0 the value reference.
    pub reference: u32,
    /// One-based indices of the knowns; `None` means "all, as far as one knows".
    pub dependencies: Option<Vec<u32>>,
    /// Kinds, as many as dependencies.
    pub kinds: Option<Vec<DependencyKind>>,
    /// Where.
    pub position: Position,
}

/// The model structure.
#[derive(Debug, Clone, Default)]
pub struct ModelStructure {
    /// Outputs.
    pub outputs: Vec<Unknown>,
    /// State derivatives.
    pub derivatives: Vec<Unknown>,
    /// Unknowns at initialisation.
    pub initial_unknowns: Vec<Unknown>,
    /// Where.
    pub position: Position,
}

/// The default experiment.
#[derive(Debug, Clone, Copy, Default)]
pub struct DefaultExperiment {
    /// Start time, in s.
    pub start_time: Option<f64>,
    /// Stop time, in s.
    pub stop_time: Option<f64>,
    /// Relative tolerance.
    pub tolerance: Option<f64>,
    /// Communication step, in s.
    pub step_size: Option<f64>,
    /// Where.
    pub position: Position,
}

/// A `modelDescription.xml`.
#[derive(Debug, Clone)]
pub struct Description {
    /// The version of FMI.
    pub fmi: Fmi,
    /// As it is spelt.
    pub fmi_version: String,
    /// Name of the model.
    pub model_name: String,
    /// Fingerprint shared with the binary.
    pub guid: String,
    /// One-line description.
    pub description: Option<String>,
    /// Author.
    pub author: Option<String>,
    /// Version of the model.
    pub version: Option<String>,
    /// Copyright.
    pub copyright: Option<String>,
    /// Licence.
    pub license: Option<String>,
    /// Tool that wrote the FMU.
    pub generation_tool: Option<String>,
    /// Date and time of generation.
    pub generation_date_and_time: Option<String>,
    /// Whether `variableNamingConvention` is `structured`.
    pub structured_names: bool,
    /// Number of event indicators (model exchange).
    pub number_of_event_indicators: u32,
    /// The co-simulation interface.
    pub co_simulation: Option<Interface>,
    /// The model exchange interface.
    pub model_exchange: Option<Interface>,
    /// Unit definitions.
    pub units: Vec<Unit>,
    /// Type definitions.
    pub types: Vec<SimpleType>,
    /// Log categories: name, description, place.
    pub log_categories: Vec<(String, Option<String>, Position)>,
    /// Default experiment.
    pub default_experiment: Option<DefaultExperiment>,
    /// Names of the tools with vendor annotations.
    pub vendor_tools: Vec<String>,
    /// The variables, in order: index 1 of the model structure is `variables[0]`.
    pub variables: Vec<Variable>,
    /// The model structure.
    pub structure: ModelStructure,
    /// FMI 3.0: the clocks.
    pub clocks: Vec<Clock>,
}

impl Description {
    /// Parses a `modelDescription.xml`.
    ///
    /// # Errors
    /// When the document is not well-formed, or not a model description of FMI 2.0 or 3.0.
    pub fn parse(bytes: &[u8]) -> Result<Self, DescriptionError> {
        let document = Document::parse(bytes)?;
        let root = &document.root;
        if root.name != "fmiModelDescription" {
            return Err(DescriptionError::NotFmi(format!(
                "the root element is {}, not fmiModelDescription",
                root.name
            )));
        }
        match root.get("fmiVersion") {
            Some(version) if Fmi::of(version).is_some() => Ok(Self::from_document(&document)),
            Some(other) => Err(DescriptionError::NotFmi(format!("FMI version {other}; 2.0 and 3.0 are supported"))),
            None => Err(DescriptionError::NotFmi("no fmiVersion attribute".into())),
        }
    }

    /// Reads what can be understood; see the module's head.
    #[must_use]
    pub fn from_document(document: &Document) -> Self {
        let root = &document.root;
        if root.get("fmiVersion").and_then(Fmi::of) == Some(Fmi::Three) {
            return Self::of_three(root);
        }
        let structure = root.child("ModelStructure");
        let unknowns = |name: &str| -> Vec<Unknown> {
            let section = structure.and_then(|s| s.child(name));
            section.into_iter().flat_map(|s| s.children_named("Unknown")).map(unknown).collect()
        };
        Self {
            number_of_event_indicators: number(root, "numberOfEventIndicators").unwrap_or(0),
            co_simulation: root.child("CoSimulation").map(interface),
            model_exchange: root.child("ModelExchange").map(interface),
            types: within(root, "TypeDefinitions", "SimpleType").filter_map(simple_type).collect(),
            vendor_tools: within(root, "VendorAnnotations", "Tool").filter_map(|e| text(e, "name")).collect(),
            variables: within(root, "ModelVariables", "ScalarVariable").map(variable).collect(),
            structure: ModelStructure {
                outputs: unknowns("Outputs"),
                derivatives: unknowns("Derivatives"),
                initial_unknowns: unknowns("InitialUnknowns"),
                position: structure.map_or(root.position, |s| s.position),
            },
            ..head(root, Fmi::Two, "guid")
        }
    }

    /// A variable by its name.
    #[must_use]
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|v| v.name == name)
    }

    /// A variable by its one-based index.
    #[must_use]
    pub fn by_index(&self, index: u32) -> Option<&Variable> {
        self.variables.get((index as usize).checked_sub(1)?)
    }

    /// The type definition of a variable.
    #[must_use]
    pub fn type_of(&self, variable: &Variable) -> Option<&SimpleType> {
        let name = variable.declared_type.as_deref()?;
        self.types.iter().find(|t| t.name == name)
    }

    /// A variable's type attributes with those of its type definition filled in where the variable gives none.
    #[must_use]
    pub fn resolved(&self, variable: &Variable) -> TypeAttributes {
        let mut own = variable.attributes.clone();
        if let Some(definition) = self.type_of(variable) {
            let other = &definition.attributes;
            own.quantity = own.quantity.or_else(|| other.quantity.clone());
            own.unit = own.unit.or_else(|| other.unit.clone());
            own.display_unit = own.display_unit.or_else(|| other.display_unit.clone());
            own.min = own.min.or(other.min);
            own.max = own.max.or(other.max);
            own.nominal = own.nominal.or(other.nominal);
            own.relative_quantity |= other.relative_quantity;
            if own.items.is_empty() {
                own.items.clone_from(&other.items);
            }
        }
        own
    }
}
