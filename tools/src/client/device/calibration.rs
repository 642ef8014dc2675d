//! Converts a calibration, and what the board has learnt about its sensor, to readable names and values.

use super::settings::shortest;
use gyronet::store::{Calibration, Learned};
use gyronet::units::SpecificForce;
use serde_json::{Value, json};

/// Temperatures at which the bias is printed, deg C.
const TEMPERATURES: [f32; 6] = [-20.0, 0.0, 20.0, 40.0, 60.0, 80.0];

/// Returns both as JSON, whose names contain the units, with the forward direction, the tilt and their sigmas, deg.
pub fn to_value(
    calibration: &Calibration,
    learned: &Learned,
    forward: Option<[f32; 2]>,
    tilt: Option<[f32; 3]>,
) -> Value {
    let points = TEMPERATURES.into_iter().filter_map(|celsius| {
        let (gyro_bias, sigma) = learned.thermal_bias.at(celsius)?;
        Some(json!({
            "temperature_c": celsius,
            "gyro_bias_rad_per_s": gyro_bias.map(shortest),
            "sigma_rad_per_s": sigma,
        }))
    });
    json!({
        "thermal_bias": points.collect::<Value>(),
        "specific_force_m_per_s2": learned.specific_force.map(|force| force.map(SpecificForce::metre_per_sec2)),
        "forward": forward.map(|[yaw, sigma]| json!({ "yaw_deg": yaw, "sigma_deg": sigma })),
        "tilt": tilt.map(|[roll, pitch, sigma]| json!({ "roll_deg": roll, "pitch_deg": pitch, "sigma_deg": sigma })),
        "unit": calibration.unit.map(|unit| {
            json!({ "gyro_map": unit.gyro_map.elements(), "weights": unit.weights })
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::units::{AngularRate, CentiCelsius};

    #[test]
    fn codes_have_units() {
        let bias = [0.01, -0.002, 0.0].map(|rate| AngularRate::from_rad_per_sec(rate).unwrap());
        let (calibration, mut learned) = (Calibration::NONE, Learned::NOTHING);
        assert_eq!(
            to_value(&calibration, &learned, None, None),
            json!({ "thermal_bias": [], "specific_force_m_per_s2": null, "forward": null, "tilt": null, "unit": null })
        );
        (0..100).for_each(|k| learned.thermal_bias.add(k == 0, CentiCelsius(2_000), bias));
        learned.specific_force = Some([SpecificForce(1 << 20); 3]);
        let value = to_value(&calibration, &learned, Some([1.5, 2.0]), Some([6.5, -1.5, 2.0]));
        assert_eq!(value["forward"], json!({ "yaw_deg": 1.5, "sigma_deg": 2.0 }));
        assert_eq!(value["tilt"], json!({ "roll_deg": 6.5, "pitch_deg": -1.5, "sigma_deg": 2.0 }));
        let point = &value["thermal_bias"][2];
        let [x, y, z] = [0, 1, 2].map(|axis| point["gyro_bias_rad_per_s"][axis].as_f64().unwrap());
        assert!((x - 0.01).abs() < 1e-4 && (y + 0.002).abs() < 1e-4 && z == 0.0, "{value}");
        assert_eq!(point["temperature_c"], 20.0);
        assert_eq!(value["specific_force_m_per_s2"], json!([1.0, 1.0, 1.0]));
    }
}
