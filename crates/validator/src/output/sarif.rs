//! For code scanning services: SARIF 2.1.0.

use serde_json::{Value, json};

use super::super::rules::{self, Report, RuleStatus, Severity, rule};

fn level(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Note => "note",
    }
}

/// The report as SARIF 2.1.0; places are inside the FMU, `model.fmu!/modelDescription.xml`.
#[must_use]
pub fn sarif(report: &Report) -> Value {
    let fmi = report.fmi;
    let rules: Vec<Value> = rules::of(fmi)
        .map(|r| {
            json!({
                "id": r.id,
                "shortDescription": { "text": r.title(fmi) },
                "help": { "text": r.advice(fmi) },
                "defaultConfiguration": { "level": level(r.severity) },
                "properties": { "kind": r.kind, "section": format!("{}, {}", fmi.standard(), r.section(fmi).unwrap_or("-")) },
            })
        })
        .collect();
    let results: Vec<Value> = report
        .findings
        .iter()
        .map(|f| {
            let uri = match &f.place {
                Some(place) => format!("{}!/{}", report.file, place.file),
                None => report.file.clone(),
            };
            let mut location = json!({ "artifactLocation": { "uri": encode(&uri) } });
            if let Some(position) = f.place.as_ref().and_then(|p| p.position) {
                location["region"] = json!({ "startLine": position.line, "startColumn": position.column });
            }
            let text = match &f.call {
                Some(call) => format!("{} (in {call})", f.message),
                None => f.message.clone(),
            };
            json!({
                "ruleId": f.rule,
                "ruleIndex": rules::of(fmi).position(|r| r.id == f.rule),
                "level": rule(&f.rule).map(|r| level(r.severity)),
                "message": { "text": text },
                "locations": [{ "physicalLocation": location }],
            })
        })
        .collect();
    let notices: Vec<Value> = report
        .rules
        .iter()
        .filter_map(|(rule, status)| match status {
            RuleStatus::NotTested(why) => Some(json!({
                "level": "note",
                "message": { "text": format!("not tested: {why}") },
                "associatedRule": { "id": rule.id },
            })),
            _ => None,
        })
        .collect();
    json!({
        "$schema": "https://json.schemastore.org/sarif-2.1.0.json",
        "version": "2.1.0",
        "runs": [{
            "tool": { "driver": {
                "name": "eixo validate",
                "version": env!("CARGO_PKG_VERSION"),
                "rules": rules,
            } },
            // Code scanning keeps one run for each id and tool, and refuses two of one in an upload.
            "automationDetails": { "id": format!("eixo validate/{}/", report.file.trim_start_matches("./")) },
            "results": results,
            "invocations": [{ "executionSuccessful": true, "toolExecutionNotifications": notices }],
        }],
    })
}

fn encode(path: &str) -> String {
    let mut uri = String::new();
    for byte in path.replace('\\', "/").bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~!:".contains(&byte) {
            uri.push(char::from(byte));
        } else {
            uri.push_str(&format!("%{byte:02X}"));
        }
    }
    uri
}
