//! Exit codes and the final error message.
//!
//! | code | class | what to do |
//! |---|---|---|
//! | 0 | done | |
//! | 1 | [`ExitClass::BadInput`] | never try again: the input or an option is at fault |
//! | 2 | [`ExitClass::Usage`] | mend the command line |
//! | 3 | [`ExitClass::NoAdapter`] | try where there is a graphics adapter |
//! | 4 | [`ExitClass::Resources`] | try again, elsewhere: memory, disk, threads, files, time, a lost device |
//! | 70 | [`ExitClass::Fault`] | report it |
//! | 130 | [`ExitClass::Interrupted`] | the user asked to stop |
//!
//! Memory that the system refuses to a small allocation ends a program in Rust by the signal SIGABRT, and the kernel's own hand by
//! SIGKILL: no safe code can catch either. The caller of this command takes both for [`ExitClass::Resources`]. What can be large by
//! the input alone, the bytes of a file, is asked for in a way that may fail, and bounded before.

use std::any::Any;
use std::error::Error;
use std::io;
use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use silmap_geometry::Interrupted;
use silmap_gpu::GpuError;
use silmap_measure::MeasureError;
use silmap_measure::evaluate::EvaluateError;
use silmap_mesh_io::{MeshFault, MeshIoError};
use silmap_preprocess::capture::CaptureError;
use silmap_preprocess::pipeline::BuildError;
use silmap_study::RenderError;
use thiserror::Error;

use crate::{interrupt, output};

/// There is nothing to draw with.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct NoAdapter(pub(crate) GpuError);

/// Not everything was built; each model's own line says why.
#[derive(Debug, Error)]
#[error("{sentence}")]
pub(crate) struct NotAllBuilt {
    pub(crate) sentence: String,
    /// What an engine should do with the list.
    pub(crate) class: ExitClass,
}

/// How a command ended when it did not do what it was asked. The numbers are the exit codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum ExitClass {
    /// The input, or an option's value, is at fault.
    BadInput = 1,
    /// Options that do not exist or do not go together. The reader of options ends the program itself with this code.
    Usage = 2,
    /// There is no graphics adapter.
    NoAdapter = 3,
    /// Out of memory, disk, threads, open files or time: worth trying elsewhere.
    Resources = 4,
    /// A defect of this program.
    Fault = 70,
    /// The user asked to stop: the shell's convention for SIGINT.
    Interrupted = 130,
}

impl ExitClass {
    /// The exit code.
    pub(crate) fn code(self) -> u8 {
        self as u8
    }

    /// What an error that came up to a command means.
    pub(crate) fn of(error: &anyhow::Error) -> Self {
        error.chain().find_map(class_of).unwrap_or(Self::BadInput)
    }
}

/// A limit that this run was given, and that another run elsewhere need not have: time, memory.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
#[allow(
    dead_code,
    reason = "for commands with limits of their own; the class is decided here and nowhere else"
)]
pub(crate) struct OverLimit(pub(crate) String);

/// What one error in a chain says about its class, if anything.
fn class_of(error: &(dyn Error + 'static)) -> Option<ExitClass> {
    let error = (error.downcast_ref::<MeasureError>()).map_or(error, MeasureError::cause);
    if error.is::<NoAdapter>() {
        return Some(ExitClass::NoAdapter);
    }
    if error.is::<Interrupted>() {
        return Some(ExitClass::Interrupted);
    }
    if let Some(NotAllBuilt { class, .. }) = error.downcast_ref() {
        return Some(*class);
    }
    if error.is::<OverLimit>() {
        return Some(ExitClass::Resources);
    }
    if let Some(gpu) = gpu_error(error) {
        return Some(class_of_gpu(gpu));
    }
    let source = match error.downcast_ref() {
        Some(MeshIoError {
            fault: MeshFault::Unreadable { source } | MeshFault::Unwritable { source },
            ..
        }) => Some(source),
        _ => error.downcast_ref::<io::Error>(),
    };
    source
        .filter(|e| is_of_resources(e))
        .map(|_| ExitClass::Resources)
}

/// The device's error in one of those that hand it on as their own.
fn gpu_error<'e>(error: &'e (dyn Error + 'static)) -> Option<&'e GpuError> {
    let of_capture = |error: &'e CaptureError| match error {
        CaptureError::Gpu(gpu) => Some(gpu),
        _ => None,
    };
    if let Some(BuildError::Capture(capture)) = error.downcast_ref() {
        return of_capture(capture);
    }
    if let Some(EvaluateError::Capture(capture)) = error.downcast_ref() {
        return of_capture(capture);
    }
    if let Some(capture) = error.downcast_ref() {
        return of_capture(capture);
    }
    match error.downcast_ref() {
        Some(RenderError::Gpu(gpu)) => Some(gpu),
        _ => error.downcast_ref(),
    }
}

fn class_of_gpu(error: &GpuError) -> ExitClass {
    match error {
        GpuError::NoAdapter | GpuError::NoSuchAdapter { .. } | GpuError::NoDevice { .. } => {
            ExitClass::NoAdapter
        }
        GpuError::DeviceLost { .. } | GpuError::OutOfMemory { .. } | GpuError::Timeout { .. } => {
            ExitClass::Resources
        }
        // More pixels than go through the adapter's largest buffer.
        GpuError::NotReadable { .. } => ExitClass::BadInput,
        // The device refused what this program should not have asked for.
        _ => ExitClass::Fault,
    }
}

/// Whether the system had not enough of something, rather than no such file or no permission.
fn is_of_resources(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    /// Too many open files, in the system and in the process; a thread or process that cannot be started.
    #[cfg(unix)]
    const EXHAUSTED: [i32; 3] = [23, 24, 11];
    #[cfg(not(unix))]
    const EXHAUSTED: [i32; 0] = [];
    let is_answer_of_system = error.raw_os_error().is_some();
    match error.kind() {
        Kind::StorageFull
        | Kind::QuotaExceeded
        | Kind::OutOfMemory
        | Kind::TimedOut
        | Kind::StaleNetworkFileHandle => true,
        // The system's limit for files that are written; an input over our own limit is as large everywhere.
        Kind::FileTooLarge => is_answer_of_system,
        _ => (error.raw_os_error()).is_some_and(|code| EXHAUSTED.contains(&code)),
    }
}

/// What panics said, and where: this belongs in the sentence at the end, not before it. Some are caught on the way and mean nothing.
static PANICS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// So many messages are kept; of a panic in every thread the first ones suffice.
const MOST_PANICS: usize = 64;

/// Makes panics say nothing by themselves.
pub(crate) fn keep_panics_quiet() {
    panic::set_hook(Box::new(|info| {
        let place = info.location().map_or_else(String::new, |at| {
            format!(" ({}:{})", name_of_source(at.file()), at.line())
        });
        let message = message_of(info.payload());
        let mut panics = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
        if panics.len() < MOST_PANICS {
            panics.push(format!("{message}{place}"));
        }
    }));
}

/// Runs a command and says in one sentence how it ended, if not well.
pub(crate) fn run(command: impl FnOnce() -> anyhow::Result<()>) -> ExitCode {
    // Whatever a panic leaves half-done is not looked at again.
    let ended = panic::catch_unwind(AssertUnwindSafe(command));
    let class = match ended {
        Ok(Ok(())) => return ExitCode::SUCCESS,
        Ok(Err(_)) if interrupt::is_requested() => ExitClass::Interrupted,
        Ok(Err(error)) => {
            let class = ExitClass::of(&error);
            output::say(&format!("silmap: error: {error:#}"));
            return ExitCode::from(class.code());
        }
        Err(payload) => {
            output::say(&format!(
                "silmap: error: {}",
                fault_sentence(payload.as_ref())
            ));
            ExitClass::Fault
        }
    };
    if class == ExitClass::Interrupted {
        output::say("silmap: interrupted");
    }
    ExitCode::from(class.code())
}

/// One sentence that asks to report a panic, with all that a report needs.
fn fault_sentence(payload: &(dyn Any + Send)) -> String {
    let message = message_of(payload);
    let panics = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
    let mut with_place = panics.iter().filter(|told| told.starts_with(&message));
    let what = with_place.next().unwrap_or(&message);
    let command = std::env::args_os()
        .map(|word| word.to_string_lossy().into_owned())
        .collect::<Vec<_>>()
        .join(" ");
    format!(
        "this is a fault of silmap {} and not of its input, please report it with the files: \"{}\" in `{command}`",
        env!("CARGO_PKG_VERSION"),
        what.replace('\n', " ")
    )
}

fn message_of(payload: &dyn Any) -> String {
    let text = payload.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_else(|| "no message".to_owned())
}

/// A source file's path from its crate on.
fn name_of_source(path: &str) -> &str {
    match path.split_once("/registry/src/") {
        Some((_, rest)) => rest.split_once('/').map_or(rest, |(_, rest)| rest),
        None => path,
    }
}

#[cfg(test)]
mod tests {
    use anyhow::Context;

    use super::*;

    fn class(error: impl Error + Send + Sync + 'static) -> ExitClass {
        let error: Result<(), _> = Err(error);
        ExitClass::of(&error.context("file.ply").unwrap_err())
    }

    #[test]
    fn full_disks_and_lost_devices_are_no_fault_of_the_input() {
        for kind in [io::ErrorKind::StorageFull, io::ErrorKind::OutOfMemory] {
            assert_eq!(class(io::Error::from(kind)), ExitClass::Resources);
            let source = io::Error::from(kind);
            let error = MeshIoError {
                path: "a".into(),
                fault: MeshFault::Unwritable { source },
            };
            assert_eq!(class(error), ExitClass::Resources);
        }
        let lost = || GpuError::DeviceLost {
            reason: String::new(),
        };
        assert_eq!(class(lost()), ExitClass::Resources);
        assert_eq!(class(RenderError::Gpu(lost())), ExitClass::Resources);
        let nested = BuildError::Capture(CaptureError::Gpu(lost()));
        assert_eq!(class(nested), ExitClass::Resources);
        let nested = MeasureError::Render(RenderError::Gpu(lost()));
        assert_eq!(class(nested), ExitClass::Resources);
        assert_eq!(class(NoAdapter(lost())), ExitClass::NoAdapter);
        assert_eq!(class(OverLimit(String::new())), ExitClass::Resources);
    }

    #[test]
    fn what_is_not_there_is_a_fault_of_the_input() {
        for kind in [io::ErrorKind::NotFound, io::ErrorKind::PermissionDenied] {
            assert_eq!(class(io::Error::from(kind)), ExitClass::BadInput);
        }
        // An input over our own limit is over it everywhere.
        let ours = io::Error::new(io::ErrorKind::FileTooLarge, "too large");
        assert_eq!(class(ours), ExitClass::BadInput);
        assert_eq!(
            ExitClass::of(&anyhow::anyhow!("a sentence")),
            ExitClass::BadInput
        );
    }

    #[test]
    fn a_panic_is_a_sentence_and_code_70() {
        let ended = run(|| panic!("two and two\nare five"));
        assert_eq!(
            format!("{ended:?}"),
            format!("{:?}", ExitCode::from(ExitClass::Fault.code()))
        );
        let said = fault_sentence(&"two and two\nare five");
        assert!(said.contains(env!("CARGO_PKG_VERSION")), "{said}");
        assert_eq!(said.lines().count(), 1);
        let place = "/home/a/.cargo/registry/src/index-1/image-0.25/src/png.rs";
        assert_eq!(name_of_source(place), "image-0.25/src/png.rs");
    }
}
