//! This module finds the paper's sequences in a folder by their names, and splits them as the paper does. Of KAIST
//! Urban, 06 to 13 are for training, 14 to 17 for validation and 18 to 37 for testing. Of NCLT's 27 dates, the first
//! 18 are for training and 9 for testing. The paper names no validation sequences of NCLT; here they are the last two
//! of the 18.

use crate::drive::error::{DataError, DataFault};
use crate::paper::sequence;
use crate::simulate::layout::Layout;
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// The dates of NCLT's sequences.
const DATES: [&str; 27] = [
    "2012-01-08",
    "2012-01-15",
    "2012-01-22",
    "2012-02-02",
    "2012-02-04",
    "2012-02-05",
    "2012-02-12",
    "2012-02-18",
    "2012-02-19",
    "2012-03-17",
    "2012-03-25",
    "2012-03-31",
    "2012-04-29",
    "2012-05-11",
    "2012-05-26",
    "2012-06-15",
    "2012-08-04",
    "2012-08-20",
    "2012-09-28",
    "2012-10-28",
    "2012-11-04",
    "2012-11-16",
    "2012-11-17",
    "2012-12-01",
    "2013-01-10",
    "2013-02-23",
    "2013-04-05",
];
/// Indices in [`DATES`] of the first validation sequence, and of the first test sequence.
const DATES_SPLIT: [usize; 2] = [16, 18];

/// Names the use of a sequence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The sequence's truth trains the networks and the rivals.
    Train,
    /// The sequence's truth chooses among epochs and seeds.
    Validate,
    /// The sequence is used only for the tables.
    Test,
}

/// Holds a sequence that was found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Member {
    /// Name of its folder, which may be longer than the paper's name: urban28-pankyo.
    pub name: String,
    /// Path of its folder.
    pub folder: PathBuf,
    /// Use of the sequence.
    pub role: Role,
    /// The number of the simulated device; `None` for a recorded one.
    pub device: Option<u64>,
}

/// Holds the sequences of a data set that were found.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Split {
    /// The data set.
    pub layout: Layout,
    /// The sequences found, in the paper's order.
    pub members: Vec<Member>,
    /// Names of the paper's sequences that are missing.
    pub missing: Vec<String>,
    /// Folders and files that are not used, each with the reason.
    pub unused: Vec<String>,
}

/// The error of a folder that training is impossible with.
#[derive(Debug, thiserror::Error)]
pub enum SplitError {
    /// The folder cannot be read.
    #[error(transparent)]
    Data(#[from] DataError),
    /// There is no sequence for a required purpose.
    #[error("{root}: no sequence to {purpose} with; needed is one of {names}")]
    None {
        /// The folder.
        root: String,
        /// The purpose: `train` or `validate`.
        purpose: &'static str,
        /// The names of the sequences for this purpose.
        names: String,
    },
}

/// Returns the paper's names of a data set's sequences, and their use.
fn expected(layout: Layout) -> Vec<(String, Role)> {
    let role = |k: usize, [validate, test]: [usize; 2]| match k {
        k if k < validate => Role::Train,
        k if k < test => Role::Validate,
        _ => Role::Test,
    };
    match layout {
        Layout::Kaist => (6..=37).map(|k| (format!("urban{k:02}"), role(k, [14, 18]))).collect(),
        Layout::Nclt => {
            DATES.iter().enumerate().map(|(k, date)| ((*date).to_owned(), role(k, DATES_SPLIT))).collect()
        }
    }
}

/// Returns whether a folder's name is that of a sequence: the same name, or followed by something other than a digit.
fn is_named(folder: &str, name: &str) -> bool {
    folder.strip_prefix(name).is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_digit()))
}

impl Split {
    /// Finds the sequences directly below a folder.
    ///
    /// # Errors
    /// [`SplitError`] if the folder cannot be read, or has no sequence to train or to validate with.
    pub fn find(layout: Layout, root: &Path) -> Result<Self, SplitError> {
        let error = |source: std::io::Error| DataError::of(root.display(), DataFault::Io(source));
        let entries = fs::read_dir(root).map_err(error)?;
        let mut folders: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
        folders.sort();
        let (mut members, mut missing): (Vec<Member>, Vec<String>) = (Vec::new(), Vec::new());
        let mut unused = Vec::new();
        let all = expected(layout);
        for (expected, role) in &all {
            let before = members.len();
            for folder in folders.extract_if(.., |folder| is_named(&name(folder), expected)) {
                let name = name(&folder);
                match sequence::layout(&folder) {
                    Ok(found) if found == layout && members.len() == before => {
                        match sequence::marker(&folder) {
                            Ok(spec) => {
                                let device = spec.map(|spec| spec.device);
                                members.push(Member { name, folder, role: *role, device });
                            }
                            Err(error) => unused.push(error.to_string()),
                        }
                    }
                    Ok(found) if found == layout => unused.push(format!("{name}: a second {expected}")),
                    Ok(found) => unused.push(format!("{name}: has the layout of {found:?}")),
                    Err(error) => unused.push(error.to_string()),
                }
            }
            if members.len() == before {
                missing.push(expected.clone());
            }
        }
        unused.extend(folders.iter().map(|folder| format!("{}: not in the paper", name(folder))));
        for (needed, purpose) in [(Role::Train, "train"), (Role::Validate, "validate")] {
            if !members.iter().any(|member| member.role == needed) {
                let names: Vec<&str> =
                    all.iter().filter(|(_, role)| *role == needed).map(|(name, _)| name.as_str()).collect();
                let names = names.join(", ");
                return Err(SplitError::None { root: root.display().to_string(), purpose, names });
            }
        }
        Ok(Self { layout, members, missing, unused })
    }
}

fn name(folder: &Path) -> String {
    folder.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
