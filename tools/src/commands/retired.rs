//! Commands and options that have gone: a user of one is told what does its work now.

use clap::error::{ContextKind, ContextValue};

const SITUATIONS: &str = "`cargo run --profile tool -p gyronet-host-tests --bin situations`";
const LEARNT: &str =
    "the board itself at its standstills (`device info`: tilt; `device calibrate show`: bias)";
const RETIRED: [(&str, &str); 24] = [
    ("campaign", SITUATIONS),
    ("soak", SITUATIONS),
    ("bus", "tools/gyronet.dbc, with `gyronet device set`, which refuses what loads the bus too much,"),
    ("paper", "`make -f tools/paper/Makefile`"),
    ("tables", "`cargo paper tables`"),
    ("train", "`python -m gyronet_train.linear` (tools/python/gyronet_train/README.md)"),
    ("calibrate static", LEARNT),
    ("calibrate mounting", LEARNT),
    ("calibrate --store", LEARNT),
    ("device log", "`device info`, with the troubles (any UDS tester, `cargo gyronet reference troubles`),"),
    ("warm-up", "`gyronet simulate --trip motorway` with `gyronet evaluate`"),
    (
        "--image",
        "`cargo test -p gyronet-host-tests --test board` (`size` and `bench-target` measure the image)",
    ),
    ("--policies", "`cargo bringup`, which counts cycles on a board,"),
    (
        "monitor",
        "`cantools monitor`, for a log `cantools decode`, with tools/gyronet.dbc (src/can/README.md)",
    ),
    ("--weights", "`gyronet evaluate --weights`"),
    ("--ablation", "`gyronet evaluate` (its rows), with `gyronet doctor` (the reference's own error),"),
    ("--mcap", "`gyronet correct`, or `gyronet replay --csv` for a plot,"),
    ("doctor --out", "`gyronet doctor --json`"),
    ("--layout", "`cargo paper simulate`"),
    ("--set", "`cargo paper simulate`"),
    ("--all", "`gyronet evaluate --json`"),
    ("quantize --drives", "`gyronet evaluate --weights`"),
    ("--checkpoint", "`gyronet quantize`, with `gyronet evaluate --weights`,"),
    ("--lags", "`compensate.lag` in a configuration of `gyronet.Coprocessor` (tools/python)"),
];

/// The line about a retired name, if that is what the arguments are wrong about.
pub fn line(error: &clap::Error) -> Option<String> {
    let kinds = [ContextKind::InvalidSubcommand, ContextKind::InvalidValue, ContextKind::InvalidArg];
    let ContextValue::String(word) = kinds.into_iter().find_map(|kind| error.get(kind))? else { return None };
    let is_it = |name: &str| {
        let (command, option) = name.rsplit_once(' ').unwrap_or(("", name));
        option == word && (command.is_empty() || std::env::args().any(|argument| argument == command))
    };
    let (name, successor) = RETIRED.iter().find(|(name, _)| is_it(name))?;
    Some(format!("{name} has gone; {successor} does its work"))
}
