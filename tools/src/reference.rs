//! Tables of the library for the pages: settings, data identifiers, troubles and states.

pub mod identifiers;
mod settings;
mod states;
mod table;

pub use identifiers::identifiers;
pub use settings::settings;
pub use states::states;
pub use table::Table;

use gyronet::uds::dtc::TROUBLES;

pub fn troubles() -> Table {
    let mut table = Table::new(&["code", "bytes", "trouble", "check"]);
    for trouble in &TROUBLES {
        let (code, bytes) = (trouble.display().to_string(), format!("{:06X}", trouble.code));
        table.row([&code, &bytes, trouble.name, trouble.check]);
    }
    table
}
