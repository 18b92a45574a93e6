//! THE list of rules. `eixo validate --rules`, the documentation and the tests iterate it; nothing lists rules twice.
//!
//! A behavioural rule stands here with the function that tests it. The static rules come out of readers that go through the
//! file once and find on their way what several of them ask, so that none has a function of its own: each has a constant in
//! [`id`], with which its findings are reported. One that is never used is a warning of the compiler. Behavioural rules have
//! a constant where something else speaks of them.
//!
//! The first section is that of FMI 2.0.4, the second that of FMI 3.0; `-` stands for none: the rule is not one of that
//! version, or not tested for it. Titles and advice are in the terms of 2.0; [`super::wording`] has those of 3.0. What the standard
//! leaves undefined is robustness, never conformance; and what only an importer that breaks the standard can bring out (a call out of order, an unknown reference) is a note.

use super::super::behaviour::Behaviour::{Indirect, Learning, Loaded, Raw};
use super::super::behaviour::{
    changes, delay, dependencies, effects, experiment, instances, interpolation, leaks, lifecycle, observed, partial,
    references, reset, rounded, settings, slope, start, state, step_size, steps, surroundings, symbols, three, values,
};
use super::Kind::{Conformance, Quality, Robustness};
use super::Severity::{Error, Note, Warning};
use super::{Check, Rule};

/// The name of a rule; there are none but those of the list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Id(&'static str);

impl Id {
    /// As `--only`, `--skip` and reports have it.
    pub const fn text(self) -> &'static str {
        self.0
    }
}

macro_rules! rules {
    (
        static {$(
            $name:ident = $id:literal $severity:ident $kind:ident $two:literal $three:literal; $title:literal, $advice:literal;
        )*}
        behaviour {$(
            $($b_name:ident =)? $b_id:literal $b_severity:ident $b_kind:ident $b_two:literal $b_three:literal $test:expr;
            $b_title:literal, $b_advice:literal;
        )*}
    ) => {
        /// Names of rules.
        pub(crate) mod id {
            use super::Id;
            $(pub(crate) const $name: Id = Id($id);)*
            $($(pub(crate) const $b_name: Id = Id($b_id);)?)*
        }

        /// Every rule, in the order in which it is reported.
        pub const RULES: &[Rule] = &[
            $(Rule {
                id: $id, title: $title, severity: $severity, kind: $kind, sections: [$two, $three], advice: $advice,
                check: Check::Static,
            },)*
            $(Rule {
                id: $b_id, title: $b_title, severity: $b_severity, kind: $b_kind, sections: [$b_two, $b_three],
                advice: $b_advice, check: Check::Behaviour($test),
            }),*
        ];
    };
}

rules! { static {
    ARCHIVE_READABLE = "archive-readable" Error Conformance "2.3" "2.5";
        "The FMU is a ZIP archive", "Pack the FMU again with an ordinary ZIP tool; compare its size with the original after each transfer.";
    ARCHIVE_PATH = "archive-path" Error Robustness "2.3" "2.5";
        "No entry leads out of the archive", "Remove absolute paths, `..`, symbolic links and control characters from the entries' names; importers refuse or overwrite files.";
    ARCHIVE_BACKSLASH = "archive-backslash" Error Conformance "2.3" "2.5";
        "Paths use forward slashes", "Pack with forward slashes, which the ZIP specification prescribes; importers outside Windows see one odd file name.";
    ARCHIVE_METHOD = "archive-method" Error Conformance "2.3" "2.5";
        "Entries are deflated or stored, and not encrypted", "Pack with deflate and without a password.";
    ARCHIVE_DUPLICATE = "archive-duplicate" Error Robustness "2.3" "2.5";
        "Entry names are unique, on any file system", "Rename or remove the second entry; which of the two an importer takes is chance.";
    ARCHIVE_DAMAGED = "archive-damaged" Error Conformance "2.3" "2.5";
        "Every entry can be inflated and has the right checksum", "Pack the FMU again; it was cut or changed after packing.";
    ARCHIVE_BOMB = "archive-bomb" Error Robustness "2.3" "2.5";
        "The archive inflates to a sane size", "Remove the entry that inflates beyond all measure, or ship it outside the FMU.";
    ARCHIVE_DESCRIPTION = "archive-description" Error Conformance "2.3" "2.5.1";
        "modelDescription.xml is at the top of the archive", "Pack the folder's contents, not the folder, and spell modelDescription.xml exactly so.";
    XML_WELL_FORMED = "xml-well-formed" Error Conformance "2.2" "2.4";
        "modelDescription.xml is well-formed XML", "Correct the XML at the place named; escape & as &amp; and < as &lt;.";
    FMI_VERSION = "fmi-version" Error Conformance "2.2.1" "2.4.1";
        "fmiVersion is 2.0", "Write fmiVersion=\"2.0\", for 2.0.1 to 2.0.5 too.";
    INTERFACE_MISSING = "interface-missing" Error Conformance "2.2.1" "2.4.1";
        "There is a ModelExchange or CoSimulation element", "Put one of them first in the file.";
    SCHEMA_ELEMENT = "schema-element" Error Conformance "2.2" "2.4";
        "Elements are where the schema has them", "Put the elements in the schema's order, and no others.";
    SCHEMA_ATTRIBUTE = "schema-attribute" Error Conformance "2.2" "2.4";
        "Attributes are those of the schema", "Correct the spelling, or move tool data to VendorAnnotations or Annotations.";
    SCHEMA_REQUIRED = "schema-required" Error Conformance "2.2" "2.4";
        "Required attributes are there", "Add the attribute.";
    SCHEMA_VALUE = "schema-value" Error Conformance "2.2" "2.4";
        "Attribute values are of the schema's types", "Write the value in the form named.";
    DATE_TIME = "date-time" Error Conformance "2.2.1" "2.4.1";
        "generationDateAndTime is a date and time", "Write it as 2009-12-08T14:33:22Z.";
    GUID = "guid" Error Conformance "2.2.1" "2.4.1";
        "The guid is not empty", "Generate a guid (or a hash of the file) at export and compile it into the binary.";
    MODEL_NAME = "model-name" Warning Quality "2.2.1" "2.4.1";
        "The modelName is not empty", "Give the model's name.";
    MODEL_IDENTIFIER = "model-identifier" Error Conformance "2.2.1" "2.4.2";
        "modelIdentifier is a C identifier", "Use letters, digits and underscores, no digit first; it names the binary and prefixes functions in source code.";
    CAPABILITY_SERIALIZE = "capability-serialize" Error Conformance "4.3.1" "2.4.2";
        "canSerializeFMUstate comes with canGetAndSetFMUstate", "Set both flags, or neither.";
    LOG_CATEGORY = "log-category" Error Conformance "2.2.4" "2.4.5";
        "Log categories are unique", "Remove the second one.";
    VENDOR_TOOL = "vendor-tool" Error Conformance "2.2.6" "-";
        "Vendor annotations are unique by tool", "Merge the annotations of one tool.";
    DEFAULT_EXPERIMENT = "default-experiment" Error Conformance "2.2.5" "2.4.6";
        "The default experiment is in order", "Let startTime < stopTime, 0 < stepSize <= stopTime - startTime and tolerance > 0.";
    UNIT_UNIQUE = "unit-unique" Error Conformance "2.2.2" "2.4.3";
        "Units, and display units of a unit, are unique", "Remove the second one.";
    UNIT_CONVERSION = "unit-conversion" Error Conformance "2.2.2" "2.4.3";
        "Factors of units can be inverted", "Give a finite factor that is not 0.";
    UNIT_KNOWN = "unit-known" Warning Conformance "2.2.2" "2.4.3";
        "Factors of well-known units are theirs", "Give the factor to base units for a Unit, and that from the unit to the display unit for a DisplayUnit (1000 for mm of m), or another name.";
    UNIT_UNDECLARED = "unit-undeclared" Error Conformance "2.2.2" "2.4.3";
        "Units in use are defined", "Add the Unit to UnitDefinitions.";
    DISPLAY_UNIT = "display-unit" Error Conformance "2.2.2" "2.4.3";
        "Display units in use are defined, and have a unit", "Add the DisplayUnit to the Unit, or the unit to the variable.";
    TYPE_UNIQUE = "type-unique" Error Conformance "2.2.3" "2.4.4";
        "Type names are unique, among variables too", "Rename the type.";
    TYPE_UNDECLARED = "type-undeclared" Error Conformance "2.2.3" "2.4.4";
        "Declared types are defined", "Add the SimpleType to TypeDefinitions.";
    TYPE_MISMATCH = "type-mismatch" Error Conformance "2.2.3" "2.4.4";
        "A variable is of the type that its declared type has", "Let both be Real, Integer, Boolean, String or Enumeration.";
    ENUMERATION_ITEMS = "enumeration-items" Error Conformance "2.2.3" "2.4.4";
        "Items of an enumeration are unique in name and value", "Give each item its own name and value.";
    VARIABLE_NAME_UNIQUE = "variable-name-unique" Error Conformance "2.2.7" "2.4.7";
        "Variable names are unique", "Rename one of the variables.";
    VARIABLE_NAME = "variable-name" Warning Conformance "2.2.9" "2.4.7";
        "Variable names follow the naming convention", "Quote unusual names as 'name', or declare variableNamingConvention=\"flat\".";
    VARIABILITY_TYPE = "variability-type" Error Conformance "2.2.7" "2.4.7";
        "Only a Real is continuous", "Declare variability=\"discrete\" (or fixed, tunable, constant); continuous is the default.";
    CAUSALITY_VARIABILITY = "causality-variability" Error Conformance "2.2.7" "2.4.7";
        "Causality and variability go together", "See the table of combinations in section 2.2.7.";
    INITIAL = "initial" Error Conformance "2.2.7" "2.4.7";
        "initial goes with causality and variability", "Leave initial out to get the default, or see the table in section 2.2.7.";
    START_MISSING = "start-missing" Error Conformance "2.2.7" "2.4.7";
        "Start values are there where they are needed", "Add the start value.";
    START_FORBIDDEN = "start-forbidden" Error Conformance "2.2.7" "2.4.7";
        "No start value where the value is calculated", "Remove start, or declare initial=\"approx\" or \"exact\".";
    START_RANGE = "start-range" Error Conformance "2.2.7" "2.4.7";
        "Start values are between min and max, or an item of the enumeration", "Correct start, min or max.";
    MIN_MAX = "min-max" Error Conformance "2.2.7" "2.4.7";
        "min is not above max", "Exchange or correct them.";
    NOMINAL = "nominal" Warning Conformance "2.2.7" "2.4.7";
        "Nominal values are positive", "Give a typical magnitude, or leave nominal out.";
    INDEPENDENT_VARIABLE = "independent-variable" Error Conformance "2.2.7" "2.4.7";
        "At most one variable is independent, and it is a Real", "Keep the one that stands for time.";
    DERIVATIVE_INDEX = "derivative-index" Error Conformance "2.2.7" "2.4.7";
        "derivative names another continuous Real", "Give the one-based index of the state.";
    REINIT = "reinit" Warning Conformance "2.2.7" "-";
        "reinit is used for model exchange alone", "Remove the attribute.";
    ALIAS = "alias" Error Conformance "2.2.7" "-";
        "Variables of one value reference agree in start value and variability", "Give the start value to one of them, or separate value references.";
    ALIAS_UNIT = "alias-unit" Error Conformance "2.2.7" "-";
        "Variables of one value reference have one unit", "Give all of them the same unit, or none.";
    ALIAS_UNIT_MISSING = "alias-unit-missing" Note Conformance "2.2.7" "-";
        "Variables of one value reference all have a unit, or none, spelt alike", "Give all of them the same unit by the same name, or none.";
    REFERENCE_UNIQUE = "reference-unique" Error Conformance "-" "2.4.7";
        "Value references are unique", "Give each variable its own valueReference; a second name of one value is an Alias element.";
    DIMENSION = "dimension" Error Conformance "-" "2.4.7";
        "Dimensions have a size", "Give each Dimension either a start of 1 or more, or the valueReference of a UInt64 that is a structural parameter or constant.";
    START_COUNT = "start-count" Error Conformance "-" "2.4.7";
        "Arrays have as many start values as elements, or one for all", "List the start values row by row.";
    CLOCK = "clock" Error Conformance "-" "2.2.8";
        "Clocks are declared as their kind asks", "See the table of clock types: outputs are triggered, constant clocks have an interval, and variables name their clocks by value reference.";
    STRUCTURE_INDEX = "structure-index" Error Conformance "2.2.8" "2.4.8";
        "Indices of the model structure are those of variables", "Indices count the ScalarVariables from 1; they are no value references.";
    STRUCTURE_DUPLICATE = "structure-duplicate" Error Conformance "2.2.8" "2.4.8";
        "No unknown is listed twice", "Remove the second one.";
    STRUCTURE_OUTPUTS = "structure-outputs" Error Conformance "2.2.8" "2.4.8";
        "Outputs lists exactly the variables of causality output", "Add or remove the Unknown.";
    STRUCTURE_DERIVATIVES = "structure-derivatives" Error Conformance "2.2.8" "2.4.8";
        "Derivatives lists derivatives", "Add the derivative attribute to the variable, or remove the Unknown.";
    STRUCTURE_INITIAL_UNKNOWNS = "structure-initial-unknowns" Error Conformance "2.2.8" "2.4.8";
        "InitialUnknowns is complete", "List outputs with initial approx or calculated, calculated parameters, and states and derivatives with initial approx or calculated; nothing else.";
    STRUCTURE_INITIAL_UNKNOWNS_ABSENT = "structure-initial-unknowns-absent" Warning Conformance "2.2.8" "2.4.8";
        "InitialUnknowns are there when something is calculated at initialisation", "List outputs with initial approx or calculated, calculated parameters, and states and derivatives with initial approx or calculated. The schema lets the element be left out, and some exporters always do; some importers refuse that.";
    STRUCTURE_ORDER = "structure-order" Error Conformance "2.2.8" "-";
        "InitialUnknowns goes by index", "Sort the list.";
    DEPENDENCIES_INDEX = "dependencies-index" Error Conformance "2.2.8" "2.4.8";
        "Dependencies are indices of variables, each once", "Indices count the ScalarVariables from 1; they are no value references.";
    DEPENDENCIES_ORDER = "dependencies-order" Warning Conformance "2.2.8" "-";
        "Dependencies go by index", "Sort the list, with its dependenciesKind.";
    DEPENDENCIES_KNOWN = "dependencies-known" Note Conformance "2.2.8" "-";
        "Dependencies are knowns of their section", "List inputs, states and the independent variable; in InitialUnknowns inputs, variables with initial exact and the independent variable.";
    DEPENDENCIES_KIND = "dependencies-kind" Error Conformance "2.2.8" "2.4.8";
        "dependenciesKind has one fitting kind a dependency", "Give as many kinds as dependencies, other than dependent for Reals alone.";
    DEPENDENCIES_KIND_REAL = "dependencies-kind-real" Note Conformance "2.2.8" "-";
        "Kinds other than dependent are for Reals, and in InitialUnknowns only constant", "Write dependent; importers that use the kinds for linearisation look at Reals alone.";
    BINARY_MISSING = "binary-missing" Error Conformance "2.3" "2.5.1";
        "There is a binary or source code", "Add binaries/<platform>/<modelIdentifier>.<so|dll|dylib>, or sources/.";
    BINARY_FOLDER = "binary-folder" Warning Conformance "2.3" "2.5.1";
        "Binaries are in platform folders of the standard's spelling", "Use win32, win64, linux32, linux64, darwin32 or darwin64.";
    BINARY_NAME = "binary-name" Error Conformance "2.3" "2.5.1";
        "Each platform folder holds <modelIdentifier> with the platform's extension", "Name the binary as the modelIdentifier of its interface, with .so, .dll or .dylib and no prefix such as lib.";
    BINARY_FORMAT = "binary-format" Error Conformance "2.3" "2.5.1";
        "Each binary is of its folder's platform", "Put the library built for that platform there; an empty, 32-bit or foreign file cannot be loaded.";
    SOURCE_FILES = "source-files" Warning Conformance "2.3" "-";
        "Listed source files are in the archive", "Add the file under sources/, or remove it from SourceFiles.";
} behaviour {
    BINARY_LOAD = "binary-load" Error Robustness "2.3" "2.5.1" Raw(lifecycle::load);
        "The binary loads, with every symbol it needs", "Link what is missing statically or ship it beside the binary; build against an old C library; `ldd -r` shows the gaps.";
    BINARY_SYMBOLS = "binary-symbols" Error Conformance "2.1" "2.2.1" Loaded(symbols::symbols);
        "The functions that hosts and the capability flags need are exported", "Export the function with C linkage and default visibility, or clear the capability flag.";
    "binary-all-symbols" Warning Conformance "2.1" "2.2.1" Loaded(symbols::all_symbols);
        "All functions of co-simulation are exported", "Export the rest too, returning fmi2Error; many hosts look all of them up when they load an FMU.";
    "types-platform" Error Conformance "2.1.4" "-" Loaded(lifecycle::types_platform);
        "fmi2GetTypesPlatform gives \"default\"", "Return fmi2TypesPlatform of the standard header.";
    VERSION = "version" Error Conformance "2.1.4" "2.2.4" Loaded(lifecycle::version);
        "fmi2GetVersion gives \"2.0\"", "Return fmi2Version of the standard header, for 2.0.x too.";
    INSTANTIATE = "instantiate" Error Conformance "2.1.5" "2.3.1" Loaded(lifecycle::instantiate);
        "An instance can be made and freed", "See the FMU's message; the guid compiled in must be that of modelDescription.xml.";
    INITIALISE = "initialise" Error Conformance "2.1.6" "2.3.2" Loaded(lifecycle::initialise);
        "An instance initialises with its start values", "The start values of modelDescription.xml must make a valid model.";
    SETUP_ENDLESS = "setup-endless" Error Conformance "2.1.6" "2.3.2" Loaded(lifecycle::setup_endless);
        "An instance initialises without a stop time", "Accept stopTimeDefined = fmi2False in fmi2SetupExperiment: many importers do not know the end beforehand.";
    VARIABLE_READABLE = "variable-readable" Error Conformance "2.1.7" "2.2.6.2" Loaded(values::readable);
        "Every variable can be read", "Let each valueReference of modelDescription.xml be one of the binary, for the variable's type.";
    ARRAY_BOUNDS = "array-bounds" Error Conformance "2.1.7" "-" Loaded(settings::bounds);
        "Getters and setters keep within the arrays that they are given", "Read and write nvr elements, no more, and leave the value references alone; what lies behind is the host's memory.";
    SIMULATE = "simulate" Error Conformance "4.2.2" "4.2.1" Learning(experiment::simulate);
        "The default experiment runs to its end", "Let the model run from its start values with the default step size, or declare another default experiment.";
    STEP_STATUS = "step-status" Error Conformance "4.2.2" "4.2.1" Loaded(lifecycle::step_status);
        "fmi2DoStep returns a status of the standard, fmi2Pending only when announced", "Set canRunAsynchronuously or step synchronously; return fmi2OK, Warning, Discard, Error or Fatal.";
    "step-report" Error Conformance "-" "4.2.1" Loaded(three::report);
        "fmi3DoStep tells how far it came", "Write all four output arguments in each call; lastSuccessfulTime is the end of the step unless it returned early.";
    "early-return" Error Conformance "-" "4.2.1" Indirect(three::early_return);
        "Steps return early only where that is allowed and announced, and can be gone on from", "Look at earlyReturnAllowed, set mightReturnEarlyFromDoStep, and make progress in each step.";
    "event-mode" Error Conformance "-" "2.3.5" Loaded(three::event_mode);
        "Events are handled in event mode", "Accept fmi3EnterEventMode at communication points, and let fmi3UpdateDiscreteStates come to an end; or clear hasEventMode.";
    "configuration-mode" Error Conformance "-" "2.3.6" Loaded(three::configuration_mode);
        "Structural parameters can be set in configuration mode", "Accept fmi3EnterConfigurationMode after fmi3InstantiateCoSimulation, and allocate arrays anew in fmi3ExitConfigurationMode.";
    "setup-tolerance" Error Conformance "2.1.6" "2.3.2" Loaded(lifecycle::setup_tolerance);
        "An instance initialises with the tolerance of its default experiment", "Accept toleranceDefined = fmi2True in fmi2SetupExperiment, and leave the tolerance aside where no solver needs it.";
    INSTANCES_REPEATED = "instances-repeated" Error Conformance "2.1.5" "2.3.1" Learning(instances::repeated);
        "A second instance can be made after the first was freed", "Undo in fmi2FreeInstance what fmi2Instantiate did for the whole process, or set canBeInstantiatedOnlyOncePerProcess.";
    DETERMINISM = "determinism" Warning Robustness "2.1" "2.2" Learning(lifecycle::determinism);
        "Equal runs give equal results", "Initialise all memory; keep clocks and unseeded random numbers out of the model.";
    TERMINATE = "terminate" Error Conformance "2.1.6" "2.3.4" Loaded(lifecycle::terminate);
        "Instances can be terminated, and freed at any time", "Let fmi2Terminate succeed after initialisation, and fmi2FreeInstance in every state.";
    "terminated" Error Conformance "4.2.4" "2.3.8" Loaded(experiment::terminated);
        "After fmi2Terminate the final values can be read", "Keep the values until fmi2FreeInstance or fmi2Reset.";
    "free-null" Error Conformance "2.1.5" "2.3.1" Loaded(lifecycle::free_null);
        "fmi2FreeInstance of a null pointer does nothing", "Return at once when the component is null.";
    UNLOAD = "unload" Warning Robustness "2.1.5" "2.3.1" Raw(lifecycle::unload);
        "The binary can be unloaded and the process ends well", "Join threads and remove exit handlers in fmi2FreeInstance.";
    GUID_CHECK = "guid-check" Note Robustness "2.1.5" "2.3.1" Loaded(lifecycle::guid);
        "A wrong GUID is refused", "Compare the GUID in fmi2Instantiate and return null; it guards against a binary and an XML of different versions.";
    "resources-missing" Warning Robustness "2.1.5" "2.3.1" Loaded(lifecycle::resources);
        "A resources folder that is not there is survived", "Return null from fmi2Instantiate, with a message, when a resource cannot be read.";
    RESOURCES_PATH = "resources-path" Warning Conformance "2.1.5" "2.3.1" Raw(surroundings::resources);
        "Resources are found in a folder with blanks and umlauts", "fmuResourceLocation is a URI (RFC 3986): decode %20 and the like before opening files.";
    "resources-uri" Warning Conformance "2.1.5" "-" Raw(surroundings::short_uri);
        "Resources are found by a URI without an authority, file:/path", "Take both file:/path and file:///path for fmuResourceLocation: the standard asks for both, and importers in Java write the first.";
    START_TIME = "start-time" Error Conformance "2.1.6" "2.3.2" Loaded(start::start_time);
        "The start time is where the run begins", "Take startTime of fmi2SetupExperiment for the initial time.";
    "start-time-effect" Note Robustness "2.1.6" "2.3.2" Indirect(start::effect);
        "What depends on the time starts at the start time", "Count the time of excitations from startTime, not from the beginning of the run; or leave the independent variable out of the dependencies of what does not depend on it.";
    "stop-time" Note Conformance "2.1.6" "2.3.2" Loaded(experiment::stop_time);
        "A step past the stop time is refused", "Return fmi2Error when stopTimeDefined is true and a step would end after stopTime.";
    "start-values" Error Conformance "2.2.7" "2.4.7" Loaded(values::start_values);
        "Start values of the binary are those of modelDescription.xml", "Generate both from one source; a host that sets nothing simulates another model than the XML says.";
    "start-settable" Error Conformance "4.2.4" "2.3.2" Loaded(values::start_settable);
        "Start values can be set before initialisation", "Accept fmi2SetXXX of inputs, and of variables with initial exact or approx, after fmi2Instantiate.";
    "initial-readable" Error Conformance "4.2.4" "2.3.3" Loaded(settings::initial_readable);
        "Outputs can be read in initialisation mode", "Accept fmi2GetXXX of outputs between fmi2EnterInitializationMode and fmi2ExitInitializationMode; importers solve loops over several FMUs there.";
    "inputs-initial" Error Conformance "4.2.4" "2.3.3" Loaded(experiment::inputs_initial);
        "Inputs set before and during initialisation are there after it", "Do not set inputs back to their start values in fmi2EnterInitializationMode or fmi2ExitInitializationMode.";
    "parameters-initial" Error Conformance "4.2.4" "2.3.3" Indirect(experiment::parameters_initial);
        "Parameters set in initialisation mode are there after it, and act", "Accept fmi2SetXXX of variables with initial exact until fmi2ExitInitializationMode, and compute there what follows from them.";
    "set-get" Error Conformance "2.1.7" "2.2.6.2" Loaded(values::set_get);
        "Parameters and inputs read as they were set", "Store each value under its own reference.";
    "set-get-other" Error Conformance "2.1.7" "-" Indirect(settings::others);
        "Integer, Boolean and String parameters read as they were set", "Store each value under its own reference, and keep it during initialisation; store a text whole, however long it is, or return fmi2Error.";
    "set-together" Error Conformance "2.1.7" "-" Indirect(settings::joint);
        "Values set in one call, or in another order, are those set one by one", "Take value[i] for the reference vr[i], and let no setter change another variable; compute what follows in fmi2ExitInitializationMode.";
    "set-twice" Error Conformance "2.1.7" "-" Indirect(settings::twice);
        "Of two values set at one instant the second counts", "Store the value in each call.";
    "string-copied" Error Conformance "2.1.7" "-" Loaded(settings::copied);
        "Strings that are set are copied", "Copy the text in fmi2SetString; the importer may free or overwrite its own when the call has come back.";
    "set-get-rounded" Note Robustness "2.1.7" "2.2.6.2" Indirect(values::set_get_rounded);
        "Parameters and inputs are kept to the last digit", "Keep Reals as 64-bit numbers; what is cut to 32 bits comes back as another number.";
    "get-consistent" Error Robustness "2.1.7" "2.2.6.2" Loaded(observed::get_consistent);
        "Reading changes nothing, and values do not depend on how they are read", "Compute outputs without side effects on the state.";
    BOOLEAN_VALUES = "boolean-values" Error Conformance "2.1.2" "2.2.6.2" Loaded(observed::boolean_values);
        "Booleans are fmi2False (0) or fmi2True (1)", "Normalise with !!value.";
    STRING_VALUES = "string-values" Error Conformance "2.1.7" "2.2.6.2" Learning(references::string_values);
        "Strings are not null, UTF-8, and there until the next call", "Return an empty string for no text, convert from other encodings, and keep the memory until fmi2GetString or fmi2FreeInstance is called next.";
    "string-buffers" Error Conformance "2.1.7" "2.2.6.2" Loaded(references::string_buffers);
        "Strings read together are those read one by one", "Give each String variable a buffer of its own.";
    "unchanging" Error Conformance "2.2.7" "2.4.7" Loaded(observed::unchanging);
        "Constant, fixed and parameter variables do not change by themselves", "Declare the variable discrete or continuous, or leave its value alone.";
    "output-finite" Error Robustness "2.1.7" "2.2.6.2" Loaded(observed::finite);
        "Outputs are finite", "Return fmi2Discard or fmi2Error instead of passing NaN or infinity on.";
    "output-range" Warning Conformance "2.2.7" "2.2.6.3" Loaded(observed::range);
        "Calculated values keep within min and max, and to the items of their enumeration", "Correct the limits, or the model.";
    "tunable-set" Error Conformance "4.2.4" "4.2.1" Loaded(changes::tunable_set);
        "Tunable parameters can be set during a run", "Accept fmi2SetXXX between steps, or declare the parameter fixed.";
    "tunable-effect" Warning Conformance "2.2.7" "4.2.1" Indirect(changes::tunable_effect);
        "Tunable parameters act when they are set during a run", "Use the present value in each step, or declare the parameter fixed.";
    "fixed-set" Note Robustness "4.2.4" "4.2.1" Loaded(changes::fixed_set);
        "Fixed and constant variables cannot be set during a run", "Return fmi2Error, or declare the parameter tunable when it takes effect.";
    "bad-reference-get" Note Robustness "2.1.7" "2.2.6.2" Loaded(references::bad_reference_get);
        "Reading an unknown value reference is refused", "Return fmi2Error in the default branch; a wrong connection goes unnoticed otherwise.";
    "bad-reference-set" Note Robustness "2.1.7" "2.2.6.2" Loaded(references::bad_reference_set);
        "Setting an unknown value reference is refused", "Return fmi2Error in the default branch; a wrong connection goes unnoticed otherwise.";
    REFERENCE_BITS = "reference-bits" Note Robustness "2.1.7" "2.2.6.2" Loaded(references::bits);
        "Value references are looked at whole", "Keep value references as 32-bit numbers; cut ones meet another variable's.";
    "empty-call" Warning Robustness "2.1.7" "2.2.6.2" Loaded(references::empty);
        "Reading and setting no variables at all succeeds", "Return fmi2OK when nvr is 0, before looking at the arrays.";
    "array-count" Note Robustness "-" "2.2.6.2" Loaded(three::array_count);
        "Too few values for an array are refused", "Compare nValues with the elements of the variables and return fmi3Error; memory beyond the importer's is read or written otherwise.";
    "reset" Error Conformance "2.1.6" "2.3.1" Loaded(reset::reset);
        "fmi2Reset restores a new instance", "Restore states, parameters, inputs and all internal memory to what fmi2Instantiate made them.";
    "reset-rounded" Note Robustness "2.1.6" "2.3.1" Indirect(rounded::reset);
        "A run after fmi2Reset is that of a new instance to the last digit", "Let fmi2Reset forget what the solver remembers, its step size, order and last derivative; a run after others cannot be reproduced otherwise.";
    "state-restore" Error Conformance "2.1.8" "2.2.6.4" Loaded(state::restore);
        "fmi2SetFMUstate restores everything", "Copy all that influences the future: states, inputs, parameters, event times, solver memory.";
    "state-rounded" Note Robustness "2.1.8" "2.2.6.4" Indirect(rounded::state);
        "A run from a restored state is the one before to the last digit", "Keep in the FMU state what the solver remembers: its step size, order and last derivative.";
    "state-handles" Error Conformance "2.1.8" "2.2.6.4" Loaded(state::handles);
        "FMU states can be overwritten and freed as the standard says", "Reuse a state that is passed in, set it to null when freed, ignore null.";
    "state-serialise" Error Conformance "2.1.8" "2.2.6.4" Loaded(state::serialise);
        "A state serialised and read back is the same, in another instance too", "Serialise the whole state, and no pointers.";
    "state-leak" Warning Robustness "2.1.8" "2.2.6.4" Indirect(leaks::state_leak);
        "States that are freed leave no memory behind", "Free in fmi2FreeFMUstate all that fmi2GetFMUstate and fmi2DeSerializeFMUstate took.";
    "step-size" Error Conformance "4.2.2" "4.2.1" Loaded(step_size::honoured);
        "communicationStepSize is honoured", "Integrate to currentCommunicationPoint + communicationStepSize.";
    "step-convergence" Warning Robustness "4.2.2" "4.2.1" Loaded(step_size::convergence);
        "Results converge as the step shrinks", "Scale whatever happens once a call with the step size, or sub-step internally.";
    "output-delay" Warning Robustness "4.2.2" "4.2.1" Indirect(delay::delay);
        "Outputs are those at the end of the step", "Compute outputs after the integration, from the new states.";
    "step-variable" Error Conformance "4.3.1" "4.4" Loaded(step_size::variable);
        "Steps of varying size give the results of equal ones", "Use the size of the present step, or clear canHandleVariableCommunicationStepSize.";
    "step-rounding" Warning Robustness "4.2.2" "4.2.1" Indirect(step_size::rounding);
        "Communication points and the stop time need not be met to the last digit", "Compare times with a tolerance of some units in the last place; importers that add step after step are off by their rounding.";
    "step-negative" Note Robustness "4.2.2" "4.2.1" Loaded(steps::negative);
        "A step backwards is refused", "Return fmi2Error or fmi2Discard for communicationStepSize < 0.";
    "step-zero" Warning Robustness "4.2.2" "4.2.1" Loaded(steps::zero);
        "A step of size 0 does no harm", "Do not divide by communicationStepSize.";
    "step-wrong-point" Note Robustness "4.2.2" "4.2.1" Loaded(steps::wrong_point);
        "A step from another point than the communication point is refused", "Compare currentCommunicationPoint with the time reached and return fmi2Error.";
    "step-early" Note Robustness "4.2.4" "4.2.1" Loaded(steps::early);
        "A step before initialisation is refused", "Keep track of the state of the calling sequence and return fmi2Error.";
    "step-late" Note Robustness "4.2.4" "4.2.1" Loaded(steps::late);
        "A step after termination is refused", "Keep track of the state of the calling sequence and return fmi2Error.";
    "initialisation-order" Note Robustness "4.2.4" "2.3.3" Loaded(steps::initialisation_order);
        "Initialisation out of order is refused", "Keep track of the state of the calling sequence and return fmi2Error.";
    "nan-input" Warning Robustness "2.1.7" "2.2.6.2" Loaded(steps::nan_input);
        "Inputs that are NaN, infinite or huge are survived", "Bound iterations, and return fmi2Error or fmi2Discard when they do not converge.";
    "status-functions" Warning Robustness "4.2.3" "-" Loaded(steps::status_functions);
        "Status functions and fmi2CancelStep come back when nothing is pending", "Return fmi2Discard or fmi2Error.";
    "time-variable" Error Conformance "2.2.7" "2.4.7" Loaded(steps::time);
        "The independent variable is the communication point", "Return startTime after initialisation, and the end of the step after each step.";
    "derivative-value" Warning Conformance "2.2.7" "2.4.7" Loaded(steps::derivative);
        "Variables declared as derivatives are the slope of their state", "Correct the derivative attribute's index or the value.";
    "input-derivatives" Error Conformance "4.2.1" "-" Loaded(interpolation::input_derivatives);
        "Input derivatives are taken, and zero ones change nothing", "Implement fmi2SetRealInputDerivatives or clear canInterpolateInputs.";
    "input-derivatives-effect" Error Conformance "4.3.1" "-" Indirect(interpolation::effect);
        "Input derivatives have an effect", "Let the input run along its slope during the step, or clear canInterpolateInputs.";
    "input-derivatives-course" Warning Robustness "4.2.1" "-" Indirect(slope::course);
        "The input runs along its derivative", "Let the input be value + derivative * (t - currentCommunicationPoint) during the step.";
    OUTPUT_DERIVATIVES = "output-derivatives" Error Conformance "4.2.1" "2.2.12" Loaded(interpolation::output_derivatives);
        "Output derivatives are given", "Implement fmi2GetRealOutputDerivatives or set maxOutputDerivativeOrder to 0.";
    "directional-derivative" Error Conformance "2.1.9" "2.2.11" Loaded(partial::directional);
        "Directional derivatives are those that perturbation shows", "Check signs, factors and the order of the arguments; solvers diverge on wrong ones.";
    "dependencies-hold" Error Conformance "2.2.8" "2.2.10" Loaded(dependencies::outputs);
        "Outputs depend directly on declared inputs alone", "Add the input to the output's dependencies; masters order the FMUs and find algebraic loops by them.";
    "dependencies-soon" Note Robustness "2.2.8" "2.2.10" Indirect(dependencies::outputs_soon);
        "Outputs answer within a step to declared inputs alone", "Add the input to the output's dependencies, if it is there that the output is computed from it.";
    "dependencies-initial" Note Robustness "2.2.8" "2.2.10" Indirect(dependencies::initial);
        "Initial unknowns and outputs depend on declared knowns alone at initialisation", "Add the known to the dependencies, or leave the attribute out, which stands for all.";
    "dependencies-constant" Error Conformance "2.2.8" "2.2.10" Indirect(dependencies::kinds);
        "Dependencies declared constant are", "Declare the kind dependent (or fixed, tunable, discrete).";
    "dependencies-time" Note Conformance "2.2.8" "2.2.10" Indirect(dependencies::time);
        "Outputs that depend on the time say so", "Add the independent variable to the output's dependencies.";
    "instances-independent" Error Conformance "2.1.5" "2.3.1" Loaded(instances::independent);
        "Instances in one process do not affect each other", "Keep all state in the component, or set canBeInstantiatedOnlyOncePerProcess.";
    "instances-sequential" Error Conformance "2.1.5" "2.3.1" Loaded(instances::sequential);
        "An instance keeps nothing of one before it", "Keep parameters and start values in the component, not in static memory.";
    "instances-threads" Note Robustness "2.1.5" "2.3.1" Loaded(instances::threads);
        "Instances on several threads do not affect each other", "Keep scratch memory in the component, and lock what is shared.";
    "thread-handover" Note Robustness "2.1.5" "2.3.1" Loaded(instances::handover);
        "An instance goes on when another thread calls it", "Keep state in the component, not in thread-local storage.";
    "instance-leak" Warning Robustness "2.1.5" "2.3.1" Loaded(leaks::instance_leak);
        "Freed instances leave no memory behind", "Free in fmi2FreeInstance all that fmi2Instantiate and the steps took.";
    "instance-leak-large" Error Robustness "2.1.5" "2.3.1" Loaded(leaks::instance_leak_large);
        "Freed instances leave no large memory, files or threads behind", "Free, close and join in fmi2FreeInstance all that fmi2Instantiate and the steps took: hosts that vary parameters make thousands of instances.";
    "null-component" Note Robustness "2.1" "2.2" Loaded(lifecycle::null_component);
        "Calls without an instance are survived", "Return fmi2Error when the component is null.";
    "step-leak" Warning Robustness "2.1.5" "2.3.1" Loaded(leaks::step_leak);
        "Steps do not use up memory", "Free or reuse what each fmi2DoStep allocates.";
    "callbacks-copied" Note Robustness "2.1.5" "-" Loaded(effects::callbacks);
        "The callbacks and the instance name are copied", "Copy the structure and the name in fmi2Instantiate; some hosts free theirs afterwards.";
    "instance-name" Warning Robustness "2.1.5" "2.3.1" Loaded(settings::name);
        "A long instance name, with percent signs and letters beyond ASCII, is survived", "Allocate as much as the name needs, and pass it to printf through \"%s\".";
    "allocation-failure" Warning Robustness "2.1.5" "-" Loaded(effects::allocation);
        "Failing memory callbacks are survived", "Check what allocateMemory returns, and return null from fmi2Instantiate.";
    "debug-logging" Error Conformance "2.1.5" "2.3.1" Loaded(effects::debug_logging);
        "Declared log categories can be switched on and off", "Accept every category of LogCategories in fmi2SetDebugLogging.";
    "logging-off" Warning Conformance "2.1.5" "2.3.1" Loaded(effects::logging_off);
        "Nothing is logged with fmi2OK where debug logging is off", "Look at loggingOn, of fmi2Instantiate and of each fmi2SetDebugLogging, before calling the logger with fmi2OK; what goes with fmi2Warning and worse is due all the same.";
    "log-categories" Warning Quality "2.2.4" "2.4.5" Loaded(effects::log_categories);
        "Log messages are of declared categories", "Declare the category in LogCategories, so that users can choose it.";
    "log-chosen" Note Conformance "2.1.5" "2.3.1" Indirect(effects::log_chosen);
        "Debug messages are of the log categories that are chosen", "After fmi2SetDebugLogging(fmi2True) log debug messages of every category where nCategories = 0, and otherwise only those of the categories in the list.";
    "log-unknown" Warning Robustness "2.1.5" "2.3.1" Loaded(effects::log_unknown);
        "A log category that is not declared is survived", "Return fmi2Error for a category that the FMU does not know, or leave it aside; users mistype them.";
    SIDE_DIRECTORY = "side-directory" Error Robustness "2.3" "2.5.1" Raw(effects::directory);
        "The working directory stays", "Open files by the path of fmuResourceLocation instead.";
    "side-rounding" Error Robustness "2.1" "2.2" Raw(effects::rounding);
        "The floating-point environment stays", "Restore rounding, exception masks and flush-to-zero before returning; -ffast-math changes them when the library is loaded.";
    SIDE_STDOUT = "side-stdout" Warning Robustness "2.1.5" "2.2.3" Raw(effects::stdout);
        "Nothing is printed to standard output", "Use the logger callback.";
    "side-signals" Warning Robustness "2.1" "2.2" Raw(effects::signals);
        "Signal handlers stay", "Leave signals to the host.";
    "side-process" Warning Robustness "2.1" "2.2" Raw(effects::process);
        "Limits, masks, timers and standard descriptors of the process stay", "Leave umask, blocked signals, timers, limits and the descriptors 0 to 2 to the host.";
    "side-environment" Warning Robustness "2.1" "2.2" Raw(effects::environment);
        "Environment variables stay", "Pass settings inside the FMU.";
    "side-locale" Warning Robustness "2.1" "2.2" Raw(effects::locale);
        "The locale of numbers stays", "Use uselocale or explicit formats instead of setlocale.";
    "locale-numbers" Warning Robustness "2.1.5" "2.3.1" Raw(surroundings::locale);
        "Numbers are read alike whatever the host's locale", "Use strtod_l with the C locale, std::from_chars or the like: a host with a user interface may have a decimal comma.";
    "side-files" Warning Robustness "2.3" "2.5.1" Raw(effects::files);
        "No files are written to the working directory", "Write to a temporary folder, and remove it in fmi2FreeInstance.";
    }
}
