//! These modules draw pictures and pages. [`svg`] draws figures for a file, and [`page`] writes HTML with charts that
//! can be zoomed. They do not depend on the data; each tool draws its own pictures with them.

pub mod curve;
pub mod page;
pub mod svg;
