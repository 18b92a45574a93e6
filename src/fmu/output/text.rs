//! For a person: grouped by severity, with the source line and the way out.

use std::fmt::Write as _;

use super::super::rules::{Finding, RULES, Report, Rule, Severity, Verdict, rule};

/// Longest part of a source line that is quoted, in characters.
const QUOTE: usize = 120;

struct Paint(bool);

impl Paint {
    fn with(&self, code: &str, text: impl std::fmt::Display) -> String {
        if self.0 { format!("\u{1b}[{code}m{text}\u{1b}[0m") } else { text.to_string() }
    }

    fn severity(&self, severity: Severity) -> String {
        let code = match severity {
            Severity::Error => "1;31",
            Severity::Warning => "1;33",
            Severity::Note => "1;36",
        };
        self.with(code, severity)
    }
}

/// The report as text; `color` with ANSI colours.
#[must_use]
pub fn text(report: &Report, strict: bool, color: bool) -> String {
    let paint = Paint(color);
    let mut out = String::new();
    for severity in [Severity::Error, Severity::Warning, Severity::Note] {
        for finding in &report.findings {
            if let Some(rule) = rule(&finding.rule)
                && rule.severity == severity
            {
                write_finding(&mut out, report, finding, rule, &paint);
            }
        }
    }
    write_rest(&mut out, report, strict, &paint);
    out
}

/// Control characters of an FMU's texts shown as what they are, so that they cannot steer the terminal.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() && c != '\n' { '\u{FFFD}' } else { c }).collect()
}

fn write_finding(out: &mut String, report: &Report, finding: &Finding, rule: &Rule, paint: &Paint) {
    let message = plain(&finding.message);
    let _ = writeln!(out, "{} {}: {message}", paint.severity(rule.severity), paint.with("1", format!("[{}]", rule.id)));
    if let Some(place) = &finding.place {
        let position = place.position.map_or(String::new(), |p| format!(":{p}"));
        let _ = writeln!(out, "  {} {}{position}", paint.with("34", "-->"), plain(&place.file));
        if let Some(position) = place.position
            && let Some(line) = report.source.get(position.line as usize - 1)
        {
            let column = position.column as usize - 1;
            // Long lines are quoted around the place.
            let from = if line.chars().count() > QUOTE { column.saturating_sub(10) } else { 0 };
            let quote: String = line.chars().skip(from).take(QUOTE).collect();
            let number = position.line.to_string();
            let bar = paint.with("34", "|");
            let _ = writeln!(out, " {} {bar} {}", paint.with("34", &number), plain(&quote));
            let caret = paint.with("1", "^");
            let _ =
                writeln!(out, " {} {bar} {}{caret}", " ".repeat(number.len()), " ".repeat(column.saturating_sub(from)));
        }
    }
    if let Some(call) = &finding.call {
        let _ = writeln!(out, "  {} in {}", paint.with("34", "-->"), plain(call));
    }
    let _ = writeln!(
        out,
        "  {} {} (FMI 2.0.4, section {}; {})\n",
        paint.with("34", "="),
        rule.advice,
        rule.section,
        rule.kind
    );
}

fn write_rest(out: &mut String, report: &Report, strict: bool, paint: &Paint) {
    let mut untested: Vec<(&str, Vec<&str>)> = Vec::new();
    for (rule, verdict) in &report.rules {
        if let Verdict::NotTested(why) = verdict {
            match untested.iter_mut().find(|(w, _)| w == why) {
                Some((_, ids)) => ids.push(rule.id),
                None => untested.push((why, vec![rule.id])),
            }
        }
    }
    if !untested.is_empty() {
        let _ = writeln!(out, "{}", paint.with("1", "Not tested (which is not passed):"));
        for (why, ids) in untested {
            let _ = writeln!(out, "  {}: {}", plain(why), ids.join(", "));
        }
        out.push('\n');
    }
    for remark in &report.remarks {
        let _ = writeln!(out, "{}\n", plain(remark));
    }
    let count = |verdict: fn(&Verdict) -> bool| report.rules.iter().filter(|(_, v)| verdict(v)).count();
    let verdict = if report.passes(strict) { paint.with("1;32", "passes") } else { paint.with("1;31", "fails") };
    let _ = writeln!(
        out,
        "{} {verdict}{}: {}, {}, {}; {} rules passed, {} not applicable, {} not tested",
        plain(&report.file),
        if strict { " (strict)" } else { "" },
        plural(report.count(Severity::Error), "error"),
        plural(report.count(Severity::Warning), "warning"),
        plural(report.count(Severity::Note), "note"),
        count(|v| *v == Verdict::Passed),
        count(|v| matches!(v, Verdict::NotApplicable(_))),
        count(|v| matches!(v, Verdict::NotTested(_))),
    );
}

fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// The list of rules as Markdown.
#[must_use]
pub fn rules_text() -> String {
    let mut out =
        String::from("| rule | severity | kind | FMI 2.0.4 | what holds | what to do |\n|---|---|---|---|---|---|\n");
    for r in RULES {
        let _ = writeln!(
            out,
            "| `{}` | {} | {} | {} | {} | {} |",
            r.id,
            r.severity,
            r.kind,
            r.section,
            r.title,
            r.advice.replace('|', "\\|").replace('<', "&lt;")
        );
    }
    out
}

/// The list of rules as JSON.
#[must_use]
pub fn rules_json() -> serde_json::Value {
    let rules: Vec<_> = RULES
        .iter()
        .map(|r| {
            serde_json::json!({
                "id": r.id, "title": r.title, "severity": r.severity, "kind": r.kind, "section": r.section,
                "advice": r.advice, "tests": if r.check.is_static() { "file" } else { "behaviour" },
            })
        })
        .collect();
    serde_json::json!({ "schema": "eixo.rules/1", "rules": rules })
}
