//! Tables on the pages are what their command prints:
//!
//! ```text
//! <!-- printed by: cargo gyronet ARGUMENTS -->
//! ...
//! <!-- end -->
//! ```
//!
//! With `GYRONET_WRITE_PAGES=1` the test writes them. `RECORDINGS` in the arguments is the folder of the recordings.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const BEGIN: &str = "<!-- printed by: cargo gyronet ";
const END: &str = "<!-- end -->\n";
/// A text that is no Markdown stands in a fence.
const FENCE: [&str; 2] = ["```text\n", "```\n"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The command's output in the root, or `None` if it needs recordings that are not here.
fn printed(arguments: &str) -> Option<String> {
    let recordings =
        std::env::var_os("GYRONET_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    if arguments.contains("RECORDINGS") && !recordings.join("wid_car").is_dir() {
        let required =
            std::env::var("GYRONET_REQUIRE").is_ok_and(|all| all.split(',').any(|one| one == "data"));
        assert!(!required, "{arguments}: no recordings");
        println!("SKIPPED: {arguments}: no recordings");
        return None;
    }
    let arguments = arguments.replace("RECORDINGS", &recordings.display().to_string());
    let mut command = Command::new(env!("CARGO_BIN_EXE_gyronet"));
    let output = command.args(arguments.split(' ')).current_dir(root()).output().unwrap();
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap())
}

/// The page with what its commands print now, and the number of commands.
fn current(page: &str) -> (String, usize) {
    let mut parts = page.split(BEGIN);
    let mut text = parts.next().unwrap().to_owned();
    let mut commands = 0;
    for part in parts {
        let (arguments, rest) = part.split_once(" -->\n").expect("the command ends on its line");
        let (old, after) = rest.split_once(END).expect("the table has an end");
        let [open, close] = if old.starts_with(FENCE[0]) { FENCE } else { ["", ""] };
        let now = printed(arguments).map_or_else(|| old.to_owned(), |text| format!("{open}{text}{close}"));
        text += &format!("{BEGIN}{arguments} -->\n{now}{END}{after}");
        commands += 1;
    }
    (text, commands)
}

fn pages(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let seen = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy();
        !name.starts_with('.') && name != "target"
    };
    let (folders, files): (Vec<_>, Vec<_>) = entries.filter(seen).partition(|path| path.is_dir());
    let own = files.into_iter().filter(|path| path.extension().is_some_and(|end| end == "md"));
    own.chain(folders.iter().flat_map(|folder| pages(folder))).collect()
}

#[test]
fn tables_are_what_their_commands_print() {
    let mut commands = 0;
    for path in pages(&root()) {
        let page = fs::read_to_string(&path).unwrap();
        let (now, here) = current(&page);
        commands += here;
        if std::env::var_os("GYRONET_WRITE_PAGES").is_some() && now != page {
            fs::write(&path, &now).unwrap();
        } else {
            assert!(now == page, "{} is stale: run this test with GYRONET_WRITE_PAGES=1", path.display());
        }
    }
    assert!(commands >= 2, "{commands} tables found in all pages: are they read at all?");
}
