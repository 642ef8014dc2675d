//! Computes the latitude of a position in UTM, the coordinates of KAIST Urban's poses. The latitude
//! matters because the Earth's rate is 300 times a fibre-optic gyro's bias, and the data set's drives are up to a
//! degree apart.
//!
//! The series are those of Snyder, Map Projections: A Working Manual (USGS Professional Paper 1395), equations 3-24,
//! 7-19 and 8-17, on the ellipsoid WGS 84, north of the equator. The omitted terms are below 1e-4 degrees.

/// Semi-major axis, m, and square of the eccentricity.
const AXIS: f64 = 6_378_137.0;
const ECCENTRICITY: f64 = 0.006_694_379_990_14;
/// Scale on the central meridian, and its easting, m.
const SCALE: f64 = 0.9996;
const MERIDIAN: f64 = 500_000.0;
/// Ranges of UTM coordinates on land, m; coordinates outside are in a frame of the data's own.
const EASTINGS: std::ops::Range<f64> = 1e5..9e5;
const NORTHINGS: std::ops::Range<f64> = 1e5..9.4e6;

/// Returns the latitude of an easting and a northing, degrees; `None` if they are not in UTM.
pub fn latitude_deg([easting, northing]: [f64; 2]) -> Option<f64> {
    if !EASTINGS.contains(&easting) || !NORTHINGS.contains(&northing) {
        return None;
    }
    let e2 = ECCENTRICITY;
    let mu = northing / SCALE / (AXIS * (1.0 - e2 / 4.0 - 3.0 * e2 * e2 / 64.0));
    let root = (1.0 - e2).sqrt();
    let e1 = (1.0 - root) / (1.0 + root);
    let foot = mu + 1.5 * e1 * libm::sin(2.0 * mu) + 21.0 / 16.0 * e1 * e1 * libm::sin(4.0 * mu);
    let curved = 1.0 - e2 * libm::sin(foot).powi(2);
    let (across, along) = (AXIS / curved.sqrt(), AXIS * (1.0 - e2) / curved.powf(1.5));
    let distance = (easting - MERIDIAN) / (across * SCALE);
    Some((foot - across * libm::tan(foot) / along * distance * distance / 2.0).to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_places() {
        // 40.5 N, 73.5 W, in zone 18.
        let east = latitude_deg([627_103.1, 4_484_334.9]).unwrap();
        assert!((east - 40.5).abs() < 2e-4, "{east}");
        // On the central meridian a quarter of the way to the pole.
        let middle = latitude_deg([500_000.0, 4_982_950.4]).unwrap();
        assert!((middle - 45.0).abs() < 2e-4, "{middle}");
    }

    #[test]
    fn a_frame_of_its_own_is_no_utm() {
        for place in [[0.0, 0.0], [355_000.0, 12.0], [12.0, 4_025_000.0], [f64::NAN, 4e6]] {
            assert_eq!(latitude_deg(place), None);
        }
    }
}
