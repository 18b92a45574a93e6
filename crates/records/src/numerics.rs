//! Sums over columns of samples.

/// Partial sums of an inner product: as many as two registers of four numbers hold, so that it vectorises.
const LANES: usize = 8;

/// Inner product of two columns of one length, in partial sums whose order is fixed: the same numbers give the same bits.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (ac, bc) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = ac.remainder().iter().zip(bc.remainder()).map(|(x, y)| x * y).sum();
    let mut lanes = [0.0; LANES];
    for (x, y) in ac.zip(bc) {
        for i in 0..LANES {
            lanes[i] += x[i] * y[i];
        }
    }
    ((lanes[0] + lanes[4]) + (lanes[1] + lanes[5])) + ((lanes[2] + lanes[6]) + (lanes[3] + lanes[7])) + rest
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
