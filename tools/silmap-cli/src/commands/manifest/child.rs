//! The child process that builds one model, and its result.
//!
//! It is this program again with the options of the line. While it runs its memory is looked at, and it is stopped when its time
//! is over or the user asks. It ends with the process that reads the list, however that ends.

use std::ffi::OsString;
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;

use super::ending::{Ended, Ending, Stopped};
use super::entry::Entry;
use crate::args::ManifestArgs;
use crate::interrupt;
use crate::machine;

/// How often a running process is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// How long a process may take to end when it is asked to.
const PATIENCE: Duration = Duration::from_secs(5);
/// What is kept of each of its streams, from the start.
const MAX_STREAM_BYTES: u64 = 1 << 20;

/// Builds a model in a process of its own.
///
/// # Errors
/// When the user asked to stop, nothing can be written to the asset's folder, or this program cannot be started again.
pub(super) fn build(entry: &Entry) -> anyhow::Result<Ended> {
    let started = Instant::now();
    let mut child = command(entry)?
        .spawn()
        .context("this program cannot be started again for a model")?;
    if let Some(bytes) = entry.memory {
        limit_memory(&child, bytes);
    }
    let mut streams = Streams::of(&mut child);
    let mut peak = None;
    let mut stopped = None;
    while !streams.have_ended() {
        peak = peak.max(machine::peak_bytes(Some(child.id())));
        match stopped {
            None => {
                if let Some(why) = reason_to_stop(entry, started, child.id()) {
                    ask_to_end(&mut child);
                    stopped = Some((why, Instant::now()));
                }
            }
            // It may be gone already.
            Some((_, since)) if since.elapsed() > PATIENCE => drop(child.kill()),
            Some(_) => {}
        }
    }
    let status = child
        .wait()
        .context("the end of a model's process was missed")?;
    interrupt::check()?;
    let [out, err] = streams.texts;
    Ok(Ending {
        entry,
        status,
        stopped: stopped.map(|(why, _)| why),
        out,
        err,
        peak,
        seconds: started.elapsed().as_secs_f64(),
    }
    .judge())
}

fn command(entry: &Entry) -> anyhow::Result<Command> {
    let program = std::env::current_exe().context("this program's own file is not known")?;
    let mut out = OsString::from("--out=");
    out.push(&entry.out);
    let mut command = Command::new(program);
    command
        .arg("build")
        .args(&entry.words)
        .args(["--json", "--reader", &std::process::id().to_string()])
        .arg(out)
        .arg("--")
        .arg(&entry.path)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    #[cfg(unix)]
    {
        use std::os::unix::process::CommandExt;
        // A terminal's ctrl-c reaches this process alone, which passes it on once; twice would be to stop at any price.
        command.process_group(0);
    }
    Ok(command)
}

fn reason_to_stop(entry: &Entry, started: Instant, process: u32) -> Option<Stopped> {
    if interrupt::is_requested() {
        return Some(Stopped::ByUser);
    }
    if let Some(most) = entry.timeout
        && started.elapsed().as_secs_f64() > most
    {
        return Some(Stopped::TimeIsOver(most));
    }
    // What the limit does not count, such as memory shared with a driver.
    let most = entry.memory?;
    (machine::held_bytes(Some(process))? > most).then_some(Stopped::TooMuchMemory)
}

/// What a process writes, read while it runs.
struct Streams {
    ends: Receiver<(usize, String)>,
    texts: [String; 2],
    open: usize,
}

impl Streams {
    fn of(child: &mut Child) -> Self {
        let (sender, ends) = mpsc::channel();
        let out = child
            .stdout
            .take()
            .map(|s| Box::new(s) as Box<dyn Read + Send>);
        let err = child
            .stderr
            .take()
            .map(|s| Box::new(s) as Box<dyn Read + Send>);
        let mut open = 0;
        for (place, stream) in [out, err].into_iter().enumerate() {
            let Some(mut stream) = stream else { continue };
            let sender = sender.clone();
            open += 1;
            thread::spawn(move || {
                let mut start = Vec::new();
                // A stream that fails has ended; what is too much is read and forgotten, so that the process can go on.
                let _ = stream
                    .by_ref()
                    .take(MAX_STREAM_BYTES)
                    .read_to_end(&mut start);
                let _ = std::io::copy(&mut stream, &mut std::io::sink());
                let text = String::from_utf8_lossy(&start).into_owned();
                // The receiver is gone after an interrupt.
                let _ = sender.send((place, text));
            });
        }
        Self {
            ends,
            texts: Default::default(),
            open,
        }
    }

    /// Waits a moment, or until both have ended.
    fn have_ended(&mut self) -> bool {
        while self.open > 0 {
            match self.ends.recv_timeout(LOOK) {
                Ok((place, text)) => {
                    self.texts[place] = text;
                    self.open -= 1;
                }
                Err(_) => return false,
            }
        }
        true
    }
}

/// Asks a process to end and to leave nothing behind.
fn ask_to_end(child: &mut Child) {
    #[cfg(unix)]
    {
        use rustix::process::{Pid, Signal, kill_process};
        // It may be gone already.
        let _ = kill_process(Pid::from_child(child), Signal::INT);
    }
    #[cfg(not(unix))]
    let _ = child.kill();
}

/// Lets allocations fail beyond a limit.
fn limit_memory(child: &Child, bytes: u64) {
    #[cfg(target_os = "linux")]
    {
        use rustix::process::{Pid, Resource, Rlimit, prlimit};
        let limit = Rlimit {
            current: Some(bytes),
            maximum: Some(bytes),
        };
        // Where it cannot be set, or the process is gone, what is held is still looked at.
        let _ = prlimit(Some(Pid::from_child(child)), Resource::Data, limit);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (child, bytes);
}

/// Makes the build of one model end with the process that reads the list.
///
/// # Errors
/// When that process is gone.
pub(crate) fn end_with_reader(args: &ManifestArgs) -> anyhow::Result<()> {
    #[cfg(target_os = "linux")]
    if let Some(reader) = args.reader {
        use rustix::process::{Signal, getppid, set_parent_process_death_signal};
        // Asked rather than killed, so that nothing half-written stays.
        set_parent_process_death_signal(Some(Signal::TERM))
            .context("this process cannot be tied to the one that reads the list")?;
        let parent = getppid().map(|pid| pid.as_raw_nonzero().get());
        anyhow::ensure!(
            parent == Some(reader),
            "the process that reads the list is gone"
        );
    }
    #[cfg(not(target_os = "linux"))]
    let _ = args;
    Ok(())
}
