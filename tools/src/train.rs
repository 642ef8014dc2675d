//! These modules are the Rust part of `gyronet train`; the training itself is a Python program. [`examine`] rejects
//! drives that cannot be trained on. [`roles`] chooses which drives train, validate and are held out. [`history`]
//! reads the history of the training, [`gain`] computes what the weights gain on held-out drives, and [`page`] writes
//! the page.

pub mod examine;
pub mod gain;
pub mod history;
mod page;
pub mod roles;

pub use page::{Training, page};
