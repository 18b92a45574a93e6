//! Sums over columns of samples.

use nalgebra::DVectorView;

/// Inner product of two columns of one length, summed in lanes whose order is fixed.
///
/// # Panics
/// If the lengths differ.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    DVectorView::from_slice(a, a.len()).dot(&DVectorView::from_slice(b, b.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_product_of_integers_is_exact_whatever_their_number() {
        for n in [0_u32, 1, 7, 8, 9, 100] {
            let a: Vec<f64> = (1..=n).map(f64::from).collect();
            assert_eq!(dot(&a, &a), f64::from(n * (n + 1) * (2 * n + 1) / 6), "{n}");
        }
    }
}
