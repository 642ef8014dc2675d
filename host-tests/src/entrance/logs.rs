//! Reads logs of other tools: for any bytes, values must be finite, in rising order of time, and bounded in number.

use super::Seed;
use gyronet_tools::drive::vehicle::Columns;
use gyronet_tools::import::can::Bus;
use gyronet_tools::import::read_bytes;
use gyronet_tools::import::value::Value;

/// Signals of every kind that a frame can hold.
const DBC: &str = r#"VERSION ""
NS_ :
BS_:
BU_: X
BO_ 291 Kinds: 8 X
 SG_ Intel : 3|17@1- (0.5,-3) [0|0] "km/h" X
 SG_ Motorola : 39|24@0+ (0.01,0) [0|0] "" X
 SG_ Last : 56|8@1+ (1,0) [0|0] "" X
"#;

/// Reads any bytes as a log of the format that their beginning indicates.
pub fn file(data: &[u8]) {
    let bus = Bus::parse("a.dbc", DBC).expect("a DBC file");
    let Ok(log) = read_bytes("log", data, Some(&bus), &Columns::new()) else { return };
    let mut samples = 0;
    for channel in log.channels.values() {
        samples += channel.len();
        let mut last = f64::NEG_INFINITY;
        for (seconds, value) in channel {
            assert!(last < seconds, "time does not increase");
            last = seconds;
            let finite = match value {
                Value::Imu(force, rate) => force.iter().chain(&rate).all(|value| value.is_finite()),
                Value::Odometry(speed, rate) => speed.is_finite() && rate.is_finite(),
                Value::Position(fix) => fix.degrees.iter().all(|degrees| degrees.is_finite()),
                Value::Number(number) => number.is_finite(),
            };
            assert!(finite && seconds.is_finite());
        }
    }
    // No value is invented: each takes at least a byte of the file, or of a compressed chunk.
    assert!(samples <= 4_096 * (data.len() + 1), "{samples} of {} bytes", data.len());
}

/// Returns one small file of each format.
pub fn seeds() -> Vec<Seed> {
    let text = |text: &str| text.as_bytes().to_vec();
    vec![
        ("bag", bag()),
        ("blf", blf()),
        ("mcap", mcap_of_one()),
        ("ulog", ulog()),
        (
            "candump",
            text(
                "(1.234567) can0 123#0102030405060708\n(1.3) can0 123##1AABB\n(1.4)  can0  123   [2]  01 02\n",
            ),
        ),
        (
            "asc",
            text(
                "date Sam Sep 30 15:06:13.191 2017\nbase hex  timestamps absolute\n 2.5 1  123  Rx d 8 01 02 03 04 05 06 07 08\n 2.6 CANFD 1 Rx 123 1 0 8 8 01 02 03 04 05 06 07 08 0 0\n",
            ),
        ),
        (
            "trc",
            text(
                ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n 1 17.4 DT 1 0123 Rx - 8 01 02 03 04 05 06 07 08\n",
            ),
        ),
        (
            "csv",
            text(
                "t_s,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z,latitude,longitude\n0.00,0,0,9.8,0,0,0,50,8\n0.01,0,0,9.8,0,0,0,50,8\n",
            ),
        ),
        (
            "xsens",
            text(
                "// Update Rate: 100.0Hz\nPacketCounter\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\n65535\t0\t0\t9.8\t0\t0\t0\n0\t0\t0\t9.8\t0\t0\t0\n",
            ),
        ),
    ]
}

fn block(bytes: &[u8]) -> Vec<u8> {
    [&(bytes.len() as u32).to_le_bytes(), bytes].concat()
}

fn fields(fields: &[(&str, &[u8])]) -> Vec<u8> {
    let field = |(name, value): &(&str, &[u8])| block(&[name.as_bytes(), b"=", value].concat());
    block(&fields.iter().flat_map(field).collect::<Vec<u8>>())
}

/// Returns an IMU message of ROS 1, or one of ROS 2 with a CDR header.
fn imu(ros_2: bool) -> Vec<u8> {
    let mut bytes = if ros_2 { vec![0, 1, 0, 0] } else { vec![1, 0, 0, 0] };
    bytes.extend([5, 0, 0, 0, 0, 0, 0, 0]);
    // An empty frame name; in CDR with its terminating zero, and padding to align what follows.
    bytes.extend(if ros_2 { vec![1, 0, 0, 0, 0, 0, 0, 0] } else { vec![0; 4] });
    bytes.extend((0..37).flat_map(|k| (0.1 * f64::from(k)).to_le_bytes()));
    bytes
}

fn bag() -> Vec<u8> {
    let connection = [
        fields(&[("op", &[7]), ("conn", &[0; 4]), ("topic", b"/imu")]),
        fields(&[("topic", b"/imu"), ("type", b"sensor_msgs/Imu")]),
    ]
    .concat();
    let message =
        [fields(&[("op", &[2]), ("conn", &[0; 4]), ("time", &[1; 8])]), block(&imu(false))].concat();
    let chunk = [connection, message].concat();
    let head =
        fields(&[("op", &[5]), ("compression", b"none"), ("size", &(chunk.len() as u32).to_le_bytes())]);
    [b"#ROSBAG V2.0\n".to_vec(), fields(&[("op", &[3])]), block(b" "), head, block(&chunk)].concat()
}

fn blf() -> Vec<u8> {
    let mut bytes = b"LOGG".to_vec();
    bytes.extend(144u32.to_le_bytes());
    bytes.resize(144, 0);
    let mut object = b"LOBJ".to_vec();
    object.extend([32, 0, 1, 0, 48, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 64, 0, 0, 0, 0, 0, 0, 0]);
    object.extend([1, 0, 0, 8, 0x23, 1, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
    bytes.extend(b"LOBJ");
    bytes.extend([16, 0, 1, 0, 80, 0, 0, 0, 10, 0, 0, 0]);
    bytes.extend([0; 16]);
    bytes.extend(object);
    bytes
}

/// Returns an MCAP file without chunks: header, schema, channel, message.
fn mcap_of_one() -> Vec<u8> {
    let record = |op: u8, bytes: &[u8]| [&[op], &(bytes.len() as u64).to_le_bytes()[..], bytes].concat();
    let schema = [&[1, 0][..], &block(b"sensor_msgs/msg/Imu"), &block(b"ros2msg"), &[0; 4]].concat();
    let channel = [&[1, 0, 1, 0][..], &block(b"/imu"), &block(b"cdr"), &[0; 4]].concat();
    let message = [&[1, 0][..], &[0; 4], &[1; 16], &imu(true)].concat();
    let magic = b"\x89MCAP0\r\n".to_vec();
    [magic, record(1, &[0; 8]), record(3, &schema), record(4, &channel), record(5, &message)].concat()
}

fn ulog() -> Vec<u8> {
    let message = |kind: u8, bytes: &[u8]| [&(bytes.len() as u16).to_le_bytes(), &[kind][..], bytes].concat();
    let format = b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;";
    let data: Vec<u8> = [&[0, 0][..], &1_000_000u64.to_le_bytes()].concat();
    let data: Vec<u8> = data.into_iter().chain((0..6u8).flat_map(|k| f32::from(k).to_le_bytes())).collect();
    let head = [b"ULog\x01\x12\x35\x01".to_vec(), vec![0; 8]].concat();
    let subscribe = [&[0, 0, 0][..], b"sensor_combined"].concat();
    [head, message(b'B', &[0; 40]), message(b'F', format), message(b'A', &subscribe), message(b'D', &data)]
        .concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_seed_holds_a_value() {
        let bus = Bus::parse("a.dbc", DBC).unwrap();
        for (name, bytes) in seeds() {
            let log = read_bytes(name, &bytes, Some(&bus), &Columns::new()).unwrap();
            assert!(!log.channels.is_empty(), "{name}: {log:?}");
        }
    }
}
