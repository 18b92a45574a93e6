//! Several effects found in one regression: the few of all candidates that leave least.
//!
//! Along the motion as measured what a model lacks is linear in the axis' parameters and in the sizes of its effects. Each of several
//! large causes hides behind the others, and parameters that are fitted before all of them are there run off with what they do: then no
//! single step leads to any. A set of them beside the parameters is one small system of normal equations, parts of one that is made once
//! (best subsets in regression: Miller, Subset selection in regression, 2nd ed. 2002, ch. 3; by a beam in place of all subsets).

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::discrepancy::Discrepancy;
use super::evidence::PRIOR;
use super::fit::{Term, effects_of};
use super::likelihood::C;
use super::model::{Coordinate, Model};
use super::starts::{Screening, StartPoint};
use crate::trace::numerics::dot;

/// Sets of one size to which each further effect is added.
const BEAM: usize = 48;
/// Share of a column's own square that is added to it, so that columns that are next to one another's share a torque in place of taking
/// opposite ones.
const RIDGE: f64 = 1e-6;

/// A set of effects in their forms, at the sizes that leave least.
pub struct Subset {
    pub terms: Vec<Term>,
    /// The axis' parameters and the effects.
    pub model: Model,
    /// Log likelihood of what it leaves, as far as that is linear, less what its effects cost.
    worth: f64,
    /// Discrepancy of that.
    pub discrepancy: Discrepancy,
}

impl Screening<'_> {
    /// The likeliest sets of two to `most` effects in some of their starts, `each` of a size, in its likeliest forms.
    pub fn best_subsets(&self, points: &[StartPoint], most: usize, each: usize) -> Vec<Subset> {
        let mut found = self.subsets_at(self.fit.discrepancy, points, most);
        // Frequencies that the whole gap hides tell the effects where next to all of it is explained.
        let best = found.iter().max_by(|a, b| a.worth.total_cmp(&b.worth)).map(|s| s.discrepancy);
        found.extend(best.into_iter().flat_map(|s| self.subsets_at(s, points, most)));
        found.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        let mut seen = BTreeSet::new();
        let mut of_size = vec![0; most + 1];
        found.retain(|subset| {
            let size = subset.terms.len();
            let is_told = of_size[size] < each && seen.insert(effects_of(&subset.terms));
            of_size[size] += usize::from(is_told);
            is_told
        });
        found
    }

    /// The sets that leave least, weighed at a discrepancy.
    fn subsets_at(&self, s: Discrepancy, points: &[StartPoint], most: usize) -> Vec<Subset> {
        let normal = Normal::new(self, points, s);
        let price: Vec<f64> = points.iter().map(|p| self.problem().price(p.term)).collect();
        let effect = |i: usize| points[i].term.0;
        let joins =
            |set: &[usize], i: usize| set.iter().all(|&k| effect(k) != effect(i) && !effect(k).excludes(effect(i)));
        let mut beam = vec![Vec::new()];
        let mut found = Vec::new();
        for size in 1..=most {
            let longer: BTreeSet<Vec<usize>> = beam
                .iter()
                .flat_map(|set: &Vec<usize>| {
                    (0..points.len()).filter(|i| joins(set, *i)).map(|i| {
                        let mut longer = set.clone();
                        longer.push(i);
                        longer.sort_unstable();
                        longer
                    })
                })
                .collect();
            let mut solved: Vec<(Vec<usize>, Solution)> =
                longer.into_par_iter().filter_map(|set| normal.solve(&set).map(|s| (set, s))).collect();
            let worth = |(set, s): &(Vec<usize>, Solution)| s.gain - set.iter().map(|i| price[*i]).sum::<f64>();
            solved.sort_by(|a, b| worth(b).total_cmp(&worth(a)).then_with(|| a.0.cmp(&b.0)));
            // What one alone does not explain may be all that is left beside another.
            solved.truncate(if size == 1 { points.len() } else { BEAM });
            if size > 1 {
                found.par_extend(solved.par_iter().filter_map(|(set, solution)| self.subset(points, set, solution)));
            }
            beam = solved.into_iter().map(|(set, _)| set).collect();
        }
        found
    }

    /// A set at its sizes; `None` where physics does not let its effects be that.
    fn subset(&self, points: &[StartPoint], set: &[usize], solution: &Solution) -> Option<Subset> {
        let (problem, fit) = (self.problem(), &self.fit);
        let mut residual = fit.rows.clone();
        let mut add = |columns: &[[Vec<C>; 2]], sizes: &[f64]| {
            for (column, size) in columns.iter().zip(sizes) {
                for (rows, column) in residual.rows.iter_mut().zip(column) {
                    rows.iter_mut().zip(column).for_each(|(r, c)| *r += c * *size);
                }
            }
        };
        add(&fit.columns, &solution.changes);
        let mut model = fit.model;
        let mut rest = &solution.sizes[..];
        for &i in set {
            let candidate = &points[i].candidate;
            let (own, others) = rest.split_at(candidate.columns.len());
            rest = others;
            add(&candidate.columns, own);
            candidate.put(own, &mut model.effects);
        }
        let x: Vec<f64> =
            fit.coordinates.iter().zip(&solution.changes).map(|(c, by)| c.changed(c.x(&fit.model), *by)).collect();
        let model = model.at(&fit.coordinates, &x);
        let terms: Vec<Term> = set.iter().map(|i| points[*i].term).collect();
        if !problem.admits(&model, &terms) {
            return None;
        }
        let discrepancy = problem.band.discrepancy(&residual);
        let price: f64 = terms.iter().map(|t| problem.price(*t)).sum();
        Some(Subset { worth: problem.band.log_likelihood(&residual, discrepancy) - price, terms, model, discrepancy })
    }
}

/// Normal equations of the axis' parameters and of all candidates at once.
struct Normal {
    a: DMatrix<f64>,
    g: DVector<f64>,
    /// Columns of each candidate.
    of: Vec<Range<usize>>,
    /// What the coefficient of each column may be; of one that may be a single value it is that.
    within: Vec<[f64; 2]>,
    /// Columns of the axis' parameters, which come first.
    own: usize,
}

/// Coefficients of a set.
struct Solution {
    /// Of the axis' parameters.
    changes: Vec<f64>,
    /// Of its candidates, in its order.
    sizes: Vec<f64>,
    /// Gain in log likelihood.
    gain: f64,
}

impl Normal {
    fn new(screening: &Screening<'_>, points: &[StartPoint], s: Discrepancy) -> Self {
        let (problem, fit) = (screening.problem(), &screening.fit);
        let own = fit.columns.len();
        let all: Vec<&[Vec<C>; 2]> =
            fit.columns.iter().chain(points.iter().flat_map(|p| &p.candidate.columns)).collect();
        let whiten = |rows: &[Vec<C>; 2]| problem.band.whiten(rows, &fit.rows.weights, s);
        let z = whiten(&fit.rows.rows);
        let j: Vec<Vec<f64>> = all.par_iter().map(|rows| whiten(rows)).collect();
        let lower: Vec<Vec<f64>> =
            (0..j.len()).into_par_iter().map(|x| (0..=x).map(|y| dot(&j[x], &j[y])).collect()).collect();
        let mut a = DMatrix::from_fn(j.len(), j.len(), |x, y| lower[x.max(y)][x.min(y)]);
        let g = DVector::from_fn(j.len(), |x, _| -dot(&j[x], &z));
        for i in 0..own {
            a[(i, i)] += 1.0 / (PRIOR * PRIOR);
        }
        let change = |c: &Coordinate| {
            let x = c.x(&fit.model);
            c.bounds.map(|b| c.change(x, b))
        };
        let within = fit.coordinates.iter().map(change).chain(points.iter().flat_map(|p| p.candidate.within()));
        let of = points.iter().scan(own, |next, p| {
            let from = *next;
            *next += p.candidate.columns.len();
            Some(from..*next)
        });
        Self { a, g, of: of.collect(), within: within.collect(), own }
    }

    /// The set at its best, parameters held at their bounds where they would leave them; `None` where an effect would.
    fn solve(&self, set: &[usize]) -> Option<Solution> {
        let columns: Vec<usize> = (0..self.own).chain(set.iter().flat_map(|i| self.of[*i].clone())).collect();
        let is_given = |[least, most]: [f64; 2]| (least >= most).then_some(least);
        let mut held: Vec<Option<f64>> = columns.iter().map(|i| is_given(self.within[*i])).collect();
        loop {
            let c = self.solve_beside(&columns, &held)?;
            let is_within = |x: usize| (self.within[columns[x]][0]..=self.within[columns[x]][1]).contains(&c[x]);
            let leaving = (0..self.own).filter(|x| held[*x].is_none() && !is_within(*x));
            if let Some(farthest) = leaving.max_by(|x, y| c[*x].abs().total_cmp(&c[*y].abs())) {
                let [least, most] = self.within[farthest];
                held[farthest] = Some(c[farthest].clamp(least, most));
                continue;
            }
            if !(self.own..c.len()).all(|x| c[x] != 0.0 && is_within(x)) {
                return None;
            }
            let resisted = |x: usize| -> f64 { (0..c.len()).map(|y| self.a[(columns[x], columns[y])] * c[y]).sum() };
            let gain = (0..c.len()).map(|x| c[x] * (self.g[columns[x]] - 0.5 * resisted(x))).sum();
            let (changes, sizes) = c.split_at(self.own);
            return Some(Solution { changes: changes.to_vec(), sizes: sizes.to_vec(), gain });
        }
    }

    /// Coefficients of some columns beside those that are held at some values.
    fn solve_beside(&self, columns: &[usize], held: &[Option<f64>]) -> Option<Vec<f64>> {
        let mut c: Vec<f64> = held.iter().map(|value| value.unwrap_or(0.0)).collect();
        let free: Vec<usize> = (0..columns.len()).filter(|x| held[*x].is_none()).collect();
        if free.is_empty() {
            return Some(c);
        }
        let scale: Vec<f64> = free.iter().map(|&x| self.a[(columns[x], columns[x])].sqrt()).collect();
        if scale.iter().any(|s| s.is_nan() || *s <= 0.0) {
            return None;
        }
        let at = |p: usize, q: usize| self.a[(columns[free[p]], columns[free[q]])] / (scale[p] * scale[q]);
        let a = DMatrix::from_fn(free.len(), free.len(), |p, q| at(p, q) + if p == q { RIDGE } else { 0.0 });
        let g = DVector::from_fn(free.len(), |p, _| {
            let x = columns[free[p]];
            let of_held: f64 = (0..held.len()).filter_map(|y| Some(self.a[(x, columns[y])] * held[y]?)).sum();
            (self.g[x] - of_held) / scale[p]
        });
        let solved = a.cholesky()?.solve(&g);
        for ((x, solved), scale) in free.iter().zip(solved.iter()).zip(&scale) {
            c[*x] = solved / scale;
        }
        Some(c)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Normal equations of columns `j` for `z` to vanish, the first `own` of them of the axis' parameters.
    fn normal(j: &[&[f64]], z: &[f64], own: usize, within: &[[f64; 2]]) -> Normal {
        Normal {
            a: DMatrix::from_fn(j.len(), j.len(), |x, y| dot(j[x], j[y])),
            g: DVector::from_fn(j.len(), |x, _| -dot(j[x], z)),
            of: (own..j.len()).map(|x| x..x + 1).collect(),
            within: within.to_vec(),
            own,
        }
    }

    const FREE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];
    const POSITIVE: [f64; 2] = [0.0, f64::INFINITY];

    #[test]
    fn a_set_is_at_its_least_squares_and_none_of_a_sign_that_its_effect_has_not() {
        // z = -(2*a + 3*b - c): each alone is told something else by what the others do.
        let (a, b, c) = ([1.0, 0.0, 0.0, 1.0], [1.0, 1.0, 0.0, 0.0], [0.0, 1.0, 1.0, 0.0]);
        let z: Vec<f64> = (0..4).map(|i| -(2.0 * a[i] + 3.0 * b[i] - c[i])).collect();
        let of = |within: [f64; 2]| normal(&[&a, &b, &c], &z, 1, &[FREE, POSITIVE, within]);
        let both = of(FREE).solve(&[0, 1]).expect("solved");
        for (told, true_one) in both.changes.iter().chain(&both.sizes).zip([2.0, 3.0, -1.0]) {
            assert!((told - true_one).abs() < 1e-4, "{told} {true_one}");
        }
        // All of half the square of z is gained.
        assert!((both.gain - 0.5 * dot(&z, &z)).abs() < 1e-4, "{}", both.gain);
        assert!(of(POSITIVE).solve(&[0, 1]).is_none());
    }

    #[test]
    fn an_effect_whose_size_is_given_is_no_share_of_it() {
        let (a, b) = ([1.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
        let z: Vec<f64> = (0..3).map(|i| -(2.0 * a[i] + 3.0 * b[i])).collect();
        let found = normal(&[&a, &b], &z, 1, &[FREE, [1.0; 2]]).solve(&[0]).expect("solved");
        // a takes (2*a.a + 2*b.a)/a.a of what b at one leaves.
        assert_eq!(found.sizes, [1.0]);
        assert!((found.changes[0] - 3.0).abs() < 1e-4, "{:?}", found.changes);
        let all = normal(&[&b], &z, 0, &[[1.0; 2]]).solve(&[0]).expect("solved");
        // b.(-z) - b.b/2, of 8 and 2.
        assert!((all.gain - 7.0).abs() < 1e-12, "{}", all.gain);
    }

    #[test]
    fn a_parameter_is_held_where_it_would_leave_its_bounds_and_the_others_are_told_beside_it_there() {
        let (a, b) = ([1.0, 0.0, 1.0], [1.0, 1.0, 0.0]);
        let z: Vec<f64> = (0..3).map(|i| -(2.0 * a[i] + 3.0 * b[i])).collect();
        let found = normal(&[&a, &b], &z, 1, &[[-0.5, 0.5], POSITIVE]).solve(&[0]).expect("solved");
        // With a at 0.5 the rest of -z is 1.5*a + 3*b, of which b takes (1.5*a.b + 3*b.b)/b.b.
        assert_eq!(found.changes, [0.5]);
        assert!((found.sizes[0] - 3.75).abs() < 1e-4, "{:?}", found.sizes);
    }
}
