//! Records with one defect each, refused by its name.

use super::*;

/// A record, what is wrong with it, and the id of the finding that must refuse it.
fn broken() -> Vec<(&'static str, Columns, &'static [&'static str])> {
    let base = plain();
    let n = base.v[0].len();
    let other = axis(Kind::Odd, 4096, 2, &Settings::default(), 1e-4);
    let mut e = noise(11, 0.03);
    let mut cases: Vec<(&'static str, Columns, &'static [&'static str])> = Vec::new();
    let mut add = |name, change: &mut dyn FnMut(&mut Columns), ids| {
        let mut c = base.clone();
        change(&mut c);
        cases.push((name, c, ids));
    };
    add("dead torque", &mut |c| c.v[0].fill(0.0), &["constant"]);
    add("dead theta1", &mut |c| c.v[1].fill(0.3), &["constant"]);
    add("dead omega2", &mut |c| c.v[4].fill(0.0), &["constant"]);
    add("dead theta2", &mut |c| c.v[3].fill(0.0), &["constant"]);
    add(
        "stuck theta1",
        &mut |c| {
            let v = c.v[1][3000];
            c.v[1][3000..4500].fill(v)
        },
        &["stuck"],
    );
    add(
        "stuck theta2 to the end",
        &mut |c| {
            let v = c.v[3][5000];
            c.v[3][5000..].fill(v)
        },
        &["stuck"],
    );
    add(
        "stuck omega1",
        &mut |c| {
            let v = c.v[2][2000];
            c.v[2][2000..4000].fill(v)
        },
        &["stuck", "foreign"],
    );
    add(
        "stuck torque",
        &mut |c| {
            let v = c.v[0][2000];
            c.v[0][2000..5000].fill(v)
        },
        &["stuck"],
    );
    add(
        "encoders exchanged",
        &mut |c| {
            c.v.swap(1, 3);
            c.v.swap(2, 4)
        },
        &["swapped"],
    );
    add("angle and speed exchanged", &mut |c| c.v.swap(1, 2), &["swapped", "foreign"]);
    add("speeds exchanged", &mut |c| c.v.swap(2, 4), &["swapped", "foreign", "sign"]);
    add("torque turned", &mut |c| c.v[0].iter_mut().for_each(|v| *v = -*v), &["sign"]);
    add("theta2 turned", &mut |c| c.v[3].iter_mut().for_each(|v| *v = -*v), &["sign"]);
    add("omega1 turned", &mut |c| c.v[2].iter_mut().for_each(|v| *v = -*v), &["sign"]);
    add("foreign torque", &mut |c| c.v[0].clone_from(&other.v[0]), &["not_followed"]);
    add("white torque", &mut |c| c.v[0] = (0..n).map(|_| e()).collect(), &["not_followed"]);
    add("torque reversed in time", &mut |c| c.v[0].reverse(), &["not_followed"]);
    add("foreign theta2", &mut |c| c.v[3].clone_from(&other.v[3]), &["foreign"]);
    add("degrees", &mut |c| [1, 3].iter().for_each(|k| c.v[*k].iter_mut().for_each(|v| *v *= 57.295_78)), &["units"]);
    add(
        "all in degrees",
        &mut |c| c.v[1..].iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v *= 57.295_78)),
        &["units"],
    );
    add("one angle in degrees", &mut |c| c.v[3].iter_mut().for_each(|v| *v *= 57.295_78), &["units"]);
    add("mN.m", &mut |c| c.v[0].iter_mut().for_each(|v| *v *= 1e3), &["units"]);
    add("milliseconds", &mut |c| c.dt = 1.0, &["units"]);
    add(
        "turns",
        &mut |c| c.v[1..].iter_mut().for_each(|c| c.iter_mut().for_each(|v| *v /= std::f64::consts::TAU)),
        &["units"],
    );
    add("omega in rpm", &mut |c| c.v[2].iter_mut().for_each(|v| *v *= 9.5493), &["units"]);
    add("theta1 jumps", &mut |c| c.v[1][4000..].iter_mut().for_each(|v| *v += 2.0), &["jump"]);
    add("theta1 within a turn", &mut |c| c.v[1].iter_mut().for_each(|v| *v = v.rem_euclid(1.0)), &["wrapped"]);
    add("torque late", &mut |c| c.v[0].rotate_right(12), &["misaligned"]);
    add("1e308", &mut |c| c.v[1][17] = 1e308, &["magnitude"]);
    add("1e-300", &mut |c| c.v[1][17] = 1e-300, &["magnitude"]);
    add("1e-300 for a while", &mut |c| c.v[1][17..40].fill(1e-300), &["magnitude"]);
    add("dt of 1e300", &mut |c| c.dt = 1e300, &["interval"]);
    add(
        "the motor's encoder twice, the second time a cycle later and in another unit",
        &mut |c| {
            c.v[3] = c.v[1].iter().map(|v| 0.5 * v - 1.0).collect();
            c.v[3].rotate_right(2);
            (0..2).for_each(|k| c.v[3][k] = c.v[3][2]);
        },
        &["copy"],
    );
    add("the motor's angle as torque", &mut |c| c.v[0] = c.v[1].iter().map(|v| -3.0 * v).collect(), &["copy"]);
    add(
        "the motor's speed by differences as torque",
        &mut |c| {
            let x = c.v[1].clone();
            (1..n - 1).for_each(|k| c.v[0][k] = x[k + 1] - x[k - 1]);
            (c.v[0][0], c.v[0][n - 1]) = (0.0, 0.0);
        },
        &["copy"],
    );
    add(
        "an inertia times the second differences of the motor's angle as torque",
        &mut |c| {
            let x = c.v[1].clone();
            (1..n - 1).for_each(|k| c.v[0][k] = 2.4e2 * (x[k + 1] - 2.0 * x[k] + x[k - 1]));
            (c.v[0][0], c.v[0][n - 1]) = (0.0, 0.0);
        },
        &["computed"],
    );
    add("counts as angle", &mut |c| c.v[1].iter_mut().for_each(|v| *v = (*v * 1e9).round()), &["magnitude"]);
    cases
}

#[test]
fn a_broken_record_is_refused_by_the_name_of_its_defect() {
    let mut missed = Vec::new();
    for (name, columns, ids) in broken() {
        let found = refused(&Input { nominal: Some(NOMINAL), ..columns.input() });
        if !found.iter().any(|id| ids.contains(id)) {
            missed.push(format!("{name}: {found:?}, not {ids:?}"));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
