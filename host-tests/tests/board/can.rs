//! CAN on the virtual board: what goes out is what the host makes, what comes in is heard, and a bus that is
//! away gets nothing old when it is back.

use crate::common::{
    self, MS, SAMPLE, SECOND, SET, SLCAN, START, boot, counters, drive, faults, frames, host, id, times,
};
use embedded_can::{Frame, Id};
use gyronet::can::DataFrame;
use gyronet::can::config::{BIT_RATES, Settings};
use gyronet::health::Faults;
use gyronet::store::Configuration;
use gyronet_host_tests::board::Board;
use gyronet_host_tests::recordings;
use gyronet_host_tests::replay;
use gyronet_host_tests::stored::Stored;
use gyronet_tools::drive::stream::Recording;
use std::time::{Duration, Instant};

/// Age at which a frame no longer goes out, with the time that the frames before it take.
const STALE: Duration = Duration::from_millis(21);
const ANGLE: u16 = 0x1A1;

/// Frames that went out when their sample was older than [`STALE`], with their place among the host's. An angle
/// message with the fault bit BUS is none of the host's, which has no bus.
fn stale(sent: &[(Duration, DataFrame)], made: &[DataFrame]) -> Vec<(Duration, usize)> {
    let sample = |time: Duration| (time.saturating_sub(START).as_millis() / SAMPLE.as_millis()) as usize;
    let oldest = |time: Duration| sample(time.saturating_sub(STALE)) * SET;
    let newest = |time: Duration| ((sample(time) + 1) * SET).min(made.len());
    let fresh = |time: Duration, frame| made[oldest(time).min(newest(time))..newest(time)].contains(frame);
    sent.iter()
        .filter(|(_, frame)| frame.id() != id(ANGLE) || !faults(&[*frame])[0].contains(Faults::BUS))
        .filter(|(time, frame)| !fresh(*time, frame))
        .map(|(time, frame)| (*time, made.iter().position(|made| made == frame).unwrap_or(usize::MAX)))
        .collect()
}

struct Disturbed {
    board: Board,
    before: Vec<(Duration, DataFrame)>,
    during: Vec<(Duration, DataFrame)>,
    after: Vec<(Duration, DataFrame)>,
    made: Vec<DataFrame>,
}

fn disturbed(lasts: Duration, set: (&str, serde_json::Value), back: serde_json::Value) -> Option<Disturbed> {
    let mut board = boot()?;
    let samples = drive(((SECOND + lasts + SECOND).as_millis() / SAMPLE.as_millis()) as usize);
    common::send(&mut board, &samples, START);
    board.run(START + SECOND);
    let before = board.can_frames();
    board.configure(set.0, set.1);
    board.run(lasts);
    let during = board.can_frames();
    board.configure(set.0, back);
    board.run(SECOND);
    let after = board.can_frames();
    Some(Disturbed { board, before, during, after, made: host(&samples) })
}

#[test]
fn frames_are_those_of_the_host_byte_for_byte() {
    compare(&drive(600));
}

#[test]
fn frames_of_a_real_drive_are_those_of_the_host() {
    let Some(path) = recordings::trial(11) else { return };
    let rows = Recording::read(&path).expect("a recording").rows.into_iter().take(3_000).enumerate();
    let samples: Vec<Vec<u8>> = rows.map(|(k, row)| replay::message(k, &row.sample)).collect();
    compare(&samples);
}

fn compare(samples: &[Vec<u8>]) {
    let Some(mut board) = boot() else { return };
    common::send(&mut board, samples, START);
    let begun = Instant::now();
    board.run(START + SAMPLE * samples.len() as u32);
    let (took, instructions) = (begun.elapsed().as_secs_f64(), board.counts().instructions as f64);
    println!("{} samples in {took:.1} s, {:.1} M instructions/s", samples.len(), instructions / took * 1e-6);
    let sent = board.can_frames();
    let made = host(samples);
    println!("first frame {:?} after the first sample began", sent[0].0 - START);
    assert!(sent[0].0 - START < 10 * MS);
    assert!(sent.len() >= SET * (samples.len() - 1), "{} frames", sent.len());
    assert!(frames(&sent) == made[..sent.len()], "in order, and the same");
    // A sample's six frames are out before the next sample comes, one behind the other.
    for (k, set) in sent.chunks_exact(SET).enumerate() {
        let began = START + SAMPLE * k as u32;
        assert!(set[SET - 1].0 - began < SAMPLE, "sample {k}: {:?}", set[SET - 1].0 - began);
        assert!(set[SET - 1].0 - set[0].0 < 2 * MS, "sample {k}: six frames");
    }
    let counters = counters(&mut board);
    assert_eq!((counters.lines.unsent, counters.lines.line_errors, counters.lines.overruns), (0, 0, 0));
    sums(&sent);
}

/// A bus at each bit rate that can be configured: frames out as the host's, wheel frames in from power-on
/// on; at another rate none.
#[test]
fn every_bit_rate_is_the_configured_one() {
    const SAMPLES: usize = 30;
    let made = host(&drive(SAMPLES));
    for bits_per_second in BIT_RATES {
        for bus in [bits_per_second, bits_per_second / 2] {
            let can = Settings { bits_per_second, ..Settings::DEFAULT };
            let configuration = Configuration { can, ..Configuration::DEFAULT };
            let Some(mut board) = common::unpowered() else { return };
            Stored::default().record(&configuration).write_to(&mut board);
            board.configure("CAN1.bit_rate", bus);
            board.power_on();
            common::send(&mut board, &drive(SAMPLES), START);
            common::stop_wheels(&mut board, SAMPLES as u32 + 30, Duration::ZERO);
            board.run(START + SAMPLE * SAMPLES as u32);
            let sent = frames(&board.can_frames());
            println!("{bits_per_second} on a bus of {bus}: {} frames", sent.len());
            if bus != bits_per_second {
                assert_eq!(sent, [], "{bits_per_second} on {bus}");
                continue;
            }
            assert!(sent.len() >= SET * (SAMPLES - 2), "{}", sent.len());
            let own = |frames: &[DataFrame]| {
                let rates = frames.iter().filter(|frame| frame.id() != id(ANGLE));
                rates.copied().collect::<Vec<_>>()
            };
            // The host has no wheels, which the angle message reports.
            assert!(own(&sent) == own(&made[..sent.len()]), "{bits_per_second}");
            let missed = faults(&sent).iter().filter(|faults| faults.contains(Faults::WHEELS)).count();
            assert!(missed < 3, "{missed} sets without wheels at {bits_per_second}");
            assert_eq!(counters(&mut board).lines.frames_lost, 0, "{bits_per_second}");
        }
    }
}

/// cantools reads the log: the sum of the rates is the accumulated angle.
fn sums(sent: &[(Duration, DataFrame)]) {
    let mut log = String::new();
    for (time, frame) in sent {
        let Id::Standard(id) = frame.id() else { panic!("11 bits") };
        log += &common::logged(*time, id.as_raw(), "#", frame.data());
    }
    let Some(text) = common::read_log("log_sums.py", &log) else { return };
    let off: f64 = text.split_whitespace().last().and_then(|word| word.parse().ok()).expect("a difference");
    assert!(off < 1e-6, "{text}");
}

/// The status byte that SLCAN answers to `F`.
fn status(board: &mut Board) -> String {
    let _ = board.sent(SLCAN);
    board.send(SLCAN, b"F\r");
    // It is taken with a tick, and waits for the bytes that DMA is sending.
    board.run(5 * MS);
    let text = String::from_utf8(board.sent(SLCAN)).expect("ASCII");
    // An answer is sent between two frames; the first line may be the end of one.
    let mut lines = text.split('\r');
    let first = lines.next();
    let status =
        lines.chain(first).find_map(|line| line.strip_prefix('F').filter(|status| status.len() == 2));
    status.unwrap_or_else(|| panic!("no status in {text:?}")).to_owned()
}

#[test]
fn slcan_reports_warning_passive_and_bus_off() {
    let Some(mut board) = boot() else { return };
    common::send(&mut board, &drive(80), START);
    board.run(START + 50 * MS);
    assert_eq!(status(&mut board), "00");
    // Each attempt adds 8 to the error counter, up to 128: passive. Each frame that gets through takes 1 off.
    board.configure("CAN1.acknowledge", false);
    board.run(50 * MS);
    assert_eq!(status(&mut board), "20", "passive from 128 on");
    board.configure("CAN1.acknowledge", true);
    board.run(20 * MS);
    assert_eq!(status(&mut board), "04", "warning from 96 on");
    board.run(200 * MS);
    assert_eq!(status(&mut board), "00");
    board.configure("CAN1.short", "recessive");
    board.run_until("bus_off", 20 * MS).expect("the errors add up");
    assert_eq!(status(&mut board), "80", "off the bus");
}

/// Nothing is acknowledged, another node always wins, or the bus is unplugged.
#[test]
fn nothing_old_goes_out_when_the_bus_takes_frames_again() {
    for (lasts, setting, bad) in
        [(200, "CAN1.acknowledge", false), (200, "CAN1.babble", true), (10_000, "CAN1.connected", false)]
    {
        let lasts = lasts * MS;
        let Some(mut run) = disturbed(lasts, (setting, bad.into()), (!bad).into()) else { return };
        assert!(frames(&run.before)[..] == run.made[..run.before.len()]);
        assert_eq!(run.during.len(), 0, "{setting}");
        assert_eq!(stale(&run.after, &run.made), [], "{setting}");
        let faults = faults(&frames(&run.after));
        assert!(faults[0].contains(Faults::BUS), "the first angle message reports frames that were dropped");
        assert!(!faults[faults.len() - 1].contains(Faults::BUS), "and the last one of a bus in order");
        let first = run.after[0].0 - (START + SECOND + lasts);
        println!("{setting}: first frame {first:?} after the bus is back");
        assert!(first < 30 * MS, "{setting}: {first:?}");
        let dropped = counters(&mut run.board).lines.unsent as usize;
        let missing = run.made.len() - run.before.len() - run.after.len();
        assert!(dropped.abs_diff(missing) <= SET, "{setting}: {dropped} counted, {missing} missing");
    }
}

/// The page's 20 ms, a tick and the frame itself.
#[test]
fn a_frame_waits_no_longer_than_its_age_allows() {
    for lasts in 22..34 {
        let Some(run) = disturbed(lasts * MS, ("CAN1.babble", true.into()), false.into()) else { return };
        let first = |frame: &DataFrame| frame.id() == id(0x174);
        let made: Vec<_> = run.made.iter().filter(|frame| first(frame)).collect();
        let before: Vec<_> = run.before.iter().filter(|(_, frame)| first(frame)).collect();
        let (at, frame) = run.after.iter().find(|(_, frame)| first(frame)).expect("the bus is free");
        let ago = (0..6).find(|ago| made[before.len() + ago] == frame).expect("of these samples");
        let usual = before[before.len() - 1].0 + SAMPLE * (ago as u32 + 1);
        let late = at.saturating_sub(usual);
        assert!(late <= 21 * MS + MS / 2, "{lasts} ms: {late:?}");
    }
}

/// Recessive bits between the wait after bus-off and the return.
const RECESSIVE: u64 = 128 * 11;

/// Case bus/03: the bus is in order again as soon as the controller is off it.
#[test]
fn bus_off_lasts_10_20_and_40_ms_and_the_standard_s_wait() {
    let Some(mut board) = boot() else { return };
    common::send(&mut board, &drive(500), START);
    board.run(START + Duration::from_millis(500));
    for (wait, pause) in [(10, 703), (20, 703), (40, 1_400), (10, 103)] {
        let _ = board.events();
        board.configure("CAN1.short", "recessive");
        board.run_until("bus_off", 50 * MS).expect("the errors add up");
        board.configure("CAN1.short", serde_json::Value::Null);
        let _ = board.can_frames();
        board.run(pause * MS);
        let events = board.events();
        let ([off], [back]) = (&times("bus_off", &events)[..], &times("bus_off_ended", &events)[..]) else {
            panic!("{wait} ms: {events:?}")
        };
        let first = board.can_frames()[0].0;
        println!("{wait} ms: back after {:?}, first frame {:?} later", *back - *off, first - *back);
        let promised = wait * MS + Duration::from_micros(2 * RECESSIVE);
        assert!((*back - *off).abs_diff(promised) < MS, "{:?} for {promised:?}", *back - *off);
        assert!(first - *back < SAMPLE + 2 * MS, "the next sample's frames are sent");
    }
}

#[test]
fn bus_off_again_and_again() {
    let set = ("CAN1.short", "recessive".into());
    let Some(mut run) = disturbed(400 * MS, set, serde_json::Value::Null) else { return };
    let back = common::back_at_growing_intervals(&run.board.events(), RECESSIVE, MS);
    assert_eq!(stale(&run.after, &run.made), []);
    assert!(faults(&frames(&run.after))[0].contains(Faults::BUS));
    assert!(run.after[0].0 - back[5] < SAMPLE + 2 * MS, "{:?}", run.after[0].0 - back[5]);
}
