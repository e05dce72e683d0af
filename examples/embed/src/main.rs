//! A window with a scene of its own, and many instances of an asset in it.

mod adapter;
mod fly_camera;
mod scene;
mod stage;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, anyhow};
use clap::Parser;
use silmap_map::Asset;
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalPosition};
use winit::event::{ElementState, MouseButton, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop};
use winit::keyboard::{KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

use crate::fly_camera::FlyCamera;
use crate::stage::Stage;

/// Draws many instances of an asset in a scene.
#[derive(Debug, Parser)]
struct Options {
    /// An asset that `silmap build` made
    #[arg(long, value_name = "FILE.glb")]
    model: PathBuf,
    /// How many of them
    #[arg(long, value_name = "COUNT", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(..=1_000_000))]
    instances: u32,
    /// Clip in the fragment shader, in a pass without a stencil
    #[arg(long)]
    coverage: bool,
    /// Walk by itself, and stop after so many frames
    #[arg(long, value_name = "COUNT")]
    frames: Option<u32>,
}

fn main() -> ExitCode {
    match run(Options::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("example-embed: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: Options) -> anyhow::Result<()> {
    let name = options.model.display().to_string();
    let bytes = std::fs::read(&options.model).with_context(|| name.clone())?;
    let asset = silmap_map::asset::read(&bytes).context(name)?;
    let events = EventLoop::new();
    let events = events.map_err(|_| anyhow!("there is no display to open a window on"))?;
    // Frames follow each other: the surface waits for the display.
    events.set_control_flow(ControlFlow::Wait);
    let mut program = Program {
        options,
        asset,
        camera: FlyCamera::default(),
        looking_from: None,
        cursor: PhysicalPosition::default(),
        drawn: 0,
        last: Instant::now(),
        title_after: (Instant::now(), 0),
        window: None,
        outcome: Ok(()),
    };
    events.run_app(&mut program)?;
    program.outcome
}

/// The program between two events.
struct Program {
    options: Options,
    asset: Asset,
    camera: FlyCamera,
    /// Where the cursor was when the left button was pressed, or at the last move since.
    looking_from: Option<PhysicalPosition<f64>>,
    cursor: PhysicalPosition<f64>,
    /// Frames since the start.
    drawn: u32,
    last: Instant,
    /// When the title was last set, and frames then.
    title_after: (Instant, u32),
    window: Option<(Arc<Window>, Stage)>,
    outcome: anyhow::Result<()>,
}

impl Program {
    fn open(&self, events: &ActiveEventLoop) -> anyhow::Result<(Arc<Window>, Stage)> {
        let attributes = Window::default_attributes()
            .with_title("silmap")
            .with_inner_size(LogicalSize::new(1024, 768));
        let window = events.create_window(attributes).context("no window")?;
        let window = Arc::new(window);
        let stage = self.stage(&window, events)?;
        Ok((window, stage))
    }

    fn stage(&self, window: &Arc<Window>, events: &ActiveEventLoop) -> anyhow::Result<Stage> {
        let display = Box::new(events.owned_display_handle());
        Stage::open(window, display, &self.asset, &self.options)
    }

    fn frame(&mut self, events: &ActiveEventLoop) -> anyhow::Result<()> {
        if let Some((window, stage)) = self.window.take_if(|(_, stage)| stage.is_lost()) {
            // What draws to a window must be gone before something else does.
            drop(stage);
            let stage = self.stage(&window, events)?;
            self.window = Some((window, stage));
        }
        let Some((window, stage)) = &mut self.window else {
            return Ok(());
        };
        let seconds = self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
        match self.options.frames {
            Some(_) => self.camera.walk(),
            None => self.camera.fly(seconds.min(0.1)),
        }
        let Some(stats) = stage.frame(window, &self.camera)? else {
            // Nothing can be drawn now: an event says when it can.
            return Ok(());
        };
        self.drawn += 1;
        let (since, before) = self.title_after;
        let seconds = since.elapsed().as_secs_f64();
        if seconds > 1.0 {
            let rate = f64::from(self.drawn - before) / seconds;
            window.set_title(&format!(
                "silmap: {rate:.1} frames a second, {} instances in {} draw calls, {} outlines made",
                stats.drawn, stats.draw_calls, stats.interpolated
            ));
            self.title_after = (Instant::now(), self.drawn);
        }
        if Some(self.drawn) == self.options.frames {
            println!(
                "{} frames by {}, {} instances in the last one",
                self.drawn,
                stage.adapter_name(),
                stats.drawn
            );
            events.exit();
        } else {
            window.request_redraw();
        }
        Ok(())
    }

    /// Ends the program with an error.
    fn fail(&mut self, events: &ActiveEventLoop, error: anyhow::Error) {
        self.outcome = Err(error);
        events.exit();
    }
}

impl ApplicationHandler for Program {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.window.is_none() {
            match self.open(events) {
                Ok(window) => self.window = Some(window),
                Err(error) => return self.fail(events, error),
            }
        }
        if let Some((window, _)) = &self.window {
            window.request_redraw();
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match event {
            WindowEvent::CloseRequested => events.exit(),
            WindowEvent::RedrawRequested => {
                if let Err(error) = self.frame(events) {
                    self.fail(events, error);
                }
            }
            WindowEvent::Resized(size) => {
                if let Some((window, stage)) = &mut self.window {
                    stage.resize(size.width, size.height);
                    window.request_redraw();
                }
            }
            WindowEvent::Occluded(false) => {
                if let Some((window, _)) = &self.window {
                    window.request_redraw();
                }
            }
            WindowEvent::Focused(false) => {
                self.camera.release_all();
                self.looking_from = None;
            }
            WindowEvent::KeyboardInput { event, .. } => {
                if let PhysicalKey::Code(code) = event.physical_key {
                    if code == KeyCode::Escape {
                        events.exit();
                    }
                    self.camera.key(code, event.state == ElementState::Pressed);
                }
            }
            WindowEvent::MouseInput {
                state,
                button: MouseButton::Left,
                ..
            } => {
                let is_pressed = state == ElementState::Pressed;
                self.looking_from = is_pressed.then_some(self.cursor);
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.cursor = position;
                if let Some(from) = self.looking_from.replace(position) {
                    self.camera.look(position.x - from.x, position.y - from.y);
                } else {
                    self.looking_from = None;
                }
            }
            _ => {}
        }
    }
}
