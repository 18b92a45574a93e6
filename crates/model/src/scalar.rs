//! Numbers the physics is written over: `f64`, and forward-mode dual numbers that carry exact derivatives.
//!
//! The axis, its effects and the step are written once over [`Scalar`]; run with [`Dual`] they give the trace together
//! with its sensitivities to any `N` parameters, which is what the output-error fits and the FMU's directional
//! derivatives use (forward-mode automatic differentiation, Griewank & Walther 2008, chapter 3).
//!
//! Own code, not a crate: the FMU's library has no dependencies.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number, with or without derivatives.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + From<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign<f64>
{
    /// Whether it carries derivatives.
    const HAS_DERIVATIVES: bool;

    /// The value.
    fn re(self) -> f64;
    /// Applies a function with the given value and derivative at `self.re()` (the chain rule).
    fn chain(self, value: f64, derivative: f64) -> Self;

    /// Sine.
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// Sine, and the value of the cosine.
    fn sin_cos(self) -> (Self, f64) {
        let (s, c) = self.re().sin_cos();
        (self.chain(s, c), c)
    }
    /// Cosine.
    fn cos(self) -> Self {
        let (s, c) = self.re().sin_cos();
        self.chain(c, -s)
    }
    /// Exponential.
    fn exp(self) -> Self {
        let e = self.re().exp();
        self.chain(e, e)
    }
    /// Square root; the derivative at zero is taken as zero.
    fn sqrt(self) -> Self {
        let r = self.re().sqrt();
        self.chain(r, if r > 0.0 { 0.5 / r } else { 0.0 })
    }
    /// Power of a positive base to a real exponent; zero, with zero derivatives, for a base of zero.
    fn powf(self, exponent: Self) -> Self {
        let (x, n) = (self.re(), exponent.re());
        if x <= 0.0 {
            return Self::default();
        }
        #[allow(clippy::float_cmp, reason = "the one exponent that leaves any base as it is")]
        let value = if n == 1.0 { x } else { x.powf(n) };
        self.chain(0.0, n * value / x) + exponent.chain(0.0, value * x.ln()) + value
    }
    /// Absolute value, with the derivative +1 at zero.
    fn abs(self) -> Self {
        if self.re() < 0.0 { -self } else { self }
    }
    /// The square.
    fn squared(self) -> Self {
        self * self
    }
}

impl Scalar for f64 {
    const HAS_DERIVATIVES: bool = false;

    #[inline]
    fn re(self) -> f64 {
        self
    }
    #[inline]
    fn chain(self, value: f64, _derivative: f64) -> Self {
        value
    }
}

/// A value and its derivatives to `N` parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub re: f64,
    /// Its derivatives.
    pub eps: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The `index`-th parameter itself, of the given value.
    ///
    /// # Panics
    /// If `index >= N`.
    #[must_use]
    pub fn variable(re: f64, index: usize) -> Self {
        let mut eps = [0.0; N];
        eps[index] = 1.0;
        Self { re, eps }
    }
}

impl<const N: usize> Default for Dual<N> {
    fn default() -> Self {
        Self { re: 0.0, eps: [0.0; N] }
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    fn from(re: f64) -> Self {
        Self { re, eps: [0.0; N] }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    const HAS_DERIVATIVES: bool = true;

    #[inline]
    fn re(self) -> f64 {
        self.re
    }
    #[inline]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Self { re: value, eps: self.eps.map(|e| e * derivative) }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(mut self, other: Self) -> Self {
        self += other;
        self
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(mut self, other: Self) -> Self {
        self -= other;
        self
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let mut eps = [0.0; N];
        for ((out, a), b) in eps.iter_mut().zip(&self.eps).zip(&other.eps) {
            *out = a * other.re + b * self.re;
        }
        Self { re: self.re * other.re, eps }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let re = self.re / other.re;
        let inverse = 1.0 / other.re;
        let mut eps = [0.0; N];
        for ((out, a), b) in eps.iter_mut().zip(&self.eps).zip(&other.eps) {
            *out = (a - b * re) * inverse;
        }
        Self { re, eps }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Self { re: -self.re, eps: self.eps.map(|e| -e) }
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, other: f64) -> Self {
        Self { re: self.re + other, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: f64) -> Self {
        Self { re: self.re - other, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: f64) -> Self {
        self.chain(self.re * other, other)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, other: f64) -> Self {
        self.chain(self.re / other, 1.0 / other)
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.re += other.re;
        for (a, b) in self.eps.iter_mut().zip(&other.eps) {
            *a += b;
        }
    }
}

impl<const N: usize> SubAssign for Dual<N> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        self.re -= other.re;
        for (a, b) in self.eps.iter_mut().zip(&other.eps) {
            *a -= b;
        }
    }
}

impl<const N: usize> MulAssign<f64> for Dual<N> {
    #[inline]
    fn mul_assign(&mut self, other: f64) {
        *self = *self * other;
    }
}

#[cfg(test)]
mod tests {
    use super::{Dual, Scalar};

    /// A function that uses every operation, and its derivative by hand.
    fn f<S: Scalar>(x: S) -> S {
        (x.sin() * x.exp() + x.cos() / (x.squared() + 1.0)) - (x * 3.0).sqrt() + (-x).abs() / 2.0 + x.powf(x * 2.0)
    }

    #[test]
    fn a_dual_carries_the_derivative_of_every_operation() {
        let x = 0.7_f64;
        let d = f(Dual::<2>::variable(x, 1));
        let q = x * x + 1.0;
        let by_hand = x.cos() * x.exp() + x.sin() * x.exp() + (-x.sin() * q - x.cos() * 2.0 * x) / (q * q)
            - 3.0 / (2.0 * (3.0 * x).sqrt())
            + 0.5
            + x.powf(2.0 * x) * (2.0 * x.ln() + 2.0);
        assert!((d.re - f(x)).abs() < 1e-15);
        assert_eq!(d.eps[0], 0.0);
        assert!((d.eps[1] - by_hand).abs() < 1e-14, "{} {by_hand}", d.eps[1]);
    }
}
