//! These modules make pictures and pages: [`svg`] draws figures for a file, [`page`] writes HTML with charts that can
//! be zoomed. Neither depends on what it shows; each product draws its own pictures with them.

pub mod curve;
pub mod page;
pub mod svg;
