//! A linear layer computes every output from all inputs with int32 weights, and rounds just once at the end: products
//! are summed in 64 bits.

/// Holds the weights of a linear layer in place: a row for each output, a column for each input.
#[derive(Debug, Clone, Copy)]
pub struct Linear<'w> {
    inputs: usize,
    weights: &'w [i32],
}

impl<'w> Linear<'w> {
    pub const FRACTION_BITS: u32 = 24;
    /// The magnitudes of a row must not add up to more than this, so that no inputs can overflow a sum of 64 bits.
    pub const ROW_LIMIT: u64 = u32::MAX as u64;

    /// Creates a layer over rows of `inputs` weights of a file; or the number of a row that could overflow.
    pub fn new(inputs: usize, weights: &'w [i32]) -> Result<Self, usize> {
        let layer = Self { inputs, weights };
        let magnitude = |row: &[i32]| row.iter().map(|weight| u64::from(weight.unsigned_abs())).sum::<u64>();
        match layer.rows().position(|row| magnitude(row) > Self::ROW_LIMIT) {
            Some(row) => Err(row),
            None => Ok(layer),
        }
    }

    pub fn rows(&self) -> impl Iterator<Item = &'w [i32]> {
        self.weights.chunks_exact(self.inputs.max(1))
    }

    /// Returns a row's output, rounded to nearest and saturated.
    pub fn output(row: &[i32], inputs: &[i32]) -> i32 {
        let start = 1 << (Self::FRACTION_BITS - 1);
        // The magnitude is at most (2^32 - 1) 2^31 plus one half, which is below 2^63.
        let product = |weight: i32, input: i32| i64::from(weight) * i64::from(input);
        let ((rows, row), (columns, rest)) = (row.as_chunks(), inputs.as_chunks());
        // Four at a time, since the loop costs as much as a product.
        let sum = rows.iter().zip(columns).fold(start, |sum: i64, ([a, b, c, d], [w, x, y, z])| {
            let sum = sum.wrapping_add(product(*a, *w)).wrapping_add(product(*b, *x));
            sum.wrapping_add(product(*c, *y)).wrapping_add(product(*d, *z))
        });
        let products = row.iter().zip(rest).map(|(weight, input)| product(*weight, *input));
        let sum = products.fold(sum, i64::wrapping_add) >> Self::FRACTION_BITS;
        sum.clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
    }
}
