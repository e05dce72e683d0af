//! Suppressing a driver's message on standard error.
//!
//! Mesa's Vulkan drivers come with a layer (`VK_LAYER_MESA_device_select`) that asks a Wayland compositor which device is in use. Where
//! there is no session, as on servers and in containers, `XDG_RUNTIME_DIR` is not set, and the layer's library prints "error:
//! XDG_RUNTIME_DIR is invalid or not set in the environment" on standard error, though nothing is wrong. It is quiet when the variable
//! names a folder without a compositor. A program cannot safely change its own environment while it has threads, so that it starts
//! itself again, in the same process, before it has done anything.

use crate::args::Command;

/// A folder that does not exist: no compositor is found there, as none is without the variable.
#[cfg(target_os = "linux")]
const NOWHERE: &str = "/nonexistent";

/// Starts this program again with the variable set, where it is not and the command may open a device. Comes back otherwise, and
/// where that fails: the complaint does no harm.
#[cfg(target_os = "linux")]
pub(crate) fn keep_quiet(command: &Command) {
    use std::env;
    use std::os::unix::process::CommandExt;
    const NAME: &str = "XDG_RUNTIME_DIR";
    if !command.may_open_device() || env::var_os(NAME).is_some_and(|value| !value.is_empty()) {
        return;
    }
    let (Ok(program), mut words) = (env::current_exe(), env::args_os()) else {
        return;
    };
    let mut again = std::process::Command::new(program);
    if let Some(name) = words.next() {
        again.arg0(name);
    }
    // Only returns when it failed.
    let _ = again.args(words).env(NAME, NOWHERE).exec();
}

/// There is nothing to do elsewhere.
#[cfg(not(target_os = "linux"))]
pub(crate) fn keep_quiet(_: &Command) {}
