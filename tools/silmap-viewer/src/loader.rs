//! Work beside the drawing: on a thread in a window, by the browser's own means on a page.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use web_time::{Duration, Instant};

use crate::making::{Ready, Shape};

/// Work that takes no longer is not shown, so that the window does not flicker.
const SHORT: Duration = Duration::from_millis(300);

/// What work tells the window.
#[cfg_attr(
    target_arch = "wasm32",
    expect(
        dead_code,
        reason = "on a page nothing is built, and what is fetched comes at once"
    )
)]
pub(crate) enum News {
    /// What goes on, and how much of it is done, 0 to 1.
    Progress(String, Option<f32>),
    /// Something to show already; more comes.
    Preview(Box<Ready>),
    /// All of it.
    Done(Box<Ready>),
    /// It is done, and there is nothing to show: one sentence.
    Said(String),
    /// Nothing comes: one sentence.
    Failed(String),
    /// It was stopped.
    Stopped,
}

/// A way to tell that there is news.
#[derive(Clone)]
pub(crate) struct Teller {
    sender: Sender<News>,
    context: egui::Context,
}

impl Teller {
    pub(crate) fn tell(&self, news: News) {
        // Nobody listens any more where another file was dropped.
        let _ = self.sender.send(news);
        self.context.request_repaint();
    }
}

/// Work that goes on.
pub(crate) struct Loading {
    news: Receiver<News>,
    /// What is loaded.
    pub(crate) name: String,
    /// The shape that is made of what is shown already, where that is all it does.
    pub(crate) reshapes: Option<Shape>,
    /// What was told last.
    pub(crate) progress: (String, Option<f32>),
    since: Instant,
    stop: Arc<AtomicBool>,
}

impl Loading {
    /// Begins; `start` gets what it tells by, and what says that it shall stop.
    pub(crate) fn begin(
        context: &egui::Context,
        name: &str,
        start: impl FnOnce(Teller, Arc<AtomicBool>),
    ) -> Self {
        let (sender, news) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let teller = Teller {
            sender,
            context: context.clone(),
        };
        start(teller, Arc::clone(&stop));
        context.request_repaint_after(SHORT);
        Self {
            news,
            name: name.to_owned(),
            reshapes: None,
            progress: ("reading".to_owned(), None),
            since: Instant::now(),
            stop,
        }
    }

    /// Begins work on a thread of its own; what it returns is its last news.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn beside(
        context: &egui::Context,
        name: &str,
        work: impl FnOnce(&Teller, &AtomicBool) -> News + Send + 'static,
    ) -> Self {
        Self::begin(context, name, |teller, stop| {
            let own = teller.clone();
            let thread = std::thread::Builder::new().name("work".to_owned());
            let started = thread.spawn(move || {
                let news = work(&own, &stop);
                own.tell(news);
            });
            if let Err(error) = started {
                teller.tell(News::Failed(format!("no thread can be started: {error}")));
            }
        })
    }

    /// Begins work once the page has a moment: it has one thread.
    #[cfg(target_arch = "wasm32")]
    pub(crate) fn beside(
        context: &egui::Context,
        name: &str,
        work: impl FnOnce(&Teller, &AtomicBool) -> News + 'static,
    ) -> Self {
        Self::begin(context, name, |teller, stop| {
            wasm_bindgen_futures::spawn_local(async move {
                let news = work(&teller, &stop);
                teller.tell(news);
            });
        })
    }

    /// What there is; `None` where there is nothing new.
    pub(crate) fn next(&mut self) -> Option<News> {
        match self.news.try_recv() {
            Ok(News::Progress(what, share)) => {
                self.progress = (what, share);
                self.next()
            }
            Ok(news) => Some(news),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(News::Failed(format!(
                "{}: loading ended without a word",
                self.name
            ))),
        }
    }

    /// Whether it goes on for so long that it is to be shown.
    pub(crate) fn is_long(&self) -> bool {
        self.since.elapsed() >= SHORT
    }

    /// Asks it to stop.
    pub(crate) fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Does long work whose stages are told as they go on, and which stops when it is asked to.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn watched<T>(
    teller: &Teller,
    stop: &AtomicBool,
    work: impl FnOnce(&silmap_geometry::Watch<'_>) -> T,
) -> T {
    use silmap_geometry::{Stage, StageEvent, Watch};
    use std::collections::BTreeMap;
    use std::sync::{Mutex, PoisonError};

    let stages = Mutex::new(BTreeMap::<Stage, (u64, u64)>::new());
    let listen = |event| {
        let mut stages = stages.lock().unwrap_or_else(PoisonError::into_inner);
        match event {
            StageEvent::Started { stage, total } => {
                stages.insert(stage, (0, total));
            }
            StageEvent::Advanced { stage, count } => {
                if let Some((done, total)) = stages.get_mut(&stage) {
                    let before = *done * 100 / (*total).max(1);
                    *done += count;
                    if *done * 100 / (*total).max(1) == before {
                        return;
                    }
                }
            }
            StageEvent::Finished { stage } => {
                stages.remove(&stage);
            }
        }
        if let Some((stage, &(done, total))) = stages.iter().next() {
            let share = (total > 0).then(|| (done as f32 / total as f32).min(1.0));
            teller.tell(News::Progress(stage.to_string(), share));
        }
    };
    work(&Watch::new(&listen, stop))
}

/// On a page nothing takes so long that it is told of: the work has the page's thread.
#[cfg(target_arch = "wasm32")]
pub(crate) fn watched<T>(
    _: &Teller,
    _: &AtomicBool,
    work: impl FnOnce(&silmap_geometry::Watch<'_>) -> T,
) -> T {
    work(&silmap_geometry::Watch::silent())
}
