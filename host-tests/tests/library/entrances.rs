//! Every entrance of bytes over its corpus, and over damaged copies of it: what fuzzing does under coverage, for a moment
//! and on any machine.

use gyronet_host_tests::entrance::{ALL, Entrance, records};
use gyronet_host_tests::noise::Noise;
use gyronet_host_tests::recordings::workspace;
use std::fs;
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::Duration;

fn corpus(entrance: &Entrance) -> Vec<Vec<u8>> {
    let folder = workspace().join("host-tests/fuzz/corpus").join(entrance.name);
    let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).expect("a file")).collect()
}

/// The other inputs are of formats that do not change with a version of the library.
#[test]
fn the_records_of_the_corpus_are_current() {
    for (name, seed) in records::seeds() {
        let path = workspace().join("host-tests/fuzz/corpus/records").join(name);
        if std::env::var_os("GYRONET_WRITE_CORPUS").is_some() {
            fs::write(&path, &seed).expect("a file of the repository");
        }
        assert!(fs::read(path).is_ok_and(|kept| kept == seed), "{name}: test with GYRONET_WRITE_CORPUS=1");
    }
}

/// An input that takes longer has no end: the slowest takes milliseconds.
const LIMIT: Duration = Duration::from_secs(60);

/// Each entrance works in a thread of its own, so that an input without an end fails the test and does not stop it.
#[test]
fn damaged_copies_keep_every_promise_and_none_waits_without_a_bound() {
    for entrance in &ALL {
        let (ended, inputs) = mpsc::channel();
        let worker = thread::spawn(move || {
            run(entrance, || ended.send(()).expect("the test waits for it"));
        });
        let all = std::iter::from_fn(|| match inputs.recv_timeout(LIMIT) {
            Ok(()) => Some(()),
            Err(RecvTimeoutError::Disconnected) => None,
            Err(RecvTimeoutError::Timeout) => panic!("{}: an input has no end", entrance.name),
        });
        println!("{}: {} inputs", entrance.name, all.count());
        worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    }
}

/// Runs the corpus of an entrance and damaged copies of it; `ended` is called after each input.
fn run(entrance: &Entrance, ended: impl Fn()) {
    let corpus = corpus(entrance);
    let one = |input: &[u8]| {
        (entrance.run)(input);
        ended();
    };
    corpus.iter().for_each(|input| one(input));
    let mut noise = Noise::new(26);
    for _ in 0..entrance.mutations {
        let pick = |noise: &mut Noise| &corpus[noise.int(0, corpus.len() as i64 - 1) as usize];
        let mut input = pick(&mut noise).clone();
        for _ in 0..noise.int(1, 4) {
            let other = pick(&mut noise);
            damage(&mut input, other, &mut noise);
        }
        one(&input);
    }
}

/// One change, of the kinds that a line, a disk or a stranger makes.
fn damage(input: &mut Vec<u8>, other: &[u8], noise: &mut Noise) {
    let at = noise.int(0, input.len() as i64) as usize;
    match noise.int(0, 6) {
        0 => input.truncate(at),
        1 => input.insert(at, noise.byte()),
        2 => drop(input.splice(at.., other[at.min(other.len())..].iter().copied())),
        3 => input.extend_from_within(at..),
        kind => {
            let Some(byte) = input.get_mut(at) else { return };
            *byte = match kind {
                4 => *byte ^ 1 << noise.int(0, 7),
                5 => [0, 0xFF, 0x7F, 0x80, b'9', b'-', b'\n'][noise.int(0, 6) as usize],
                _ => noise.byte(),
            };
        }
    }
}
