//! The data identifiers of diagnosis (ISO 14229-1 C.1).

use super::Table;

#[derive(Debug)]
pub struct Identifier {
    pub id: u16,
    /// Name, as in `tools/gyronet_uds.yaml`.
    pub name: &'static str,
    /// Length of each value in bytes, or its encoding.
    pub bytes: &'static str,
    pub content: &'static str,
    pub access: Access,
}

/// The services that accept an identifier; writing needs the extended session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    Read,
    ReadWrite,
    Write,
}

const fn read_only(id: u16, name: &'static str, bytes: &'static str, content: &'static str) -> Identifier {
    Identifier { id, name, bytes, content, access: Access::Read }
}

const fn writable(id: u16, name: &'static str, bytes: &'static str, content: &'static str) -> Identifier {
    Identifier { access: Access::ReadWrite, ..read_only(id, name, bytes, content) }
}

const fn write_only(id: u16, name: &'static str, bytes: &'static str, content: &'static str) -> Identifier {
    Identifier { access: Access::Write, ..read_only(id, name, bytes, content) }
}

pub const IDENTIFIERS: [Identifier; 28] = [
    read_only(0xF186, "session", "1", "session: 1 default, 2 programming, 3 extended"),
    read_only(0xF189, "firmware_version", "1, 1, 1", "version of the firmware"),
    read_only(0xF18C, "serial_number", "text", "serial number of the chip, 24 hexadecimal digits"),
    read_only(0xF197, "system_name", "text", "name of the system, \"gyronet\""),
    writable(0x0100, "configuration", "1, then postcard", "layout version, then the configuration"),
    writable(0x0101, "wheels", "postcard", "settings of the wheel frames"),
    read_only(0x0102, "calibration", "1, then postcard", "layout version, then the calibration"),
    read_only(
        0x0103,
        "weights",
        "1, 4",
        "weights of GyroNet: 0 none, 1 built in, 2 slot A, 3 slot B; CRC-32 of the weights",
    ),
    read_only(
        0x0104,
        "state",
        "1, 1",
        "status of the yaw rate (`gyronet reference states`), fault bits as on CAN",
    ),
    read_only(0x0105, "pipeline_counters", "4 each", "counters of the pipeline"),
    read_only(
        0x0106,
        "input_counters",
        "4 each",
        "counters of the sensor monitor, of the inputs and of the lines",
    ),
    read_only(0x0107, "diagnosis_errors", "4 each", "failed diagnostic transfers"),
    read_only(0x0108, "tick", "4", "sensor time since the start, 10 ms steps"),
    read_only(0x0109, "fog_counters", "4 each", "counters of the fibre-optic gyro"),
    read_only(0x010A, "info", "postcard", "versions, part, reset, clock, stored data, weights and status"),
    read_only(0x010B, "last_refusal", "postcard", "the reason why the last request was refused, if it was"),
    write_only(
        0x010D,
        "unit_map",
        "postcard",
        "gain and misalignment of this unit's gyro, or none; 0102 contains it",
    ),
    write_only(0x0110, "public_key", "32", "public key that authorises writing, zeros for none"),
    read_only(
        0x0111,
        "access",
        "1, 4, 1, 4",
        "0 open, 1 locked, 2 unlocked; newest signature counter; wrong answers; first bytes of the key",
    ),
    read_only(0x0112, "fog_messages", "4", "number of messages of the fibre-optic gyro since the start"),
    read_only(
        0x0113,
        "access_refusals",
        "4 each",
        "requests refused for lack of access: locked, unsigned, wrong answers, wrong signatures, replayed",
    ),
    read_only(0x0115, "learned", "postcard", "what the board has learnt about the sensor"),
    read_only(
        0x0116,
        "forward",
        "1, 2, 2",
        "forward direction: 0 unknown, 1 within 10 deg, 2 within 3 deg; its angle to the left of the configured x axis, its sigma, both 1/100 deg",
    ),
    read_only(
        0x0117,
        "wheel_speeds",
        "2, 2, 2, 2, 1, 1",
        "speed of each wheel, 0.01 m/s, 7FFF for none; the wheels: 0 unknown, 1 moving, 2 standing; 1 if the vehicle is proven to stand",
    ),
    read_only(
        0x0118,
        "level",
        "1, 2, 2, 2",
        "tilt of the sensor beyond the configured mounting, by standstills and turns: 0 unknown, 1 coarse, 2 within 3 deg; roll, pitch, their sigma, all three 1/100 deg",
    ),
    read_only(
        0x0119,
        "course",
        "1, 2, 2, 4, 4, 4, 1",
        "gain of the yaw gyro by courses: 0 unknown, 1 coarse, 2 fine, 3 they contradict the gyro; gain and sigma, 1e-5; courses used, refused, and starts of the heading after contradictions; the newest course: 0 used, 1 far from the gyro's heading, 2 the same in a turn, 3 the vehicle stands, 4 reckoned by the receiver's own sensors",
    ),
    writable(
        0x011A,
        "firmware",
        "1, 1",
        "slot of the firmware that runs: 0 A, 1 B, FF none; 0 not updatable, 1 confirmed, 2 on trial, 3 the update was rolled back, 4 it is damaged; CRC-32 of the image. Written: the head of an update",
    ),
    read_only(
        0x011B,
        "contradiction",
        "4, 2, 2, 2, 2, 2",
        "seconds in which wheels, accelerometer or another gyro contradicted a gyro or the wheels; of the newest: inertial and fibre-optic rate, 0.01 deg/s, lateral force to the left, 0.01 m/s^2, speed, right wheel less left, 0.01 m/s; 7FFF for none",
    ),
];

pub fn identifiers() -> Table {
    let mut table = Table::new(&["identifier", "name", "bytes", "content", "services"]);
    for of in &IDENTIFIERS {
        let services = match of.access {
            Access::Read => "0x22",
            Access::ReadWrite => "0x22, 0x2E",
            Access::Write => "0x2E",
        };
        table.row([&format!("{:04X}", of.id), of.name, of.bytes, of.content, services]);
    }
    table
}
