//! GyroNet's network by CMSIS-NN, whose sources the user has fetched, counted as ours is.
//!
//! `tools/bench/cmsis_nn.c` calls CMSIS-NN's LSTM and dense kernels in GyroNet's shape. It runs on another emulated
//! Cortex-M4 than our images, which has the memory for weights that are written at the start; neither count depends on
//! the board.

use super::bench::{self, BenchError};
use std::path::Path;
use std::process::Command;

pub const FETCH: &str = "git clone --depth 1 https://github.com/ARM-software/CMSIS-NN";
pub const COMPILER: &str = "arm-none-eabi-gcc";
const MACHINE: &str = "mps2-an386";

/// Integer kernels of an LSTM and of a dense layer.
const SOURCES: [&str; 18] = [
    "LSTMFunctions/arm_lstm_unidirectional_s8.c",
    "LSTMFunctions/arm_lstm_unidirectional_s16.c",
    "NNSupportFunctions/arm_nn_lstm_step_s8.c",
    "NNSupportFunctions/arm_nn_lstm_step_s16.c",
    "NNSupportFunctions/arm_nn_lstm_calculate_gate_s8_s16.c",
    "NNSupportFunctions/arm_nn_lstm_calculate_gate_s16.c",
    "NNSupportFunctions/arm_nn_vec_mat_mul_result_acc_s8_s16.c",
    "NNSupportFunctions/arm_nn_vec_mat_mul_result_acc_s16.c",
    "NNSupportFunctions/arm_nn_vec_mat_mult_t_s8.c",
    "NNSupportFunctions/arm_nn_vec_mat_mult_t_s16.c",
    "NNSupportFunctions/arm_nntables.c",
    "ActivationFunctions/arm_nn_activation_s16.c",
    "BasicMathFunctions/arm_elementwise_mul_s16.c",
    "BasicMathFunctions/arm_elementwise_mul_acc_s16.c",
    "BasicMathFunctions/arm_elementwise_mul_s16_s8.c",
    "BasicMathFunctions/arm_elementwise_mul_s16_batch_offset.c",
    "FullyConnectedFunctions/arm_fully_connected_s8.c",
    "FullyConnectedFunctions/arm_fully_connected_s16.c",
];

#[derive(Debug)]
pub struct Region {
    /// The width of the activations, such as `cmsis-nn/s8/window`.
    pub name: String,
    pub instructions: u64,
    /// Modelled Cortex-M4 cycles at zero wait states.
    pub cycles: u64,
}

/// Builds and runs the image from the CMSIS-NN in `folder`; returns its regions and the compiler's version.
pub fn measure(folder: &Path) -> Result<(Vec<Region>, String), BenchError> {
    let bench = bench::workspace().join("tools/bench");
    let mut gcc = Command::new(COMPILER);
    gcc.args([
        "-O3",
        "-mcpu=cortex-m4",
        "-mthumb",
        "-mfloat-abi=soft",
        "-nostdlib",
        "-fno-tree-loop-distribute-patterns",
    ]);
    gcc.arg("-I").arg(bench.join("freestanding")).arg("-I").arg(folder.join("Include"));
    gcc.arg(bench.join("cmsis_nn.c"));
    for source in SOURCES {
        let path = folder.join("Source").join(source);
        if !path.is_file() {
            return Err(BenchError::NoSources(path.display().to_string()));
        }
        gcc.arg(path);
    }
    let version =
        Command::new(COMPILER).arg("-dumpfullversion").output().map_err(|_| BenchError::NoCompiler)?;
    // Vectors and code at the start of the board's flash, data in its RAM.
    gcc.args(["-Wl,--section-start=.vectors=0", "-Wl,-Ttext=0x100", "-Wl,-Tdata=0x20000000", "-Wl,-e,reset"]);
    let image = bench::scratch()?.join("cmsis_nn.elf");
    bench::run(gcc.arg("-o").arg(&image))?;
    let (printed, counts) = bench::regions(MACHINE, &image)?;
    let names: Vec<&str> = printed.lines().collect();
    let counts: Vec<(u64, u64)> = counts.collect();
    if names.len() != counts.len() || names.iter().any(|name| name.starts_with("FAILED")) {
        return Err(BenchError::Line(printed));
    }
    let regions = names.into_iter().zip(counts).map(|(name, (instructions, cycles))| Region {
        name: format!("cmsis-nn/{name}"),
        instructions,
        cycles,
    });
    Ok((regions.collect(), String::from_utf8_lossy(&version.stdout).trim().to_owned()))
}
