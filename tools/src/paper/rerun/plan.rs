//! This module lists the steps from a data set's files to its tables, as data: each step is one command.

use super::split::{Role, Split};
use crate::simulate::layout::Layout;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Names the program that runs a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Program {
    /// This command, gyronet.
    Gyronet,
    /// A Python with PyTorch, and `tools/train` on its path.
    Python,
}

/// An argument of a step, or several that belong together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Argument {
    /// An argument that is always given.
    Always(String),
    /// Arguments that are given only if another step, named first, is finished.
    If(String, Vec<String>),
}

/// A step of the plan: one command.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Step {
    /// Name of the step.
    pub name: String,
    /// The program.
    pub program: Program,
    /// The arguments.
    pub arguments: Vec<Argument>,
    /// The files that the step reads, other than the output of other steps.
    pub inputs: Vec<PathBuf>,
    /// The step that must be finished before this one.
    pub needs: Option<String>,
    /// The file that the step writes, if any.
    pub output: Option<PathBuf>,
}

/// Describes how much to train.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Effort {
    /// Epochs of GyroNet, for each of its seeds.
    pub gyronet_epochs: u32,
    /// Number of seeds of GyroNet, starting from 1; the best is kept.
    pub gyronet_seeds: u32,
    /// Epochs of FoGNet.
    pub fognet_epochs: u32,
    /// Training steps of lwoi's two Gaussian processes.
    pub lwoi_steps: u32,
    /// The Gaussian processes are trained on every Nth window, because memory and time grow at least with the square
    /// of the number of windows.
    pub lwoi_every: u32,
    /// Training steps of each of RINS-W's detectors.
    pub rinsw_steps: u32,
}

impl Effort {
    /// The effort with which the numbers of `tools/PAPER.md` were computed.
    pub const FULL: Self = Self {
        gyronet_epochs: 20,
        gyronet_seeds: 3,
        fognet_epochs: 14,
        lwoi_steps: 100,
        lwoi_every: 2,
        rinsw_steps: 1200,
    };
    /// The effort of a trial: every step is run, and nothing is trained well.
    pub const TRIAL: Self = Self {
        gyronet_epochs: 1,
        gyronet_seeds: 1,
        fognet_epochs: 1,
        lwoi_steps: 5,
        lwoi_every: 2,
        rinsw_steps: 10,
    };
}

/// Suffix of the name of the step that computes the rates of a drive.
const RATES: &str = "-rates";

/// Selects sequences by their role.
type Choice = fn(Role) -> bool;

/// A builder of a [`Step`].
struct Builder(Step);

impl Builder {
    fn new(name: String, program: Program) -> Self {
        Self(Step { name, program, arguments: Vec::new(), inputs: Vec::new(), needs: None, output: None })
    }

    fn text(mut self, texts: &[&dyn ToString]) -> Self {
        self.0.arguments.extend(texts.iter().map(|text| Argument::Always(text.to_string())));
        self
    }

    fn given(mut self, arguments: impl IntoIterator<Item = Argument>) -> Self {
        self.0.arguments.extend(arguments);
        self
    }

    fn needs(mut self, step: String) -> Self {
        self.0.needs = Some(step);
        self
    }

    fn makes(mut self, output: PathBuf) -> Step {
        self.0.output = Some(output);
        self.0
    }
}

/// Returns the steps for a data set, which write below `out`. `inputs` lists the files of a sequence.
#[must_use]
pub fn plan(split: &Split, effort: Effort, out: &Path, inputs: impl Fn(&Path) -> Vec<PathBuf>) -> Vec<Step> {
    let set = match split.layout {
        Layout::Kaist => "kaist",
        Layout::Nclt => "nclt",
    };
    let out = out.join(set);
    let step = |name: &str| format!("{set}/{name}");
    let drives = out.join("drives");
    let csv = |name: &str| format!("{name}.csv");
    let show = |path: &Path| path.display().to_string();
    let used = |role: Choice| split.members.iter().filter(move |member| role(member.role));
    // Returns one argument for each selected sequence whose step, named with `suffix`, is finished.
    let left =
        |suffix: &str, role: Choice, before: Option<&str>, text: &dyn Fn(&super::split::Member) -> String| {
            let arguments = used(role).map(|member| {
                let texts = before.map(str::to_owned).into_iter().chain([text(member)]).collect();
                Argument::If(step(&format!("{}{suffix}", member.name)), texts)
            });
            arguments.collect::<Vec<_>>()
        };
    let of = |role: Choice, before: Option<&str>, text: &dyn Fn(&super::split::Member) -> String| {
        left("", role, before, text)
    };
    let (train, validate, tables): (Choice, Choice, Choice) =
        (|role| role == Role::Train, |role| role == Role::Validate, |role| role != Role::Train);
    let mut steps = Vec::new();
    for member in &split.members {
        let import = Builder::new(step(&member.name), Program::Gyronet).text(&[
            &"import",
            &set,
            &show(&member.folder),
        ]);
        let mut import = if member.role == Role::Test {
            import.0
        } else {
            let file = drives.join(csv(&member.name));
            import.text(&[&"--training", &"--out", &show(&file)]).makes(file)
        };
        import.inputs = inputs(&member.folder);
        steps.push(import);
    }

    let networks = out.join("networks");
    let seeds: Vec<String> = (1..=effort.gyronet_seeds).map(|seed| seed.to_string()).collect();
    let gyronet = Builder::new(step("gyronet"), Program::Python)
        .text(&[&"-m", &"gyronet_train", &show(&drives), &"--out", &show(&networks)])
        .text(&[&"--epochs", &effort.gyronet_epochs, &"--seeds"])
        .given(seeds.into_iter().map(Argument::Always))
        .text(&[&"--train"])
        .given(of(train, None, &|member| csv(&member.name)))
        .text(&[&"--validate"])
        .given(of(validate, None, &|member| csv(&member.name)));
    steps.push(gyronet.makes(networks.join("gyronet.safetensors")));
    // All sequences of a data set have one gyro. If they are simulated, a network is for the device that it was
    // trained on.
    let device = used(train).find_map(|member| member.device);
    let part = match split.layout {
        Layout::Kaist => "DSP-1760",
        Layout::Nclt => "DSP-3000",
    };
    let serial = device.unwrap_or(0);
    let drive = |member: &super::split::Member| show(&drives.join(csv(&member.name)));
    let fognet = |name: &str, suffix: &str, options: &[&dyn ToString]| {
        Builder::new(step(name), Program::Python)
            .text(&[&"-m", &"gyronet_train.fognet", &"drives", &"--out", &show(&networks)])
            .text(&[&"--stem", &name, &"--epochs", &effort.fognet_epochs])
            .text(options)
            .given(device.is_some().then(|| Argument::Always("--simulated".into())))
            .text(&[&"--train"])
            .given(left(suffix, train, None, &drive))
            .text(&[&"--validate"])
            .given(left(suffix, validate, None, &drive))
            .makes(networks.join(format!("{name}.safetensors")))
    };
    let quantize = |network: &str| {
        let [from, to] = ["safetensors", "blob"].map(|kind| networks.join(format!("{network}.{kind}")));
        Builder::new(step(&format!("{network}-weights")), Program::Gyronet)
            .text(&[&"quantize", &show(&from), &"--out", &show(&to)])
            .needs(step(network))
            .makes(to)
    };
    let weights = |network: &str, option: &str| {
        let file = show(&networks.join(format!("{network}.blob")));
        Argument::If(step(&format!("{network}-weights")), vec![option.to_owned(), file])
    };
    steps.extend([
        fognet("fognet", "", &[&"--gyro", &part, &"--serial", &serial]),
        quantize("gyronet"),
        quantize("fognet"),
    ]);

    // The pseudo-FoG is a FoGNet that corrects GyroNet's rate of the inertial sensor.
    let rates = out.join("rates");
    for member in used(|role| role != Role::Test) {
        let file = rates.join(csv(&member.name));
        let replay = Builder::new(step(&format!("{}{RATES}", member.name)), Program::Gyronet)
            .text(&[&"replay", &drive(member)])
            .given([weights("gyronet", "--weights")])
            .text(&[&"--csv", &show(&file)])
            .needs(step(&member.name));
        steps.push(replay.makes(file));
    }
    steps.push(fognet("pseudo_fog", RATES, &[&"--gyro", &"pseudo-FoG", &"--rates", &show(&rates)]));
    steps.push(quantize("pseudo_fog"));

    let mut methods = Vec::new();
    if split.layout == Layout::Kaist {
        let rivals = [
            ("lwoi", "model", vec![("--steps", effort.lwoi_steps), ("--every", effort.lwoi_every)]),
            ("rinsw", "rinsw", vec![("--steps", effort.rinsw_steps)]),
        ];
        for (name, mode, options) in rivals {
            let folder = out.join(name);
            let mut rival = Builder::new(step(name), Program::Python).text(&[
                &"-m",
                &format!("gyronet_train.{name}"),
                &"--out",
                &show(&folder),
            ]);
            for (option, value) in options {
                rival = rival.text(&[&option, &value]);
            }
            if name == "rinsw" {
                rival = rival.text(&[&"--modes", &mode]);
            }
            let rival = rival
                .text(&[&"--train"])
                .given(of(train, None, &|member| show(&member.folder)))
                .text(&[&"--test"])
                .given(of(tables, None, &|member| show(&member.folder)));
            steps.push(rival.makes(folder.join(format!("{name}.json"))));
            let method = format!("{name}={}", show(&folder.join(mode)));
            methods.push(Argument::If(step(name), vec!["--method".into(), method]));
        }
    }

    let report = out.join("report");
    let networks = [
        weights("gyronet", "--weights"),
        weights("fognet", "--fog-weights"),
        weights("pseudo_fog", "--pseudo-fog-weights"),
    ];
    let tables = Builder::new(step("tables"), Program::Gyronet)
        .text(&[&"tables"])
        .given(of(tables, None, &|member| show(&member.folder)))
        .given(of(train, Some("--train"), &|member| show(&member.folder)))
        .given(networks)
        .given(methods)
        .text(&[&"--out", &show(&report)]);
    steps.push(tables.makes(report.join("report.html")));
    steps
}
