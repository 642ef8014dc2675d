//! HTML pages with charts that can be zoomed. They do not depend on the data; each tool draws its own charts with them.

pub mod curve;
pub mod page;
