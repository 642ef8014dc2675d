//! Reads MCAP files with ROS 1 or ROS 2 messages.

use super::input::Input;
use super::log::Log;
use super::ros_message::{self, Encoding};
use super::zstd::Zstd;
use mcap::io::MessageReader;
use mcap::sans_io::LinearReaderOptions;

/// First bytes of an MCAP file.
pub const MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Largest record, bytes; recorders close a chunk after 1 to 4 MiB.
const MAX_RECORD: usize = 256 << 20;

/// Reads a file, including its magic. Reading ends at the first damage, which is counted.
pub fn read(input: &mut Input<'_>, log: &mut Log) {
    let options = LinearReaderOptions::default().with_record_length_limit(MAX_RECORD);
    let mut reader = MessageReader::new_with_options(input, options);
    if let Err(error) = reader.add_decompressor(Zstd::new()) {
        return log.drop(error.to_string());
    }
    for message in reader {
        let message = match message {
            Ok(message) => message,
            Err(error) => return log.drop(format!("corrupt from here on: {error}")),
        };
        let encoding = match message.channel.message_encoding.as_str() {
            "ros1" => Encoding::Ros1,
            "cdr" => Encoding::Cdr,
            other => {
                log.pass_over(&format!("encoding {other:?}"));
                continue;
            }
        };
        let kind = message.channel.schema.as_ref().map_or("no schema", |schema| &schema.name);
        let recorded = 1e-9 * message.log_time as f64;
        ros_message::add(log, &message.channel.topic, kind, encoding, &message.data, recorded);
    }
}
