//! Bits that flip in the working state of a board in the middle of a drive: in the watch with its
//! pipeline (bias, windows, compensation, yaw, configuration), in the feeds, in what knows of the wheels.
//!
//! A flipped bit may make of a value what its type does not know. Here that is a process of its
//! own, which dies or hangs; on the board it is a fault handler or the watchdog, and a start anew.

use gyronet::can::feeds::Feeds;
use gyronet::can::wheel::WheelReceiver;
use gyronet::guard::Guard;
use gyronet::model::{Blob, GyroNet, weights};
use gyronet_host_tests::upset::{self, first_difference};
use gyronet_tools::bundled;
use gyronet_tools::campaign::board::{Board, Remembering};
use gyronet_tools::campaign::draw::Draw;
use gyronet_tools::campaign::drive::Drive;
use gyronet_tools::campaign::fault::Span;
use gyronet_tools::campaign::judge::Outcome;
use gyronet_tools::campaign::part::Part;
use gyronet_tools::campaign::scene::{STATE_EVERY, Scene};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::ops::Range;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// Rows of a run, and the one of them before which a bit flips.
const ROWS: usize = 800;
const AT: usize = 110;
/// Static initialisation is over, and a second has been good.
const FIRST_STATE: usize = 6;
const SEED: u64 = 1;
/// For a run of 8 s that takes milliseconds.
const HANGS: Duration = Duration::from_secs(60);
/// Which flips a process is to do.
const FLIPS: &str = "GYRONET_FLIPS";

/// What became of one flip, as a process says it.
#[derive(Debug, Clone, Copy)]
struct Effect {
    told: bool,
    not_recovered: bool,
    moved: f64,
    sigmas: f64,
    grown: f64,
    grown_sigmas: f64,
}

impl Effect {
    fn parse(line: &str) -> Option<Self> {
        let values: Vec<f64> =
            line.strip_prefix("effect ")?.split(' ').filter_map(|word| word.parse().ok()).collect();
        let &[told, not_recovered, moved, sigmas, grown, grown_sigmas] = &values[..] else { return None };
        let [told, not_recovered] = [told, not_recovered].map(|flag| flag != 0.0);
        Some(Self { told, not_recovered, moved, sigmas, grown, grown_sigmas })
    }
}

/// A line for each field that bits flipped in.
#[derive(Debug, Clone, Default)]
struct Line {
    flips: usize,
    nothing: usize,
    within: usize,
    told: usize,
    beyond: usize,
    died: usize,
    not_recovered: usize,
    most: f64,
    grown: usize,
    grown_most: f64,
}

impl Line {
    fn add(&mut self, other: &Self) {
        self.flips += other.flips;
        self.nothing += other.nothing;
        self.within += other.within;
        self.told += other.told;
        self.beyond += other.beyond;
        self.died += other.died;
        self.not_recovered += other.not_recovered;
        self.grown += other.grown;
        self.most = self.most.max(other.most);
        self.grown_most = self.grown_most.max(other.grown_most);
    }

    fn count(&mut self, effect: Option<Effect>) {
        self.flips += 1;
        let Some(effect) = effect else {
            self.died += 1;
            return;
        };
        match effect {
            Effect { sigmas, .. } if sigmas > 1.0 => self.beyond += 1,
            Effect { told: true, .. } => self.told += 1,
            Effect { sigmas: 0.0, .. } => self.nothing += 1,
            _ => self.within += 1,
        }
        self.most = self.most.max(effect.moved);
        self.not_recovered += usize::from(effect.not_recovered);
        self.grown += usize::from(effect.grown_sigmas > 1.0);
        self.grown_most = self.grown_most.max(effect.grown);
    }
}

/// Does some flips; for each a line that it begins, one of what became of it, and one of the
/// field that it was in.
fn flip(flips: Range<usize>) {
    let blob = Blob::new_checked(&weights::DEFAULT.0).expect("they come with the library");
    let mut network = GyroNet::new(blob);
    let drive = Drive::new(&bundled::simulated_drive().expect("it comes with the tools"));
    let scene = Scene::new(&drive, Part::Xsens, &mut network);
    let states = (scene.rows() - ROWS) / STATE_EVERY;
    for number in flips {
        let mut draw = Draw::new(SEED, number as u64);
        let from = (FIRST_STATE + draw.below(states - FIRST_STATE)) * STATE_EVERY;
        let bit = draw.below(8 * STATE.iter().sum::<usize>());
        let span = Span { from, to: from + ROWS, healthy: 0 };
        let at = drive.readings[from + AT].at;
        let mut run = |reach: &mut dyn FnMut(&mut Board)| {
            let mut network = Remembering { network: &mut network, known: &scene.known };
            scene.run_on(span, &[], Some(at), &mut network, |row, board| {
                if row == from + AT {
                    reach(board);
                }
            })
        };
        println!("\nflip {number}");
        let Outcome { told_after, not_recovered, moved, moved_sigmas, grown, grown_sigmas, .. } =
            run(&mut |board| upset(board, bit));
        let [told, not_recovered] = [told_after.is_some(), not_recovered].map(u8::from);
        println!("effect {told} {not_recovered} {moved:e} {moved_sigmas:e} {grown:e} {grown_sigmas:e}");
        // Once more, to see what it was.
        run(&mut |board| {
            let before = text(board);
            upset(board, bit);
            println!("field {}", first_difference(&before, &text(board)).unwrap_or_default());
        });
    }
}

/// Bytes of what bits flip in.
const STATE: [usize; 3] = [size_of::<Guard>(), size_of::<Feeds>(), size_of::<WheelReceiver>()];

fn upset(board: &mut Board, bit: usize) {
    let [guard, feeds, _] = STATE.map(|bytes| 8 * bytes);
    if bit < guard {
        upset::flip(board.guard(), bit);
    } else if bit < guard + feeds {
        upset::flip(board.feeds(), bit - guard);
    } else {
        upset::flip(board.wheels(), bit - guard - feeds);
    }
}

fn text(board: &mut Board) -> String {
    let guard = format!("guard: {:#?}", board.guard());
    let feeds = format!("feeds: {:#?}", board.feeds());
    [guard, feeds, format!("wheels: {:#?}", board.wheels())].join("\n")
}

/// The flips of this process, when it was started for them by [`effects`].
#[test]
#[ignore = "a part of the others"]
fn process() {
    let flips = std::env::var(FLIPS).expect("it is started by another test");
    let (from, to) = flips.split_once(' ').expect("two numbers");
    flip(from.parse().expect("a number")..to.parse().expect("a number"));
}

fn start(flips: Range<usize>) -> (Child, mpsc::Receiver<String>) {
    let mut child = Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "process", "--ignored", "--nocapture"])
        .env(FLIPS, format!("{} {}", flips.start, flips.end))
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .expect("this test again");
    let lines = BufReader::new(child.stdout.take().expect("piped")).lines();
    let (sender, receiver) = mpsc::channel();
    std::thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| sender.send(line)));
    (child, receiver)
}

/// What becomes of so many flips, by field.
fn effects(count: usize) -> BTreeMap<String, Line> {
    let mut fields = BTreeMap::<String, Line>::new();
    let mut next = 0;
    while next < count {
        let (mut child, lines) = start(next..count);
        let (mut begun, mut effect) = (None, None);
        while let Ok(line) = lines.recv_timeout(HANGS) {
            match line.split_once(' ') {
                Some(("flip", number)) => (begun, effect) = (number.parse::<usize>().ok(), None),
                Some(("effect", _)) => effect = Effect::parse(&line),
                Some(("field", name)) => {
                    fields.entry(name.to_owned()).or_default().count(effect);
                    next = begun.take().expect("it has begun") + 1;
                }
                _ => {}
            }
        }
        // It has ended, or it hangs.
        let _ = child.kill();
        let panicked = child.wait().expect("a child").code().is_some();
        if let Some(number) = begun {
            let name = if panicked { "(panic)" } else { "(end of the process)" };
            fields.entry(name.to_owned()).or_default().count(effect);
            next = number + 1;
        }
    }
    fields
}

/// Fields of one kind, by what their names begin with; what belongs to none is among the others. The first
/// [`WATCHED`] kinds are held against a second copy or a seal: a flip there is told of, always.
const KINDS: [(&str, &[&str]); 6] = [
    (
        "accumulated yaw, biases, levelling, mounting, and what watches them",
        &[
            "guard.newest",
            "guard.pipeline.config.mounting",
            "guard.pipeline.known.levelling",
            "guard.pipeline.known.zero.",
            "guard.pipeline.known.zero_rate.bias",
            "guard.pipeline.known.zero_rate.copy",
            "guard.pipeline.known.seal",
            "guard.pipeline.mounting_seal",
            "guard.pipeline.navigation_yaw",
        ],
    ),
    ("rates that wait", &["guard.pipeline.compensator.kept.rate", "guard.pipeline.compensator.kept.copy"]),
    ("what the navigation yaw is owed", &["guard.pipeline.compensator.navigation_carry"]),
    (
        "estimates that wait",
        &[
            "guard.pipeline.out",
            "guard.pipeline.compensator.kept.count",
            "guard.pipeline.compensator.kept.estimate",
            "guard.pipeline.compensator.kept.sum",
        ],
    ),
    ("windows", &["guard.pipeline.window."]),
    ("configuration and state of the wheel receiver", &["wheels."]),
];
const WATCHED: usize = 2;

fn kind(field: &str) -> &'static str {
    let among = |begins: &[&str]| begins.iter().any(|begin| field.starts_with(begin));
    KINDS.iter().find(|(_, begins)| among(begins)).map_or("others", |(kind, _)| kind)
}

/// A line for each, and one for all of them.
fn table<'n>(lines: impl Iterator<Item = (&'n str, &'n Line)>) -> Line {
    let mut all = Line::default();
    println!(
        "| in | flips | nothing | within sigma | told | beyond | most, rad | died | not recovered | grown | by at most, rad |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let row = |name: &str, line: &Line| {
        let Line { flips, nothing, within, told, beyond, most, died, not_recovered, grown, grown_most } =
            line;
        println!(
            "| {name} | {flips} | {nothing} | {within} | {told} | {beyond} | {most:.1e} | {died} | {not_recovered} | {grown} | {grown_most:.1e} |"
        );
    };
    for (name, line) in lines {
        row(name, line);
        all.add(line);
    }
    row("all", &all);
    println!();
    all
}

/// A correction of 30 deg/s for a sample, 0.0052 rad, and what windows make of it.
const MOST: f64 = 8e-3;

fn check(count: usize) {
    let fields = effects(count);
    table(fields.iter().map(|(name, line)| (name.as_str(), line)));
    let mut kinds = BTreeMap::<&str, Line>::new();
    for (name, line) in &fields {
        kinds.entry(kind(name)).or_default().add(line);
    }
    let all = table(kinds.iter().map(|(name, line)| (*name, line)));
    assert_eq!(all.flips, count);
    for (kind, _) in &KINDS[..WATCHED] {
        assert_eq!(kinds.get(kind).map_or(0, |line| line.beyond), 0, "{kind}");
    }
    for (name, line) in &fields {
        assert!(line.most <= MOST, "{name}: {line:?}");
    }
    assert!(all.nothing > count / 2 && all.told > 0, "{all:?}");
    assert!(all.died <= count / 50, "{all:?}");
}

#[test]
fn a_hundred_flips() {
    check(100);
}

/// `cargo test -p gyronet-host-tests --test state_upsets -- --ignored --nocapture thousands`
#[test]
#[ignore = "takes minutes"]
fn thousands_of_flips() {
    check(4_000);
}
