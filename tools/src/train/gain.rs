//! Computes what weights gain on drives that had no part in their training.

use crate::evaluate::methods::Method;
use crate::evaluate::report::DriveErrors;
use serde::Serialize;

/// The mean over drives and the standard deviation between them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    pub mean: f64,
    /// The standard deviation; `None` for one drive.
    pub deviation: Option<f64>,
}

impl Spread {
    /// Returns the spread of some values; `None` if there are none.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = (!values.is_empty()).then_some(values.len() as f64)?;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        let deviation = (values.len() > 1).then(|| (squares / (count - 1.0)).sqrt());
        Some(Self { mean, deviation })
    }
}

impl std::fmt::Display for Spread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.3}", self.mean)?;
        self.deviation.map_or(Ok(()), |deviation| write!(f, " +- {deviation:.3}"))
    }
}

/// The 1 s error of a method over that of static initialisation.
#[derive(Debug, Clone, Serialize)]
pub struct Ratio {
    /// The method's name.
    pub method: &'static str,
    pub drives: Vec<f64>,
    /// The spread over the drives.
    pub all: Spread,
}

/// The gain on some drives.
#[derive(Debug, Clone, Serialize)]
pub struct Gain {
    /// The drives' names.
    pub drives: Vec<String>,
    /// The ratio of each method to static initialisation, in the order of [`Gain::METHODS`].
    pub over_static: Vec<Ratio>,
    /// The error of the navigation rate over that of the best classical method of each drive.
    pub over_best_classical: Option<Spread>,
}

impl Gain {
    /// The methods that are compared; methods that use the library's own weights are left out.
    pub const METHODS: [Method; 6] = [
        Method::STATIC_ZERO_RATE,
        Method::FIR,
        Method::FIR_ZERO_RATE,
        Method::VQF,
        Method::PROMPT,
        Method::NAVIGATION,
    ];

    /// Computes the gain on some drives.
    pub fn new(drives: &[DriveErrors]) -> Self {
        let over_static = Self::METHODS.into_iter().filter_map(|method| {
            let ratio = |drive: &DriveErrors| {
                let still = drive.methods[Method::STATIC].error.mean_1s_rad?;
                Some(drive.methods[method].error.mean_1s_rad? / still)
            };
            let drives: Vec<f64> = drives.iter().filter_map(ratio).collect();
            Some(Ratio { method: method.name, all: Spread::of(&drives)?, drives })
        });
        let classical: Vec<f64> =
            drives.iter().filter_map(|drive| Some(drive.over_best_classical?.default.ratio)).collect();
        Self {
            drives: drives.iter().map(|drive| drive.name.clone()).collect(),
            over_static: over_static.collect(),
            over_best_classical: Spread::of(&classical),
        }
    }

    /// Returns the ratio of the navigation rate.
    pub fn sent(&self) -> Option<Spread> {
        self.over_static.iter().find(|ratio| ratio.method == Method::NAVIGATION.name).map(|ratio| ratio.all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spread_is_that_between_drives() {
        let spread = Spread::of(&[0.5, 0.7, 0.9]).expect("three drives");
        assert_eq!(spread.to_string(), "0.700 +- 0.200");
        assert_eq!(Spread::of(&[0.5]).expect("one drive").to_string(), "0.500");
        assert_eq!(Spread::of(&[]), None);
    }
}
