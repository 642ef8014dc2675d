//! `gyronet-paper tables` computes the paper's tables on given sequences.

use super::{named, print_json, remark};
use gyronet::model::fognet::FogNetState;
use gyronet::model::weights::{FOGNET, GYRONET};
use gyronet::model::{FogNet, GyroNet};
use gyronet_paper::sequence::{self, Sequence};
use gyronet_paper::tables::given::Given;
use gyronet_paper::tables::joint::{Fit, Joint};
use gyronet_paper::tables::results::{Results, SequenceErrors};
use gyronet_paper::tables::{estimates, table};
use gyronet_tools::network::weight_file::WeightFile;
use std::fs;
use std::io::Write;
use std::path::PathBuf;

/// Compute the paper's tables on sequences of KAIST Urban.
///
/// The input is sequences: folders in the layout of KAIST Complex Urban, recorded or written by
/// `gyronet-paper simulate`. The command prints Tables I to V beside the paper's own results, except tables that these
/// sequences have no results for. Results of simulated sequences are marked. If the vehicle does not stand still for the first 3 s, methods that need static initialisation are
/// left out, and the reason is printed.
///
/// --method adds another program's method: a folder of trajectories in the format of TUM's RGB-D benchmark (rows of
/// time x y z qx qy qz qw, as evo writes them), one for each sequence, named SEQUENCE.txt. A trajectory starts from
/// the true pose, in the truth's frame and on the clock of the sequence's files, and ends within 1 s of the
/// sequence's end. A trajectory that is missing or cannot be compared is left out; the tables say how many were left
/// out, and why.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "\
Examples:
  gyronet-paper simulate --set test --out sequences && gyronet-paper tables sequences
  gyronet-paper tables urban14 urban15 --json
  gyronet-paper tables sequences --method lwoi=OUT/model --method mine=trajectories")]
pub struct Args {
    /// Folders of sequences, or folders that contain such folders.
    #[arg(required = true, value_name = "DIR")]
    folders: Vec<PathBuf>,
    /// Fit the fibre-optic gyro and the wheels to this sequence, or to the sequences in this folder, and show the fit
    /// as a method. May be repeated.
    #[arg(long, value_name = "DIR")]
    train: Vec<PathBuf>,
    /// Add the trajectories of a folder to the tables under this name. May be repeated.
    #[arg(long = "method", value_name = "NAME=FOLDER")]
    methods: Vec<Given>,
    /// Weight file of GyroNet [default: the library's].
    #[arg(long, value_name = "BLOB")]
    weights: Option<PathBuf>,
    /// Weight file of FoGNet [default: the library's].
    #[arg(long, value_name = "BLOB")]
    fog_weights: Option<PathBuf>,
    /// Weight file of a FoGNet that was trained on GyroNet's rate, for pseudo_fog [default: that of --fog-weights].
    #[arg(long, value_name = "BLOB")]
    pseudo_fog_weights: Option<PathBuf>,
}

/// Fits the fibre-optic gyro and the wheels to sequences; `None` without any.
fn fit(folders: &[PathBuf]) -> super::Result<Option<Joint>> {
    let mut fit = Fit::default();
    for folder in folders {
        for path in sequence::find(folder)? {
            fit.add(&Sequence::read(&path)?);
        }
    }
    if folders.is_empty() {
        return Ok(None);
    }
    fit.solve().map(Some).ok_or_else(|| "--train: these sequences turn or move too little for a fit".into())
}

pub fn run(args: &Args, json: bool) -> super::Result {
    for (k, given) in args.methods.iter().enumerate() {
        if args.methods[..k].iter().any(|other| other.method == given.method) {
            return Err(format!("--method {}: this name is given twice", given.method.name).into());
        }
        // A trajectory that is missing from the folder is not an error; a missing folder is.
        fs::read_dir(&given.folder).map_err(named(&given.folder))?;
    }
    let open = |path: &Option<PathBuf>, built_in: &[u8]| match path {
        Some(path) => WeightFile::read(path),
        None => Ok(WeightFile::new("built-in weights", built_in)),
    };
    let weights = open(&args.weights, &GYRONET.0)?;
    let fog_weights = open(&args.fog_weights, &FOGNET.0)?;
    let pseudo_weights = args.pseudo_fog_weights.as_deref().map(WeightFile::read).transpose()?;
    let mut network = GyroNet::new(weights.blob()?);
    let fog_blob = fog_weights.fog_blob()?;
    let pseudo_blob = pseudo_weights.as_ref().unwrap_or(&fog_weights).fog_blob()?;
    let mut fog_state = FogNetState::ZERO;
    let mut fognet = FogNet::new(fog_blob, &mut fog_state);
    let mut pseudo_state = FogNetState::ZERO;
    let mut pseudo_fog = FogNet::new(pseudo_blob, &mut pseudo_state);
    let mut folders = Vec::new();
    for folder in &args.folders {
        folders.extend(sequence::find(folder)?);
    }
    let joint = fit(&args.train)?;
    let mut all = Vec::new();
    for folder in &folders {
        let sequence = Sequence::read(folder)?;
        let mut estimates = estimates::run(&sequence, &mut network);
        estimates.add_fognet(&sequence, &mut fognet, fog_blob.training);
        estimates.add_pseudo_fog(&sequence, &mut pseudo_fog);
        if let Some(joint) = &joint {
            estimates.add_joint(&sequence, joint);
        }
        args.methods.iter().for_each(|given| estimates.add_given(&sequence, given));
        let errors = SequenceErrors::new(&sequence, &estimates);
        remark(format_args!("{}: {:.0} s of driving", errors.name, errors.seconds))?;
        all.push(errors);
    }
    let results = Results::new(all);
    let files = [args.weights.as_deref(), args.fog_weights.as_deref()];
    let tables: Vec<_> = table::tables(&results).into_iter().map(|table| table.with_weights(files)).collect();
    if json {
        return print_json(&results);
    }
    let mut out = std::io::stdout().lock();
    Ok(tables.iter().try_for_each(|table| writeln!(out, "{table}"))?)
}
