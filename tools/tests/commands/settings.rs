//! The settings of `gyronet device set`: nothing lost on the way through text.

use super::{gyronet, scratch, text};
use gyronet::store::{Configuration, Record};
use gyronet_tools::client::device::settings::{assign, from_value, to_value};

#[test]
fn values_are_set_by_name() {
    let mut value = to_value(&Configuration::DEFAULT).unwrap();
    for setting in ["imu=Icm42688", "latitude_deg=48.1", "compensate.model=false", "can.yaw.ids.2=419"] {
        assign(&mut value, setting).unwrap();
    }
    let configuration = from_value(value.clone()).unwrap();
    configuration.check().unwrap();
    assert!(!configuration.compensate.model);
    assert_eq!(configuration.can.yaw.unwrap().ids, [416, 417, 419]);
    let refused = |setting: &str| {
        let mut value = value.clone();
        let assigned = assign(&mut value, setting);
        assigned.and_then(|()| from_value(value)).unwrap_err().to_string()
    };
    assert_eq!(refused("imu"), "imu: not NAME=VALUE");
    assert!(refused("latitude=1").contains("no such setting"));
    assert!(refused("can.vdc2.source=128").contains("retired, since VDC2"));
    assert!(refused("can.yaw.e2e.P05.data_ids=[1,2,3]").contains("profile P01"));
    assert!(refused("slcan_inputs=true").contains("come over CAN"));
    for retired in ["fog_lane.fognet=Simulated", "fog_serial=1"] {
        assert!(refused(retired).contains("retired, because FoGNet"), "{}", refused(retired));
    }
    for (renamed, name) in
        [("fog_lane.tilt_deg=3", "fog_gyro"), ("compensate.mode.Overlap.stride=5", "compensate.stride")]
    {
        assert!(refused(renamed).ends_with(&format!(": its name is {name} now")), "{}", refused(renamed));
    }
    // A configuration that was written before.
    let mut old = value.clone();
    old["fog_lane"] = serde_json::json!({ "tilt_deg": 0.0, "fognet": "Simulated" });
    assert!(from_value(old).unwrap_err().to_string().starts_with("fog_lane.fognet: retired"));
    assert!(refused("compensate.max_mean=0.1").contains("retired: a correction is limited"));
    assert!(refused("imu=None").starts_with("no configuration: unknown variant"));
}

#[test]
fn wheel_frames_with_an_identifier_of_the_board_are_refused() {
    let file = scratch("wheels-check").join("wheels.toml");
    for (id, is_free) in [("0x1A1", false), ("0x7E8", false), ("0x1A6", false), ("0x1A7", true)] {
        let signal = |wheel: &str, bit: u8| {
            format!(
                "{{ wheel = '{wheel}', start_bit = {bit}, bits = 16, order = 'intel', factor_kmh = 0.01, offset_kmh = 0 }}"
            )
        };
        let signals = [signal("rear-left", 0), signal("rear-right", 16)].join(", ");
        std::fs::write(&file, format!("[[frame]]\nid = {id}\nsignal = [{signals}]\n")).unwrap();
        let output = gyronet(&["wheels", "check", file.to_str().unwrap()]);
        let error = text(&output.stderr);
        assert!(
            output.status.success() == is_free && error.contains("one of our own") != is_free,
            "{id}: {error}"
        );
    }
}
