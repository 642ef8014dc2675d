//! This module runs the bench image in the emulator and reads the counts in its output.
//!
//! With a C compiler, QEMU's plugin `tools/bench/m4count.c` counts instructions exactly and models Cortex-M4 cycles.
//! Without one, the image counts instructions with its own SysTick under `-icount shift=0`, where an instruction
//! takes a nanosecond. That count is accurate to 6 instructions.

use std::ffi::OsStr;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// SysTick ticks of the emulated STM32F405 per 1000 instructions (168 MHz, 1 instruction/ns).
const TICKS_PER_1000: u64 = 168;
/// Timeout of an image's run or a build.
const LIMIT: Duration = Duration::from_secs(900);
const POLL: Duration = Duration::from_millis(5);
/// The images that are measured, in order.
pub const IMAGES: [&str; 2] = ["bench", "bench_fognet"];
/// The images that are built to be flashed, optimised for size.
const FLASHED: [&str; 2] = ["coprocessor", "bringup"];
/// The emulated board.
pub const MACHINE: &str = "netduinoplus2";
/// The Rust target of the image.
pub const TARGET: &str = "thumbv7em-none-eabihf";

/// The reason why a bench cannot be run.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A program could not be started.
    #[error("{program} cannot be started: {source}")]
    Start {
        /// The program.
        program: String,
        /// The system's error.
        source: std::io::Error,
    },
    /// A program ended with an error.
    #[error("{program} failed:\n{output}")]
    Failed {
        /// The program.
        program: String,
        /// Its error output.
        output: String,
    },
    /// A program did not end.
    #[error("{program} did not end within {LIMIT:?}")]
    TooLong {
        /// The program.
        program: String,
    },
    /// The image printed an unexpected line.
    #[error("the bench image printed an unexpected line: {0}")]
    Line(String),
}

/// Holds the counts of one region of the image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Count {
    /// The image's name for the region.
    pub name: String,
    /// Number of executed instructions.
    pub instructions: u64,
    /// Modelled Cortex-M4 cycles at zero wait states; `None` without the plugin.
    pub cycles: Option<u64>,
    /// Modelled cycles on an STM32F405 at 168 MHz: flash with 5 wait states, empty caches at the start.
    pub cycles_5ws: Option<u64>,
    /// Bytes of stack used below the caller.
    pub stack: u64,
}

/// Holds all counts of one run, and the sizes that the image prints.
#[derive(Debug, Clone, Default)]
pub struct Counts {
    /// The regions in the order in which they ran.
    pub regions: Vec<Count>,
    /// The sizes: name and bytes.
    pub sizes: Vec<(String, u64)>,
}

impl Counts {
    /// Appends the counts of another image.
    pub fn extend(&mut self, other: Self) {
        self.regions.extend(other.regions);
        self.sizes.extend(other.sizes);
    }

    /// Returns the first region of a name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Count> {
        self.regions.iter().find(|count| count.name == name)
    }

    /// Returns whether instructions were counted exactly; otherwise the counts are accurate to six.
    #[must_use]
    pub fn exact(&self) -> bool {
        self.regions.iter().all(|count| count.cycles.is_some())
    }

    /// Returns whether all windows of a network have the same instruction count, as they must for any input.
    #[must_use]
    pub fn constant(&self) -> bool {
        let tolerance = if self.exact() { 0 } else { 12 };
        ["gyronet/window", "fognet/window"].into_iter().all(|network| {
            let mut windows = self.starting_with(network).map(|count| count.instructions);
            let first = windows.next();
            windows.all(|other| first.is_some_and(|first| first.abs_diff(other) <= tolerance))
        })
    }

    /// Returns all regions whose name begins with `prefix`.
    pub fn starting_with(&self, prefix: &str) -> impl Iterator<Item = &Count> {
        self.regions.iter().filter(move |count| count.name.starts_with(prefix))
    }
}

/// Returns the root of the workspace that this crate was built in; images are built from there.
#[must_use]
pub fn workspace() -> PathBuf {
    let tools = Path::new(env!("CARGO_MANIFEST_DIR"));
    tools.parent().unwrap_or(tools).to_owned()
}

/// Returns cargo's target folder. It is the folder that contains this program if cargo built the program there, so
/// that `cargo fw` and the commands share one build; otherwise it is the workspace's.
#[must_use]
pub fn target_folder() -> PathBuf {
    let program = std::env::current_exe().ok();
    let folder = program.as_deref().and_then(|program| program.ancestors().nth(2));
    // Cargo marks its target folder with this file.
    let cargo = folder.filter(|folder| folder.join("CACHEDIR.TAG").is_file());
    cargo.map_or_else(|| workspace().join("target"), Path::to_owned)
}

/// Checks that rustc has a standard library for the target.
///
/// # Errors
/// A message that says what is missing.
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
///
/// # Errors
/// [`BenchError`] with the compiler's output.
pub fn build(workspace: &Path, image: &str, folder: &Path) -> Result<PathBuf, BenchError> {
    build_for(("netduino-plus-2", TARGET), workspace, image, folder)
}

/// Builds an image for a board, named by its features, and its target.
///
/// # Errors
/// [`BenchError`] with the compiler's output.
pub fn build_for(
    (board, target): (&str, &str),
    workspace: &Path,
    image: &str,
    folder: &Path,
) -> Result<PathBuf, BenchError> {
    let mut cargo = Command::new(std::env::var_os("CARGO").as_deref().unwrap_or(OsStr::new("cargo")));
    cargo.current_dir(workspace).args(["build", "--release", "--quiet", "-p", "gyronet", "--bin", image]);
    if FLASHED.contains(&image) {
        // As `cargo fw` and `cargo bringup` build them.
        cargo.args(["--config", "profile.release.opt-level='s'"]);
    }
    cargo.args(["--features", board, "--target", target, "--target-dir"]).arg(folder);
    run(&mut cargo)?;
    Ok(folder.join(target).join("release").join(image))
}

/// Runs the bench image with the plugin that counts instructions, or without it if it cannot be built or loaded.
///
/// # Errors
/// [`BenchError`].
pub fn measure(workspace: &Path, image: &Path) -> Result<Counts, BenchError> {
    match plugin(workspace) {
        // An emulator built without plugins refuses the argument.
        Some(plugin) => count(image, Some(&plugin)).or_else(|_| count(image, None)),
        None => count(image, None),
    }
}

/// The policies of the flash accelerator that ST's manual leaves open, with the plugin's options for each. The model
/// uses the first one.
pub const POLICIES: [(&str, &str); 4] = [
    ("least recently used", ""),
    ("first in, first out", ",policy=fifo"),
    ("prefetched lines kept", ",prefetched=kept"),
    ("both", ",policy=fifo,prefetched=kept"),
];

/// Returns the counts of the bench image under each of [`POLICIES`].
///
/// # Errors
/// [`BenchError`], also without a C compiler.
pub fn measure_policies(workspace: &Path, image: &Path) -> Result<Vec<Counts>, BenchError> {
    let plugin = plugin(workspace).ok_or_else(|| BenchError::Line("no instruction counter".into()))?;
    let counts = POLICIES.iter().map(|(_, options)| {
        let mut plugin = plugin.clone().into_os_string();
        plugin.push(options);
        count(image, Some(Path::new(&plugin)))
    });
    counts.collect()
}

/// Compiles the plugin that counts instructions; returns `None` without a C compiler.
pub fn plugin(workspace: &Path) -> Option<PathBuf> {
    let folder = workspace.join("target");
    std::fs::create_dir_all(&folder).ok()?;
    let library = folder.join("m4count.so");
    let source = workspace.join("tools/bench/m4count.c");
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let mut cc = Command::new(compiler);
    cc.args(["-O2", "-shared", "-fPIC", "-o"]).arg(&library).arg(source);
    run(&mut cc).is_ok().then_some(library)
}

/// Runs the bench image and combines its output with the plugin's counts.
fn count(image: &Path, plugin: Option<&Path>) -> Result<Counts, BenchError> {
    let (stdout, stderr) = match plugin {
        Some(plugin) => emulate(MACHINE, image, &["-plugin", &plugin.display().to_string()])?,
        None => emulate(MACHINE, image, &["-icount", "shift=0"])?,
    };
    let mut regions = stderr.lines().filter(|line| line.starts_with("REGION"));
    let mut counts = Counts::default();
    for line in stdout.lines() {
        let unexpected = || BenchError::Line(line.to_owned());
        let (name, _) = line.split_once(' ').ok_or_else(unexpected)?;
        if let Some(bytes) = field(line, "bytes=") {
            counts.sizes.push((name.to_owned(), bytes));
            continue;
        }
        let stack = field(line, "stack=").ok_or_else(unexpected)?;
        let (instructions, cycles) = if plugin.is_some() {
            let region = regions.next().ok_or_else(unexpected)?;
            let instructions = field(region, "insns=").ok_or_else(unexpected)?;
            let cycles = field(region, "m4cycles~").ok_or_else(unexpected)?;
            let waited = field(region, "waited~").ok_or_else(unexpected)?;
            (instructions, Some((cycles, waited)))
        } else {
            (field(line, "ticks=").ok_or_else(unexpected)? * 1000 / TICKS_PER_1000, None)
        };
        let (cycles, cycles_5ws) = cycles.unzip();
        counts.regions.push(Count { name: name.to_owned(), instructions, cycles, cycles_5ws, stack });
    }
    Ok(counts)
}

/// Runs an image on an emulated machine until it ends by itself; returns what the image and the emulator printed.
///
/// # Errors
/// [`BenchError`], also when the image reports a failure.
pub fn emulate(machine: &str, image: &Path, arguments: &[&str]) -> Result<(String, String), BenchError> {
    let mut qemu = Command::new("qemu-system-arm");
    qemu.args(["-machine", machine, "-nographic", "-monitor", "none"]);
    qemu.args(["-serial", "none", "-semihosting-config", "enable=on,target=native"]);
    run(qemu.args(arguments).arg("-kernel").arg(image))
}

/// Returns the number after `key` in a line.
pub(crate) fn field(line: &str, key: &str) -> Option<u64> {
    let (_, rest) = line.split_once(key)?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

/// Runs a program to its end; returns its output, or its error output as an error.
fn run(command: &mut Command) -> Result<(String, String), BenchError> {
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
