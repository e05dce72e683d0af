//! Options of `view`, which another program reads.

use std::ffi::OsString;

use clap::Args;

/// Opens the viewer: an asset, or a mesh while its asset is built
///
/// `silmap view --help` lists its options. The viewer is a program of its own, `silmap-viewer`, beside this one or on the PATH.
#[derive(Debug, Args)]
#[command(disable_help_flag = true, disable_version_flag = true)]
pub(crate) struct ViewArgs {
    /// What the viewer is given
    #[arg(
        trailing_var_arg = true,
        allow_hyphen_values = true,
        value_name = "FILE"
    )]
    pub(crate) words: Vec<OsString>,
}
