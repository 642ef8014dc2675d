//! Reads the reset values of all registers from the source that svd2rust generated.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

/// The part's module of the crate.
const PART: &str = "stm32f405";

/// Returns the folder of the part's module in the source of the `stm32f4` crate that the workspace uses.
pub fn source(workspace: &Path) -> Result<PathBuf, String> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--offline", "--format-version", "1", "--features", PART])
        // Other targets' packages need not be there.
        .args(["--filter-platform", "thumbv7em-none-eabihf", "--manifest-path"])
        .arg(workspace.join("Cargo.toml"))
        .output()
        .map_err(|error| format!("cargo metadata: {error}"))?;
    if !output.status.success() {
        return Err(format!("cargo metadata: {}", String::from_utf8_lossy(&output.stderr).trim()));
    }
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).map_err(|e| e.to_string())?;
    let packages = metadata["packages"].as_array().ok_or("cargo metadata lists no packages")?;
    let package = packages.iter().find(|package| package["name"] == "stm32f4");
    let manifest = package.and_then(|package| package["manifest_path"].as_str()).map(Path::new);
    let folder = manifest.and_then(Path::parent).map(|folder| folder.join("src").join(PART));
    folder.filter(|folder| folder.is_dir()).ok_or_else(|| format!("no source of stm32f4's {PART}"))
}

/// The reset values of a part's registers.
pub struct ResetValues {
    /// The module of each instance (`CAN2`), and of each module itself (`can1`).
    modules: BTreeMap<String, String>,
    /// The values by module and accessor.
    values: BTreeMap<(String, String), u64>,
}

impl ResetValues {
    /// Reads the folder of [`source`].
    pub fn read(folder: &Path) -> Result<Self, String> {
        let mut modules = BTreeMap::new();
        for line in text(&folder.join("mod.rs"))?.lines() {
            // pub type CAN2 = crate::Periph<can1::RegisterBlock, 0x4000_6800>;
            if let Some((name, rest)) = line.strip_prefix("pub type ").and_then(|line| line.split_once(" = "))
                && let Some(module) =
                    rest.strip_prefix("crate::Periph<").and_then(|rest| rest.split(':').next())
            {
                modules.insert(name.to_owned(), module.to_owned());
            }
        }
        // pub use self::usart1 as usart2;
        for line in text(&folder.join("mod.rs"))?.lines() {
            if let Some(rest) = line.strip_prefix("pub use self::")
                && let Some((module, name)) = rest.trim_end_matches(';').split_once(" as ")
                && folder.join(module).is_dir()
            {
                modules.insert(name.to_owned(), module.to_owned());
            }
        }
        let mut values = BTreeMap::new();
        for module in modules.values().cloned().collect::<BTreeSet<_>>() {
            collect(folder, &module, &folder.join(&module), &mut values)?;
            modules.insert(module.clone(), module);
        }
        Ok(Self { modules, values })
    }

    /// Returns the reset value of a register of an instance or module, if it has such a register.
    pub fn of(&self, peripheral: &str, register: &str) -> Option<u64> {
        let module = self.modules.get(peripheral)?;
        self.values.get(&(module.clone(), register.to_owned())).copied()
    }

    /// Returns whether an instance or a module has this name.
    pub fn knows(&self, peripheral: &str) -> bool {
        self.modules.contains_key(peripheral)
    }

    /// Returns the names of all instances.
    pub fn instances(&self) -> impl Iterator<Item = &str> {
        let instance = |name: &&String| name.chars().all(|letter| !letter.is_ascii_lowercase());
        self.modules.keys().filter(instance).map(String::as_str)
    }
}

/// Collects the registers of a block and of the clusters in its folder.
fn collect(
    folder: &Path,
    module: &str,
    block: &Path,
    values: &mut BTreeMap<(String, String), u64>,
) -> Result<(), String> {
    let source = text(&block.with_extension("rs"))?;
    for line in source.lines() {
        // pub const fn mcr(&self) -> &MCR {
        let Some(rest) = line.trim_start().strip_prefix("pub const fn ") else { continue };
        let Some((accessor, rest)) = rest.split_once('(') else { continue };
        let Some(kind) = rest.split_once("-> &").and_then(|(_, kind)| kind.strip_suffix(" {")) else {
            continue;
        };
        match value(folder, block, kind)? {
            Some(value) => drop(values.insert((module.to_owned(), accessor.to_owned()), value)),
            None => {
                let cluster = block.join(kind.to_lowercase());
                if cluster.with_extension("rs").is_file() {
                    collect(folder, module, &cluster, values)?;
                }
            }
        }
    }
    Ok(())
}

/// Returns the reset value of a register's type in a block; a cluster has none.
fn value(folder: &Path, block: &Path, kind: &str) -> Result<Option<u64>, String> {
    let source = text(&block.with_extension("rs"))?;
    let alias = format!("pub type {kind} = crate::Reg<");
    if let Some(rest) = source.lines().find_map(|line| line.strip_prefix(&alias)) {
        let file = block.join(rest.split(':').next().unwrap_or_default()).with_extension("rs");
        let register = text(&file)?;
        let constant =
            register.lines().find_map(|line| line.trim_start().strip_prefix("const RESET_VALUE: "));
        let Some(constant) = constant else { return Ok(Some(0)) };
        let number =
            constant.split_once("= ").and_then(|(_, number)| hexadecimal(number.trim_end_matches(';')));
        return number.map(Some).ok_or_else(|| format!("{}: {constant}", file.display()));
    }
    // pub use crate::stm32f405::gpioa::BSRR;
    let other = format!("pub use crate::{PART}::");
    let used =
        source.lines().filter_map(|line| line.strip_prefix(&other)).filter_map(|line| line.split_once("::"));
    match used.into_iter().find(|(_, name)| name.trim_end_matches(';') == kind) {
        Some((from, _)) => value(folder, &folder.join(from), kind),
        None => Ok(None),
    }
}

/// Parses `0x` and digits, with or without underscores between.
pub fn hexadecimal(number: &str) -> Option<u64> {
    u64::from_str_radix(&number.strip_prefix("0x")?.replace('_', ""), 16).ok()
}

fn text(path: &Path) -> Result<String, String> {
    std::fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))
}
