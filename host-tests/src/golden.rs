//! The outputs of PyTorch for some windows, layer by layer, as `gyronet_train` exports them.

use crate::recordings::workspace;
use safetensors::{Dtype, SafeTensors};

pub const WINDOWS: usize = 8;
/// Allowed difference: f32 sums of a few hundred products of order 1, twice over, are summed in another order than in
/// PyTorch. A normalised input of 20 has an LSB of 2e-6; everything else stays within 1.
const TOLERANCE: f32 = 1e-5;

#[derive(Debug)]
pub struct Golden(Vec<u8>);

impl Golden {
    pub fn read(network: &str) -> Self {
        let path = workspace().join(format!("tools/weights/{network}.golden.safetensors"));
        Self(std::fs::read(path).expect("the committed tensors"))
    }

    /// Row-major.
    pub fn tensor(&self, name: &str, shape: &[usize]) -> Vec<f32> {
        let file = SafeTensors::deserialize(&self.0).expect("safetensors");
        let view = file.tensor(name).expect(name);
        assert_eq!((view.dtype(), view.shape()), (Dtype::F32, shape), "{name}");
        view.data().as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
    }

    /// Compares a layer's outputs with the tensor of its name.
    pub fn compare(&self, name: &str, shape: &[usize], ours: &[f32]) {
        let theirs = self.tensor(name, shape);
        assert_eq!(ours.len(), theirs.len(), "{name}");
        let largest = |values: &mut dyn Iterator<Item = f32>| values.fold(0.0f32, |max, v| max.max(v.abs()));
        let difference = largest(&mut ours.iter().zip(&theirs).map(|(ours, theirs)| ours - theirs));
        let value = largest(&mut theirs.iter().copied());
        println!("{name}: largest difference {difference:.2e}, largest value {value:.3}");
        assert!(difference <= TOLERANCE, "{name}");
        assert!(value > 0.0, "{name} says nothing");
    }
}
