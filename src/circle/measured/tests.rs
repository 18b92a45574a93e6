//! Exports in every form that is read, of one and the same circle.

use std::fmt::Write as _;

use super::*;

/// A circle of 50 mm with a bump of 4 um (um) at 60 degrees, as (angle in degrees, deviation in um) from 0 to 360.
fn circle(points: usize) -> Vec<(f64, f64)> {
    (0..points)
        .map(|k| 360.0 * k as f64 / points as f64)
        .map(|a| (a, 4.0 * (-((a - 60.0) / 10.0).powi(2)).exp()))
        .collect()
}

fn read_text(name: &str, text: &str, given: &Given) -> Result<Measured, MeasuredError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    std::fs::write(&file, text).unwrap();
    read(&[file], given)
}

/// The largest deviation in um of a turn and where it stands, degrees.
fn peak(m: &Measured, turn: usize) -> (f64, f64) {
    let t = &m.turns[turn];
    let k = (0..t.angle.len()).max_by(|a, b| t.deviation[*a].total_cmp(&t.deviation[*b])).unwrap();
    let low = t.deviation.iter().copied().fold(f64::INFINITY, f64::min);
    (1e6 * (t.deviation[k] - low), t.angle[k].to_degrees())
}

fn bump(m: &Measured, turn: usize, points: usize) {
    let (height, angle) = peak(m, turn);
    // The least-squares centre follows the bump a little.
    assert!((height - 4.0).abs() < 0.6 && (angle - 60.0).abs() < 3.0, "{height} um at {angle}");
    assert_eq!(m.turns[turn].angle.len(), points);
}

#[test]
fn angle_and_radius_in_every_unit_and_separator_are_one_circle() {
    let rows = circle(720);
    let write = |head: &str, row: &dyn Fn(f64, f64) -> String| {
        rows.iter().fold(head.to_owned(), |mut out, (a, d)| {
            let _ = writeln!(out, "{}", row(*a, *d));
            out
        })
    };
    let files = [
        ("a.csv", write("angle [deg],radius [mm]\n", &|a, d| format!("{a},{}", 50.0 + 1e-3 * d))),
        ("b.csv", write("Angle (degrees);Radius [m]\n", &|a, d| format!("{a};{}", 0.05 + 1e-6 * d))),
        ("c.csv", write("phi [rad]\tr [um]\n", &|a, d| format!("{}\t{}", a.to_radians(), 5e4 + d))),
        ("d.txt", write("Winkel  Radius\n", &|a, d| format!("{a:.3}   {:.5}", 50.0 + 1e-3 * d).replace('.', ","))),
        (
            "e.txt",
            write("Ballbar\nNominal radius: 50 mm\n\nAngle [deg]  Deviation [microns]\n", &|a, d| format!("{a}  {d}")),
        ),
        (
            "f.csv",
            write("x [mm],y [mm]\n", &|a, d| {
                let (s, c) = a.to_radians().sin_cos();
                format!("{},{}", 350.0 + (50.0 + 1e-3 * d) * c, -20.0 + (50.0 + 1e-3 * d) * s)
            }),
        ),
    ];
    for (name, text) in files {
        let m = read_text(name, &text, &Given::default()).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert!((m.radius - 0.05).abs() < 1e-12, "{name}: {}", m.radius);
        assert!(m.turns.len() == 1 && !m.turns[0].clockwise, "{name}");
        bump(&m, 0, 720);
    }
}

#[test]
fn a_part_is_taken_by_the_column_of_time_and_refused_where_there_is_none() {
    // A turn of 12 s between two ways in and out, which lie far off the circle.
    let mut text = "t [ms],x [mm],y [mm]\n".to_owned();
    let mut row = |t: f64, x: f64, y: f64| writeln!(text, "{},{x},{y}", 1e3 * t).unwrap();
    (0..100).for_each(|k| row(0.02 * f64::from(k), 0.5 * f64::from(k), 0.0));
    for (k, (a, d)) in circle(720).iter().enumerate() {
        let (s, c) = a.to_radians().sin_cos();
        row(2.0 + k as f64 / 60.0, (50.0 + 1e-3 * d) * c, (50.0 + 1e-3 * d) * s);
    }
    (0..100).for_each(|k| row(14.0 + 0.02 * f64::from(k), 50.0 - 0.5 * f64::from(k), 0.0));
    let part = |from, to| Given { part: Part { from, to }, ..Given::default() };
    let m = read_text("a.csv", &text, &part(Some(2.0), Some(13.99))).unwrap();
    bump(&m, 0, 720);
    assert!((m.feed.unwrap() - std::f64::consts::TAU * 0.05 / 12.0).abs() < 1e-4, "{:?}", m.feed);
    let error = |text: &str, given: &Given| read_text("a.csv", text, given).unwrap_err().to_string();
    let short = error(&text, &part(None, Some(3.0)));
    assert!(short.contains("no whole turn in the 161 of its 920 rows that --from and --to leave"), "{short}");
    let none = error(&text, &part(Some(20.0), None));
    assert!(none.contains("its t runs from 0 s to 15.98 s"), "{none}");
    let timeless = error("angle [deg],radius [mm]\n0,50\n1,50\n", &part(Some(1.0), None));
    assert!(timeless.contains("no column of time") && timeless.contains("time [s]"), "{timeless}");
    let wrong = error("time [mm],x [mm],y [mm]\n0,50,0\n1,50,1\n", &part(Some(1.0), None));
    assert!(wrong.contains("column time: [mm] is no unit of time"), "{wrong}");
}

#[test]
fn two_directions_come_from_a_column_two_columns_two_runs_or_two_files() {
    let rows = circle(720);
    let mut column = "angle [deg],deviation [um],direction\n".to_owned();
    let mut columns = "angle [deg],deviation CCW [um],deviation CW [um]\n".to_owned();
    let mut runs = "angle [deg],deviation [um]\n".to_owned();
    for (a, d) in &rows {
        let _ = writeln!(column, "{a},{d},CCW");
        let _ = writeln!(columns, "{a},{d},{d}");
        let _ = writeln!(runs, "{a},{d}");
    }
    for (a, d) in rows.iter().rev() {
        let _ = writeln!(column, "{a},{d},CW");
        let _ = writeln!(runs, "{a},{d}");
    }
    let given = Given { radius: Some(0.05), ..Given::default() };
    for (name, text) in [("a.csv", &column), ("b.csv", &columns), ("ccw.csv", &runs)] {
        let m = read_text(name, text, &given).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(m.turns.iter().map(|t| t.clockwise).collect::<Vec<_>>(), [false, true], "{name}");
        bump(&m, 0, 720);
        bump(&m, 1, 720);
    }
    // Two files sorted by the angle: their names tell the direction.
    let folder = tempfile::tempdir().unwrap();
    let one = format!(
        "angle [deg],deviation [um]\n{}",
        rows.iter().fold(String::new(), |s, (a, d)| s + &format!("{a},{d}\n"))
    );
    let files: Vec<PathBuf> = ["run_cw.csv", "run_ccw.csv"].iter().map(|n| folder.path().join(n)).collect();
    files.iter().for_each(|f| std::fs::write(f, &one).unwrap());
    let m = read(&files, &given).unwrap();
    assert_eq!(m.turns.iter().map(|t| t.clockwise).collect::<Vec<_>>(), [false, true]);
    // Without names that tell, the user must.
    let files: Vec<PathBuf> = ["1.csv", "2.csv"].iter().map(|n| folder.path().join(n)).collect();
    files.iter().for_each(|f| std::fs::write(f, &one).unwrap());
    let error = read(&files, &given).unwrap_err().to_string();
    assert!(error.contains("--directions ccw,cw"), "{error}");
    let m = read(&files, &Given { clockwise: vec![true, false], ..given }).unwrap();
    assert_eq!(m.turns.len(), 2);
}

#[test]
fn positions_give_feed_and_direction_and_lose_their_ways_in_and_out() {
    let mut text = "time [s],x [mm],y [mm]\n".to_owned();
    let mut time = 0.0;
    let mut put = |x: f64, y: f64| {
        let _ = writeln!(text, "{time},{x},{y}");
        time += 0.01;
    };
    (0..40).for_each(|_| put(50.0, 0.0));
    // A turn and a quarter, clockwise, at 50 mm * 2*pi / 8 s.
    for k in 0..1000 {
        let (s, c) = (-std::f64::consts::TAU * f64::from(k) / 800.0).sin_cos();
        put(50.0 * c, 50.0 * s);
    }
    (0..40).for_each(|_| put(0.0, -50.0));
    let m = read_text("log.csv", &text, &Given::default()).unwrap();
    assert!(m.turns[0].clockwise && m.turns[0].angle.len().abs_diff(800) < 6, "{}", m.turns[0].angle.len());
    let feed = m.feed.unwrap();
    assert!((feed - 0.05 * std::f64::consts::TAU / 8.0).abs() < 2e-4, "{feed}");
    assert!(m.notes.iter().any(|n| n.contains("450 degrees")), "{:?}", m.notes);
}

#[test]
fn what_is_no_circular_test_is_said_with_file_place_and_way_out() {
    let rows = |head: &str, from: f64, to: f64, n: usize, r: &dyn Fn(f64) -> String| {
        (0..n)
            .map(|k| from + (to - from) * k as f64 / n as f64)
            .fold(head.to_owned(), |s, a| s + &format!("{a},{}\n", r(a)))
    };
    let fifty = |_: f64| "50.0".to_owned();
    let given = Given::default();
    for (text, word) in [
        (String::new(), "a.csv"),
        ("time [s],T [N.m]\n0,1\n1,2\n".to_owned(), "no column for the angle"),
        (rows("angle [deg],T [N.m]\n", 0.0, 360.0, 720, &fifty), "no column for the radius"),
        (rows("angle [deg],deviation\n", 0.0, 360.0, 720, &fifty), "has no unit"),
        (rows("angle [deg],deviation [furlong]\n", 0.0, 360.0, 720, &fifty), "furlong"),
        (rows("angle [deg],deviation [s]\n", 0.0, 360.0, 720, &fifty), "a length is needed"),
        (rows("angle [deg],deviation [um]\n", 0.0, 360.0, 720, &|_| "1".to_owned()), "--radius"),
        (rows("angle [deg],radius [mm]\n", 0.0, 220.0, 720, &fifty), "no whole turn"),
        (rows("angle [deg],radius [mm]\n", 0.0, 360.0, 40, &fifty), "at least 180 points"),
        (
            rows("angle [deg],radius [mm]\n", 0.0, 360.0, 720, &|a| if a > 180.0 { "x".into() } else { "50".into() }),
            "not a finite number",
        ),
        (
            rows("angle [deg],radius [mm]\n", 0.0, 360.0, 720, &|a| if a > 180.0 { "70".into() } else { "50".into() }),
            "off the circle",
        ),
        (
            rows("angle [deg],radius [mm]\n", 0.0, 360.0, 720, &|a| {
                if a == 90.0 { "50,1".into() } else { "50".into() }
            }),
            "fields",
        ),
    ] {
        let error = read_text("a.csv", &text, &given).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(word), "{word}: {error}");
    }
    // Numbers without sense are refused, not drawn.
    for extreme in ["1e300", "-1e308", "1e-300", "0"] {
        for head in ["x [m],y [m]\n", "angle [deg],radius [m]\n", "angle [rad],deviation [m]\n"] {
            let text = rows(head, 0.0, 360.0, 720, &|_| extreme.to_owned());
            if let Ok(m) = read_text("a.csv", &text, &Given { radius: Some(0.05), ..given.clone() }) {
                assert!(m.turns.iter().flat_map(|t| &t.deviation).all(|d| d.is_finite()), "{head} {extreme}");
            }
        }
    }
    let whole = rows("angle [deg],radius [mm]\n", 0.0, 360.0, 720, &fifty);
    let error = read_text("a.csv", &whole, &Given { radius: Some(-1.0), ..given.clone() }).unwrap_err().to_string();
    assert!(error.contains("greater than zero"), "{error}");
    let error =
        read_text("a.csv", &whole, &Given { clockwise: vec![true, false], ..given.clone() }).unwrap_err().to_string();
    assert!(error.contains("--directions names 2"), "{error}");
    assert!(read(&[PathBuf::from("/no/such/file.csv")], &given).unwrap_err().to_string().contains("/no/such/file.csv"));
}
