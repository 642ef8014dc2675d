//! The states of the corrected yaw rate, as the board reports them.

use super::Table;
use gyronet::health::Status;

/// A state, or a condition that leaves the state as it is: the status that the board reports, if it changes; name; when it is
/// entered; yaw rate and fault bits on CAN; until when; the counter of the pipeline or of the sensor monitor.
type State = (Option<Status>, &'static str, &'static str, &'static str, &'static str, &'static str);

/// All states. In a fault state there is no yaw rate: our own messages report "not available", Bosch's set "failed".
///
/// From a fault the state returns to init where no bias is known, otherwise to degraded.
const STATES: [State; 15] = [
    (
        Some(Status::Init),
        "init",
        "the start; a jump of the clock before the bias was known",
        "gyro without correction, marked initialising",
        "3 s at rest",
        "`moving`",
    ),
    (
        Some(Status::Degraded),
        "degraded",
        "the start, if earlier drives have shown the bias",
        "gyro less that bias",
        "3 s at rest",
        "`moving`",
    ),
    (
        Some(Status::Degraded),
        "degraded",
        "the bias is known; a gap, a late or implausible window, saturation, damaged weights",
        "gyro less bias",
        "a window is accepted",
        "`missing`, `late`, `implausible`",
    ),
    (
        Some(Status::Ready),
        "ready",
        "an accepted window covers the recent samples",
        "gyro less bias and correction",
        "one of the other states",
        "`windows`",
    ),
    (
        Some(Status::Silent),
        "fault: silent",
        "29 ms without a sample, by the board's clock; 2 s after the start without the first one",
        "none, every 10 ms; GAP",
        "the next sample",
        "`silences`",
    ),
    (
        Some(Status::Stuck),
        "fault: stuck",
        "seven samples (70 ms) in which all gyro axes, all accelerometer axes, or one axis that seldom repeats \
         itself do not change; thirty in which any axis does not",
        "none; STUCK",
        "a sample that differs",
        "`stuck`",
    ),
    (
        Some(Status::Clipped),
        "fault: saturated",
        "the sensor reports saturation",
        "none; CLIPPED",
        "50 ms after the last such sample",
        "`invalid`, `held`",
    ),
    (
        Some(Status::Clipped),
        "fault: wrong",
        "a reading changes in 10 ms by more than 12 times what this axis is used to (RMS of 0.6 s), and by more than \
         0.3 rad/s in yaw, 1 rad/s in roll and pitch, 30 m/s^2",
        "none; IMPLAUSIBLE",
        "a reading near the last good one, or the fourth such reading in a row",
        "`wrong`",
    ),
    (
        None,
        "not confirmed",
        "the bias rests on the one standstill of the start, in which a ferry or a turntable may have turned; 0x1A3 says coarse",
        "as in the present state, at best degraded",
        "the vehicle drives off within 10 s of a reading at rest, which decides, or stops later and agrees",
        "",
    ),
    (
        None,
        "late",
        "samples arrive more than 29 ms later than their time stamps let expect: the line has stalled",
        "as in the present state, at best degraded, with its latency; GAP",
        "samples that arrive in time",
        "",
    ),
    (
        None,
        "jumped",
        "the yaw rate has jumped as no vehicle turns, and stays there",
        "as in the present state, at best degraded, the jump in the expected error; IMPLAUSIBLE",
        "it jumps back, or the vehicle stands",
        "`wrong`",
    ),
    (
        None,
        "sensor moved",
        "its up or forward direction differs from earlier drives",
        "as in the present state, at best degraded; IMPLAUSIBLE",
        "the next start, or `calibrate forget`",
        "`moved_mounts`",
    ),
    (
        None,
        "clock off",
        "the sensor's clock differs from the board's crystal by more than 4 %; the yaw is then accumulated by the \
         sensor's clock",
        "as in the present state, at best degraded; IMPLAUSIBLE",
        "the clocks agree again",
        "`clock_off`",
    ),
    (
        None,
        "rate not used",
        "the sensor sends fewer than 50 or more than 1000 samples a second",
        "none, as silent; IMPLAUSIBLE",
        "a rate between",
        "`misplaced`",
    ),
    (
        None,
        "contradicted",
        "two seconds in which other sources (fibre-optic gyro, wheels, accelerometer) contradict the gyro; 0x1A3 names it",
        "as in the present state, at best degraded; IMPLAUSIBLE",
        "two seconds of a turn in which they agree, or straight on where a bias was wrong",
        "",
    ),
];

pub fn states() -> Table {
    let mut table =
        Table::new(&["state", "status in data 0104", "when", "yaw rate on CAN", "until", "counter"]);
    for (status, name, entered, rate, left, counter) in STATES {
        let number = status.map(|status| (status as u8).to_string()).unwrap_or_default();
        table.row([name, &number, entered, rate, left, counter]);
    }
    table
}
