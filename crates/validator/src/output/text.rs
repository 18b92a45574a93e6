//! For a person: grouped by severity, with the source line and what to do.

use std::fmt::Write as _;

use super::super::description::Fmi;
use super::super::rules::{Finding, Outcome, RULES, Report, Rule, RuleStatus, Severity, rule};

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

/// The report as text; `color` with ANSI colours. Findings of one rule and one cause are written once, with how many there
/// are; with `all`, each.
#[must_use]
pub fn text(report: &Report, strict: bool, color: bool, all: bool) -> String {
    let paint = Paint(color);
    let mut out = String::new();
    let causes = causes(report, all);
    for severity in [Severity::Error, Severity::Warning, Severity::Note] {
        for cause in &causes {
            if let Some(rule) = rule(&cause[0].rule)
                && rule.severity == severity
            {
                write_cause(&mut out, report, cause, rule, &paint);
            }
        }
    }
    write_rest(&mut out, report, strict, &paint);
    out
}

/// The findings by cause: of one rule, and alike but for names and numbers.
fn causes(report: &Report, all: bool) -> Vec<Vec<&Finding>> {
    let mut groups: Vec<(String, Vec<&Finding>)> = Vec::new();
    for finding in &report.findings {
        let cause = format!("{} {}", finding.rule, cause(&finding.message));
        match groups.iter_mut().find(|(key, _)| !all && *key == cause) {
            Some((_, group)) => group.push(finding),
            None => groups.push((cause, vec![finding])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// A message without its names, in quotes, and its numbers.
fn cause(message: &str) -> String {
    let mut out = String::new();
    let mut quoted = false;
    let mut number = false;
    for c in message.chars() {
        match c {
            '"' => {
                quoted = !quoted;
                out.push('"');
            }
            _ if quoted => {}
            // Signs and exponents belong to a number that has begun; letters end it.
            '0'..='9' => number = true,
            '.' | '+' | '-' | 'e' | 'E' if number => {}
            _ => {
                number = false;
                if c != '-' {
                    out.push(c);
                }
            }
        }
    }
    out
}

/// The first name in quotes of a message.
fn named(message: &str) -> Option<&str> {
    message.split('"').nth(1)
}

/// How many rules are named that one cause kept from being tested.
const SHOWN: usize = 8;
/// How many names are given of findings that have one cause.
const NAMES: usize = 5;

/// Control characters of an FMU's texts shown as what they are, so that they cannot steer the terminal; a tab is a blank.
fn printable(text: &str) -> String {
    let shown = |c: char| match c {
        '\t' => ' ',
        c if c.is_control() && c != '\n' => '\u{FFFD}',
        c => c,
    };
    text.chars().map(shown).collect()
}

fn write_cause(out: &mut String, report: &Report, cause: &[&Finding], rule: &Rule, paint: &Paint) {
    let finding = cause[0];
    let message = printable(&finding.message);
    let _ = writeln!(out, "{} {}: {message}", paint.severity(rule.severity), paint.with("1", format!("[{}]", rule.id)));
    if let Some(place) = &finding.place {
        let position = place.position.map_or(String::new(), |p| format!(":{p}"));
        let _ = writeln!(out, "  {} {}{position}", paint.with("34", "-->"), printable(&place.file));
        if let Some(position) = place.position
            && let Some(line) = report.source.get(position.line as usize - 1)
        {
            let column = position.column as usize - 1;
            // Long lines are quoted around the place.
            let from = if line.chars().count() > QUOTE { column.saturating_sub(10) } else { 0 };
            let quote: String = line.chars().skip(from).take(QUOTE).collect();
            let number = position.line.to_string();
            let bar = paint.with("34", "|");
            let _ = writeln!(out, " {} {bar} {}", paint.with("34", &number), printable(&quote));
            let caret = paint.with("1", "^");
            let _ =
                writeln!(out, " {} {bar} {}{caret}", " ".repeat(number.len()), " ".repeat(column.saturating_sub(from)));
        }
    }
    if let Some(call) = &finding.call {
        let _ = writeln!(out, "  {} in {}", paint.with("34", "-->"), printable(call));
    }
    if cause.len() > 1 {
        let names: Vec<String> = cause[1..]
            .iter()
            .filter_map(|f| named(&f.message))
            .take(NAMES)
            .map(|n| format!("\"{}\"", printable(n)))
            .collect();
        let more = if cause.len() - 1 > names.len() { ", ..." } else { "" };
        let names = if names.is_empty() { String::new() } else { format!(": {}{more}", names.join(", ")) };
        let _ =
            writeln!(out, "  {} and {} more like it{names} (--all lists each)", paint.with("34", "+"), cause.len() - 1);
    }
    let _ = writeln!(
        out,
        "  {} {} ({}, section {}; {})\n",
        paint.with("34", "="),
        finding.advice.clone().unwrap_or_else(|| rule.advice(report.fmi)),
        report.fmi.standard(),
        rule.section(report.fmi).unwrap_or("-"),
        rule.kind
    );
}

fn write_rest(out: &mut String, report: &Report, strict: bool, paint: &Paint) {
    let mut untested: Vec<(&str, Vec<&str>)> = Vec::new();
    for (rule, status) in &report.rules {
        if let RuleStatus::NotTested(why) = status {
            match untested.iter_mut().find(|(w, _)| w == why) {
                Some((_, ids)) => ids.push(rule.id),
                None => untested.push((why, vec![rule.id])),
            }
        }
    }
    if !untested.is_empty() && !report.static_only {
        let _ = writeln!(out, "{}", paint.with("1", "Not tested (which is not passed):"));
        for (why, ids) in untested {
            let shown = if ids.len() > SHOWN { format!("{} rules", ids.len()) } else { ids.join(", ") };
            let _ = writeln!(out, "  {}: {shown}", printable(why));
        }
        out.push('\n');
    }
    for remark in &report.remarks {
        let _ = writeln!(out, "{}\n", printable(remark));
    }
    let count = |is_so: fn(&RuleStatus) -> bool| report.rules.iter().filter(|(_, v)| is_so(v)).count();
    let verdict = match report.outcome(strict) {
        Outcome::Passes if report.static_only => paint.with("1;32", "passes the static rules"),
        Outcome::Passes => paint.with("1;32", "passes"),
        Outcome::Fails => paint.with("1;31", "fails"),
        Outcome::NotTested => paint.with("1;33", "was not tested beyond its archive and XML"),
    };
    let _ = writeln!(
        out,
        "{} {verdict}{}: {}, {}, {}; {} rules passed, {} not applicable, {} not tested",
        printable(&report.file),
        match (strict, report.static_only) {
            (true, true) => " (--strict, --static: nothing of it was run)",
            (true, false) => " (--strict)",
            (false, true) => " (--static: nothing of it was run)",
            (false, false) => "",
        },
        plural(report.count(Severity::Error), "error"),
        plural(report.count(Severity::Warning), "warning"),
        plural(report.count(Severity::Note), "note"),
        count(|v| *v == RuleStatus::Passed),
        count(|v| matches!(v, RuleStatus::NotApplicable(_))),
        count(|v| matches!(v, RuleStatus::NotTested(_))),
    );
}

fn plural(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// The list of rules as Markdown.
#[must_use]
pub fn rules_text() -> String {
    let mut out = String::from(
        "| rule | severity | kind | FMI 2.0.4 | FMI 3.0 | what holds | what to do |\n|---|---|---|---|---|---|---|\n",
    );
    for r in RULES {
        let _ = writeln!(
            out,
            "| `{}` | {} | {} | {} | {} | {} | {} |",
            r.id,
            r.severity,
            r.kind,
            r.sections[0],
            r.sections[1],
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
                "id": r.id, "title": r.title, "severity": r.severity, "kind": r.kind,
                "section": r.section(Fmi::Two), "section3": r.section(Fmi::Three),
                "advice": r.advice, "tests": if r.is_static() { "file" } else { "behaviour" },
            })
        })
        .collect();
    serde_json::json!({ "schema": "eixo.rules/1", "rules": rules })
}

#[cfg(test)]
mod tests {
    use super::cause;

    #[test]
    fn one_cause_has_one_key_whatever_the_names_and_numbers() {
        let of = |name: &str, a: &str, b: &str| format!("the parameter \"{name}\" was set to {a} and reads {b}");
        assert_eq!(cause(&of("a.b[1]", "1.05", "-1")), cause(&of("c", "1e-300", "0")));
        assert_ne!(cause(&of("a", "1", "2")), cause("the input \"a\" was set to 1 and reads 2"));
    }
}
