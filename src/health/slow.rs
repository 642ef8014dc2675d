//! States that change slowly: whether the vehicle stands, and how well the board knows its sensor.

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Verdict {
    /// Neither is shown, or the inertial sensor contradicts standing wheels.
    #[default]
    Unknown = 0,
    Standing = 1,
    Moving = 2,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Evidence {
    #[default]
    None = 0,
    Wheels = 1,
    /// A quiet inertial sensor, since the start or after braking.
    Inertial = 2,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Knowledge {
    /// Not at all: the configured or built-in value is in use.
    #[default]
    Unknown = 0,
    /// From earlier drives, and not confirmed yet; a mounting of which up or forward is known, within 10 deg.
    Coarse = 1,
    /// Measured; a mounting of which up and forward are known within 3 deg.
    Fine = 2,
    Refused = 3,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SlowStatus {
    pub verdict: Verdict,
    pub evidence: Evidence,
    pub bias: Knowledge,
    pub gain: Knowledge,
    pub mounting: Knowledge,
    /// Sources in contradiction: inertial gyro 1, fibre-optic gyro 2, wheels 4; `None` before two were compared.
    pub doubts: Option<u8>,
    /// Gaps in the accumulated yaws of both gyros; `None` before one begins.
    pub gaps: Option<u32>,
    /// Expected error (1 sigma) of the last minute's turn, 0.01 deg, gaps included; `None` before it begins.
    pub doubt: Option<u32>,
}
