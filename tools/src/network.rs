//! The networks' weights on a host: [`checkpoint`]s from training, [`quantize`]d into [`weight_file`]s, and the error
//! that this adds ([`quantization_error`]).

pub mod checkpoint;
pub mod quantization_error;
pub mod quantize;
pub mod tensors;
pub mod weight_file;
