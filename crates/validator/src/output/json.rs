//! For programs.

use serde_json::{Value, json};

use super::super::rules::{Outcome, Report, RuleStatus, Severity, rule};

/// The report as JSON, `eixo.validation/1`.
#[must_use]
pub fn json(report: &Report, strict: bool) -> Value {
    let findings: Vec<Value> = report
        .findings
        .iter()
        .map(|f| {
            let rule = rule(&f.rule);
            let mut value = json!({
                "rule": f.rule,
                "severity": rule.map(|r| r.severity),
                "kind": rule.map(|r| r.kind),
                "section": rule.and_then(|r| r.section(report.fmi)),
                "message": f.message,
            });
            if let Some(place) = &f.place {
                value["file"] = json!(place.file);
                if let Some(position) = place.position {
                    value["line"] = json!(position.line);
                    value["column"] = json!(position.column);
                }
            }
            if let Some(call) = &f.call {
                value["call"] = json!(call);
            }
            value["advice"] = json!(f.advice.clone().or(rule.map(|r| r.advice(report.fmi))));
            value
        })
        .collect();
    let rules: Vec<Value> = report
        .rules
        .iter()
        .map(|(rule, status)| {
            let (name, why) = status_text(status);
            let mut value = json!({ "id": rule.id, "verdict": name });
            if let Some(why) = why {
                value["why"] = json!(why);
            }
            value
        })
        .collect();
    json!({
        "schema": "eixo.validation/1",
        "file": report.file,
        "model": report.model,
        "standard": report.fmi.standard(),
        "outcome": match report.outcome(strict) {
            Outcome::Passes => "passes",
            Outcome::Fails => "fails",
            Outcome::NotTested => "not_tested",
        },
        "passes": report.passes(strict),
        "static": report.static_only,
        "strict": strict,
        "counts": {
            "error": report.count(Severity::Error),
            "warning": report.count(Severity::Warning),
            "note": report.count(Severity::Note),
        },
        "findings": findings,
        "rules": rules,
        "remarks": report.remarks,
    })
}

/// The name of a status in JSON, with its reason.
pub(super) fn status_text(status: &RuleStatus) -> (&'static str, Option<&str>) {
    match status {
        RuleStatus::Passed => ("passed", None),
        RuleStatus::Failed => ("failed", None),
        RuleStatus::NotTested(why) => ("not_tested", Some(why)),
        RuleStatus::NotApplicable(why) => ("not_applicable", Some(why)),
        RuleStatus::Skipped => ("skipped", None),
    }
}
