//! Runs each estimator on a record: its start, the description of its equations, and how it ended.

use super::extended::{NOISE_ORDER, extended_batch, extended_recursive};
use super::frequency::Measured;
use super::instrumental::instrumental;
use super::joined::Joined;
use super::output_error::{Free, OutputError, OutputErrorFit};
use super::paper;
use super::parameters::{Estimated, wider};
use super::record::RegressionRecord;
use super::regression::{RegressionError, least_squares, recursive};
use super::result::{History, MethodResult};
use super::run::{Method, Request, hold_name, torque_unit};
use super::statistics::whiteness;
use crate::axis::{Parameters, Scheme, Structure};
use crate::numerics::level::rms;
use crate::trace::Machine;

/// One record, and what the methods share.
pub(super) struct Run<'a> {
    /// The record, SI units.
    pub joined: &'a Joined<'a>,
    /// What simulations are compared with.
    pub compared: &'a Joined<'a>,
    pub machine: &'a Machine,
    pub request: &'a Request,
    pub record: &'a RegressionRecord<'a>,
    /// The problem of output error on [`Self::compared`].
    pub outputs: &'a OutputError<'a>,
    /// The frequency response of a periodic record.
    pub measured: Option<&'a Measured>,
    /// The estimates so far, each with its method.
    pub estimates: Vec<(&'static str, Estimated)>,
    /// The fit of output error, once it has run.
    pub oe: Option<OutputErrorFit>,
}

type Found = (Estimated, Option<History>);

impl Run<'_> {
    /// Runs a method; the estimates so far are starting points for it.
    pub fn method(&mut self, method: Method) -> MethodResult {
        let (lambda, p0) = (self.request.forgetting, self.request.p0);
        let mut result = MethodResult::empty(method.name(), method.title());
        let plain = format!("F5, {}", self.record.equations());
        let recursion = format!("forgetting factor {lambda}, P(0) = {p0:e}");
        let found: Result<Found, String> = match method {
            _ if self.request.paper && matches!(method, Method::Ls | Method::Rls | Method::Els | Method::ElsBatch) => {
                result.formulation = "Euler 5x4 (paper, eq. 6)".to_owned();
                result.notes.push(paper::EULER_NOTE.to_owned());
                if self.joined.pieces().len() > 1 {
                    result.notes.push("the paper's regression takes the longest piece of the record alone".to_owned());
                }
                self.euler(method)
            }
            Method::Ls => {
                result.formulation = format!("{plain}; QR");
                least_squares(self.record).map(|e| (e, None)).map_err(|e| e.to_string())
            }
            Method::Rls => {
                result.formulation = format!("{plain}; {recursion}");
                recursive(self.record, lambda, p0).map(|(e, h)| (e, Some(h))).map_err(|e| e.to_string())
            }
            Method::Els => {
                result.formulation = format!("{plain}; noise model of order {NOISE_ORDER}; {recursion}");
                extended_recursive(self.record, lambda, p0).map(|(e, h)| (e, Some(h))).map_err(|e| e.to_string())
            }
            Method::ElsBatch => {
                result.formulation = format!("{plain}; noise model of order {NOISE_ORDER}");
                extended_batch(self.record).map(|e| (e, None)).map_err(|e| e.to_string())
            }
            Method::Iv => {
                result.formulation = format!("S4, {}; instruments simulated", self.record.equations());
                self.instrumental(&mut result).map(|e| (e, None)).map_err(|e| e.to_string())
            }
            Method::Oe => self.output_error(&mut result).map(|e| (e, None)),
            Method::Frequency => self.frequency(&mut result).map(|e| (e, None)),
        };
        match found {
            Ok((estimated, history)) => {
                result.history = history;
                self.take(&mut result, estimated);
            }
            Err(why) => result.failure = Some(why),
        }
        result
    }

    /// Sets the estimates of a result, and keeps them as a starting point for the methods that follow.
    fn take(&mut self, result: &mut MethodResult, estimated: Estimated) {
        let reference = self.request.reference.then_some(&self.machine.parameters);
        result.assess(&estimated, reference, self.machine.signals.motion, self.joined.samples().dt);
        self.estimates.push((result.method, estimated));
    }

    /// The paper's Euler regressions, on the longest piece of the record.
    ///
    /// # Errors
    /// Why there is no estimate.
    fn euler(&self, method: Method) -> Result<Found, String> {
        let (lambda, p0) = (self.request.forgetting, self.request.p0);
        let longest = self.joined.longest_trace();
        let alone;
        let record = if self.joined.pieces().len() > 1 {
            alone = RegressionRecord::new(&longest, self.machine.parameters.rho).map_err(|e| e.to_string())?;
            &alone
        } else {
            self.record
        };
        match method {
            Method::Ls => paper::euler_least_squares(record).map(|e| (e, None)),
            Method::Rls => paper::euler_recursive(record, lambda, p0, false).map(|(e, h)| (e, Some(h))),
            Method::Els => paper::euler_recursive(record, lambda, p0, true).map(|(e, h)| (e, Some(h))),
            _ => Err(RegressionError::Diverged { what: "batch ELS has no Euler form; it" }),
        }
        .map_err(|e| e.to_string())
    }

    /// The start that simulates best, of all estimates so far and the axis file.
    fn start(&self) -> Option<Parameters> {
        let rho = self.machine.parameters.rho;
        let mut starts: Vec<Parameters> = self
            .estimates
            .iter()
            .filter(|(_, e)| e.is_physical())
            .map(|(_, e)| e.parameters(rho))
            .map(|p| Parameters { b: p.b.max(0.0), ..p })
            .collect();
        if starts.is_empty() {
            // No method that was asked for gave a physical start: least squares is cheap.
            starts.extend(least_squares(self.record).ok().filter(Estimated::is_physical).map(|e| e.parameters(rho)));
        }
        if let Some(measured) = self.measured {
            starts.extend(measured.guess(rho));
        }
        starts.push(self.machine.parameters);
        let free = Free { parameters: false, offset: self.record.zero_offset != 0.0, bias: true };
        starts
            .into_iter()
            .filter(|p| p.check(Structure::TwoInertia).is_ok() && p.k > 0.0)
            .map(|p| (likelihood(&self.outputs.fit(&p, Scheme::Exact, free), self.record.len()), p))
            .filter(|(l, _)| l.is_finite())
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, p)| p)
    }

    fn instrumental(&self, result: &mut MethodResult) -> Result<Estimated, RegressionError> {
        let start = self.start().ok_or(RegressionError::Diverged { what: "the search for a start" })?;
        let (estimated, rounds) = instrumental(self.record, self.outputs, &start)?;
        result.iterations = Some(rounds);
        Ok(estimated)
    }

    fn output_error(&mut self, result: &mut MethodResult) -> Result<Estimated, String> {
        let start = self.start().ok_or("no physical start was found: give one with --axis")?;
        let offset = self.record.zero_offset != 0.0;
        let plain = Free { parameters: true, offset, bias: false };
        let schemes = self.request.scheme.map_or_else(|| vec![Scheme::Exact, Scheme::NEWMARK], |s| vec![s]);
        let n = self.compared.len();
        let better = |a: OutputErrorFit, b: OutputErrorFit| if likelihood(&b, n) > likelihood(&a, n) { b } else { a };
        let mut best = schemes
            .iter()
            .map(|s| self.outputs.fit(&start, *s, plain))
            .reduce(better)
            .ok_or("no integration scheme was asked for")?;
        // A constant torque (amplifier offset, gravity) is fitted as well where it explains more than chance would.
        let exact = best.sigma.iter().zip(self.outputs.outputs()).all(|(s, (_, y))| *s < 1e-9 * rms(y));
        if !exact {
            let rho = self.machine.parameters.rho;
            let with = self.outputs.fit(&best.estimated.parameters(rho), best.scheme, Free { bias: true, ..plain });
            if likelihood(&with, n) - likelihood(&best, n) > (n as f64).ln() + 10.0 {
                best = with;
            }
        }
        // Where the residual is coloured, the standard errors of white noise are too small.
        let white = || self.outputs.residuals(&best).iter().all(|(_, r)| whiteness(r).white);
        if !exact
            && !white()
            && let (Some(plain), Some(coloured)) = (best.estimated.covariance, self.outputs.coloured(&best))
        {
            let wide = wider(&plain, &coloured);
            if wide.iter().all(|v| v.is_finite()) {
                best.estimated.covariance = Some(wide);
                result.notes.push("the residual is not white: the standard errors allow for its colour".to_owned());
            }
        }
        let integration = match best.scheme {
            Scheme::Exact => "exact integration",
            Scheme::Newmark { .. } => "Newmark integration at the sampling interval",
        };
        let hold = hold_name(self.joined.samples().hold);
        let channels: Vec<&str> = self.outputs.outputs().map(|(s, _)| s.name()).collect();
        result.formulation = format!("simulation of {} against the record; {integration}, {hold}", channels.join(", "));
        if best.bias != 0.0 {
            let unit = torque_unit(self.machine.signals.motion);
            result.notes.push(format!("a constant torque of {:.6e} {unit} was fitted with the parameters", best.bias));
        }
        result.termination = Some(best.termination);
        result.iterations = Some(best.iterations);
        if !best.termination.is_converged() {
            result.notes.push("the fit did not converge: give a nearer start with --axis".to_owned());
        }
        let estimated = best.estimated.clone();
        self.oe = Some(best);
        Ok(estimated)
    }

    fn frequency(&self, result: &mut MethodResult) -> Result<Estimated, String> {
        let measured = self.measured.ok_or("the record is not periodic")?;
        let rho = self.machine.parameters.rho;
        let scheme = self.request.scheme.unwrap_or(Scheme::Exact);
        let mut starts: Vec<Parameters> = measured.guess(rho).into_iter().collect();
        starts.extend(self.estimates.iter().filter(|(_, e)| e.is_physical()).map(|(_, e)| e.parameters(rho)));
        starts.push(self.machine.parameters);
        let fit = starts
            .iter()
            .filter(|p| p.check(Structure::TwoInertia).is_ok() && p.k > 0.0)
            .map(|p| measured.fit(p, scheme))
            .min_by(|a, b| a.model_error.total_cmp(&b.model_error))
            .ok_or("no physical start was found: give one with --axis")?;
        let f = measured.frequencies();
        result.formulation = format!(
            "response averaged over {} periods of {} samples, {} lines from {:.4} to {:.4} Hz",
            measured.periods,
            measured.period,
            f.len(),
            f.first().copied().unwrap_or_default(),
            f.last().copied().unwrap_or_default()
        );
        result.notes.push(format!(
            "the linear model leaves {:.1} % of the response unexplained beyond its noise; the standard errors take \
             that error as independent from line to line",
            100.0 * fit.model_error
        ));
        result.termination = Some(fit.termination);
        result.iterations = Some(fit.iterations);
        Ok(fit.estimated)
    }
}

/// Twice the logarithm of the likelihood, but for a constant, at the levels of the residuals.
fn likelihood(fit: &OutputErrorFit, samples: usize) -> f64 {
    -2.0 * samples as f64 * fit.sigma.iter().map(|s| s.ln()).sum::<f64>()
}
