//! `eixo validate` on a corpus of deliberately broken FMUs, each killed by exactly the rule meant, and of unusual but
//! legal ones, which have no finding at all.
//!
//! The corpus is one small C FMU with switchable defects (`tests/corpus/fmu.c`, compiled here with `cc`) and mutations
//! of its `modelDescription.xml` and archive. Without a C compiler the behavioural part says so and is skipped.

#![cfg(unix)]
// Helpers beside the test functions may fail as these do.
#![allow(clippy::unwrap_used)]

mod archives;
mod cli;
mod contained;
mod corpus;
mod defects;
mod descriptions;
mod foreign;
mod hostile;
mod pipeline;
#[path = "../program/skip.rs"]
mod skip;
mod three;
mod variants;

use std::collections::BTreeSet;

use corpus::{Mutant, parallel};
use eixo::fmu::rules::RULES;

fn static_mutants() -> Vec<Mutant> {
    descriptions::mutants().into_iter().chain(archives::mutants()).collect()
}

fn kill(mutants: &[Mutant], static_only: bool) {
    let failures = parallel(mutants, |mutant| {
        let report = corpus::validate(&mutant.build(), static_only);
        let found: BTreeSet<&str> = report.findings.iter().map(|f| f.rule.as_str()).collect();
        let expected = BTreeSet::from([mutant.rule]);
        (found != expected)
            .then(|| format!("{}: expected {expected:?}, found {found:?}: {:#?}", mutant.name, report.findings))
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn each_mutant_of_the_archive_and_the_description_is_killed_by_exactly_the_rule_meant() {
    kill(&static_mutants(), true);
}

#[test]
fn each_defect_of_the_binary_is_killed_by_exactly_the_rule_meant() {
    if corpus::compiler() {
        kill(&defects::mutants(), false);
    }
}

#[test]
fn every_rule_has_a_mutant_and_every_mutant_a_rule() {
    let two = static_mutants().into_iter().chain(defects::mutants());
    let mutants: Vec<Mutant> = two.chain(three::mutants()).collect();
    let aimed: BTreeSet<&str> = mutants.iter().map(|m| m.rule).collect();
    let rules: BTreeSet<&str> = RULES.iter().map(|r| r.id).collect();
    assert_eq!(aimed, rules);
    assert!(mutants.len() >= 60, "{}", mutants.len());
    let names: BTreeSet<&str> = mutants.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names.len(), mutants.len(), "two mutants of one name");
}

#[test]
fn unusual_but_legal_fmus_have_no_finding_at_all() {
    if !corpus::compiler() {
        return;
    }
    let failures = parallel(&variants::variants(), |variant| {
        let report = corpus::validate(&variant.bytes, false);
        (!report.findings.is_empty()).then(|| format!("{}: {:#?}", variant.name, report.findings))
    });
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Writes the mutants as files for `scripts/validators.py`, which asks other validators about them: into the folder
/// `EIXO_MUTANTS`. Not a test: it runs where it is asked for.
#[test]
#[ignore = "writes files for scripts/validators.py"]
fn writes_the_mutants() {
    let folder = std::env::var_os("EIXO_MUTANTS").map(std::path::PathBuf::from).expect("EIXO_MUTANTS names a folder");
    let running = if corpus::compiler() { defects::mutants() } else { Vec::new() };
    let groups = [
        ("2.0 archive and XML", static_mutants()),
        ("2.0 binary", running),
        ("3.0 archive and XML", three::static_mutants()),
        ("3.0 binary", if corpus::compiler() { three::running_mutants() } else { Vec::new() }),
    ];
    for (name, mutants) in groups {
        let folder = folder.join(name);
        std::fs::create_dir_all(&folder).unwrap();
        for mutant in mutants {
            let plain: String = mutant.name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
            std::fs::write(folder.join(format!("{}--{plain}.fmu", mutant.rule)), mutant.build()).unwrap();
        }
    }
}
