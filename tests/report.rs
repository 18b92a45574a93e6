//! The report layer on a page with every kind of block: well-formed, escaped, self-contained, small, the same each time.
//! The page is left in the tests' temporary folder to be looked at.

use std::f64::consts::TAU;
use std::sync::Arc;

use eixo::report::polar::{PolarTrace, Ring};
use eixo::report::terminal::{self, Layout};
use eixo::report::{
    Axis, Block, Cell, ChainDiagram, Chart, Colour, Dash, Figure, Mark, Place, PolarPlot, Range, Report, Section,
    Series, Shape, Summary, Symbol, Table, Tone, html,
};
use quick_xml::events::Event;

/// A noise that needs no generator: the fractional part of a growing product.
fn noise(k: usize) -> f64 {
    (k as f64 * 0.754_877_666_246_693).fract() + (k as f64 * 0.569_840_290_998_053).fract() - 1.0
}

fn long_chart(samples: usize, name: &str) -> Chart {
    let t: Arc<[f64]> = (0..samples).map(|k| 4.6 * k as f64 / samples as f64).collect();
    let measured: Arc<[f64]> = t
        .iter()
        .enumerate()
        .map(|(k, t)| 2e-2 * (TAU * 1.3 * t).sin() + 1e-2 * (TAU * 4.0 * t).cos() + 1e-3 * noise(k))
        .collect();
    let before: Arc<[f64]> =
        t.iter().map(|t| 2.3e-2 * (TAU * 1.3 * t - 0.2).sin() + 0.8e-2 * (TAU * 4.0 * t).cos()).collect();
    let after: Arc<[f64]> = t.iter().map(|t| 2e-2 * (TAU * 1.3 * t).sin() + 1e-2 * (TAU * 4.0 * t).cos()).collect();
    Chart::new("Table angle on the held-out trace", Axis::linear("time", "s"), Axis::linear(name, "rad"))
        .with(Series::line("measured", t.clone(), measured).in_colour(Colour::Ink))
        .with(Series::line("before", t.clone(), before).in_colour(Colour::Vermillion).with_dash(Dash::Dashed))
        .with(Series::line("after", t, after).in_colour(Colour::Blue))
        .mark(Mark::Span(3.1, 4.6, "held out".into()))
        .mark(Mark::X(3.3, "first reversal after the start".into()))
}

fn figures() -> Vec<Figure> {
    let f: Vec<f64> = (1..=100).map(f64::from).collect();
    let lines: Vec<f64> = f.iter().map(|f| 1e-3 / (1.0 + (f / 40.0).powi(4)) * (1.2 + noise(*f as usize))).collect();
    let frf: Vec<f64> = f.iter().map(|f| 40.0 / (f * f) / ((1.0 - (f / 77.0).powi(2)).powi(2) + 1e-3).sqrt()).collect();
    let measured: Vec<f64> = frf.iter().enumerate().map(|(k, v)| v * (1.0 + 0.2 * noise(k))).collect();
    let low: Vec<f64> = measured.iter().map(|v| 0.8 * v).collect();
    let high: Vec<f64> = measured.iter().map(|v| 1.25 * v).collect();
    let k: Vec<f64> = (0..2048).map(f64::from).collect();
    let history: Vec<f64> = k
        .iter()
        .map(|k| {
            0.0176 + if *k < 9.0 { 300.0 * noise(*k as usize) } else { 1e-9 * (-k / 300.0).exp() * noise(*k as usize) }
        })
        .collect();
    let omega: Vec<f64> = k.iter().map(|k| 12.0 * (k * 0.01).sin() + noise(*k as usize)).collect();
    let friction: Vec<f64> =
        omega.iter().enumerate().map(|(i, w)| 2e-3 * w.signum() + 1e-5 * w + 2e-4 * noise(i)).collect();
    let steps: Vec<f64> = k.iter().take(40).map(|k| (k / 5.0).floor()).collect();
    vec![
        Figure::new(
            Chart::new("Excitation at its lines", Axis::log("frequency", "Hz"), Axis::linear("amplitude", "N.m"))
                .with(Series::new("", Shape::Stem, f.clone(), lines)),
            "Flat up to 10 times the natural frequency.",
        ),
        Figure::new(
            Chart::new(
                "Frequency response from torque to motor speed",
                Axis::log("frequency", "Hz"),
                Axis::log("gain", "rad/s/(N.m)"),
            )
            .with(Series::band("95 % of the measurements", f.clone(), low, high).in_colour(Colour::Grey))
            .with(Series::points("measured", f.clone(), measured).in_colour(Colour::Ink))
            .with(Series::line("model", f, frf))
            .mark(Mark::X(77.0, "resonance 77 Hz".into())),
            "",
        ),
        Figure::new(
            Chart::new("History of K", Axis::linear("sample", ""), Axis::linear("K", "N.m/rad").over(Range::Robust))
                .with(Series::line("RLS", k.clone(), history))
                .mark(Mark::Y(0.0176, "reference".into())),
            "The start-up transient leaves the plot.",
        ),
        Figure::new(
            Chart::new(
                "Residual torque against motor speed",
                Axis::linear("omega1", "rad/s"),
                Axis::linear("residual torque", "N.m"),
            )
            .with(Series::points("", omega, friction).in_colour(Colour::Blue)),
            "A step at standstill: dry friction.",
        ),
        Figure::new(
            Chart::new("Quantised position", Axis::linear("time", "s"), Axis::linear("counts", "")).with(Series::new(
                "held",
                Shape::Step,
                k[..40].to_vec(),
                steps,
            )),
            "",
        ),
        Figure::new(
            {
                let angle: Arc<[f64]> = (0..=3600).map(|k| TAU * f64::from(k) / 3600.0).collect();
                let glitch = |a: f64, at: f64| 6e-6 * (-((a - at) / 0.05).powi(2)).exp();
                let deviation = |gain: f64| -> Arc<[f64]> {
                    angle
                        .iter()
                        .map(|a| {
                            gain * (0..5).map(|q| glitch(*a, TAU / 4.0 * f64::from(q))).sum::<f64>()
                                + 1e-6 * (2.0 * a).cos()
                        })
                        .collect()
                };
                PolarPlot {
                    title: "Circular test, radius 50 mm".into(),
                    unit: "m".into(),
                    traces: vec![
                        PolarTrace {
                            name: "nominal".into(),
                            angle: angle.clone(),
                            deviation: deviation(0.0),
                            colour: None,
                            dash: Dash::Dashed,
                        },
                        PolarTrace {
                            name: "diagnosed".into(),
                            angle: angle.clone(),
                            deviation: deviation(1.0),
                            colour: None,
                            dash: Dash::Solid,
                        },
                    ],
                    full_scale: None,
                    radius: Some(0.05),
                    ring: Some(Ring { centre: (1e-6, 0.0), low: -1e-6, high: 5e-6, colour: Colour::Vermillion }),
                }
            },
            "Quadrant glitches where an axis reverses.",
        ),
    ]
}

fn chain() -> ChainDiagram {
    let place = |name: &str, symbol, note: &str, share, marked| Place {
        name: name.into(),
        symbol,
        note: note.into(),
        share: Some(share),
        marked,
    };
    ChainDiagram {
        title: String::new(),
        places: vec![
            place("input", Symbol::Input, "drive and command", 0.004, false),
            place("motor", Symbol::Motor, "inertia, screw, bearings", 0.913, true),
            place("coupling", Symbol::Coupling, "K, B", 0.051, false),
            place("table", Symbol::Table, "inertia, guide", 0.03, false),
            place("sensor", Symbol::Sensor, "encoders", 0.002, false),
        ],
    }
}

fn example(samples: usize, name: &str) -> Report {
    let mut ranking = Table::new(
        "Every hypothesis tried",
        ["cause", "place", "probability", "closure", "delta BIC", "inertia [kg.m2]"],
    );
    ranking.strong_row(vec![
        name.into(),
        "motor".into(),
        Cell::Bar(0.9991),
        Cell::Percent(0.991),
        Cell::number(0.0),
        Cell::Estimate(2.3701e-4, 1.2e-7, String::new()),
    ]);
    ranking.row(vec![
        "torque ripple".into(),
        "motor".into(),
        Cell::Bar(8e-4),
        Cell::Percent(0.62),
        Cell::number(1432.3),
        Cell::Empty,
    ]);
    Report {
        title: format!("Diagnosis of {name}"),
        subject: format!("{name} · holdout.csv · 8192 samples at 1.78 kHz"),
        sections: vec![
            Section::new(
                "",
                vec![
                    Block::Summary(Summary {
                        tone: Tone::Finding,
                        sentence: "Dry friction at the motor, which the model leaves out, causes 91 % of the gap.".into(),
                        detail: "With it in the model the error on the held-out trace falls from 18.2 % to 0.9 %, the noise floor being 0.8 %.".into(),
                        figures: vec![
                            ("closure".into(), Cell::Percent(0.991)),
                            ("Coulomb torque".into(), Cell::Estimate(2.04e-3, 1.3e-5, "N.m".into())),
                            ("probability".into(), Cell::Percent(0.9991)),
                        ],
                    }),
                    Block::figure(Figure::new(chain(), "Share of the gap at each place.")),
                ],
            ),
            Section::new(
                "How far the gap shrinks",
                vec![Block::figure(Figure::new(long_chart(samples, name), "Three model runs on data that no fit has seen."))],
            ),
            Section::new("Where", vec![Block::Warning(format!("One encoder only: {name}")), Block::Figures(figures())]),
            Section::new(
                "Which",
                vec![
                    Block::Table(ranking),
                    Block::KeyValues(vec![
                        ("inertia".into(), Cell::quantity(2.37e-4, "kg.m2")),
                        (name.to_owned(), Cell::text(name)),
                        ("samples".into(), Cell::Count(1_000_000)),
                    ]),
                    Block::Details("Settings".into(), vec![Block::Paragraph("Multiple shooting over windows of 500 samples.".into())]),
                ],
            ),
            Section::new(
                "What to do next",
                vec![Block::Steps(vec!["Put the friction into the model.".into(), format!("Run a slow sine on {name}.")])],
            ),
        ],
        footer: "eixo".into(),
    }
}

/// The page's `svg` elements, outermost only.
fn drawings(page: &str) -> Vec<&str> {
    let mut out = Vec::new();
    let (mut depth, mut start) = (0, 0);
    for (at, _) in page.match_indices('<') {
        if page[at..].starts_with("<svg") {
            if depth == 0 {
                start = at;
            }
            depth += 1;
        } else if page[at..].starts_with("</svg>") {
            depth -= 1;
            if depth == 0 {
                out.push(&page[start..at + 6]);
            }
        }
    }
    assert_eq!(depth, 0);
    out
}

#[test]
fn the_page_is_the_same_each_time_and_left_to_be_looked_at() {
    let page = html::page(&example(20_000, "axis X"));
    assert_eq!(page, html::page(&example(20_000, "axis X")));
    std::fs::write(concat!(env!("CARGO_TARGET_TMPDIR"), "/report.html"), &page)
        .expect("the tests' folder can be written");
}

#[test]
fn every_drawing_is_well_formed_named_and_free_of_missing_numbers() {
    let page = html::page(&example(3000, "axis X"));
    let all = drawings(&page);
    assert!(all.len() > 15, "{}", all.len());
    let mut named = 0;
    for svg in all {
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let mut reader = quick_xml::Reader::from_str(svg);
        reader.config_mut().check_end_names = true;
        loop {
            match reader.read_event().unwrap_or_else(|e| panic!("{e} in {svg}")) {
                Event::Start(e) => {
                    for a in e.attributes() {
                        a.unwrap_or_else(|e| panic!("{e} in {svg}"));
                    }
                }
                Event::Eof => break,
                _ => {}
            }
        }
        if svg.contains("role=\"img\"") {
            assert!(svg.contains("aria-label=\"") && svg.contains("<title>"), "{svg}");
            named += 1;
        } else {
            assert!(svg.contains("aria-hidden=\"true\""), "{svg}");
        }
    }
    assert!(named > 10);
}

#[test]
fn hostile_names_stay_text() {
    let attacks = [
        "<script>alert(1)</script>",
        "\"><img src=x onerror=alert(1)>",
        "' onmouseover='alert(1)",
        "</title></style></svg><script>",
        "&lt;b&gt; ]]> <!-- {{x}}",
        "\u{1b}[2J\u{202e}gpj.exe\0\r",
    ];
    let calm = html::page(&example(200, "name"));
    for attack in attacks {
        let page = html::page(&example(200, attack));
        let tags = |p: &str| p.matches('<').count();
        assert_eq!(tags(&page), tags(&calm), "no markup came in with {attack:?}");
        assert!(!page.contains('\u{1b}') && !page.contains('\u{202e}') && !page.contains('\0'));
        assert!(page.matches("<script").count() == 1 && !page.contains("<img"), "the page's own script alone");
        for svg in drawings(&page) {
            let mut reader = quick_xml::Reader::from_str(svg);
            while !matches!(reader.read_event().expect("well-formed"), Event::Eof) {}
        }
        let text = terminal::render(&example(200, attack), Layout::default());
        assert!(!text.contains('\u{1b}') && !text.contains('\0') && !text.contains('\r'), "{text:?}");
    }
}

#[test]
fn a_link_leads_to_a_plain_path_beside_the_page_or_is_text() {
    let mut table = Table::new("links", ["trace"]);
    let paths = ["reports/a-1.html", "javascript:alert(1)", "../../etc/passwd", "//host/x", "reports/\"><script>.html"];
    paths.iter().for_each(|path| table.row(vec![Cell::Link("name".to_owned(), (*path).to_owned())]));
    let sections = vec![Section::new("", vec![Block::Table(table)])];
    let page = html::page(&Report { sections, ..Report::default() });
    let links: Vec<&str> = page.split("href=\"").skip(1).filter_map(|s| s.split('"').next()).collect();
    assert_eq!(links, ["reports/a-1.html"]);
    assert_eq!(page.matches(">name<").count(), 5);
}

#[test]
fn a_reference_line_is_named_in_the_legend_and_only_far_off_in_the_plot() {
    let drawn = |at: f64| {
        let chart = Chart::new("t", Axis::linear("x", ""), Axis::linear("y", ""))
            .with(Series::line("data", vec![0.0, 1.0], vec![-1.0, 1.0]))
            .mark(Mark::Y(at, "the noise".into()));
        let sections = vec![Section::new("", vec![Block::figure(Figure::new(chart, ""))])];
        html::page(&Report { sections, ..Report::default() })
    };
    let page = drawn(0.5);
    let legend = page.split("<ul class=\"legend\">").nth(1).and_then(|s| s.split("</ul>").next()).expect("a legend");
    assert!(legend.contains("the noise") && legend.contains("class=\"mark\""), "{legend}");
    assert_eq!(legend.matches("data-s=").count(), 1, "a line is not switched off as a series is");
    let plots = drawings(&page);
    assert!(plots.iter().all(|svg| !svg.contains("the noise</text>")), "it stands in the data");
    assert!(drawings(&drawn(1e3)).iter().any(|svg| svg.contains("the noise ↑</text>")));
}

#[test]
fn a_figure_that_is_alone_in_its_row_is_drawn_for_the_whole_width() {
    let chart = Chart::new("t", Axis::linear("x", ""), Axis::linear("y", "")).with(Series::line(
        "data",
        vec![0.0, 1.0],
        vec![-1.0, 1.0],
    ));
    let page =
        |block: Block| html::page(&Report { sections: vec![Section::new("", vec![block])], ..Report::default() });
    let figure = Figure::new(chart, "");
    assert_eq!(page(Block::Figures(vec![figure.clone()])), page(Block::figure(figure)));
}

#[test]
fn a_unit_in_a_sentence_of_the_page_is_written_as_in_its_tables() {
    let mut table = Table::new("Torque in N.m", ["cause", "K [N.m/rad]"]);
    table.row(vec![Cell::text("0.1 N.m of friction"), Cell::quantity(1.0, "N.m/rad")]);
    let blocks = vec![
        Block::Paragraph("The model lacks 0.004 N.m rms.".into()),
        Block::Warning("I1 is 2 kg.m2.".into()),
        Block::Steps(vec!["Take 0.1 N.m.".into()]),
        Block::Table(table),
    ];
    let report = Report {
        title: "units".into(),
        subject: String::new(),
        sections: vec![Section::new("", blocks)],
        footer: String::new(),
    };
    let page = html::page(&report);
    assert!(!page.contains("N.m") && !page.contains("kg.m2"), "one page, two spellings");
    for typeset in ["0.004 N·m rms", "2 kg·m²", "Take 0.1 N·m.", "Torque in N·m", "0.1 N·m of friction", "[N·m/rad]"]
    {
        assert!(page.contains(typeset), "{typeset}");
    }
    assert!(terminal::render(&report, Layout::default()).contains("0.004 N.m rms"));
}

#[test]
fn a_heading_can_be_broken_within_the_name_of_a_parameter() {
    let mut table = Table::new("t", ["drift of viscous_motor.coefficient"]);
    table.row(vec![Cell::Percent(0.1)]);
    let sections = vec![Section::new("", vec![Block::Table(table)])];
    let page = html::page(&Report { sections, ..Report::default() });
    assert!(page.contains(">drift of viscous_<wbr>motor.<wbr>coefficient<wbr></th>"), "{page}");
}

#[test]
fn the_page_fetches_nothing_and_runs_its_own_script_alone() {
    let page = html::page(&example(200, "axis X"));
    assert!(page.contains("default-src 'none'"));
    for needle in
        ["<link", "@import", "url(", " src=", "javascript:", " onload", "fetch(", "XMLHttpRequest", "innerHTML"]
    {
        assert!(!page.contains(needle), "{needle}");
    }
    // One script, and the policy names its hash and no other source of scripts.
    let script = page.split("<script>").nth(1).and_then(|s| s.split("</script>").next()).expect("a script");
    assert_eq!(page.matches("<script").count(), 1);
    let named = page.split("script-src 'sha256-").nth(1).and_then(|s| s.split('\'').next()).expect("a hash");
    assert!(page.contains(&format!("script-src 'sha256-{named}';")));
    let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let value = |c: u8| letters.iter().position(|l| *l == c).expect("a letter of base64");
    let bits: Vec<usize> =
        named.trim_end_matches('=').bytes().flat_map(|c| (0..6).rev().map(move |k| value(c) >> k & 1)).collect();
    let bytes: Vec<u8> =
        bits.chunks_exact(8).map(|b| b.iter().fold(0, |v, bit| v << 1 | u8::from(*bit == 1))).collect();
    assert_eq!(bytes, <sha2::Sha256 as sha2::Digest>::digest(script).to_vec(), "the hash is that of the script");
    // Without a plot there is nothing to run.
    assert!(!html::page(&Report::default()).contains("<script"));
    let outside: Vec<&str> = page.match_indices("http").map(|(at, _)| &page[at..page.len().min(at + 30)]).collect();
    assert!(
        outside.iter().all(|s| s.starts_with("http://www.w3.org/2000/svg") || s.starts_with("http-equiv")),
        "{outside:?}"
    );
}

#[test]
fn a_million_samples_make_a_small_page() {
    let page = html::page(&example(1_000_000, "axis X"));
    assert!(page.len() < 600_000, "{} bytes", page.len());
}

#[test]
fn missing_and_infinite_values_do_not_reach_the_drawing() {
    let x: Vec<f64> = (0..100).map(f64::from).collect();
    let mut y = x.clone();
    (y[3], y[50], y[99]) = (f64::NAN, f64::INFINITY, f64::NEG_INFINITY);
    for log in [false, true] {
        for shape in [Shape::Line, Shape::Points, Shape::Stem, Shape::Step, Shape::Band { low: x.clone().into() }] {
            let axis = |l: &str| if log { Axis::log(l, "m") } else { Axis::linear(l, "m") };
            let chart = Chart::new("", axis("x"), axis("y"))
                .with(Series::new("s", shape, x.clone(), y.clone()))
                .mark(Mark::X(f64::NAN, "a".into()));
            let empty = Chart::new("", axis("x"), axis("y"));
            let report = Report {
                sections: vec![Section::new(
                    "",
                    vec![Block::Figures(vec![Figure::new(chart, ""), Figure::new(empty, "")])],
                )],
                ..Report::default()
            };
            let page = html::page(&report);
            assert!(drawings(&page).iter().all(|svg| !svg.contains("NaN") && !svg.contains("inf ")), "{page}");
        }
    }
}

#[test]
fn the_terminal_shows_verdict_and_tables_within_the_width() {
    let text = terminal::render(&example(200, "axis X"), Layout { width: 80, colour: false });
    println!("{text}");
    assert!(text.contains("! Dry friction at the motor"));
    assert!(text.contains("> axis X") && text.contains("2.3701e-4 ± 1.2e-7"));
    assert!(text.contains("1. Put the friction into the model."));
    assert!(text.lines().all(|l| l.chars().count() <= 80), "{text}");
    let coloured = terminal::render(&example(200, "axis X"), Layout { width: 80, colour: true });
    assert!(coloured.contains("\u{1b}[1m"));
}

/// Relative luminance and contrast of WCAG 2.2.
fn contrast(a: &str, b: &str) -> f64 {
    let luminance = |hex: &str| {
        let hex = hex.trim_start_matches('#');
        let hex: String = if hex.len() == 3 { hex.chars().flat_map(|c| [c, c]).collect() } else { hex.to_owned() };
        let channel = |k: usize| {
            let v = f64::from(u8::from_str_radix(&hex[2 * k..2 * k + 2], 16).expect("a colour")) / 255.0;
            if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * channel(0) + 0.7152 * channel(1) + 0.0722 * channel(2)
    };
    let (a, b) = (luminance(a), luminance(b));
    (a.max(b) + 0.05) / (a.min(b) + 0.05)
}

#[test]
fn text_has_the_contrast_of_wcag_aa_in_both_schemes() {
    let page = html::page(&Report::default());
    let value = |block: &str, name: &str| -> String {
        let at = block.find(&format!("--{name}:")).unwrap_or_else(|| panic!("--{name}"));
        let rest = &block[at + name.len() + 3..];
        rest[..rest.find([';', '}']).expect("an end")].to_owned()
    };
    let blocks: Vec<&str> = page.split(":root{").skip(1).map(|b| &b[..b.find('}').expect("a brace")]).collect();
    assert_eq!(blocks.len(), 2, "light and dark");
    for block in blocks.iter().map(|b| format!("{b}}}")) {
        let block = block.as_str();
        for back in ["page", "card"] {
            for text in ["text", "muted", "neutral"] {
                let c = contrast(&value(block, text), &value(block, back));
                assert!(c >= 4.5, "{text} on {back}: {c:.2}");
            }
            for line in ["blue", "vermillion", "green", "ink"] {
                let c = contrast(&value(block, line), &value(block, back));
                assert!(c >= 3.0, "{line} on {back}: {c:.2}");
            }
        }
        for tone in ["good", "finding", "unsure", "neutral"] {
            let c = contrast(&value(block, tone), &value(block, "page"));
            assert!(c >= 4.5, "the sign of {tone}: {c:.2}");
            let c = contrast(&value(block, "text"), &value(block, &format!("{tone}-bg")));
            assert!(c >= 4.5, "text on {tone}: {c:.2}");
        }
    }
}
