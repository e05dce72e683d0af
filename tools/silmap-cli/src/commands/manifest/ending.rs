//! Classification of a child process's end: done, bad input, out of resources, or a fault of silmap.

use std::process::ExitStatus;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::entry::{Entry, one_line};
use crate::exit::ExitClass;

/// A process that held this share of its limit when a signal ended it had run out of memory.
const NEAR_LIMIT: f64 = 0.8;
/// The signal that the system sends when memory is short.
const SIGKILL: i32 = 9;
/// What Rust's allocator says last.
const NO_MEMORY: &str = "memory allocation of ";

/// Why a process was stopped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stopped {
    /// Seconds that it had.
    TimeIsOver(f64),
    TooMuchMemory,
    ByUser,
}

/// The end of a process, with what it said.
#[derive(Debug)]
pub(super) struct Ending<'a> {
    pub(super) entry: &'a Entry,
    pub(super) status: ExitStatus,
    pub(super) stopped: Option<Stopped>,
    /// Standard output.
    pub(super) out: String,
    /// Standard error.
    pub(super) err: String,
    /// The most memory that it was seen with.
    pub(super) peak: Option<u64>,
    /// From its start to its end.
    pub(super) seconds: f64,
}

/// What became of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Status {
    /// Its asset is there.
    Done,
    /// Its asset was there.
    Kept,
    /// It is at fault itself: trying again changes nothing.
    BadInput,
    /// Memory, disk, time or an adapter was missing: another try elsewhere may do.
    Resources,
    /// A fault of ours, to be reported.
    Failed,
}

impl Status {
    /// What a process or an error of this class means for its model.
    pub(super) fn of(class: ExitClass) -> Self {
        match class {
            ExitClass::BadInput | ExitClass::Usage => Self::BadInput,
            ExitClass::NoAdapter | ExitClass::Resources | ExitClass::Interrupted => Self::Resources,
            ExitClass::Fault => Self::Failed,
        }
    }
}

/// How a model ended.
#[derive(Debug)]
pub(super) struct Ended {
    pub(super) status: Status,
    pub(super) message: Option<String>,
    pub(super) seconds: Value,
    pub(super) peak_bytes: Option<u64>,
    pub(super) exit_code: Option<i32>,
    pub(super) bytes: Option<u64>,
    pub(super) warnings: Vec<String>,
}

impl Ended {
    /// What came before a process was started.
    pub(super) fn without_process(status: Status, message: String) -> Self {
        Self {
            status,
            message: Some(message),
            seconds: json!({"total": 0.0}),
            peak_bytes: None,
            exit_code: None,
            bytes: None,
            warnings: Vec::new(),
        }
    }
}

impl Ending<'_> {
    pub(super) fn judge(&self) -> Ended {
        let printed = serde_json::from_str(&self.out).unwrap_or(Value::Null);
        if self.status.success() && printed.is_object() {
            return self.done(&printed);
        }
        let (status, message) = self.failure();
        Ended {
            status,
            message: Some(message),
            seconds: json!({"total": self.seconds}),
            peak_bytes: self.peak,
            exit_code: self.status.code(),
            bytes: None,
            warnings: Vec::new(),
        }
    }

    fn done(&self, printed: &Value) -> Ended {
        let warnings = printed["warnings"].as_array().into_iter().flatten();
        Ended {
            status: Status::Done,
            message: None,
            seconds: printed["seconds"].clone(),
            peak_bytes: printed["peak_bytes"].as_u64().max(self.peak),
            exit_code: Some(0),
            bytes: printed["bytes"].as_u64(),
            warnings: warnings
                .filter_map(|w| Some(w.as_str()?.to_owned()))
                .collect(),
        }
    }

    fn failure(&self) -> (Status, String) {
        let model = self.entry.path.display();
        let said = self.sentence();
        match self.stopped {
            Some(Stopped::TimeIsOver(seconds)) => {
                return (
                    Status::Resources,
                    format!("{model}: not built within {seconds} s"),
                );
            }
            Some(Stopped::TooMuchMemory) => return (Status::Resources, self.no_memory()),
            Some(Stopped::ByUser) | None => {}
        }
        let class = self.status.code().map(class_of);
        match class {
            Some(Ok(ExitClass::Interrupted)) => (
                Status::Resources,
                format!("{model}: its build was interrupted"),
            ),
            Some(Ok(class)) if said.is_empty() => (
                Status::of(class),
                self.fault(&format!("exit code {}", class.code())),
            ),
            // What ran short first may be reported by another name, as by a thread without memory for its stack.
            Some(Ok(ExitClass::Resources))
                if self.entry.memory.is_some() && !said.contains("memory") =>
            {
                (Status::Resources, format!("{}: {said}", self.no_memory()))
            }
            // It says so itself, and what the files are.
            Some(Ok(class)) => (Status::of(class), said),
            Some(Err(code)) => (Status::Failed, self.fault(&format!("exit code {code}"))),
            None if self.err.contains(NO_MEMORY) || self.is_near_limit() => {
                (Status::Resources, self.no_memory())
            }
            None => match signal(self.status) {
                Some(SIGKILL) => (
                    Status::Resources,
                    format!(
                        "{model}: its build was killed, as the system does when memory is short"
                    ),
                ),
                Some(signal) => (Status::Failed, self.fault(&format!("signal {signal}"))),
                None => (Status::Failed, self.fault("no exit code")),
            },
        }
    }

    fn is_near_limit(&self) -> bool {
        match (self.entry.memory, self.peak) {
            (Some(most), Some(peak)) => peak as f64 > NEAR_LIMIT * most as f64,
            _ => false,
        }
    }

    fn no_memory(&self) -> String {
        let model = self.entry.path.display();
        match self.entry.memory {
            Some(most) => {
                format!("{model}: its build needs more than the {most} bytes of memory it may have")
            }
            None => format!("{model}: there is not enough memory to build it"),
        }
    }

    fn fault(&self, end: &str) -> String {
        let model = self.entry.path.display();
        match &self.sentence()[..] {
            "" => format!("{model}: its build ended in a fault of ours ({end})"),
            said => format!("{model}: its build ended in a fault of ours ({end}): {said}"),
        }
    }

    /// The sentence by which the process said what is wrong.
    fn sentence(&self) -> String {
        let lines = || self.err.lines().map(str::trim);
        if let Some(said) = lines()
            .filter_map(|line| line.strip_prefix("silmap: error: "))
            .next_back()
        {
            return said.to_owned();
        }
        let from = |start: &str| self.err.find(start).map(|at| one_line(&self.err[at..]));
        from("error: ")
            .or_else(|| from("thread '"))
            .or_else(|| lines().rfind(|line| !line.is_empty()).map(str::to_owned))
            .unwrap_or_default()
    }
}

/// The class of an exit code, or the code that has none.
fn class_of(code: i32) -> Result<ExitClass, i32> {
    [
        ExitClass::BadInput,
        ExitClass::Usage,
        ExitClass::NoAdapter,
        ExitClass::Resources,
        ExitClass::Fault,
        ExitClass::Interrupted,
    ]
    .into_iter()
    .find(|class| i32::from(class.code()) == code)
    .ok_or(code)
}

#[cfg(unix)]
fn signal(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal(_: ExitStatus) -> Option<i32> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::process::ExitStatusExt;
    use std::path::PathBuf;

    use super::*;

    fn judge(raw: i32, stopped: Option<Stopped>, err: &str, memory: Option<u64>) -> Ended {
        let entry = Entry {
            model: "m.ply".to_owned(),
            path: PathBuf::from("m.ply"),
            out: PathBuf::from("m.glb"),
            words: Vec::new(),
            meaning: String::new(),
            files: Vec::new(),
            timeout: None,
            memory,
        };
        Ending {
            entry: &entry,
            status: ExitStatus::from_raw(raw),
            stopped,
            out: String::new(),
            err: err.to_owned(),
            peak: Some(900),
            seconds: 1.0,
        }
        .judge()
    }

    #[test]
    fn endings_say_what_to_do() {
        let panic =
            "thread 'main' panicked at src/a.rs:1:2:\nindex out of bounds\n\nnote: run with";
        let exit = |code: i32| code << 8;
        for (raw, stopped, err, memory, status, says) in [
            (
                exit(1),
                None,
                "silmap: warning: odd\nsilmap: error: m.ply: it is open",
                None,
                Status::BadInput,
                "m.ply: it is open",
            ),
            (
                exit(2),
                None,
                "error: --keep cannot be more than --views\n\nUsage: silmap",
                None,
                Status::BadInput,
                "--keep cannot be more than --views",
            ),
            (
                exit(3),
                None,
                "silmap: error: no adapter",
                None,
                Status::Resources,
                "no adapter",
            ),
            (
                exit(4),
                None,
                "silmap: error: the disk is full",
                None,
                Status::Resources,
                "the disk is full",
            ),
            (
                exit(130),
                None,
                "silmap: interrupted",
                None,
                Status::Resources,
                "interrupted",
            ),
            (
                exit(130),
                Some(Stopped::TimeIsOver(2.5)),
                "silmap: interrupted",
                None,
                Status::Resources,
                "m.ply: not built within 2.5 s",
            ),
            (
                exit(130),
                Some(Stopped::TooMuchMemory),
                "",
                Some(9),
                Status::Resources,
                "more than the 9 bytes",
            ),
            (
                exit(101),
                None,
                panic,
                None,
                Status::Failed,
                "(exit code 101): thread 'main' panicked at src/a.rs:1:2: index out of bounds",
            ),
            (
                exit(70),
                None,
                "silmap: error: a fault",
                None,
                Status::Failed,
                "a fault",
            ),
            (
                exit(0),
                None,
                "",
                None,
                Status::Failed,
                "a fault of ours (exit code 0)",
            ),
            (
                6,
                None,
                "memory allocation of 12 bytes failed",
                None,
                Status::Resources,
                "not enough memory",
            ),
            (
                6,
                None,
                "memory allocation of 12 bytes failed",
                Some(5),
                Status::Resources,
                "more than the 5 bytes",
            ),
            (
                11,
                None,
                "",
                Some(1000),
                Status::Resources,
                "more than the 1000 bytes",
            ),
            (
                11,
                None,
                "",
                Some(9000),
                Status::Failed,
                "a fault of ours (signal 11)",
            ),
            (9, None, "", None, Status::Resources, "was killed"),
        ] {
            let ended = judge(raw, stopped, err, memory);
            let message = ended.message.unwrap();
            assert!(
                ended.status == status && message.contains(says),
                "{raw} {err}: {message}"
            );
        }
    }
}
