//! Simulated columns of a fit, brought along from step to step.
//!
//! A run for each free value and each step is most of the work of a fit. After a step the columns are corrected by what it showed of them:
//! of all that tell how the residual changed along it, those nearest to the ones before (Broyden, Mathematics of Computation 19, 1965).

use rayon::prelude::*;

use super::descent::Along;
use super::likelihood::{C, Spectra};
use super::model::Coordinate;
use super::problem::Problem;

/// Columns of all coordinates at a point, the simulated ones of which are brought along.
#[derive(Clone)]
pub struct Secant {
    /// One a coordinate.
    pub columns: Vec<Spectra>,
    /// Which of them are simulated.
    is_simulated: Vec<bool>,
}

impl Secant {
    /// Every column at a point, those that no other run tells simulated.
    pub fn simulated(problem: &Problem<'_>, at: &Along, coordinates: &[Coordinate]) -> Option<Self> {
        let of = |c: &Coordinate| match problem.column_without_simulation(c, at) {
            Some(column) => Some((column, false)),
            None => Some((problem.simulated_column(c, at)?, true)),
        };
        let all: Option<Vec<(Spectra, bool)>> = coordinates.par_iter().map(of).collect();
        let (columns, is_simulated) = all?.into_iter().unzip();
        Some(Self { columns, is_simulated })
    }

    /// The same at another point, the simulated ones as they were brought there.
    pub fn renewed(mut self, problem: &Problem<'_>, at: &Along, coordinates: &[Coordinate]) -> Option<Self> {
        let every = self.columns.par_iter_mut().zip(&mut self.is_simulated).zip(coordinates);
        every
            .map(|((column, is_simulated), c)| {
                match problem.column_without_simulation(c, at) {
                    Some(told) => (*column, *is_simulated) = (told, false),
                    None if *is_simulated => {}
                    None => (*column, *is_simulated) = (problem.simulated_column(c, at)?, true),
                }
                Some(())
            })
            .collect::<Option<()>>()?;
        Some(self)
    }

    /// Brings the simulated columns along a `step` that changed the residual from one to another. Distances are measured in units in which
    /// every coordinate has one `information`.
    pub fn follow(&mut self, [from, to]: [&Spectra; 2], step: &[f64], information: &[f64]) {
        let simulated: Vec<usize> = (0..step.len()).filter(|i| self.is_simulated[*i]).collect();
        let length: f64 = simulated.iter().map(|&i| information[i] * step[i] * step[i]).sum();
        if length <= 0.0 || !length.is_finite() {
            return;
        }
        for e in 0..2 {
            let mut missing: Vec<C> = to[e].iter().zip(&from[e]).map(|(t, f)| t - f).collect();
            for (column, by) in self.columns.iter().zip(step) {
                missing.iter_mut().zip(&column[e]).for_each(|(m, c)| *m -= c * by);
            }
            for &i in &simulated {
                let share = information[i] * step[i] / length;
                self.columns[i][e].iter_mut().zip(&missing).for_each(|(c, m)| *c += m * share);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_tell_the_step_that_they_were_brought_along_and_what_is_not_simulated_stays() {
        let row = |x: [f64; 2]| -> Spectra { [x.map(C::from).to_vec(), Vec::new()] };
        let mut secant = Secant {
            columns: vec![row([1.0, 0.0]), row([0.0, 1.0]), row([1.0, 1.0])],
            is_simulated: vec![true, true, false],
        };
        let (step, to) = ([0.5, -0.25, 2.0], [4.0, 3.0]);
        secant.follow([&row([1.0, 1.0]), &row(to)], &step, &[1.0, 4.0, 9.0]);
        assert_eq!(secant.columns[2][0], row([1.0, 1.0])[0]);
        for k in 0..2 {
            let told: f64 = secant.columns.iter().zip(step).map(|(c, by)| c[0][k].re * by).sum();
            assert!((told - (to[k] - 1.0)).abs() < 1e-12, "{told}");
        }
        // The correction is the smallest: along information times step.
        let moved = [secant.columns[0][0][0].re - 1.0, secant.columns[1][0][0].re];
        assert!((moved[0] * 4.0 * -0.25 - moved[1] * 0.5).abs() < 1e-12, "{moved:?}");
    }
}
