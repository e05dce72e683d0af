//! The viewer on a web page: WebGPU or WebGL2, by the build that the page chose.

use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::*;

use crate::app::App;
use crate::look::Look;
use crate::start::Start;

#[cfg(not(any(feature = "webgpu", feature = "webgl")))]
compile_error!("a page is drawn by the feature webgpu or webgl");

/// What this build draws by.
#[wasm_bindgen]
#[must_use]
pub fn backend() -> String {
    if cfg!(feature = "webgpu") {
        "WebGPU".to_owned()
    } else {
        "WebGL2".to_owned()
    }
}

/// A running viewer.
#[wasm_bindgen(js_name = Viewer)]
#[expect(missing_debug_implementations, reason = "the runner has none")]
pub struct Page {
    runner: eframe::WebRunner,
}

#[wasm_bindgen(js_class = Viewer)]
impl Page {
    /// Starts in a canvas. `query` is what follows `?` in the page's address: `asset=URL`, `bare` for the picture alone, and a view as
    /// "Copy a link to this view" gives it.
    ///
    /// # Errors
    /// When the query is not understood, or the browser cannot draw by this build.
    pub async fn start(canvas: web_sys::HtmlCanvasElement, query: String) -> Result<Page, JsValue> {
        let decoded = web_sys::UrlSearchParams::new_with_str(&query)?;
        let asset = decoded.get("asset");
        let mut pairs = Vec::new();
        for pair in decoded.entries() {
            let pair: js_sys::Array = pair?.unchecked_into();
            let (key, value) = (pair.get(0).as_string(), pair.get(1).as_string());
            let (Some(key), Some(value)) = (key, value) else {
                continue;
            };
            if key != "asset" && key != "bare" {
                // A value with & in it is none that is known.
                pairs.push(format!("{key}={}", value.replace('&', " ")));
            }
        }
        let link = pairs.join("&");
        let look = Look::read_link(&link).map_err(|error| JsValue::from(error.to_string()))?;
        let start = Start {
            look,
            is_given: !link.is_empty() || asset.is_some(),
            is_bare: decoded.has("bare"),
            file: asset,
        };
        let focused = {
            let canvas = canvas.clone();
            move |_: &egui::Event| is_focused(&canvas)
        };
        let mut options = eframe::WebOptions {
            should_prevent_default: Box::new(focused),
            ..eframe::WebOptions::default()
        };
        if let egui_wgpu::WgpuSetup::CreateNew(setup) = &mut options.wgpu_options.wgpu_setup {
            setup.instance_descriptor.backends = if cfg!(feature = "webgpu") {
                wgpu::Backends::BROWSER_WEBGPU
            } else {
                wgpu::Backends::GL
            };
            setup.device_descriptor = std::sync::Arc::new(|adapter| wgpu::DeviceDescriptor {
                label: Some("silmap viewer"),
                required_limits: silmap_gpu::Gpu::required_limits(adapter),
                ..Default::default()
            });
        }
        let runner = eframe::WebRunner::new();
        let create = Box::new(|context: &eframe::CreationContext<'_>| {
            let app: Box<dyn eframe::App> = Box::new(App::new(context, start));
            Ok(app)
        });
        runner.start(canvas, options, create).await?;
        Ok(Page { runner })
    }

    /// Opens another asset.
    pub fn open(&self, address: String) {
        if let Some(mut app) = self.runner.app_mut::<App>() {
            app.pending_address = Some(address);
            app.context.request_repaint();
        }
    }

    /// Saves the picture that is seen, as a PNG that the browser downloads.
    pub fn save(&self) {
        let app = self.runner.app_mut::<App>();
        if let Some(mut app) = app.filter(|app| !app.viewer.is_loading()) {
            let context = app.context.clone();
            crate::download::save_picture(&mut app.viewer, &context);
            context.request_repaint();
        }
    }

    /// What the keyboard is at, or what was done last, in words: for those who do not see it.
    #[must_use]
    pub fn described(&self) -> String {
        let app = self.runner.app_mut::<App>();
        app.map(|app| app.described.clone()).unwrap_or_default()
    }

    /// Takes back what is said.
    pub fn dismiss(&self) {
        if let Some(mut app) = self.runner.app_mut::<App>() {
            app.viewer.message = None;
            app.context.request_repaint();
        }
    }

    /// Whether the graphics device is gone, so that only another viewer can draw. wgpu panics where a device that is gone is asked
    /// for a buffer that is mapped (30.0.1, WebGPU), which may be before it is said to be gone.
    #[must_use]
    pub fn is_lost(&self) -> bool {
        if self.runner.has_panicked() {
            return true;
        }
        let app = self.runner.app_mut::<App>();
        app.is_some_and(|app| app.viewer.is_lost())
    }

    /// What is said at the moment; a page may say it in its own words.
    #[must_use]
    pub fn message(&self) -> Option<String> {
        let app = self.runner.app_mut::<App>()?;
        app.viewer.message().map(|message| message.text.clone())
    }

    /// The name of what is shown; none while there is nothing.
    #[must_use]
    pub fn shown(&self) -> Option<String> {
        let app = self.runner.app_mut::<App>()?;
        (app.viewer.has_drawn()).then(|| app.viewer.scene().name.clone())
    }

    /// How many pictures were drawn, and the mean milliseconds of the last ones: of this thread, and until the device had drawn them,
    /// which is −1 where the device does not tell.
    #[must_use]
    pub fn times(&self) -> Vec<f64> {
        let app = self.runner.app_mut::<App>();
        app.map(|app| app.viewer.times_millis().to_vec())
            .unwrap_or_default()
    }

    /// Bytes that the program has of the page's memory.
    #[must_use]
    pub fn memory(&self) -> f64 {
        const PAGE_BYTES: f64 = 65_536.0;
        core::arch::wasm32::memory_size(0) as f64 * PAGE_BYTES
    }

    /// Where the picture is on the canvas: left, top, width and height, pixels of the canvas.
    #[must_use]
    pub fn picture(&self) -> Vec<f32> {
        let app = self.runner.app_mut::<App>();
        app.map(|app| app.viewer.picture_place().to_vec())
            .unwrap_or_default()
    }

    /// The query of a link to what is seen.
    #[must_use]
    pub fn link(&self) -> String {
        let app = self.runner.app_mut::<App>();
        app.map(|app| app.viewer.link()).unwrap_or_default()
    }

    /// Looks at it another way; the query is one of [`Page::link`].
    ///
    /// # Errors
    /// When it is not understood.
    pub fn look(&self, query: &str) -> Result<(), JsValue> {
        let look = Look::read_link(query).map_err(|e| JsValue::from(e.to_string()))?;
        if let Some(mut app) = self.runner.app_mut::<App>() {
            app.viewer.take_look(look);
            app.context.request_repaint();
        }
        Ok(())
    }

    /// Ends it, and frees what it holds.
    pub fn destroy(&self) {
        self.runner.destroy();
    }
}

/// Whether the canvas has the keyboard.
fn is_focused(canvas: &web_sys::HtmlCanvasElement) -> bool {
    let document = web_sys::window().and_then(|window| window.document());
    let active = document.and_then(|document| document.active_element());
    active.is_some_and(|active| {
        // Where text is typed a field of eframe's own stands in for the canvas.
        active.is_same_node(Some(canvas)) || active.tag_name() == "INPUT"
    })
}
