//! Promises that are not kept yet, with the deliverable of issue 34 that keeps them.
//!
//! The letters are those of [`super::judge`], of the situation's first vehicle with seed 1. The test fails where
//! others are broken, and where one of these is kept, so that this list only shrinks.

/// Situation, deliverable, letters.
static KNOWN: &[(&str, u8, &str)] = &[
    ("ferry that turns while the board starts", 3, "sy"),
    ("ferry that turns on the way", 3, "sy"),
    ("turntable of 0.2 deg/s", 3, "sy"),
    ("turntable of a showroom while the board starts", 3, "sy"),
    ("ship that swings at anchor", 3, "sy"),
    ("car carrier in a town", 3, "syt"),
    ("shuttle train", 3, "syt"),
    ("lift for cars", 4, "sy"),
    ("loading ramp", 4, "sy"),
    ("start on a steep slope", 4, "sy"),
    ("serpentines of 15 %", 4, "sy"),
    ("parking garage spiral", 4, "sy"),
    ("banked test track", 4, "sy"),
    ("car wash with a conveyor", 4, "sy"),
    ("people board, the wind rocks", 3, "g"),
    ("town", 4, "sy"),
    ("creeping below the wheels' threshold", 3, "sy"),
    ("creeping from the start", 3, "sy"),
    ("smooth motorway", 3, "st"),
    ("warm-up with slow bends", 3, "syt"),
    ("night of cooling", 3, "sy"),
    ("long idle", 4, "sy"),
    ("engine off at each stop", 4, "sy"),
    ("idling truck", 4, "s"),
    ("vibrating utility vehicle", 3, "gm"),
    ("restart in motion", 3, "sy"),
    ("reversing", 4, "sy"),
    ("roundabout at the start", 3, "syg"),
    ("towed with the front axle lifted", 4, "sy"),
    ("wheels locked on ice", 4, "sy"),
    ("slow slide with locked wheels", 3, "syt"),
    ("spin on ice", 4, "sy"),
    ("wheels spin at a standstill", 4, "sy"),
    ("tram tracks", 4, "s"),
    ("speed bumps", 4, "sy"),
    ("washboard road", 4, "s"),
    ("sensor of 50 Hz", 2, "g"),
    ("sensor of 83 Hz", 2, "g"),
    ("sensor of 104 Hz", 2, "sy"),
    ("sensor of 120 Hz", 2, "sy"),
    ("sensor of 200 Hz", 2, "g"),
    ("sensor of 400 Hz", 2, "g"),
    ("sensor that samples at uneven times", 2, "g"),
    ("sensor whose clock is 1.5 % fast", 2, "sy"),
    ("sensor whose clock jumps", 2, "sy"),
    ("every clock and counter wraps", 4, "sy"),
    ("gain of 1.008", 4, "sy"),
    ("mounted 5 deg askew", 4, "sy"),
    ("gyro stuck in a turn", 1, "sy"),
    ("one gyro axis stuck in a turn", 1, "sy"),
    ("sensor silent in a turn", 1, "sy"),
    ("no number for an axis in a turn", 1, "sy"),
    ("one implausible reading", 1, "sy"),
    ("one small implausible reading", 1, "sy"),
    ("implausible readings for a second", 1, "sy"),
    ("gyro beyond its range", 1, "sy"),
    ("bias steps after a knock", 3, "sy"),
    ("sensor moved between two drives", 3, "sy"),
    ("sensor swapped", 3, "sy"),
    ("messages every 50 ms", 1, "sy"),
    ("messages every 100 ms", 1, "sy"),
    ("bits flip on the line", 1, "sy"),
    ("noise on the line", 1, "sy"),
    ("messages are lost", 1, "sy"),
    ("messages come twice", 1, "sy"),
    ("messages are cut off", 1, "sy"),
    ("messages overtake each other", 1, "sy"),
    ("line stalls in a turn", 1, "sy"),
    ("wheel marked as faulty", 5, "sy"),
    ("one wheel dead", 4, "sy"),
    ("one tyre flat", 4, "sy"),
    ("wheels of another size", 4, "sy"),
    ("wheel frames end", 4, "sy"),
    ("wheel frames frozen in motion", 4, "sy"),
    ("wheel frames frozen at zero on a motorway", 3, "syt"),
];

fn entry(situation: &str) -> Option<&'static (&'static str, u8, &'static str)> {
    KNOWN.iter().find(|(name, ..)| *name == situation)
}

/// The letters of a situation's broken promises.
pub fn letters(situation: &str) -> &'static str {
    entry(situation).map_or("", |(.., letters)| letters)
}

/// The deliverable that keeps a situation's promises.
pub fn owner(situation: &str) -> Option<u8> {
    entry(situation).map(|(_, owner, _)| *owner)
}
