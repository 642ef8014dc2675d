//! The wheel settings that the Python package writes of DBC files, in the style of several makers, are such that
//! `gyronet wheels check` and the board accept them, with ranges, codes, validity and direction where the file tells them.

use gyronet::can::wheel::WheelSignal;
use gyronet_host_tests::recordings::workspace;
use gyronet_host_tests::require;
use gyronet_tools::wheels::WheelFile;
use std::process::Command;

const TOYOTA: &str = "BO_ 170 W: 8 E\n SG_ RL : 6|15@0+ (0.01,-67.67) [0|250] \"km/h\" E\n SG_ RL_FAULT : 7|1@0+ (1,0) [0|1] \"\" E
 SG_ RR : 22|15@0+ (0.01,-67.67) [0|250] \"km/h\" E\n SG_ RR_FAULT : 23|1@0+ (1,0) [0|1] \"\" E\n";
const VW: &str = "BO_ 178 W: 8 E\n SG_ RL : 0|16@1+ (0.0075,0) [0|491.49] \"Unit_KiloMeterPerHour\" E
 SG_ RR : 16|16@1+ (0.0075,0) [0|491.49] \"Unit_KiloMeterPerHour\" E
VAL_ 178 RL 65533 \"Unterspannung\" 65534 \"Init\" 65535 \"Fehler\" ;\n";
const HYUNDAI: &str = "BO_ 160 W: 8 E\n SG_ RL : 0|14@1+ (0.03125,0) [0|511.9] \"km^h\" E\n SG_ RL_DIR : 14|2@1+ (1,0) [0|3] \"\" E
 SG_ RR : 16|14@1+ (0.03125,0) [0|511.9] \"km^h\" E\nVAL_ 160 RL_DIR 0 \"undefined\" 1 \"forward\" 2 \"backward\" ;\n";
/// An identifier of 29 bits without bit 31, and a range beyond the board's own.
const WIDE: &str = "BO_ 274726976 W: 8 E\n SG_ RL : 0|16@1- (0.01,0) [-327|327] \"m/s\" E\n SG_ RR : 16|16@1- (0.01,0) [-327|327] \"m/s\" E\n";

fn rear_left(python: &str, dbc: &str) -> WheelSignal {
    let folder = tempfile::tempdir().unwrap();
    let text = format!("VERSION \"\"\nNS_ :\nBS_:\nBU_: E\n{dbc}");
    std::fs::write(folder.path().join("car.dbc"), text).unwrap();
    let arguments = "-B -m gyronet wheels from-dbc car.dbc --rear-left RL --rear-right RR --quiet";
    let output = Command::new(python)
        .args(arguments.split(' '))
        .current_dir(folder.path())
        .env("PYTHONPATH", workspace().join("tools/python"))
        .output()
        .unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let settings = WheelFile::parse(&text).and_then(|file| file.settings());
    settings.unwrap_or_else(|error| panic!("{error}\n{text}")).signals[2].expect("a rear left wheel")
}

#[test]
fn the_board_accepts_what_from_dbc_writes() {
    let Some(python) = require::python(&["cantools"]) else { return };
    let [toyota, vw, hyundai, wide] = [TOYOTA, VW, HYUNDAI, WIDE].map(|dbc| rear_left(&python, dbc));
    let fault = toyota.valid_when.unwrap();
    assert_eq!((fault.field.start(), fault.value, toyota.field.bits()), (7, 0, 15));
    assert_eq!(vw.invalid, [65_535, 65_534, 65_533].map(Some));
    assert_eq!((hyundai.reverse_when.unwrap().value, hyundai.invalid), (2, [None; 3]));
    assert!(wide.field.is_signed() && wide.range.is_none());
    // 0.036 km/h: 65536 / 3.6 codes per km/h, and 16 bits of fraction.
    assert_eq!(wide.factor_q16, (0.01 * 65_536.0 * 65_536.0_f64).round() as i32);
    for signal in [toyota, vw, hyundai] {
        let [least, most] = signal.range.unwrap();
        // A wheel that stands is never out of range by a rounding of the board's.
        assert!((-400..-1).contains(&least.0) && most.0 > 150 * 65_536 / 4, "{least:?} {most:?}");
    }
}
