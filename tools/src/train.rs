//! These modules are what `gyronet train` does around the Python that trains: [`examine`] refuses drives that cannot
//! carry a training, [`roles`] chooses which drive trains, validates and is held out, [`history`] reads what the training
//! reported, [`gain`] says what its weights gain on drives held out, and [`page`] reports all of it.

pub mod examine;
pub mod gain;
pub mod history;
mod page;
pub mod roles;

pub use page::{Training, page};
