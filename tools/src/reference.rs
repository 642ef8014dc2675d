//! Tables of the library for the pages: settings, data identifiers, troubles and states.

mod settings;
mod table;

pub use settings::settings;
pub use table::Table;

use gyronet::health::states::STATES;
use gyronet::uds::data::{Access, IDENTIFIERS};
use gyronet::uds::dtc::TROUBLES;

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

pub fn troubles() -> Table {
    let mut table = Table::new(&["code", "bytes", "trouble", "check"]);
    for trouble in &TROUBLES {
        let (code, bytes) = (trouble.display().to_string(), format!("{:06X}", trouble.code));
        table.row([&code, &bytes, trouble.name, trouble.check]);
    }
    table
}

pub fn states() -> Table {
    let mut table =
        Table::new(&["state", "status in data 0104", "when", "yaw rate on CAN", "until", "counter"]);
    for state in &STATES {
        let number = state.status.map(|status| (status as u8).to_string()).unwrap_or_default();
        table.row([state.name, &number, state.entered, state.rate, state.left, state.counter]);
    }
    table
}
