//! The bench image in the emulator, and the counts in their output.
//!
//! QEMU's plugin `tools/bench/m4count.c` counts instructions exactly and models Cortex-M4 cycles at zero wait states. It
//! is built with the C compiler that Rust's linker needs anyway.

use super::cmsis_nn::{COMPILER, FETCH};
use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const LIMIT: Duration = Duration::from_secs(900);
const POLL: Duration = Duration::from_millis(5);
pub const IMAGE: &str = "bench";
/// The images that are built to be flashed, optimised for size.
pub const FLASHED: [&str; 3] = ["boot", "coprocessor", "bringup"];
pub const MACHINE: &str = "netduinoplus2";
pub const TARGET: &str = "thumbv7em-none-eabihf";

#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    #[error("{program} cannot be started: {source}")]
    Start { program: String, source: std::io::Error },
    #[error("{program} failed:\n{output}")]
    Failed { program: String, output: String },
    #[error("{program} did not end within {LIMIT:?}")]
    TooLong { program: String },
    #[error("the image printed an unexpected line: {0}")]
    Line(String),
    #[error("{0} is not there: the folder does not hold CMSIS-NN (fetch it with `{FETCH}`)")]
    NoSources(String),
    #[error("{COMPILER} is not installed (Debian and Ubuntu: apt install gcc-arm-none-eabi)")]
    NoCompiler,
}

#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Count {
    pub name: String,
    pub instructions: u64,
    /// Modelled Cortex-M4 cycles at zero wait states.
    pub cycles: u64,
    /// Bytes of stack used below the caller.
    pub stack: u64,
}

#[derive(Debug, Clone, Default)]
pub struct Counts {
    pub regions: Vec<Count>,
    pub sizes: Vec<(String, u64)>,
}

impl Counts {
    pub fn get(&self, name: &str) -> Option<&Count> {
        self.regions.iter().find(|count| count.name == name)
    }

    /// Returns whether all windows of a network have the same instruction count, as they must for any input.
    pub fn constant(&self) -> bool {
        ["gyronet/window", "fognet/window"].into_iter().all(|network| {
            let mut windows = self.starting_with(network).map(|count| count.instructions);
            let first = windows.next();
            windows.all(|other| first == Some(other))
        })
    }

    pub fn starting_with(&self, prefix: &str) -> impl Iterator<Item = &Count> {
        self.regions.iter().filter(move |count| count.name.starts_with(prefix))
    }
}

/// Returns the root of the workspace that this crate was built in; images are built from there.
pub fn workspace() -> PathBuf {
    let tools = Path::new(env!("CARGO_MANIFEST_DIR"));
    tools.parent().unwrap_or(tools).to_owned()
}

/// Returns cargo's target folder. It is the folder that contains this program if cargo built the program there, so
/// that `cargo fw` and the commands share one build; otherwise it is the workspace's.
pub fn target_folder() -> PathBuf {
    let program = std::env::current_exe().ok();
    let folder = program.as_deref().and_then(|program| program.ancestors().nth(2));
    // Cargo marks its target folder with this file.
    let cargo = folder.filter(|folder| folder.join("CACHEDIR.TAG").is_file());
    cargo.map_or_else(|| workspace().join("target"), Path::to_owned)
}

pub fn target_installed(target: &str) -> Result<(), String> {
    if !workspace().join("memory.x").is_file() {
        return Err("the repository that this program was built in no longer exists".into());
    }
    let rustc = std::env::var_os("RUSTC").unwrap_or("rustc".into());
    let output = Command::new(rustc)
        .args(["--print", "target-libdir", "--target", target])
        .current_dir(workspace())
        .output()
        .map_err(|error| format!("rustc cannot be run: {error}"))?;
    let folder = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    if output.status.success() && Path::new(&folder).is_dir() {
        Ok(())
    } else {
        Err(format!("the Rust target {target} is not installed (rustup target add {target})"))
    }
}

/// Builds an image of the firmware for the emulated board under `folder` and returns its path.
pub fn build(image: &str, folder: &Path) -> Result<PathBuf, BenchError> {
    build_for(("netduino-plus-2", TARGET), image, folder)
}

/// Builds image and boot loader of `package`, the NUCLEO-H563ZI's folder or a copy of it, under `folder`, and returns the
/// folder that holds both.
pub fn build_banks(package: &Path, folder: &Path) -> Result<PathBuf, BenchError> {
    const TARGET: &str = "thumbv8m.main-none-eabihf";
    let mut cargo = Command::new(std::env::var_os("CARGO").as_deref().unwrap_or(OsStr::new("cargo")));
    cargo.current_dir(workspace()).args(["build", "--release", "--locked", "--quiet", "--manifest-path"]);
    cargo.arg(package.join("Cargo.toml")).args(["--target", TARGET, "--target-dir"]).arg(folder);
    run(&mut cargo)?;
    Ok(folder.join(TARGET).join("release"))
}

pub fn build_for((board, target): (&str, &str), image: &str, folder: &Path) -> Result<PathBuf, BenchError> {
    let mut cargo = Command::new(std::env::var_os("CARGO").as_deref().unwrap_or(OsStr::new("cargo")));
    let build = "build --release --quiet -p gyronet-images --bin";
    cargo.current_dir(workspace()).args(build.split(' ')).arg(image);
    // Those to flash as `cargo fw` builds them; no debugger is attached to the others.
    let is_flashed = FLASHED.contains(&image);
    let setting = if is_flashed { "profile.release.opt-level='s'" } else { "profile.release.debug=false" };
    cargo.args(["--config", setting]);
    cargo.args(["--features", board, "--target", target, "--target-dir"]).arg(folder);
    run(&mut cargo)?;
    Ok(folder.join(target).join("release").join(image))
}

/// Runs the bench image with the plugin and combines its output with the plugin's counts.
pub fn measure(image: &Path) -> Result<Counts, BenchError> {
    let (stdout, mut regions) = regions(MACHINE, image)?;
    let mut counts = Counts::default();
    for line in stdout.lines() {
        let unexpected = || BenchError::Line(line.to_owned());
        let (name, _) = line.split_once(' ').ok_or_else(unexpected)?;
        if let Some(bytes) = field(line, "bytes=") {
            counts.sizes.push((name.to_owned(), bytes));
            continue;
        }
        let stack = field(line, "stack=").ok_or_else(unexpected)?;
        let (instructions, cycles) = regions.next().ok_or_else(unexpected)?;
        counts.regions.push(Count { name: name.to_owned(), instructions, cycles, stack });
    }
    Ok(counts)
}

/// Runs an image with the plugin; returns the image's output, and instructions and cycles of each region.
pub(super) fn regions(
    machine: &str,
    image: &Path,
) -> Result<(String, impl Iterator<Item = (u64, u64)>), BenchError> {
    let plugin = plugin()?;
    let (stdout, stderr) = emulate(machine, image, &["-plugin", &plugin.display().to_string()])?;
    let counts = stderr.lines().filter(|line| line.starts_with("REGION"));
    let counts = counts.filter_map(|line| Some((field(line, "insns=")?, field(line, "m4cycles~")?)));
    Ok((stdout, counts.collect::<Vec<_>>().into_iter()))
}

fn plugin() -> Result<PathBuf, BenchError> {
    let library = scratch()?.join("m4count.so");
    let source = workspace().join("tools/bench/m4count.c");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let mut cc = Command::new(compiler);
    cc.args(["-O2", "-shared", "-fPIC", "-o"]).arg(&library).arg(source);
    run(&mut cc)?;
    Ok(library)
}

/// Returns the folder for what the bench compiles from C.
pub(super) fn scratch() -> Result<PathBuf, BenchError> {
    let folder = workspace().join("target");
    let program = || format!("a bench in {}", folder.display());
    std::fs::create_dir_all(&folder).map_err(|source| BenchError::Start { program: program(), source })?;
    Ok(folder)
}

/// Runs an image on an emulated machine until it ends by itself; returns what the image and the emulator printed.
pub fn emulate(machine: &str, image: &Path, arguments: &[&str]) -> Result<(String, String), BenchError> {
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", machine, "-nographic", "-monitor", "none"]);
    qemu.args(["-serial", "none", "-semihosting-config", "enable=on,target=native"]);
    run(qemu.args(arguments).arg("-kernel").arg(image))
}

fn field(line: &str, key: &str) -> Option<u64> {
    let (_, rest) = line.split_once(key)?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Runs a program to its end; returns its output, or its error output as an error.
pub(super) fn run(command: &mut Command) -> Result<(String, String), BenchError> {
    let program = command.get_program().to_string_lossy().into_owned();
    let start = |source| BenchError::Start { program: program.clone(), source };
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().map_err(start)?;
    let (stdout, stderr) = (collect(child.stdout.take()), collect(child.stderr.take()));
    let until = Instant::now() + LIMIT;
    let status = loop {
        if let Some(status) = child.try_wait().map_err(start)? {
            break status;
        }
        if Instant::now() > until {
            // The program may have ended by itself by now, so errors are ignored.
            let _ = child.kill();
            let _ = child.wait();
            return Err(BenchError::TooLong { program });
        }
        std::thread::sleep(POLL);
    };
    let [stdout, stderr] = [stdout, stderr].map(|thread| thread.join().unwrap_or_default());
    if status.success() { Ok((stdout, stderr)) } else { Err(BenchError::Failed { program, output: stderr }) }
}

/// Reads a pipe to its end in a thread, because a full pipe would block the program.
fn collect(source: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        // A read error only truncates the output, so it is ignored.
        let _ = source.map(|mut source| source.read_to_end(&mut bytes));
        String::from_utf8_lossy(&bytes).into_owned()
    })
}
