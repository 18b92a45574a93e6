//! For continuous integration: JUnit XML, a test case a rule.

use std::fmt::Write as _;

use quick_xml::escape::escape;

use super::super::rules::{Finding, Report, RuleStatus, Severity};
use super::json::status_text;

/// The report as JUnit XML. Warnings fail a test case only when `strict`, notes never.
#[must_use]
pub fn junit(report: &Report, strict: bool) -> String {
    let fails = |severity: Severity| severity == Severity::Error || strict && severity == Severity::Warning;
    let mut cases = String::new();
    let (mut failures, mut skipped) = (0, 0);
    for (rule, status) in &report.rules {
        let name = clean(&format!("{}: {}", rule.id, rule.title));
        let _ = write!(cases, "    <testcase classname=\"eixo.validate.{}\" name=\"{name}\"", rule.kind);
        let found: Vec<&Finding> = report.findings.iter().filter(|f| f.rule == rule.id).collect();
        if let Some(first) = found.first() {
            let all: Vec<String> = found.iter().map(|f| line(f)).collect();
            let (tag, body) = if fails(rule.severity) {
                failures += 1;
                ("failure", clean(&all.join("\n")))
            } else {
                ("system-out", clean(&format!("{}: {}", rule.severity, all.join("\n"))))
            };
            let attributes = match tag {
                "failure" => format!(" type=\"{}\" message=\"{}\"", rule.severity, clean(&first.message)),
                _ => String::new(),
            };
            let _ = writeln!(cases, ">\n      <{tag}{attributes}>{body}</{tag}>\n    </testcase>");
        } else if *status == RuleStatus::Passed {
            cases.push_str("/>\n");
        } else {
            skipped += 1;
            let (name, why) = status_text(status);
            let message = clean(&why.map_or(name.to_owned(), |why| format!("{name}: {why}")));
            let _ = writeln!(cases, ">\n      <skipped message=\"{message}\"/>\n    </testcase>");
        }
    }
    let counts = format!("tests=\"{}\" failures=\"{failures}\" errors=\"0\" skipped=\"{skipped}\"", report.rules.len());
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {counts}>\n  <testsuite name=\"{}\" {counts}>\n{cases}  </testsuite>\n</testsuites>\n",
        clean(&report.file)
    )
}

fn line(finding: &Finding) -> String {
    let place = finding.place.as_ref().map_or(String::new(), |place| {
        let position = place.position.map_or(String::new(), |p| format!(":{p}"));
        format!("{}{position}: ", place.file)
    });
    let call = finding.call.as_ref().map_or(String::new(), |call| format!(" (in {call})"));
    format!("{place}{}{call}", finding.message)
}

/// Escaped, and without the characters that XML cannot hold.
fn clean(text: &str) -> String {
    let text: String = text
        .chars()
        .map(|c| if c.is_control() && c != '\n' || matches!(c, '\u{FFFE}' | '\u{FFFF}') { '\u{FFFD}' } else { c })
        .collect();
    escape(text).into_owned()
}
