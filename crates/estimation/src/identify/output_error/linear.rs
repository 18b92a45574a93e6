//! What enters output error linearly: initial states, offsets and the bias of the torque, by least squares.

use super::super::lsq::{Solution, triangularise};
use super::*;

impl OutputError<'_> {
    /// The initial states, offsets and bias that fit best with the parameters as they are: on a linear axis the outputs
    /// are linear in them. Unknowns that the outputs do not determine keep their values.
    ///
    /// What a piece has of its own is eliminated before the bias, which is common to all (R. Frisch, F. V. Waugh,
    /// Econometrica 1, 1933): the bias is found from what is left of its column and of the outputs in all pieces.
    pub(super) fn solve_state(&self, q: &mut [f64]) {
        let p: Parameters = self.axis(&q[..PARAMETERS]);
        let with_bias = self.free[BIAS];
        let bias = if with_bias { 0.0 } else { q[BIAS] };
        let mut solved: Vec<(usize, Vec<usize>, Solution)> = Vec::new();
        let (mut projection, mut square) = (0.0, 0.0);
        for (index, piece) in self.pieces.iter().enumerate() {
            let unknowns: Vec<usize> = (0..OWN).filter(|i| self.free[own(index, *i)]).collect();
            if unknowns.is_empty() && !with_bias {
                continue;
            }
            let n = piece.len();
            let options = SimulateOptions { start: self.starts[index], ..self.options };
            let run = |initial: [f64; 4], torque: &[f64]| {
                simulate(&p, self.structure, &Settings::default(), initial, torque, &options)
            };
            let fixed = |i: usize| if self.free[own(index, i)] { 0.0 } else { q[own(index, i)] };
            let torque: Vec<f64> = self.torque[piece.clone()].iter().map(|t| t + bias).collect();
            let forced = run([0, 1, 2, 3].map(fixed), &torque);
            let offset = fixed(4);
            let rest = vec![0.0; n];
            let columns: Vec<Option<Response>> = unknowns
                .iter()
                .map(|i| {
                    (*i < 4).then(|| {
                        let mut unit = [0.0; 4];
                        unit[*i] = 1.0;
                        run(unit, &rest)
                    })
                })
                .collect();
            let pushed = with_bias.then(|| run([0.0; 4], &vec![1.0; n]));
            let width = unknowns.len();
            let outputs = &self.outputs;
            let triangle = triangularise(n * outputs.len(), width, 1 + usize::from(with_bias), |row, out| {
                let (channel, k) = (row % outputs.len(), row / outputs.len());
                let (_, c, measured) = &outputs[channel];
                let weight = 1.0 / self.sigma[channel];
                for (out, column) in out.iter_mut().zip(&columns) {
                    *out = weight
                        * match column {
                            Some(response) => pick(&response.readings[k], *c),
                            None => f64::from(u8::from(*c == 2)),
                        };
                }
                let offset = if *c == 2 { offset } else { 0.0 };
                out[width] = weight * (measured[piece.start + k] - pick(&forced.readings[k], *c) - offset);
                if let Some(pushed) = &pushed {
                    out[width + 1] = weight * pick(&pushed.readings[k], *c);
                }
            });
            let Ok(solution) = triangle.solve() else { continue };
            if with_bias {
                projection += solution.residual[(0, 1)];
                square += solution.residual[(1, 1)];
            }
            solved.push((index, unknowns, solution));
        }
        if with_bias && square > 0.0 {
            q[BIAS] = projection / square;
        }
        for (index, unknowns, solution) in solved {
            for (j, i) in unknowns.iter().enumerate() {
                let pushed = if with_bias { q[BIAS] * solution.phi[(j, 1)] } else { 0.0 };
                q[own(index, *i)] = solution.phi[(j, 0)] - pushed;
            }
        }
    }
}
