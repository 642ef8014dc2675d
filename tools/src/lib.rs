//! gyronet on a host: read recordings, simulate, quantise, replay, evaluate, draw.

pub mod bundled;
pub mod candump;
pub mod checkpoint;
pub mod device;
pub mod drive;
pub mod evaluate;
pub mod fir;
pub mod image_size;
pub mod image_stack;
pub mod methods;
pub mod metrics;
pub mod monitor;
pub mod parser_load;
pub mod plot;
pub mod quantization_error;
pub mod quantize;
pub mod recording;
pub mod simulate;
pub mod target_bench;
pub mod via;
pub mod weight_file;
