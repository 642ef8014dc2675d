//! These types report the state of the board: status, source and one counter for each kind of event.

#[doc(hidden)]
pub mod slow;

use crate::sample::Validity;

/// The state of the corrected yaw rate. None needs a restart to leave it, except that with damaged weights it is
/// `Degraded` at best. `gyronet reference states` prints when each is entered and left.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Status {
    /// The bias is not known yet: the rate is sent but not good.
    #[default]
    Init,
    /// Corrected by the model.
    Ready,
    /// Corrected by static bias only.
    Degraded,
    /// The part is saturated, or was less than 50 ms ago: the rate is wrong.
    Clipped,
    /// The part's readings repeat: the rate is wrong.
    Stuck,
    /// The part sends nothing: there is no rate.
    Silent,
}

impl core::fmt::Display for Status {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Init => "initialising, no bias yet",
            Self::Ready => "ready, corrected by the model",
            Self::Degraded => "degraded, corrected by the static bias alone",
            Self::Clipped => "clipped, the sensor is saturated",
            Self::Stuck => "stuck, the sensor's readings do not change",
            Self::Silent => "silent, the sensor sends nothing",
        })
    }
}

/// Says where a rate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Source {
    /// The gyro without a correction.
    #[default]
    Raw = 0,
    /// The gyro less its static bias.
    Static = 1,
    /// Corrected by the window model.
    Model = 2,
    /// The fibre-optic gyro less the Earth's rate at the latitude and its bias.
    EarthRate = 4,
}

/// Says how far a rate can be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum Quality {
    /// The rate is fully corrected, without restrictions.
    Good = 0,
    /// Usable, with reduced confidence.
    Degraded = 1,
    /// The rate is sent, but must not be used yet.
    #[default]
    Initialising = 2,
    /// The rate is not available.
    Unusable = 3,
}

/// The present faults, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Faults(pub u8);

impl Faults {
    /// No fault is present.
    pub const NONE: Self = Self(0);
    /// Samples are missing.
    pub const GAP: Self = Self(1);
    /// The part is saturated.
    pub const CLIPPED: Self = Self(1 << 1);
    /// The part's readings repeat themselves.
    pub const STUCK: Self = Self(1 << 2);
    /// The estimate, a reading or the clock is implausible, the part was moved, or too much waits to be carried.
    pub const IMPLAUSIBLE: Self = Self(1 << 3);
    /// The network's estimate came too late.
    pub const LATE: Self = Self(1 << 4);
    /// Stored data are damaged: weights, configuration or calibration; diagnosis reports which.
    pub const STORED: Self = Self(1 << 5);
    /// The wheels are silent, or show standstill while the gyro shows a turn.
    pub const WHEELS: Self = Self(1 << 6);
    /// Frames were dropped because the bus did not accept them, or because a receive queue was full.
    pub const BUS: Self = Self(1 << 7);

    pub(crate) const fn of(validity: Validity) -> Self {
        match validity {
            Validity::Good => Self::NONE,
            Validity::Saturated | Validity::Recovering => Self::CLIPPED,
            Validity::Stuck => Self::STUCK,
            Validity::Implausible => Self::IMPLAUSIBLE,
        }
    }

    #[must_use]
    pub(crate) const fn when(self, present: bool) -> Self {
        if present { self } else { Self::NONE }
    }

    /// Returns whether all faults of `other` are among these.
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Returns the union of both.
    #[must_use]
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

/// The faults of the board other than those of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BoardFaults {
    /// Frames were lost on the bus, or the controller is off it.
    pub bus: bool,
    /// A wheel says of its speed that it is not valid.
    pub wheels: bool,
    /// The clock of the inertial sensor is too far off the board's, or it sends too few or too many samples a second.
    pub clock: bool,
    /// Other sources of the yaw rate contradict the inertial sensor.
    pub contradicted: bool,
    /// Weights, configuration or calibration are damaged.
    pub stored: bool,
    /// The configuration of this vehicle is lost: the built-in one is used, so no rate is better than degraded.
    pub configuration_lost: bool,
}

impl BoardFaults {
    /// No fault is present.
    pub const NONE: Self = Self {
        bus: false,
        wheels: false,
        clock: false,
        contradicted: false,
        stored: false,
        configuration_lost: false,
    };

    /// Returns the bits that are sent.
    #[must_use]
    pub const fn faults(self) -> Faults {
        Faults::BUS
            .when(self.bus)
            .with(Faults::WHEELS.when(self.wheels))
            .with(Faults::STORED.when(self.stored))
            .with(Faults::IMPLAUSIBLE.when(self.clock || self.contradicted))
    }

    /// Caps a quality at degraded without a configuration, with a clock that is off, or a contradiction.
    #[must_use]
    pub const fn cap_quality(self, quality: Quality) -> Quality {
        if (self.configuration_lost || self.clock || self.contradicted) && matches!(quality, Quality::Good) {
            Quality::Degraded
        } else {
            quality
        }
    }
}

/// Returns the source and the quality that a status stands for.
pub const fn judge(status: Status) -> (Source, Quality) {
    match status {
        Status::Init => (Source::Raw, Quality::Initialising),
        Status::Ready => (Source::Model, Quality::Good),
        Status::Degraded => (Source::Static, Quality::Degraded),
        Status::Clipped | Status::Stuck | Status::Silent => (Source::Raw, Quality::Unusable),
    }
}

/// Declares event counters, which saturate. Diagnosis sends them in the order of their fields.
macro_rules! counters {
    ($(#[$about:meta])* pub struct $name:ident { $($(#[$of:meta])* pub $field:ident: u32,)+ }) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        pub struct $name {
            $($(#[$of])* pub $field: u32,)+
        }

        impl $name {
            /// All counters at zero.
            pub const NONE: Self = Self { $($field: 0),+ };

            /// Returns the counters in the order in which diagnosis sends them.
            pub const fn words(&self) -> [u32; [$(stringify!($field)),+].len()] {
                [$(self.$field),+]
            }
        }
    };
}
pub(crate) use counters;

counters! {
    /// Event counters since the start. They saturate.
    pub struct Counters {
        /// Samples that became frames.
        pub samples: u32,
        /// Grid steps that no sample filled.
        pub missing: u32,
        /// Samples refused: duplicate, backwards, or of a rate that is not used.
        pub misplaced: u32,
        /// Clock jumps of more than a second.
        pub clock_jumps: u32,
        /// Samples that could not be used: saturated, recovering, stuck or implausible.
        pub invalid: u32,
        /// Static initialisations refused because the vehicle moved.
        pub moving: u32,
        /// Windows that the network has run.
        pub windows: u32,
        /// Network inputs clamped to its range.
        pub clamped_inputs: u32,
        /// Windows rejected as implausible.
        pub implausible: u32,
        /// Windows whose estimate came too late or not at all.
        pub late: u32,
        /// Seconds at standstill that updated the bias.
        pub zero_rate_updates: u32,
        /// Seconds in which the gyro contradicted that the vehicle stands.
        pub contradicted: u32,
        /// Times that the sensor was found to be mounted differently than in earlier drives.
        pub moved_mounts: u32,
    }
}

counters! {
    /// Fault counters of the sensor ([`crate::monitor`]).
    pub struct MonitorCounters {
        /// Times that the sensor became silent.
        pub silences: u32,
        /// Times that the sensor was stuck.
        pub stuck: u32,
        /// Samples not used because the sensor had just been saturated.
        pub held: u32,
        /// Readings further from the last good one than a vehicle moves in 10 ms.
        pub wrong: u32,
        /// Times that the sensor's clock was found to be too far off the board's ([`crate::align::clock_ratio`]).
        pub clock_off: u32,
    }
}

counters! {
    /// Counters of inputs that were refused or replaced ([`crate::coprocessor`]). They saturate.
    pub struct InputCounters {
        /// Messages of the inertial sensor that were not valid samples.
        pub imu_errors: u32,
        /// Messages of the fibre-optic gyro that were not valid samples.
        pub fog_errors: u32,
        /// Wheel frames that were corrupt or marked a speed as invalid.
        pub wheel_errors: u32,
        /// Frames whose latitude was too far from the one in use.
        pub latitude_errors: u32,
        /// Courses, speeds or latitudes that no vehicle has, short frames, damaged messages of a GNSS receiver.
        pub heading_errors: u32,
        /// Inputs with a time before the newest one.
        pub clock_back: u32,
        /// Estimates that no window waited for.
        pub unclaimed_estimates: u32,
        /// Windows that had not been taken when the next one was due.
        pub replaced_windows: u32,
        /// Messages that reported "failed" because a value does not fit its signal.
        pub out_of_range: u32,
    }
}

/// Adds to a counter without wrapping.
pub fn count(counter: &mut u32, by: u32) {
    *counter = counter.saturating_add(by);
}
