//! Unusual but legal FMUs.

use super::corpus::{self, DESCRIPTION, description, pack, running};

pub struct Variant {
    pub name: String,
    pub bytes: Vec<u8>,
}

type Replacements = &'static [(&'static str, &'static str)];

const INTERFACE: &str = "<CoSimulation modelIdentifier=\"corpus\" canHandleVariableCommunicationStepSize=\"true\" canInterpolateInputs=\"true\"\n      maxOutputDerivativeOrder=\"1\" canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"\n      providesDirectionalDerivative=\"true\"/>";

const TEXTS: &[(&str, Replacements)] = &[
    ("as it is", &[]),
    (
        "namespaces",
        &[(
            "<fmiModelDescription ",
            "<fmiModelDescription xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:noNamespaceSchemaLocation=\"fmi2ModelDescription.xsd\" ",
        )],
    ),
    (
        "comments and instructions",
        &[
            ("<ModelVariables>", "<!-- variables --><?tool hint?><ModelVariables><!-- first -->"),
            ("</fmiModelDescription>", "</fmiModelDescription><!-- end -->"),
        ],
    ),
    (
        "annotations of a variable",
        &[(
            "<String start=\"mass\"/>",
            "<String start=\"mass\"/><Annotations><Tool name=\"a\"><x:dialog xmlns:x=\"urn:x\" group=\"1\">text<deep><deeper/></deep></x:dialog></Tool><Tool name=\"b\"/></Annotations>",
        )],
    ),
    (
        "vendor annotations",
        &[(
            "<ModelVariables>",
            "<VendorAnnotations><Tool name=\"a\"><anything at=\"all\">text</anything></Tool><Tool name=\"b\"/></VendorAnnotations><ModelVariables>",
        )],
    ),
    ("fraction of a second", &[("2026-01-02T03:04:05Z", "2026-01-02T03:04:05.123456Z")]),
    ("date with an offset", &[("2026-01-02T03:04:05Z", "2024-02-29T23:59:59+05:30")]),
    ("date without a zone", &[("2026-01-02T03:04:05Z", "2026-01-02T03:04:05")]),
    (
        "units as Dymola writes them",
        &[(
            "<Unit name=\"s\">",
            "<Unit name=\"rad\"><BaseUnit rad=\"1\"/><DisplayUnit name=\"deg\" factor=\"57.29577951308232\"/></Unit><Unit name=\"K\"><BaseUnit K=\"1\"/><DisplayUnit name=\"degC\" offset=\"-273.15\"/></Unit><Unit name=\"Pa\"><BaseUnit kg=\"1\" m=\"-1\" s=\"-2\"/><DisplayUnit name=\"bar\" factor=\"1E-05\"/></Unit><Unit name=\"rad/s\"><BaseUnit s=\"-1\"/><DisplayUnit name=\"rpm\" factor=\"9.549296585513721\"/></Unit><Unit name=\"%\"><BaseUnit factor=\"0.01\"/></Unit><Unit name=\"s\">",
        )],
    ),
    (
        "unit with all exponents",
        &[(
            "<Unit name=\"s\">",
            "<Unit name=\"odd\"><BaseUnit kg=\"-1\" m=\"+2\" s=\"3\" A=\"-4\" K=\"5\" mol=\"6\" cd=\"-7\" rad=\"8\" factor=\"1.8E+0\" offset=\"-4.5967e2\"/></Unit><Unit name=\"s\">",
        )],
    ),
    ("unit without base", &[("<Unit name=\"s\"><BaseUnit s=\"1\"/></Unit>", "<Unit name=\"s\"/>")]),
    (
        "display unit with an offset",
        &[("factor=\"1000\"/>", "factor=\"1000\"/><DisplayUnit name=\"other\" factor=\"-2\" offset=\"1\"/>")],
    ),
    (
        "empty unit",
        &[
            ("<Unit name=\"s\">", "<Unit name=\"\"/><Unit name=\"s\">"),
            ("<Real min=\"0\" start=\"10\"/>", "<Real unit=\"\" min=\"0\" start=\"10\"/>"),
        ],
    ),
    (
        "types of every kind",
        &[
            (
                "<SimpleType name=\"Length\">",
                "<SimpleType name=\"Count\" description=\"any\"><Integer quantity=\"q\" min=\"-5\" max=\"5000\"/></SimpleType><SimpleType name=\"Flag\"><Boolean/></SimpleType><SimpleType name=\"Words\"><String/></SimpleType><SimpleType name=\"Length\">",
            ),
            ("<Integer/>", "<Integer declaredType=\"Count\"/>"),
            ("<Boolean/></ScalarVariable>", "<Boolean declaredType=\"Flag\"/></ScalarVariable>"),
            ("<String/></ScalarVariable>", "<String declaredType=\"Words\"/></ScalarVariable>"),
        ],
    ),
    (
        "enumeration with gaps and below zero",
        &[(
            "<Item name=\"low\" value=\"1\"/>",
            "<Item name=\"none\" value=\"-7\" description=\"x\"/><Item name=\"low\" value=\"1\"/>",
        )],
    ),
    (
        "booleans as digits",
        &[
            ("canInterpolateInputs=\"true\"", "canInterpolateInputs=\"1\""),
            ("<Boolean start=\"false\"/>", "<Boolean start=\"0\"/>"),
        ],
    ),
    (
        "numbers in other spellings",
        &[
            ("start=\"9.81\"", "start=\" +0.981E1 \""),
            ("start=\"0.5\"", "start=\".5\""),
            ("stopTime=\"1\"", "stopTime=\"1.\""),
        ],
    ),
    ("infinite limits", &[("min=\"-1000\" max=\"1000\"", "min=\"-INF\" max=\"INF\"")]),
    (
        "all attributes of a variable",
        &[
            (
                "<Real min=\"0\" start=\"10\"/>",
                "<Real quantity=\"Stiffness\" relativeQuantity=\"false\" unbounded=\"true\" nominal=\"10\" min=\"0\" max=\"1e9\" start=\"10\"/>",
            ),
            (
                "name=\"F\" valueReference=\"5\"",
                "name=\"F\" description=\"force &lt;N&gt; &#233;\" canHandleMultipleSetPerTimeInstant=\"false\" valueReference=\"5\"",
            ),
        ],
    ),
    (
        "single quotes and blanks",
        &[
            ("modelName=\"Corpus\"", "modelName\n=\n'Corpus \"2\"'"),
            ("dependencies=\"2 6\"", "dependencies=\"  2\n 6 \""),
        ],
    ),
    (
        "no dependencies at all",
        &[
            ("dependencies=\"2 6\" dependenciesKind=\"constant constant\"", ""),
            ("<Unknown index=\"8\" dependencies=\"3\" dependenciesKind=\"constant\"/>", "<Unknown index=\"8\"/>"),
        ],
    ),
    (
        "empty dependencies",
        &[(
            "<Unknown index=\"12\"/>\n      <Unknown index=\"14\"/>\n      <Unknown index=\"16\"/>\n      <Unknown index=\"18\"/>\n    </Outputs>",
            "<Unknown index=\"12\" dependencies=\"\" dependenciesKind=\"\"/>\n      <Unknown index=\"14\" dependencies=\"2\" dependenciesKind=\"dependent\"/>\n      <Unknown index=\"16\"/>\n      <Unknown index=\"18\"/>\n    </Outputs>",
        )],
    ),
    (
        "outputs in another order",
        &[(
            "<Unknown index=\"12\"/>\n      <Unknown index=\"14\"/>\n      <Unknown index=\"16\"/>\n      <Unknown index=\"18\"/>\n    </Outputs>",
            "<Unknown index=\"18\"/>\n      <Unknown index=\"16\"/>\n      <Unknown index=\"14\"/>\n      <Unknown index=\"12\"/>\n    </Outputs>",
        )],
    ),
    (
        "no derivatives exposed",
        &[
            (
                "<Derivatives>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\"/>\n    </Derivatives>",
                "",
            ),
            (
                "<InitialUnknowns>\n      <Unknown index=\"4\" dependencies=\"3\"/>\n      <Unknown index=\"5\"/>",
                "<InitialUnknowns>",
            ),
        ],
    ),
    (
        "no default experiment",
        &[("<DefaultExperiment startTime=\"0\" stopTime=\"1\" tolerance=\"1e-6\" stepSize=\"0.01\"/>", "")],
    ),
    (
        "default experiment that says little",
        &[(
            "<DefaultExperiment startTime=\"0\" stopTime=\"1\" tolerance=\"1e-6\" stepSize=\"0.01\"/>",
            "<DefaultExperiment tolerance=\"1e-6\"/>",
        )],
    ),
    ("starts before zero", &[("startTime=\"0\"", "startTime=\"-0.5\"")]),
    (
        "flat names",
        &[
            ("variableNamingConvention=\"structured\"", "variableNamingConvention=\"flat\""),
            ("name=\"label\"", "name=\"the label, 'as' it [is] \u{e9}\u{4e2d}\""),
        ],
    ),
    (
        "structured names",
        &[
            ("name=\"label\"", "name=\"a.b[1].'quoted \\'name\\' #1'.c_2[3,4]\""),
            ("name=\"text\"", "name=\"der(der(x))\""),
        ],
    ),
    (
        "alias",
        &[(
            "</ModelVariables>",
            "<ScalarVariable name=\"z_alias\" valueReference=\"7\" causality=\"local\"><Real unit=\"m/s\" min=\"-1e6\"/></ScalarVariable></ModelVariables>",
        )],
    ),
    (
        "one reference of two types",
        &[(
            "</ModelVariables>",
            "<ScalarVariable name=\"mode_alias\" valueReference=\"1\" causality=\"local\" variability=\"discrete\"><Integer/></ScalarVariable></ModelVariables>",
        )],
    ),
    (
        "no log categories, types or units in use",
        &[(
            "<LogCategories>\n    <Category name=\"logEvents\"/>\n    <Category name=\"logStatusError\"/>\n  </LogCategories>",
            "",
        )],
    ),
    (
        "both interfaces",
        &[(
            "<UnitDefinitions>",
            "<ModelExchange modelIdentifier=\"corpus\" completedIntegratorStepNotNeeded=\"true\"/><UnitDefinitions>",
        )],
    ),
    ("no capability", &[(INTERFACE, "<CoSimulation modelIdentifier=\"corpus\"/>")]),
    (
        "approximate output",
        &[(
            "name=\"z\" valueReference=\"7\" causality=\"output\" variability=\"continuous\"><Real unit=\"m/s\"/>",
            "name=\"z\" valueReference=\"7\" causality=\"output\" variability=\"continuous\" initial=\"calculated\"><Real unit=\"m/s\"/>",
        )],
    ),
];

pub fn variants() -> Vec<Variant> {
    let mut all = Vec::new();
    let mut add = |name: &str, bytes: Vec<u8>| all.push(Variant { name: name.to_owned(), bytes });
    for (name, replacements) in TEXTS {
        // Structured names cannot nest derivatives; the variant uses the flat convention's freedom elsewhere.
        let text = description(replacements).replace("der(der(x))", "der(x,2)");
        add(name, pack(&running(&text, "NONE")));
    }
    let encoded = |bytes: Vec<u8>| {
        let mut files = running(DESCRIPTION, "NONE");
        files[0].1 = bytes;
        pack(&files)
    };
    let accented = DESCRIPTION.replace("Mass on a spring", "Masse \u{e0} ressort");
    add("byte order mark", encoded([b"\xEF\xBB\xBF", accented.as_bytes()].concat()));
    add("line ends of Windows", encoded(accented.replace('\n', "\r\n").into_bytes()));
    let latin = accented.replace("UTF-8", "ISO-8859-1");
    add("ISO-8859-1", encoded(latin.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect()));
    let wide = accented.replace("UTF-8", "UTF-16");
    let units = std::iter::once(0xFEFF).chain(wide.encode_utf16()).flat_map(u16::to_le_bytes);
    add("UTF-16", encoded(units.collect()));
    add("no XML declaration", encoded(DESCRIPTION.lines().skip(1).collect::<Vec<_>>().join("\n").into_bytes()));

    let mut files = running(DESCRIPTION, "NONE");
    for name in [
        "documentation/index.html",
        "model.png",
        "extra/org.example/data.json",
        "sources/a.c",
        "binaries/aarch64-linux/corpus.so",
    ] {
        files.push((name.to_owned(), b"content".to_vec()));
    }
    files.push(("documentation/licenses/".to_owned(), vec![]));
    add("other files", pack(&files));
    add("a text longer than a host makes room for", pack(&running(DESCRIPTION, "STRING_LONG")));
    let timed = description(&[super::defects::TIME_DECLARED]);
    add("an output that depends on the time", pack(&running(&timed, "TIME_HIDDEN")));
    all.push(empty_structure());
    all
}

/// An FMU without outputs and derivatives, and so with an empty model structure.
fn empty_structure() -> Variant {
    let (head, _) = DESCRIPTION.split_once("<ModelStructure>").unwrap();
    let text = format!("{head}<ModelStructure/>\n</fmiModelDescription>\n")
        .replace("causality=\"output\"", "causality=\"local\"");
    Variant { name: "empty model structure".to_owned(), bytes: pack(&running(&text, "NONE")) }
}

#[test]
fn a_model_exchange_fmu_gets_the_static_rules_and_a_plain_sentence() {
    let text = description(&[(INTERFACE, "<ModelExchange modelIdentifier=\"corpus\"/>")]);
    let report = corpus::validate(&pack(&corpus::files(&text)), false);
    assert!(report.findings.is_empty(), "{:#?}", report.findings);
    assert!(report.remarks.iter().any(|r| r.contains("behaviour was not tested")));
}
