//! These modules handle the networks' weights on a host: [`checkpoint`]s from training are [`quantize`]d into
//! [`weight_file`]s, and [`quantization_error`] measures the error that this adds.

pub mod checkpoint;
pub mod quantization_error;
pub mod quantize;
pub mod tensors;
pub mod weight_file;
