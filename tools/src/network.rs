//! These modules handle the networks' weights on the host. [`checkpoint`] reads the result of a training,
//! [`quantize`] turns it into a weight file, [`weight_file`] reads such files, and [`mod@reference`] computes a checkpoint in f32.

pub mod checkpoint;
pub mod quantize;
pub mod reference;
pub mod tensors;
pub mod weight_file;
