//! Mutations of `modelDescription.xml`.

use super::corpus::{self, Mutant, description, files, pack};

/// Name, rule, replacements.
type Mutation = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

const MUTATIONS: &[Mutation] = &[
    ("element not closed", "xml-well-formed", &[("</ModelStructure>", "")]),
    ("ampersand not escaped", "xml-well-formed", &[("Mass on a spring", "Mass & spring")]),
    ("attribute twice", "xml-well-formed", &[("modelName=\"Corpus\"", "modelName=\"Corpus\" modelName=\"Corpus\"")]),
    ("version of the standard's text", "fmi-version", &[("fmiVersion=\"2.0\"", "fmiVersion=\"2.0.4\"")]),
    ("no version", "fmi-version", &[("fmiVersion=\"2.0\"", "")]),
    (
        "no interface",
        "interface-missing",
        &[(
            "<CoSimulation modelIdentifier=\"corpus\" canHandleVariableCommunicationStepSize=\"true\" canInterpolateInputs=\"true\"\n      maxOutputDerivativeOrder=\"1\" canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"\n      providesDirectionalDerivative=\"true\"/>",
            "",
        )],
    ),
    ("element misspelt", "schema-element", &[("<LogCategories>", "<Logs>"), ("</LogCategories>", "</Logs>")]),
    (
        "elements out of order",
        "schema-element",
        &[
            ("<DefaultExperiment startTime=\"0\" stopTime=\"1\" tolerance=\"1e-6\" stepSize=\"0.01\"/>", ""),
            ("<TypeDefinitions>", "<DefaultExperiment startTime=\"0\" stopTime=\"1\"/><TypeDefinitions>"),
        ],
    ),
    ("variable without a type", "schema-element", &[("<Integer/>", "")]),
    (
        "empty list",
        "schema-element",
        &[("<Category name=\"logEvents\"/>\n    <Category name=\"logStatusError\"/>", "")],
    ),
    ("text between elements", "schema-element", &[("<Outputs>", "<Outputs>text")]),
    ("no model structure", "schema-element", &[("<ModelStructure>", "<!--"), ("</ModelStructure>", "-->")]),
    ("attribute misspelt", "schema-attribute", &[("start=\"mass\"", "start=\"mass\" desciption=\"x\"")]),
    ("attribute of FMI 3", "schema-attribute", &[("generationTool=\"eixo tests\"", "instantiationToken=\"x\"")]),
    ("no value reference", "schema-required", &[("name=\"z\" valueReference=\"7\"", "name=\"z\"")]),
    ("no guid", "schema-required", &[("guid=\"{7d6b4f0e-3a52-4c7e-9d0e-c0a3b1f2e4d5}\"", "")]),
    ("enumeration without a type", "schema-required", &[("<Enumeration declaredType=\"Level\"/>", "<Enumeration/>")]),
    (
        "no such causality",
        "schema-value",
        &[(
            "name=\"z\" valueReference=\"7\" causality=\"output\"",
            "name=\"z\" valueReference=\"7\" causality=\"Output\"",
        )],
    ),
    ("value reference below zero", "schema-value", &[("valueReference=\"10\"", "valueReference=\"-10\"")]),
    ("start is no number", "schema-value", &[("start=\"9.81\"", "start=\"9,81\"")]),
    ("start is no boolean", "schema-value", &[("start=\"false\"", "start=\"False\"")]),
    ("start beyond 32 bits", "schema-value", &[("max=\"3\" start=\"0\"", "max=\"3\" start=\"3000000000\"")]),
    ("no such kind of dependency", "schema-value", &[("\"constant constant\"", "\"constant linear\"")]),
    ("date without time", "date-time", &[("2026-01-02T03:04:05Z", "2026-01-02")]),
    ("month 13", "date-time", &[("2026-01-02T03:04:05Z", "2026-13-02T03:04:05Z")]),
    ("blank guid", "guid", &[("{7d6b4f0e-3a52-4c7e-9d0e-c0a3b1f2e4d5}", " ")]),
    ("no model name", "model-name", &[("modelName=\"Corpus\"", "modelName=\"\"")]),
    ("serialises without state", "capability-serialize", &[("canGetAndSetFMUstate=\"true\" ", "")]),
    (
        "source file missing",
        "source-files",
        &[(
            "providesDirectionalDerivative=\"true\"/>",
            "providesDirectionalDerivative=\"true\"><SourceFiles><File name=\"a.c\"/></SourceFiles></CoSimulation>",
        )],
    ),
    (
        "log category twice",
        "log-category",
        &[("<Category name=\"logEvents\"/>", "<Category name=\"logEvents\"/><Category name=\"logEvents\"/>")],
    ),
    (
        "vendor twice",
        "vendor-tool",
        &[(
            "<ModelVariables>",
            "<VendorAnnotations><Tool name=\"a\"/><Tool name=\"a\"/></VendorAnnotations><ModelVariables>",
        )],
    ),
    ("stops before it starts", "default-experiment", &[("startTime=\"0\"", "startTime=\"2\"")]),
    ("tolerance of zero", "default-experiment", &[("tolerance=\"1e-6\"", "tolerance=\"0\"")]),
    ("step below zero", "default-experiment", &[("stepSize=\"0.01\"", "stepSize=\"-0.01\"")]),
    ("step longer than the run", "default-experiment", &[("stepSize=\"0.01\"", "stepSize=\"10\"")]),
    ("unit twice", "unit-unique", &[("<Unit name=\"s\">", "<Unit name=\"N\"/><Unit name=\"s\">")]),
    (
        "display unit twice",
        "unit-unique",
        &[("factor=\"1000\"/>", "factor=\"1000\"/><DisplayUnit name=\"mm\" factor=\"1e3\"/>")],
    ),
    ("factor of zero", "unit-conversion", &[("factor=\"1000\"", "factor=\"0\"")]),
    ("display unit the wrong way round", "unit-known", &[("factor=\"1000\"", "factor=\"0.001\"")]),
    (
        "unit without its factor",
        "unit-known",
        &[("<Unit name=\"s\">", "<Unit name=\"min\"><BaseUnit s=\"1\"/></Unit><Unit name=\"s\">")],
    ),
    ("a limit of NaN", "min-max", &[("<Real min=\"0\" start=\"10\"/>", "<Real min=\"NaN\" start=\"10\"/>")]),
    ("unit not defined", "unit-undeclared", &[("<Real unit=\"N\"", "<Real unit=\"kN\"")]),
    (
        "unit of a type not defined",
        "unit-undeclared",
        &[("quantity=\"Length\" unit=\"m\" displayUnit=\"mm\"", "quantity=\"Length\" unit=\"km\"")],
    ),
    ("display unit not defined", "display-unit", &[("displayUnit=\"mm\"", "displayUnit=\"cm\"")]),
    (
        "display unit without unit",
        "display-unit",
        &[("<Real min=\"0\" start=\"10\"/>", "<Real displayUnit=\"mm\" min=\"0\" start=\"10\"/>")],
    ),
    (
        "type twice",
        "type-unique",
        &[(
            "<SimpleType name=\"Length\">",
            "<SimpleType name=\"Length\"><Real unit=\"m\"/></SimpleType><SimpleType name=\"Length\">",
        )],
    ),
    (
        "type named as a variable",
        "type-unique",
        &[("<SimpleType name=\"Length\">", "<SimpleType name=\"y\"><Real/></SimpleType><SimpleType name=\"Length\">")],
    ),
    (
        "type not defined",
        "type-undeclared",
        &[("<Enumeration declaredType=\"Level\"/>", "<Enumeration declaredType=\"Height\"/>")],
    ),
    ("type of another kind", "type-mismatch", &[("<Integer/>", "<Integer declaredType=\"Level\"/>")]),
    ("two items of one value", "enumeration-items", &[("name=\"high\" value=\"3\"", "name=\"high\" value=\"2\"")]),
    ("two items of one name", "enumeration-items", &[("name=\"high\" value=\"3\"", "name=\"low\" value=\"3\"")]),
    ("two variables of one name", "variable-name-unique", &[("name=\"z\"", "name=\"y\"")]),
    ("name against the convention", "variable-name", &[("name=\"label\"", "name=\"the label\"")]),
    ("no name", "variable-name", &[("name=\"label\"", "name=\"\"")]),
    (
        "continuous integer",
        "variability-type",
        &[(
            "name=\"n\" valueReference=\"0\" causality=\"output\" variability=\"discrete\"",
            "name=\"n\" valueReference=\"0\" causality=\"output\"",
        )],
    ),
    (
        "discrete parameter",
        "causality-variability",
        &[(
            "name=\"k\" valueReference=\"8\" causality=\"parameter\" variability=\"fixed\"",
            "name=\"k\" valueReference=\"8\" causality=\"parameter\" variability=\"discrete\"",
        )],
    ),
    (
        "fixed input",
        "causality-variability",
        &[(
            "name=\"F\" valueReference=\"5\" causality=\"input\" variability=\"continuous\"",
            "name=\"F\" valueReference=\"5\" causality=\"input\" variability=\"fixed\"",
        )],
    ),
    (
        "calculated parameter",
        "initial",
        &[(
            "name=\"k\" valueReference=\"8\" causality=\"parameter\" variability=\"fixed\"",
            "name=\"k\" valueReference=\"8\" causality=\"parameter\" variability=\"fixed\" initial=\"calculated\"",
        )],
    ),
    (
        "input with initial",
        "initial",
        &[(
            "name=\"on\" valueReference=\"0\" causality=\"input\" variability=\"discrete\"",
            "name=\"on\" valueReference=\"0\" causality=\"input\" variability=\"discrete\" initial=\"exact\"",
        )],
    ),
    ("parameter without start", "start-missing", &[("<Real min=\"0\" start=\"10\"/>", "<Real min=\"0\"/>")]),
    ("input without start", "start-missing", &[("<Boolean start=\"false\"/>", "<Boolean/>")]),
    (
        "calculated output with start",
        "start-forbidden",
        &[(
            "<Real unit=\"m\" min=\"-1000\" max=\"1000\"/>",
            "<Real unit=\"m\" min=\"-1000\" max=\"1000\" start=\"0\"/>",
        )],
    ),
    ("time with start", "start-forbidden", &[("<Real unit=\"s\"/>", "<Real unit=\"s\" start=\"0\"/>")]),
    (
        "start above max",
        "start-range",
        &[("<Real min=\"0\" start=\"10\"/>", "<Real min=\"0\" max=\"5\" start=\"10\"/>")],
    ),
    (
        "start below min",
        "start-range",
        &[("<Integer min=\"0\" max=\"3\" start=\"0\"/>", "<Integer min=\"1\" max=\"3\" start=\"0\"/>")],
    ),
    (
        "start is no item",
        "start-range",
        &[
            (
                "name=\"level\" valueReference=\"2\" causality=\"output\" variability=\"discrete\"><Enumeration declaredType=\"Level\"/>",
                "name=\"level\" valueReference=\"2\" causality=\"output\" variability=\"discrete\" initial=\"exact\"><Enumeration declaredType=\"Level\" start=\"4\"/>",
            ),
            (
                "<Unknown index=\"12\"/>\n      <Unknown index=\"14\"/>\n      <Unknown index=\"16\"/>\n      <Unknown index=\"18\"/>\n    </InitialUnknowns>",
                "<Unknown index=\"12\"/>\n      <Unknown index=\"16\"/>\n      <Unknown index=\"18\"/>\n    </InitialUnknowns>",
            ),
        ],
    ),
    ("min above max", "min-max", &[("min=\"-1000\" max=\"1000\"", "min=\"1000\" max=\"-1000\"")]),
    (
        "nominal of zero",
        "nominal",
        &[("<Real min=\"0\" start=\"10\"/>", "<Real min=\"0\" nominal=\"0\" start=\"10\"/>")],
    ),
    (
        "two times",
        "independent-variable",
        &[(
            "</ModelVariables>",
            "<ScalarVariable name=\"t\" valueReference=\"0\" causality=\"independent\"><Real unit=\"s\"/></ScalarVariable></ModelVariables>",
        )],
    ),
    ("derivative of nothing", "derivative-index", &[("derivative=\"2\"", "derivative=\"99\"")]),
    ("derivative of a parameter", "derivative-index", &[("derivative=\"2\"", "derivative=\"9\"")]),
    ("derivative by value reference of a string", "derivative-index", &[("derivative=\"2\"", "derivative=\"17\"")]),
    ("reinit in co-simulation", "reinit", &[("derivative=\"2\"", "derivative=\"2\" reinit=\"true\"")]),
    (
        "two parameters of one reference",
        "alias",
        &[("name=\"d\" valueReference=\"9\"", "name=\"d\" valueReference=\"8\"")],
    ),
    (
        "constant alias of a variable",
        "alias",
        &[("name=\"der(v)\" valueReference=\"4\"", "name=\"der(v)\" valueReference=\"10\"")],
    ),
    (
        "an alias without a unit",
        "alias-unit-missing",
        &[("name=\"k\" valueReference=\"8\"", "name=\"k\" valueReference=\"7\"")],
    ),
    ("aliases of two units", "alias-unit", &[("name=\"z\" valueReference=\"7\"", "name=\"z\" valueReference=\"6\"")]),
    (
        "index beyond the variables",
        "structure-index",
        &[(
            "<Unknown index=\"7\" dependencies=\"2 6\" dependenciesKind=\"constant constant\"/>",
            "<Unknown index=\"77\"/>",
        )],
    ),
    (
        "index of zero",
        "structure-index",
        &[(
            "<Unknown index=\"7\" dependencies=\"2 6\" dependenciesKind=\"constant constant\"/>",
            "<Unknown index=\"0\"/>",
        )],
    ),
    ("output twice", "structure-duplicate", &[("<Outputs>", "<Outputs><Unknown index=\"12\"/>")]),
    (
        "output not listed",
        "structure-outputs",
        &[("<Unknown index=\"8\" dependencies=\"3\" dependenciesKind=\"constant\"/>", "")],
    ),
    ("input among the outputs", "structure-outputs", &[("<Outputs>", "<Outputs><Unknown index=\"6\"/>")]),
    (
        "state among the derivatives",
        "structure-derivatives",
        &[("<Derivatives>", "<Derivatives><Unknown index=\"3\"/>")],
    ),
    (
        "initial unknown missing",
        "structure-initial-unknowns",
        &[("<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>", "<InitialUnknowns>")],
    ),
    (
        "no initial unknowns",
        "structure-initial-unknowns-absent",
        &[("<InitialUnknowns>", "<!--"), ("</InitialUnknowns>", "-->")],
    ),
    (
        "parameter among the initial unknowns",
        "structure-initial-unknowns",
        &[(
            "<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\"/>\n      <Unknown index=\"7\"/>\n      <Unknown index=\"8\"/>",
            "<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\"/>\n      <Unknown index=\"7\"/>\n      <Unknown index=\"8\"/>\n      <Unknown index=\"9\"/>",
        )],
    ),
    (
        "initial unknowns out of order",
        "structure-order",
        &[(
            "<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\"/>",
            "<InitialUnknowns>\n      <Unknown index=\"5\"/>\n      <Unknown index=\"4\" dependencies=\"3\"/>",
        )],
    ),
    ("dependency beyond the variables", "dependencies-index", &[("dependencies=\"2 6\"", "dependencies=\"2 66\"")]),
    ("dependency twice", "dependencies-index", &[("dependencies=\"2 6\"", "dependencies=\"2 2\"")]),
    ("dependencies out of order", "dependencies-order", &[("dependencies=\"2 6\"", "dependencies=\"6 2\"")]),
    ("dependency on a parameter", "dependencies-known", &[("dependencies=\"2 6\"", "dependencies=\"2 9\"")]),
    ("fewer kinds than dependencies", "dependencies-kind", &[("\"constant constant\"", "\"constant\"")]),
    (
        "kinds without dependencies",
        "dependencies-kind",
        &[("dependencies=\"2 6\" dependenciesKind=\"constant constant\"", "dependenciesKind=\"constant constant\"")],
    ),
    ("constant kind of a boolean", "dependencies-kind-real", &[("dependencies=\"2 6\"", "dependencies=\"2 15\"")]),
];

pub fn mutants() -> Vec<Mutant> {
    let of = |&(name, rule, replacements): &Mutation| {
        Mutant::new(name, rule, move || pack(&files(&description(replacements))))
    };
    let mut all: Vec<Mutant> = MUTATIONS.iter().map(of).collect();
    all.push(Mutant::new("identifier with a hyphen", "model-identifier", || {
        let mut files = files(&description(&[("modelIdentifier=\"corpus\"", "modelIdentifier=\"cor-pus\"")]));
        files[1].0 = "binaries/linux64/cor-pus.so".into();
        pack(&files)
    }));
    all.push(Mutant::new("a byte that is not UTF-8", "xml-well-formed", || {
        let mut files = files(corpus::DESCRIPTION);
        let at = corpus::DESCRIPTION.find("spring").unwrap();
        files[0].1[at] = 0xFF;
        pack(&files)
    }));
    all
}

#[test]
fn findings_name_line_and_column() {
    let text = description(&[("start=\"9.81\"", "start=\"9,81\"")]);
    let line = text.lines().position(|l| l.contains("9,81")).unwrap();
    let column = text.lines().nth(line).unwrap().find("start=").unwrap();
    let report = corpus::validate(&pack(&files(&text)), true);
    let position = report.findings[0].place.as_ref().unwrap().position.unwrap();
    assert_eq!((position.line as usize, position.column as usize), (line + 1, column + 1));
}
