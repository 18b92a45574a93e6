//! Whole files.

use super::rows::chunks;
use super::*;
use crate::table::Header;

fn parse(text: &str) -> Result<Table, TraceError> {
    super::parse(text.as_bytes(), "a.csv")
}

#[test]
fn separators_bom_quotes_crlf_and_decimal_commas_are_read() {
    let expected = [[0.0, 1.5], [0.1, -2.5e-3]];
    for text in [
        "time [s],T [N.m]\n0,1.5\n0.1,-2.5e-3\n",
        "\u{feff}time [s];T [N.m]\r\n0;1.5\r\n0.1;-2.5e-3",
        "time [s]\tT [N.m]\n0\t1.5\n\n0.1\t-2.5e-3\n",
        "time [s];T [N.m]\n0;1,5\n0,1;-2,5e-3\n",
        "\"time [s]\",\"T [N.m]\"\n\"0\", 1.5 \n 0.1,\"-2.5e-3\"\n",
        "# made by hand\ntime [s], T [N.m],\n0,1.5,\n# half way\n0.1,-2.5e-3,\n",
        "# time [s], T [N.m]\n0,1.5\n0.1,-2.5e-3\n",
    ] {
        let table = parse(text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
        assert_eq!(table.headers[0], Header { name: "time".into(), unit: Some("s".into()) }, "{text:?}");
        assert_eq!(table.headers[1], Header { name: "T".into(), unit: Some("N.m".into()) }, "{text:?}");
        for (k, row) in expected.iter().enumerate() {
            assert_eq!([table.column(0).unwrap()[k], table.column(1).unwrap()[k]], *row, "{text:?}");
        }
        assert_eq!(table.rows(), 2);
    }
}

#[test]
fn a_bad_cell_is_an_error_only_where_its_column_is_used_and_names_its_line() {
    let table = parse("time,T,note\n0,1,start\n\n# pause\n1,nan,go\n2,x,end\n").unwrap();
    assert_eq!(table.column(0).unwrap(), [0.0, 1.0, 2.0]);
    // A cell that is no number is worse than one without a value, which may be bridged.
    let error = table.column(1).unwrap_err().to_string();
    assert!(error.contains("row 6, column T") && error.contains("\"x\""), "{error}");
    assert!(table.column(2).unwrap_err().to_string().contains("row 2, column note"));
    assert_eq!([table.line(0), table.line(1), table.line(2)], [2, 5, 6]);
}

#[test]
fn a_decimal_comma_is_told_from_the_points_of_dates_and_from_thousands() {
    for (text, expected) in [
        ("time;T\n01.03.2026 12:00:00,5;1,5\n01.03.2026 12:00:01,5;2,5\n", [1.5, 2.5]),
        ("time;T\n0;1.250,5\n1;2,5\n", [1250.5, 2.5]),
        ("time,T\n0,\"1,5\"\n1,\"2,5\"\n", [1.5, 2.5]),
    ] {
        assert_eq!(parse(text).unwrap().column(1).unwrap(), expected, "{text:?}");
    }
    // 1,250 in quotes may be either: it is refused, not guessed.
    assert!(parse("time,T\n0,\"1,250\"\n1,\"2,500\"\n").unwrap().column(1).is_err());
}

#[test]
fn a_row_with_missing_or_extra_fields_is_named_by_its_line() {
    for (text, line, found) in [
        ("time,T\n0,1\n1\n2,1\n", 3, 1),
        ("time,T\n0\n", 2, 1),
        ("time,T\n0,1\n1,2,3,4\n", 3, 4),
        ("time,T,U\n0,1,2\n1,2\n2,0.\n3", 3, 2),
    ] {
        match parse(text) {
            Err(TraceError::Ragged { line: l, found: f, .. }) => assert_eq!((l, f), (line, found), "{text:?}"),
            other => panic!("{text:?}: {other:?}"),
        }
    }
}

#[test]
fn a_last_row_that_is_cut_is_left_out_with_a_word() {
    let fixed: String = (0..20).map(|k| format!("{k},{k}.250\n")).collect();
    for (text, rows, line) in [
        ("time,T\n0,1\n1,2\n2".to_owned(), 2, Some(4)),
        ("time,T\n0,1\n# stopped\n1,2\n2\n\n".to_owned(), 2, Some(5)),
        ("time,T\n0,1\n1,2\n2,".to_owned(), 2, Some(4)),
        ("time,T\n0,1\n1,2\n2,-".to_owned(), 2, Some(4)),
        ("time\tT\n0\t1\n1\t2\n2\t".to_owned(), 2, Some(4)),
        ("time,T,\n0,1,\n1,25,\n2,2".to_owned(), 2, Some(4)),
        (format!("time,T\n{fixed}20,20.2"), 20, Some(22)),
        // Whole as far as can be told: a line end is not needed, and a cell that has none has a value missing.
        (format!("time,T\n{fixed}20,20.250"), 21, None),
        (format!("time,T\n{fixed}20,20.2\n"), 21, None),
        ("time,T\n0,1\n1,2\n2,5".to_owned(), 3, None),
        ("time,T\n0,1\n1,2\n2,\n".to_owned(), 3, None),
        ("time,T\n0,1\n1,2\nEOF\n".to_owned(), 2, None),
    ] {
        let table = parse(&text).unwrap_or_else(|e| panic!("{text:?}: {e}"));
        assert_eq!((table.rows(), table.cut.is_some()), (rows, line.is_some()), "{text:?}: {:?}", table.cut);
        if let Some(line) = line {
            let warning = table.cut.unwrap();
            assert!(warning.contains(&format!("a.csv: row {line}, the last, is cut off")), "{warning}");
        }
    }
}

#[test]
fn a_file_without_header_or_data_says_what_a_trace_looks_like() {
    for text in ["", "\n\n", "0,1\n1,2\n"] {
        assert!(parse(text).unwrap_err().to_string().contains("header row such as"), "{text:?}");
    }
    assert!(parse("T,T\n0,1\n").unwrap_err().to_string().contains("fields 1 and 2"));
}

#[test]
fn a_quantity_in_two_units_has_a_column_in_each_and_a_signal_has_one() {
    let table = parse("machine,K [N.m/rad],K_std,K [N/m],K_change\nx,1,0.1,,0\ny,,,3,0\n").unwrap();
    assert_eq!([table.position("K [N.m/rad]"), table.position("K [N/m]")], [Some(1), Some(3)]);
    assert_eq!(table.position("K"), None, "which of the two is not guessed");
    assert_eq!(table.headers[3].unit.as_deref(), Some("N/m"));
    for twice in ["a,K [N/m],K [N/m]\n0,1,2\n", "a,K,K [N/m]\n0,1,2\n", "a,theta1 [rad],theta1 [deg]\n0,1,2\n"] {
        assert!(parse(twice).unwrap_err().to_string().contains("fields 2 and 3"), "{twice}");
    }
}

#[test]
fn many_chunks_give_the_same_table_as_one() {
    let mut text = String::from("time,a\n");
    for k in 0..200_000 {
        if k % 1000 == 7 {
            text.push_str("# a comment\n");
        }
        text.push_str(&format!("{k},{}\n", f64::from(k) * 0.25));
    }
    let table = parse(&text).unwrap();
    assert!(chunks(text.as_bytes()).len() > 1);
    assert_eq!(table.rows(), 200_000);
    assert!(table.column(1).unwrap().iter().enumerate().all(|(k, v)| *v == k as f64 * 0.25));
    // Row 150000 (k from 0) has the header and the comments of k = 7, 1007, .. 149007 before it.
    assert_eq!(table.line(150_000), 150_000 + 2 + 150);
}
