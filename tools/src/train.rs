//! These modules are the Rust part of `gyronet train`; the training itself is a Python program. [`examine`] rejects
//! drives that cannot be trained on. [`roles`] chooses which drives train, validate and are held out.

pub mod examine;
pub mod roles;
