//! Fewer points, the same picture.
//!
//! M4: of the points that share a pixel column only the first, the last, the lowest and the highest decide which pixels
//! a line covers (Jugel, Jerzak, Hackenbroich, Markl, "M4: a visualization-oriented time series data aggregation",
//! PVLDB 7(10), 2014). So a trace of any length becomes at most four points a column.

use std::collections::BTreeSet;

/// A point in pixels.
pub(super) type Point = (f64, f64);

/// Runs of consecutive finite points: a line is broken where a value is missing.
pub(super) fn runs(points: impl Iterator<Item = Point>) -> Vec<Vec<Point>> {
    let mut out: Vec<Vec<Point>> = Vec::new();
    let mut open = false;
    for (x, y) in points {
        if x.is_finite() && y.is_finite() {
            if !open {
                out.push(Vec::new());
                open = true;
            }
            if let Some(run) = out.last_mut() {
                run.push((x, y));
            }
        } else {
            open = false;
        }
    }
    out
}

/// A line with at most four points for each stretch that stays in one column of `width` pixels. Points in the order
/// given; a line that runs back and forth (a phase plot) is thinned further until it has at most `most` points.
pub(super) fn line(points: &[Point], width: f64, most: usize) -> Vec<Point> {
    let mut out = Vec::new();
    let mut start = 0;
    while start < points.len() {
        let column = (points[start].0 / width).floor();
        let mut end = start + 1;
        while end < points.len() && (points[end].0 / width).floor() == column {
            end += 1;
        }
        let group = &points[start..end];
        let mut keep = BTreeSet::from([0, group.len() - 1]);
        let by_y = |a: &usize, b: &usize| group[*a].1.total_cmp(&group[*b].1);
        keep.extend((0..group.len()).min_by(by_y));
        keep.extend((0..group.len()).max_by(by_y));
        out.extend(keep.into_iter().map(|i| group[i]));
        start = end;
    }
    let mut spacing = 0.5;
    while out.len() > most {
        spacing *= 2.0;
        out = thinned(&out, spacing);
    }
    out
}

/// Points no nearer than `spacing` to the one kept before; the last one stays.
fn thinned(points: &[Point], spacing: f64) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    for (i, p) in points.iter().enumerate() {
        let far = out.last().is_none_or(|q| (p.0 - q.0).hypot(p.1 - q.1) >= spacing);
        if far || i + 1 == points.len() {
            out.push(*p);
        }
    }
    out
}

/// A cloud with one point a cell, the cells grown until at most `most` points stay.
pub(super) fn cloud(points: &[Point], most: usize) -> Vec<Point> {
    let mut cell = 1.0;
    loop {
        let mut taken = BTreeSet::new();
        let kept: Vec<Point> = points
            .iter()
            .filter(|p| p.0.is_finite() && p.1.is_finite())
            .filter(|p| taken.insert(((p.0 / cell).floor() as i64, (p.1 / cell).floor() as i64)))
            .copied()
            .collect();
        if kept.len() <= most {
            return kept;
        }
        cell *= 1.5;
    }
}

/// Stems or bars: of those in one column the lowest and the highest.
pub(super) fn extremes(points: &[Point], width: f64) -> Vec<Point> {
    let mut out: Vec<Point> = Vec::new();
    for run in points.chunk_by(|a, b| (a.0 / width).floor() == (b.0 / width).floor()) {
        let mut finite = run.iter().filter(|p| p.0.is_finite() && p.1.is_finite());
        let Some(first) = finite.next() else { continue };
        let (mut low, mut high) = (first, first);
        for p in finite {
            if p.1 < low.1 {
                low = p;
            }
            if p.1 > high.1 {
                high = p;
            }
        }
        out.push(*high);
        if low.1 < high.1 {
            out.push(*low);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows that a polyline covers in each column, which is the picture up to the pen's width.
    fn rows(points: &[Point], columns: usize) -> Vec<(f64, f64)> {
        let mut out = vec![(f64::INFINITY, f64::NEG_INFINITY); columns];
        for p in points {
            let c = (p.0.floor() as usize).min(columns - 1);
            out[c] = (out[c].0.min(p.1), out[c].1.max(p.1));
        }
        out
    }

    #[test]
    fn a_million_samples_keep_the_picture_in_four_points_a_column() {
        let n = 1_000_000;
        let points: Vec<Point> =
            (0..n).map(|k| (500.0 * k as f64 / n as f64, (k as f64 * 0.37).sin() * (k as f64 * 1e-5).cos())).collect();
        let thin = line(&points, 1.0, usize::MAX);
        assert!(thin.len() <= 4 * 500, "{}", thin.len());
        assert_eq!(rows(&points, 500), rows(&thin, 500));
        assert!(thin.windows(2).all(|w| w[0].0 <= w[1].0), "the order stays");
        assert_eq!((thin.first(), thin.last()), (points.first(), points.last()));
    }

    #[test]
    fn a_single_spike_among_many_samples_stays() {
        let mut points: Vec<Point> = (0..100_000).map(|k| (k as f64 * 3e-3, 0.0)).collect();
        points[56_789].1 = 42.0;
        assert!(line(&points, 1.0, usize::MAX).contains(&points[56_789]));
        assert!(extremes(&points, 1.0).contains(&points[56_789]));
    }

    #[test]
    fn few_points_are_left_alone() {
        let points: Vec<Point> = (0..20).map(|k| (k as f64 * 10.0, f64::from(k % 3))).collect();
        assert_eq!(line(&points, 1.0, usize::MAX), points);
        assert_eq!(cloud(&points, 100), points);
    }

    #[test]
    fn a_missing_value_breaks_the_line() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0), (3.0, 4.0), (f64::INFINITY, 0.0)];
        assert_eq!(runs(points.into_iter()), vec![vec![(0.0, 1.0)], vec![(2.0, 3.0), (3.0, 4.0)]]);
    }

    #[test]
    fn a_line_that_runs_back_and_forth_and_a_cloud_are_bounded() {
        let points: Vec<Point> =
            (0..200_000).map(|k| (250.0 + 240.0 * (k as f64 * 0.9).sin(), 100.0 * (k as f64 * 0.7).cos())).collect();
        assert!(line(&points, 1.0, 4000).len() <= 4000);
        let kept = cloud(&points, 3000);
        assert!(kept.len() <= 3000 && kept.len() > 1000, "{}", kept.len());
    }
}
