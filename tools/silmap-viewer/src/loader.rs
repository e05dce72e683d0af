//! Loading and building beside the drawing: on a thread in a window, by the browser's own means on a page.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};

use crate::scene::Scene;

/// What loading tells the window.
#[cfg_attr(
    target_arch = "wasm32",
    expect(
        dead_code,
        reason = "on a page nothing is built, and what is fetched comes at once"
    )
)]
#[derive(Debug)]
pub(crate) enum News {
    /// What goes on, and how much of it is done, 0 to 1.
    Progress(String, Option<f32>),
    /// Something to show already; more comes.
    Preview(Box<Scene>),
    /// All of it.
    Done(Box<Scene>),
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
    /// What was told last.
    pub(crate) progress: (String, Option<f32>),
    stop: Arc<std::sync::atomic::AtomicBool>,
}

impl Loading {
    /// Begins; `start` gets what it tells by, and what says that it shall stop.
    pub(crate) fn begin(
        context: &egui::Context,
        name: &str,
        start: impl FnOnce(Teller, Arc<std::sync::atomic::AtomicBool>),
    ) -> Self {
        let (sender, news) = channel();
        let stop = Arc::new(std::sync::atomic::AtomicBool::new(false));
        let teller = Teller {
            sender,
            context: context.clone(),
        };
        start(teller, Arc::clone(&stop));
        Self {
            news,
            name: name.to_owned(),
            progress: ("reading".to_owned(), None),
            stop,
        }
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

    /// Asks it to stop.
    pub(crate) fn stop(&self) {
        self.stop.store(true, std::sync::atomic::Ordering::Relaxed);
    }
}

impl Drop for Loading {
    fn drop(&mut self) {
        self.stop();
    }
}
