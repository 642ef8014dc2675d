//! The normal equations of a least-squares fit of three shares.

/// What is left of an input's squares, of all, when the other inputs explain it.
const ROUNDING: f64 = 1e-12;

/// The sums of products, with the output in the last column.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct NormalEquations([[f64; 4]; 3]);

impl NormalEquations {
    pub fn add(&mut self, inputs: [f64; 3], output: f64, weight: f64) {
        let [x, y, z] = inputs;
        for (row, input) in self.0.iter_mut().zip(inputs) {
            for (sum, factor) in row.iter_mut().zip([x, y, z, output]) {
                *sum += weight * input * factor;
            }
        }
    }

    /// Returns the shares; `None` for an input that is always zero, or that the inputs before it explain.
    #[must_use]
    pub fn solve(mut self) -> [Option<f64>; 3] {
        let least: [f64; 3] = std::array::from_fn(|k| ROUNDING * self.0[k][k]);
        for pivot in 0..3 {
            let of = self.0[pivot];
            if of[pivot] > least[pivot] {
                for (_, row) in self.0.iter_mut().enumerate().filter(|(k, _)| *k != pivot) {
                    let factor = row[pivot] / of[pivot];
                    row.iter_mut().zip(of).for_each(|(term, of)| *term -= factor * of);
                }
            }
        }
        std::array::from_fn(|k| (self.0[k][k] > least[k]).then(|| self.0[k][3] / self.0[k][k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(inputs: &[[f64; 3]]) -> [Option<f64>; 3] {
        let mut equations = NormalEquations::default();
        inputs.iter().for_each(|&[x, y, z]| equations.add([x, y, z], 0.5 * x - 2.0 * y + 4.0 * z, 3.0));
        equations.solve()
    }

    #[test]
    fn known_shares_are_found() {
        let found = fitted(&[[1.0, 2.0, 0.5], [-1.0, 1.0, 0.0], [0.0, 3.0, 1.0], [2.0, 0.5, -1.0]]);
        for (found, share) in found.into_iter().zip([0.5, -2.0, 4.0]) {
            assert!((found.unwrap() - share).abs() < 1e-12);
        }
    }

    #[test]
    fn an_input_that_is_zero_or_explained_has_no_share() {
        let [x, y, z] = fitted(&[[1.0, 3.0, 0.0], [-2.0, -6.0, 0.0], [4.0, 12.0, 0.0]]);
        assert!((x.unwrap() + 5.5).abs() < 1e-12 && y.is_none() && z.is_none());
    }
}
