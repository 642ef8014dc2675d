//! This module chooses what each drive of a folder is for: to train, to choose the best epoch, or to be held out.

use super::examine::{Examined, Refusal, examine};
use std::path::{Path, PathBuf};

/// Two drives train at least; one chooses the epoch, one is held out.
const FEWEST: usize = 4;
/// The training drives together need at least this many seconds. Less has never been tried.
const LEAST_S: f64 = 300.0;
/// The training drives together need to turn by at least this, rad: a full circle.
const LEAST_TURNED_RAD: f64 = std::f64::consts::TAU;

/// The reason why a folder cannot be trained on.
#[derive(Debug, thiserror::Error)]
pub enum RolesError {
    /// It cannot be listed.
    #[error("{folder}: {source}")]
    Folder {
        /// The folder.
        folder: String,
        /// The reason.
        source: std::io::Error,
    },
    /// Too few drives can be used.
    #[error("{folder}: {usable} drives can be used, needed are {needed}{}", listed(refused))]
    TooFew {
        /// The folder.
        folder: String,
        /// The number of drives that can be used.
        usable: usize,
        /// The number that is needed.
        needed: usize,
        /// The others.
        refused: Vec<Refusal>,
    },
    /// The training drives are too short.
    #[error(
        "{folder}: the training drives have {seconds:.0} s together, needed are {LEAST_S:.0}{}",
        listed(refused)
    )]
    TooShort {
        /// The folder.
        folder: String,
        /// Their length.
        seconds: f64,
        /// The drives left out.
        refused: Vec<Refusal>,
    },
    /// The training drives do not turn.
    #[error(
        "{folder}: no turns: the training drives turn by {:.0} degrees together, needed are {:.0}",
        turned_rad.to_degrees(),
        LEAST_TURNED_RAD.to_degrees()
    )]
    NoTurns {
        /// The folder.
        folder: String,
        /// Their turns.
        turned_rad: f64,
    },
    /// A name on the command line belongs to no drive, or to several.
    #[error("{folder}: {found} drives for the name {name:?}{}", listed(refused))]
    Name {
        /// The folder.
        folder: String,
        /// The name.
        name: String,
        /// The number of drives with it.
        found: usize,
        /// The drives left out.
        refused: Vec<Refusal>,
    },
}

/// Returns refusals, a line each.
fn listed(refused: &[Refusal]) -> String {
    refused.iter().map(|refusal| format!("\n  left out: {refusal}")).collect()
}

/// Holds the drives of a folder by what they are for.
#[derive(Debug)]
pub struct Roles {
    /// These train; none, where shards do.
    pub train: Vec<Examined>,
    /// This one chooses the epoch and the seed.
    pub validate: Examined,
    /// These are judged at the end, and choose nothing.
    pub held_out: Vec<Examined>,
    /// These cannot be used.
    pub refused: Vec<Refusal>,
}

impl Roles {
    /// Examines the folder's drives and chooses. By default the last quarter by name is held out, the drive before it
    /// validates and the others train; with `shards` none of the folder's train.
    ///
    /// # Errors
    /// [`RolesError`].
    pub fn choose(
        folder: &Path,
        shards: bool,
        validate: Option<&str>,
        held_out: &[String],
    ) -> Result<Self, RolesError> {
        let named = || folder.display().to_string();
        let (mut usable, mut refused) = (Vec::new(), Vec::new());
        for path in csv_files(folder).map_err(|source| RolesError::Folder { folder: named(), source })? {
            match examine(&path) {
                Ok(drive) => usable.push(drive),
                Err(refusal) => refused.push(refusal),
            }
        }
        let needed = if shards { 2 } else { FEWEST };
        if usable.len() < needed {
            return Err(RolesError::TooFew { folder: named(), usable: usable.len(), needed, refused });
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
        let (Some(validate), least) = (validate.or_else(|| usable.pop()), if shards { 0 } else { 2 }) else {
            return Err(RolesError::TooFew { folder: named(), usable: held_out.len(), needed, refused });
        };
        if held_out.is_empty() || usable.len() < least {
            let usable = usable.len() + held_out.len() + 1;
            return Err(RolesError::TooFew {
                folder: named(),
                usable,
                needed: held_out.len().max(1) + 3,
                refused,
            });
        }
        let train = if shards { Vec::new() } else { usable };
        let seconds = train.iter().map(|drive| drive.seconds).sum::<f64>();
        let turned_rad = train.iter().map(|drive| drive.turned_rad).sum::<f64>();
        if !shards && seconds < LEAST_S {
            return Err(RolesError::TooShort { folder: named(), seconds, refused });
        }
        if !shards && turned_rad < LEAST_TURNED_RAD {
            return Err(RolesError::NoTurns { folder: named(), turned_rad });
        }
        Ok(Self { train, validate, held_out, refused })
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

/// Returns the place of the drive of that name, or of the only one whose name contains it; else how many there are.
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
