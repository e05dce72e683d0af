//! The viewer's memory, in a process of its own: other tests' is not counted.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use common::{Files, Window};

#[test]
fn a_hundred_assets_one_after_the_other_leave_nothing_behind() {
    let mut window = Window::open("organic.glb", None, "");
    let path = Files::get().path("organic.glb");
    let mut before = 0;
    for k in 0..100 {
        window.drop_file(path.clone());
        assert!(window.app().message().is_none());
        if k == 20 {
            let _ = window.picture();
            before = resident_bytes();
        }
    }
    let _ = window.picture();
    let grown = resident_bytes().saturating_sub(before);
    // Twenty assets had been dropped by then: what grows, grows by their share.
    assert!(grown < 48 << 20, "{} MiB more after 79 assets", grown >> 20);
}

/// Memory that this process has, where the system says so.
fn resident_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().nth(1)?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1024
}
