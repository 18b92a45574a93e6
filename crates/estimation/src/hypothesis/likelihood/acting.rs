//! The density of logged torques, where a model lets others act.

use rustfft::FftPlanner;

use super::Band;
use crate::conditioning::Record;

impl Band {
    /// How dense the logged torques lie over those that act, of which a model keeps some on their way in: `ln |dT'/dT|^2` over all bins but
    /// the mean's.
    pub(in super::super) fn density_of_torques(
        &self,
        record: &Record,
        kept: &[f64],
        planner: &mut FftPlanner<f64>,
    ) -> f64 {
        let acting = record.torque.iter().zip(kept).map(|(logged, kept)| logged - kept).collect();
        let mut spectrum = |torque: Vec<f64>| {
            let [rows, _] = self.rows(&[torque, vec![0.0; record.len()]], 1.0, planner);
            rows.into_iter().map(|z| z.norm_sqr().max(f64::MIN_POSITIVE).ln())
        };
        let (logged, acting) = (spectrum(record.torque.clone()), spectrum(acting));
        self.weight.iter().zip(acting.zip(logged)).skip(1).map(|(w, (a, l))| w * (a - l)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::axis::{Hold, Parameters, Structure};
    use crate::effects::Settings;
    use crate::hypothesis::model::Model;

    #[test]
    fn logged_torques_lie_denser_than_those_that_act_by_the_gain_at_each_frequency() {
        let n = 1024;
        let torque: Vec<f64> =
            (0..n).map(|k| (0.9 * f64::from(k)).sin() + (0.02 * f64::from(k * k % 977)).cos()).collect();
        let record = Record::new(1e-3, Hold::Zoh, torque.clone(), [const { None }; 4]);
        let model = Model::new(Parameters::PAPER, Structure::Rigid, Settings::default());
        let band = Band::new(&record, &model, 100.0, &vec![1.0; n as usize]);
        let density = |kept: &[f64]| band.density_of_torques(&record, kept, &mut FftPlanner::new());
        let bins = band.weight[1..].iter().sum::<f64>();
        // Half of the torque is kept: a quarter of its power acts. All that is kept of another sign: four times.
        let kept = |share: f64| -> Vec<f64> { torque.iter().map(|t| share * t).collect() };
        assert!((density(&kept(0.5)) + bins * 4.0_f64.ln()).abs() < 1e-6 * bins);
        assert!((density(&kept(-1.0)) - bins * 4.0_f64.ln()).abs() < 1e-6 * bins);
        assert_eq!(density(&kept(0.0)), 0.0);
        // What only comes late has the same power: one sample of 1024, the last in the place of the first.
        let late: Vec<f64> =
            (0..torque.len()).map(|k| torque[k] - torque[(k + torque.len() - 1) % torque.len()]).collect();
        assert!(density(&late).abs() < 1e-6 * bins, "{}", density(&late));
    }
}
