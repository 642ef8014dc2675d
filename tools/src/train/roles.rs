//! Chooses the role of each drive of a folder: training, validation (chooses the epoch), or held out.

use super::examine::{Examined, Refusal, examine};
use std::path::{Path, PathBuf};

/// Fewest drives: two for training, one for validation, one held out.
const FEWEST: usize = 4;
/// Least time of all training drives together, s. Less has never been tried.
const LEAST_S: f64 = 300.0;
/// Least turn of all training drives together, rad: a full circle.
const LEAST_TURNED_RAD: f64 = std::f64::consts::TAU;

#[derive(Debug, thiserror::Error)]
pub enum RolesError {
    #[error("{folder}: {source}")]
    Folder { folder: String, source: std::io::Error },
    #[error("{folder}: {usable} drives can be used, but {needed} are needed{}", listed(refused))]
    TooFew { folder: String, usable: usize, needed: usize, refused: Vec<Refusal> },
    #[error(
        "{folder}: the training drives have {seconds:.0} s together, but {LEAST_S:.0} s are needed{}",
        listed(refused)
    )]
    TooShort { folder: String, seconds: f64, refused: Vec<Refusal> },
    #[error(
    "{folder}: too few turns: the training drives turn by {:.0} degrees together, but {:.0} are needed",
        turned_rad.to_degrees(),
        LEAST_TURNED_RAD.to_degrees()
    )]
    NoTurns { folder: String, turned_rad: f64 },
    #[error("{folder}: {found} drives match the name {name:?}{}", listed(refused))]
    Name { folder: String, name: String, found: usize, refused: Vec<Refusal> },
}

/// Formats refusals, one line each.
fn listed(refused: &[Refusal]) -> String {
    refused.iter().map(|refusal| format!("\n  left out: {refusal}")).collect()
}

/// The drives of a folder, by role.
#[derive(Debug)]
pub struct Roles {
    pub train: Vec<Examined>,
    /// The validation drive, which chooses the epoch and the seed.
    pub validate: Examined,
    /// Held-out drives, on which the result is evaluated.
    pub held_out: Vec<Examined>,
    pub refused: Vec<Refusal>,
}

impl Roles {
    /// Examines the drives of a folder and chooses their roles. By default the last quarter by name is held out, the
    /// drive before it validates, and the others train.
    pub fn choose(folder: &Path, validate: Option<&str>, held_out: &[String]) -> Result<Self, RolesError> {
        let named = || folder.display().to_string();
        let (mut usable, mut refused) = (Vec::new(), Vec::new());
        for path in csv_files(folder).map_err(|source| RolesError::Folder { folder: named(), source })? {
            match examine(&path) {
                Ok(drive) => usable.push(drive),
                Err(refusal) => refused.push(refusal),
            }
        }
        if usable.len() < FEWEST {
            let (usable, needed) = (usable.len(), FEWEST);
            return Err(RolesError::TooFew { folder: named(), usable, needed, refused });
        }
        let quarter = (usable.len() / 4).max(1);
        let mut take = |name: &str| match find(&usable, name) {
            Ok(at) => Ok(usable.remove(at)),
            Err(found) => Err((name.to_owned(), found)),
        };
        let chosen = held_out.iter().map(|name| take(name)).collect::<Result<Vec<_>, _>>();
        let chosen = chosen.and_then(|held_out| Ok((held_out, validate.map(take).transpose()?)));
        let (mut held_out, validate) = match chosen {
            Ok(chosen) => chosen,
            Err((name, found)) => return Err(RolesError::Name { folder: named(), name, found, refused }),
        };
        if held_out.is_empty() {
            held_out = usable.split_off(usable.len().saturating_sub(quarter));
        }
        let Some(validate) = validate.or_else(|| usable.pop()) else {
            let (usable, needed) = (held_out.len(), FEWEST);
            return Err(RolesError::TooFew { folder: named(), usable, needed, refused });
        };
        if held_out.is_empty() || usable.len() < 2 {
            let usable = usable.len() + held_out.len() + 1;
            return Err(RolesError::TooFew {
                folder: named(),
                usable,
                needed: held_out.len().max(1) + 3,
                refused,
            });
        }
        let seconds = usable.iter().map(|drive| drive.seconds).sum::<f64>();
        let turned_rad = usable.iter().map(|drive| drive.turned_rad).sum::<f64>();
        if seconds < LEAST_S {
            return Err(RolesError::TooShort { folder: named(), seconds, refused });
        }
        if turned_rad < LEAST_TURNED_RAD {
            return Err(RolesError::NoTurns { folder: named(), turned_rad });
        }
        Ok(Self { train: usable, validate, held_out, refused })
    }
}

/// Returns the folder's CSV files in the order of their names.
fn csv_files(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "csv") {
            files.push(path);
        }
    }
    files.sort_unstable();
    Ok(files)
}

/// Returns the index of the drive of that name, or of the only drive whose name contains it. Otherwise returns the
/// number of drives whose names contain it.
fn find(drives: &[Examined], name: &str) -> Result<usize, usize> {
    if let Some(at) = drives.iter().position(|drive| drive.name == name) {
        return Ok(at);
    }
    let mut found = drives.iter().enumerate().filter(|(_, drive)| drive.name.contains(name));
    match (found.next(), found.count()) {
        (Some((at, _)), 0) => Ok(at),
        (Some(_), more) => Err(1 + more),
        (None, _) => Err(0),
    }
}
