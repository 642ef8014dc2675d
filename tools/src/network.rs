//! These modules handle the networks' weights on the host. [`checkpoint`] reads the result of a training,
//! [`quantize`] turns it into a weight file, [`weight_file`] reads such files, and [`quantization_error`] measures
//! the error that quantisation adds.

pub mod checkpoint;
pub mod quantization_error;
pub mod quantize;
pub mod tensors;
pub mod weight_file;
