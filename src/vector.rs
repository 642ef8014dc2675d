//! Computes with vectors of f32.

pub(crate) fn dot<const N: usize>(a: &[f32; N], b: &[f32; N]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn norm(vector: &[f32; 3]) -> f32 {
    crate::sqrt::sqrt(dot(vector, vector))
}
