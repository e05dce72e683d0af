//! The `silmap` command.
fn main() {}
