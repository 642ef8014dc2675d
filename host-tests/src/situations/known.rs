//! Promises that are not kept yet, with the deliverable of issue 34 that keeps them.
//!
//! The letters are those of [`super::judge`], of the situation's first vehicle with seed 1. The test fails where
//! others are broken, and where one of these is kept, so that this list only shrinks.

/// Situation, deliverable, letters.
static KNOWN: &[(&str, u8, &str)] = &[
    ("ferry that turns while the board starts", 3, "syd"),
    ("turntable of a showroom while the board starts", 3, "syd"),
    ("ship that swings at anchor", 3, "syd"),
    ("car carrier in a town", 3, "t"),
    ("shuttle train", 3, "yt"),
    ("banked test track", 4, "sy"),
    ("creeping from the start", 3, "syd"),
    ("smooth motorway", 3, "t"),
    ("warm-up with slow bends", 3, "syt"),
    ("vibrating utility vehicle", 3, "gm"),
    ("slow slide with locked wheels", 3, "t"),
    ("spin on ice", 4, "y"),
    ("fibre-optic gyro whose clock is 4 % fast", 2, "sy"),
    ("fibre-optic gyro set to degrees", 4, "syg"),
    ("fibre-optic gyro stuck", 1, "y"),
    ("fibre-optic gyro silent", 1, "y"),
    ("fibre-optic gyro marks its axis", 4, "y"),
    ("bits flip on the fibre-optic gyro's line", 1, "y"),
    ("fibre-optic gyro's line stalls", 1, "y"),
    ("ferry that turns a fibre-optic gyro", 3, "syd"),
    ("implausible readings for a second", 1, "d"),
    ("gyro beyond its range", 1, "d"),
    ("bias steps after a knock", 3, "syd"),
    ("bits flip on the line", 1, "d"),
    ("messages are lost", 1, "d"),
    ("messages are cut off", 1, "d"),
    ("line stalls in a turn", 1, "sy"),
    ("wheel frames frozen at zero on a motorway", 3, "t"),
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
