//! Holds the results that the paper prints, and computes the means of its rows (X. Zhao et al., Learning
//! to Compensate for the Drift and Error of Gyroscope in Vehicle Localization).

/// A name and its figures.
pub type Line = (&'static str, &'static [f64]);

/// Table I: mean error in 1 s and final error, rad.
pub const ORIENTATION: [Line; 5] = [
    ("static initialisation", &[0.001535, 0.3153]),
    ("FIR", &[0.002755, 0.5146]),
    ("Xsens internal filter", &[0.001662, 0.2584]),
    ("GyroNet", &[0.0003854, 0.06156]),
    ("FoG", &[0.000347, 0.06448]),
];

/// GyroNet's error in 1 s relative to that of static initialisation, from [`ORIENTATION`].
pub const GYRONET_TO_STATIC: f64 = 0.0003854 / 0.001535;

/// Table II: ATE and aligned ATE, m, of FoG, lwoi and FoGNet, each with odometry. Trained on 06 to
/// 13, tested on 14 to 17.
pub const URBAN: [Line; 12] = [
    ("urban06", &[126.41, 38.04, 56.86, 22.4, 43.75, 11.62]),
    ("urban07", &[3.02, 0.41, 6.92, 4.7, 3.62, 0.30]),
    ("urban08", &[0.87, 0.38, 5.87, 5.14, 0.61, 0.32]),
    ("urban09", &[18.3, 12.49, 11.6, 7.76, 2.67, 1.34]),
    ("urban10", &[50.4, 14.12, 54.24, 9.15, 36.90, 2.47]),
    ("urban11", &[109.92, 25.39, 27.79, 16.13, 46.88, 14.77]),
    ("urban12", &[66.93, 24.21, 47.34, 24.66, 28.93, 8.12]),
    ("urban13", &[7.01, 3.94, 10.29, 2.78, 1.94, 0.51]),
    ("urban14", &[35.89, 13.99, 49.91, 10.11, 22.00, 1.33]),
    ("urban15", &[3.69, 3.54, 9.52, 8.23, 2.59, 1.29]),
    ("urban16", &[45.21, 31.37, 28.43, 18.95, 18.08, 14.35]),
    ("urban17", &[20.97, 14.25, 15.04, 10.2, 7.32, 6.91]),
];

/// Table II's last line, as printed.
pub const URBAN_AVERAGE: Line = ("average, printed", &[40.72, 15.22, 26.98, 11.68, 17.98, 5.28]);

/// Table III: ATE and aligned ATE, m, without and with padding.
pub const PADDING: [Line; 2] = [("no padding", &[19.64, 5.47]), ("padding", &[17.98, 5.28])];

/// Table IV: ATE and aligned ATE, m, of RINS-W and of FoGNet with odometry.
pub const RINS_W: [Line; 3] = [
    ("urban15", &[7.0, 5.0, 3.0, 1.0]),
    ("urban16", &[27.0, 11.0, 19.0, 14.0]),
    ("urban17", &[13.0, 11.0, 7.0, 7.0]),
];

/// Table IV's last line, as printed.
pub const RINS_W_AVERAGE: Line = ("average, printed", &[22.0, 10.0, 9.0, 7.0]);

/// Table V: ATE and aligned ATE, m, average over urban18 to 37.
pub const NEW_SEQUENCES: [Line; 3] =
    [("FoG + odometry", &[23.10, 7.02]), ("lwoi", &[23.79, 6.02]), ("FoGNet + odometry", &[14.60, 4.31])];

pub fn average(lines: &[Line]) -> Vec<f64> {
    let columns = lines.first().map_or(0, |(_, figures)| figures.len());
    let mean = |k: usize| lines.iter().map(|(_, figures)| figures[k]).sum::<f64>() / lines.len() as f64;
    (0..columns).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_of_the_printed_rows() {
        let close = |lines: &[Line], expected: [f64; 6]| {
            for (a, b) in average(lines).into_iter().zip(expected) {
                assert!((a - b).abs() < 0.006, "{a} {b}");
            }
        };
        close(&URBAN, [40.72, 15.18, 26.98, 11.68, 17.94, 5.28]);
        close(&URBAN[..8], [47.86, 14.87, 27.61, 11.59, 20.66, 4.93]);
        close(&URBAN[8..], [26.44, 15.79, 25.72, 11.87, 12.50, 5.97]);
        let rivals = average(&RINS_W);
        assert!((rivals[0] - 15.67).abs() < 0.01 && (rivals[1] - 9.0).abs() < 0.01, "{rivals:?}");
        assert!((GYRONET_TO_STATIC - 0.251).abs() < 1e-3);
    }
}
