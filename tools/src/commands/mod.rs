//! What the binary can do: one file for each subcommand, arguments in, text and files out.

pub mod bench_target;
pub mod bus;
pub mod campaign;
pub mod demo;
pub mod device;
pub mod evaluate;
pub mod import;
pub mod monitor;
mod networks;
mod progress;
pub mod quantize;
pub mod replay;
pub mod simulate;
pub mod size;
pub mod soak;
pub mod tables;

/// The library's errors are typed; here all that matters is that each prints as one clear line
/// that names the file.
pub type Result = std::result::Result<(), Box<dyn std::error::Error>>;

/// What holds for all subcommands.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct Common {
    /// Draw no progress bar.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// A file that could not be written, named.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}")]
struct WriteError {
    path: String,
    source: std::io::Error,
}

impl WriteError {
    fn to(path: &std::path::Path) -> impl Fn(std::io::Error) -> Self {
        let path = path.display().to_string();
        move |source| Self { path: path.clone(), source }
    }
}
