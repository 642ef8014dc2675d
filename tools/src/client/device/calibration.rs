//! A calibration as readable names and values.

use super::settings::{shortest, value};
use gyronet::store::Calibration;
use gyronet::units::AngularRate;
use serde_json::{Value, json};

/// Hundredths of a degree in one.
const CENTI: f64 = 100.0;

/// A calibration by names with units.
///
/// # Errors
/// [`serde_json::Error`], which no calibration gives.
pub fn to_value(calibration: &Calibration) -> serde_json::Result<Value> {
    let rates = |rates: [AngularRate; 3]| rates.map(shortest);
    let points = calibration.temperature_table.iter().map(|point| {
        let temperature = f64::from(point.temperature.0) / CENTI;
        json!({ "temperature_c": temperature, "gyro_bias_rad_per_s": rates(point.gyro_bias) })
    });
    Ok(json!({
        "gyro_bias_rad_per_s": calibration.gyro_bias.map(rates),
        "temperature_table": points.collect::<Value>(),
        "level": value(&calibration.level)?,
        "unit": calibration.unit.map(|unit| {
            json!({ "gyro_map": unit.gyro_map.elements(), "weights": unit.weights })
        }),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyronet::store::Level;
    use gyronet::units::CentiCelsius;

    #[test]
    fn codes_have_units() {
        let bias = [0.01, -0.002, 0.0].map(|rate| AngularRate::from_rad_per_sec(rate).unwrap());
        let mut calibration = Calibration::NONE;
        assert_eq!(
            to_value(&calibration).unwrap(),
            json!({ "gyro_bias_rad_per_s": null, "temperature_table": [], "level": null, "unit": null })
        );
        calibration.add_bias(bias, Some(CentiCelsius(2_150)));
        calibration.level = Some(Level { roll_deg: 1.5, pitch_deg: -0.25 });
        let value = to_value(&calibration).unwrap();
        let [x, y, z] = [0, 1, 2].map(|axis| value["gyro_bias_rad_per_s"][axis].as_f64().unwrap());
        assert!((x - 0.01).abs() < 1e-6 && (y + 0.002).abs() < 1e-6 && z == 0.0, "{value}");
        let point = &value["temperature_table"][0];
        assert_eq!(point["gyro_bias_rad_per_s"], value["gyro_bias_rad_per_s"]);
        assert_eq!(point["temperature_c"], 21.5);
        assert_eq!(value["level"], json!({ "roll_deg": 1.5, "pitch_deg": -0.25 }));
    }
}
