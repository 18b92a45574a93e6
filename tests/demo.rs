//! `eixo demo` and `eixo circle` as a user runs them.

use std::path::Path;

#[path = "program/run.rs"]
mod run;

use run::eixo_in;

fn text(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

#[test]
fn the_demonstration_ends_in_reports_with_the_papers_figures_and_the_hidden_causes() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = eixo_in(folder.path(), &["demo", "-o", "out"]);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let plain = said.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(said.contains("Every method finds the parameters of the FMU again from its trace."), "{said}");
    assert!(
        plain.contains(
            "The model leaves out 2 things: play in coupling or nut (at the coupling); Coulomb friction of motor and screw (at the motor)."
        ),
        "{said}"
    );
    // What was hidden, and the torque that nothing accounts for.
    assert!(plain.contains("Beside that no cause explains"), "{said}");
    let diagnosed = said.find("The model leaves out").expect("the diagnosis");
    assert!(diagnosed < said.find("Every method finds").expect("the paper's experiment"), "{said}");
    let out = folder.path().join("out");
    let report = text(&out, "report.html");
    // Figures 4 to 13 of the paper.
    for title in [
        "Excitation",
        "Spectrum of the excitation",
        "K as it is estimated",
        "B as it is estimated",
        "I2 as it is estimated",
        "I1 as it is estimated",
        "Spectra of the estimated torque",
        "Error of the torque estimated by Least squares",
        "Error of the torque estimated by Recursive least squares",
        "Error of the torque estimated by Extended least squares, recursive",
    ] {
        assert!(report.contains(&format!("<h3>{title}</h3>")), "{title}");
    }
    assert!(report.contains("Table 5."));
    // It opens with the machine that disagrees, then the circle; the paper's figures stand folded behind them.
    let at = |what: &str| report.find(what).unwrap_or_else(|| panic!("{what}"));
    let order = [
        "the gap is here",
        "How far the gap shrinks</h2>",
        "What it does to a circle</h2>",
        "<details>",
        "<h3>Excitation</h3>",
    ];
    assert!(order.windows(2).all(|w| at(w[0]) < at(w[1])), "{order:?}");
    for (page, others) in [
        ("report.html", ["diagnosis.html", "circle.html"]),
        ("diagnosis.html", ["report.html", "circle.html"]),
        ("circle.html", ["report.html", "diagnosis.html"]),
    ] {
        let page = text(&out, page);
        assert!(others.iter().all(|o| page.contains(&format!("href=\"{o}\""))), "{others:?}");
    }
    assert!(text(&out, "diagnosis.html").contains("the gap is here"));
    assert!(
        text(&out, "circle.html").contains("coulomb_motor on X") && text(&out, "circle.html").contains("backlash on X")
    );
    assert!(std::fs::read(out.join("axis.fmu")).expect("an FMU").starts_with(b"PK"));
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("file"), "").expect("a file");
    let output = eixo_in(folder.path(), &["demo", "-o", "file/out"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("file/out"));
}

#[test]
fn the_circular_test_names_what_acts_on_the_axes_and_refuses_nonsense() {
    let folder = tempfile::tempdir().expect("a folder");
    let axis = "name = \"X\"\n[parameters]\nI1 = 2.37e-4\nI2 = 6.07e-6\nB = 5.4e-4\nK = 1.76e-2\nrho = 3.18e-4\n\
                [effects.coulomb_motor]\nlevel = 0.004\n";
    std::fs::write(folder.path().join("x.toml"), axis).expect("a file");
    let output = eixo_in(folder.path(), &["circle", "x.toml", "--report", "c.html", "-o", "c.csv"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains("coulomb_motor on X and Y") && said.contains("peak at +X"), "{said}");
    assert!(text(folder.path(), "c.html").contains("Axes with their effects: radial deviation, magnified"));
    assert!(text(folder.path(), "c.csv").starts_with("x [m],y [m]\n"));
    let output = eixo_in(folder.path(), &["circle", "--feed", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("feed"));
}
