//! These modules handle the networks' weights on the host. [`checkpoint`] reads the result of a training,
//! [`quantize`] turns it into a weight file, and [`weight_file`] reads such files.

pub mod checkpoint;
pub mod quantize;
pub mod tensors;
pub mod weight_file;
