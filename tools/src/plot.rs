//! Pictures and pages.

mod curve;
pub mod drive;
pub mod figures;
pub mod page;
