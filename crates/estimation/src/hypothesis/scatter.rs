//! Standard errors by how the score scatters between stretches of the record (White, Econometrica 50, 1982; Ibragimov, Müller, JBES 28, 2010):
//! what is left may pull a parameter one way in one stretch and another way in the next, whatever its spectrum. The stretches are few and
//! long, so that a torque that wanders does not pull two neighbours alike. What is left of something that follows the torque (a lag, a
//! mode) pulls alike in all stretches, and unlike at one frequency and another: stretches of the band are compared, too.

use nalgebra::DMatrix;

use crate::numerics::distribution::of_log_odds;
use crate::trace::numerics::dot;

/// Stretches that are compared.
const STRETCHES: usize = 8;
/// By how much the 95 % interval of so few is wider than a normal variable's: Student's 2.365 with seven degrees of freedom over 1.960.
const FEW: f64 = 1.207;

/// A series of each equation.
pub type TimeSeries = Vec<Vec<f64>>;

/// What each parameter's score gains in each stretch.
pub type Scores = Vec<[f64; STRETCHES]>;

/// Standard errors of parameters from their scores, and the information, `J'J` and the prior's; `None` where the information is singular.
pub fn standard_errors(scores: Scores, information: &DMatrix<f64>) -> Option<Vec<f64>> {
    let k = scores.len();
    let scores: Scores = scores.into_iter().map(centred).collect();
    let freedom = STRETCHES as f64 / (STRETCHES as f64 - 1.0);
    // In units in which the information has a unit diagonal.
    let scale: Vec<f64> = (0..k).map(|i| information[(i, i)].max(f64::MIN_POSITIVE).sqrt()).collect();
    let scaled = |p: usize, q: usize, value: f64| value / (scale[p] * scale[q]);
    let spread = DMatrix::from_fn(k, k, |p, q| scaled(p, q, freedom * dot(&scores[p], &scores[q])));
    let inverse = DMatrix::from_fn(k, k, |p, q| scaled(p, q, information[(p, q)])).cholesky()?.inverse();
    let covariance = &inverse * spread * &inverse;
    Some((0..k).map(|i| FEW * covariance[(i, i)].max(0.0).sqrt() / scale[i]).collect())
}

/// The scores' parts from stretches of the record, of whitened columns, one for each parameter, and the whitened residual, as series in time.
pub fn in_time(columns: &[TimeSeries], residual: &TimeSeries) -> Scores {
    let of_column = |column: &TimeSeries| {
        std::array::from_fn(|stretch| {
            let of_equation = |(c, r): (&Vec<f64>, &Vec<f64>)| -> f64 {
                let at = |b: usize| b * r.len() / STRETCHES;
                (at(stretch)..at(stretch + 1)).map(|k| c[k] * r[k]).sum()
            };
            column.iter().zip(residual).map(of_equation).sum()
        })
    };
    columns.iter().map(of_column).collect()
}

/// The scores' parts from stretches of the band that tell as much of the parameters as one another; of each parameter's score and
/// information at each bin.
pub fn in_frequency(scores: &[Vec<f64>], information: &[Vec<f64>]) -> Scores {
    let bins = scores.first().map_or(0, Vec::len);
    let totals: Vec<f64> = information.iter().map(|i| i.iter().sum::<f64>().max(f64::MIN_POSITIVE)).collect();
    let mut parts = vec![[0.0; STRETCHES]; scores.len()];
    let mut covered = 0.0;
    for m in 0..bins {
        let own: f64 =
            information.iter().zip(&totals).map(|(i, total)| i[m] / total).sum::<f64>() / scores.len() as f64;
        let stretch = (((covered + 0.5 * own) * STRETCHES as f64) as usize).min(STRETCHES - 1);
        covered += own;
        for (part, score) in parts.iter_mut().zip(scores) {
            part[stretch] += score[m];
        }
    }
    parts
}

/// Probability that a value which is so many of its standard errors is one in every stretch, and no pull of a few of them: by Student's
/// likelihood, at a price in log evidence.
pub fn steadiness(errors: f64, price: f64) -> f64 {
    let stretches = STRETCHES as f64;
    let gained = 0.5 * stretches * (errors * errors / (stretches - 1.0)).ln_1p() - price;
    of_log_odds(gained)
}

fn centred(values: [f64; STRETCHES]) -> [f64; STRETCHES] {
    let mean = values.iter().sum::<f64>() / STRETCHES as f64;
    values.map(|v| v - mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::level::noise;

    /// Standard error of the slope of `e` over `x`, and the one that a noise of variance one everywhere has.
    fn of(x: Vec<f64>, e: Vec<f64>) -> [f64; 2] {
        let information = x.iter().map(|x| x * x).sum::<f64>();
        let scores = in_time(&[vec![x]], &vec![e]);
        let errors = standard_errors(scores, &DMatrix::from_element(1, 1, information));
        [errors.expect("regular")[0], information.sqrt().recip()]
    }

    #[test]
    fn of_white_noise_they_are_those_of_the_information() {
        // Of eight stretches a standard error is known to a quarter: in the mean of a hundred records its square is right to a twentieth.
        let x: Vec<f64> = (0..2400).map(|k| f64::from(k).sin()).collect();
        let ratio = |seed: u64| {
            let [found, white] = of(x.clone(), noise(2400, seed));
            (found / white / FEW).powi(2)
        };
        let mean = (1..=100).map(ratio).sum::<f64>() / 100.0;
        assert!((mean - 1.0).abs() < 0.15, "{mean}");
    }

    #[test]
    fn of_a_residual_that_is_large_where_its_column_is_they_are_larger() {
        // A column of 3 with a noise of 3 at one sample in six, of 1 with 1 elsewhere: sqrt(sum x^2 s^2)/sum x^2.
        let high = |k: usize| if k.is_multiple_of(6) { 3.0 } else { 1.0 };
        let x: Vec<f64> = (0..24_000).map(high).collect();
        let e: Vec<f64> = noise(24_000, 2).iter().zip(&x).map(|(e, s)| e * s).collect();
        let [found, white] = of(x, e);
        let expected = ((81.0 + 5.0) / 6.0_f64).sqrt() / ((9.0 + 5.0) / 6.0_f64).sqrt();
        assert!((found / white / FEW / expected - 1.0).abs() < 0.5, "{} {expected}", found / white);
    }

    #[test]
    fn of_a_residual_that_wanders_they_are_larger() {
        // Eight values that stay for a stretch each: as much is known as of eight samples.
        let steps = noise(8, 3);
        let e: Vec<f64> = (0..24_000).map(|k| steps[k / 3000]).collect();
        let [found, white] = of(vec![1.0; 24_000], e);
        assert!(found / white > 20.0, "{}", found / white);
    }

    #[test]
    fn of_a_residual_that_turns_over_the_band_they_are_larger() {
        // A column of ones; a residual that falls from one end of the band to the other, its mean zero, pulls as much as all of it.
        let bins = 800;
        let pulls: Vec<f64> = (0..bins).map(|m| f64::from(m) / 399.5 - 1.0).collect();
        let parts = in_frequency(&[pulls], &[vec![1.0; 800]]);
        // Stretches of a hundred bins, from -7/8 to 7/8 of the end's.
        let expected: [f64; STRETCHES] = std::array::from_fn(|i| 100.0 * (2.0 * i as f64 - 7.0) / 8.0);
        assert!(parts[0].iter().zip(expected).all(|(p, e)| (p - e).abs() < 0.2), "{parts:?}");
        // As far from white as bins are many: sqrt(8/7 * 100^2 * 2.625)/800 over 1/sqrt(800).
        let found = standard_errors(parts, &DMatrix::from_element(1, 1, 800.0)).expect("regular")[0];
        assert!((found / FEW / (8.0_f64 / 7.0 * 2.625).sqrt() / 0.125 - 1.0).abs() < 0.01, "{found}");
    }

    #[test]
    fn stretches_of_the_band_tell_as_much_as_one_another() {
        // All that is told is told in the first eight bins.
        let information: Vec<f64> = (0..64).map(|m| if m < 8 { 1.0 } else { 0.0 }).collect();
        assert_eq!(
            in_frequency(std::slice::from_ref(&information), std::slice::from_ref(&information)),
            [[1.0; STRETCHES]]
        );
        assert!(in_frequency(&[], &[]).is_empty());
    }

    #[test]
    fn a_value_of_many_errors_is_steady_and_one_of_three_is_not() {
        // 8/2 ln(1 + t^2/7) - 4: log odds of t = 0, 3 and 10.
        let odds = |t: f64| 4.0 * (1.0 + t * t / 7.0).ln() - 4.0;
        for t in [0.0, 3.0, 10.0] {
            assert!((steadiness(t, 4.0) - 1.0 / (1.0 + (-odds(t)).exp())).abs() < 1e-12);
        }
        assert!(steadiness(3.0, 4.0) < 0.5 && steadiness(5.0, 4.0) > 0.8 && steadiness(10.0, 4.0) > 0.99);
    }
}
