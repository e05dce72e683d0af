//! Pictures out of a page: what is seen as a file that the browser saves.
//!
//! The browser's own encoder makes the PNG: one of ours would be a part of the program that every visitor fetches.

use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};

use crate::loader::{Loading, News};
use crate::seen::Seen;
use crate::viewer::Viewer;

/// Begins to save the picture that is seen, in the size that it has on the page.
pub(crate) fn save_picture(viewer: &mut Viewer, context: &egui::Context) {
    let asset = &viewer.scene.name;
    let stem = asset
        .rsplit_once('.')
        .map_or(asset.as_str(), |(stem, _)| stem);
    let name = format!("{stem}.png");
    let seen = match Seen::of(viewer) {
        Ok(seen) => seen,
        Err(reason) => return viewer.say(format!("{name}: {reason}"), true),
    };
    // What is loading is drawn again and again, and that moves the read-back on.
    let loading = Loading::begin(context, &name.clone(), |teller, _| {
        spawn_local(async move {
            let saved = match seen.finish().await {
                Ok((rgba, size_px)) => save(&name, &rgba, size_px).await.map(|()| size_px),
                Err(reason) => Err(reason),
            };
            teller.tell(match saved {
                Ok((width, height)) => {
                    News::Said(format!("{name} is saved: {width} × {height} pixels"))
                }
                Err(reason) => News::Failed(format!("{name}: {reason}")),
            });
        });
    });
    viewer.loading = Some(loading);
}

/// Gives the browser a picture to save.
async fn save(name: &str, rgba: &[u8], (width, height): (u32, u32)) -> Result<(), String> {
    let reason = |error: JsValue| format!("{error:?}");
    let document = web_sys::window().and_then(|window| window.document());
    let document = document.ok_or("this is no page")?;
    let canvas: web_sys::HtmlCanvasElement = document
        .create_element("canvas")
        .map_err(reason)?
        .unchecked_into();
    canvas.set_width(width);
    canvas.set_height(height);
    let pixels = web_sys::ImageData::new_with_u8_clamped_array(wasm_bindgen::Clamped(rgba), width);
    let plane = canvas.get_context("2d").map_err(reason)?;
    let plane: web_sys::CanvasRenderingContext2d = plane
        .ok_or("the browser has no plane to draw on")?
        .unchecked_into();
    plane
        .put_image_data(&pixels.map_err(reason)?, 0.0, 0.0)
        .map_err(reason)?;
    let made = js_sys::Promise::new(&mut |resolve, _| {
        // Where it fails the browser gives nothing, as for a picture that is none.
        if canvas.to_blob(&resolve).is_err() {
            let _ = resolve.call1(&JsValue::NULL, &JsValue::NULL);
        }
    });
    let blob = JsFuture::from(made).await.map_err(reason)?;
    if blob.is_null() {
        return Err("the browser cannot make a PNG of it".to_owned());
    }
    let address =
        web_sys::Url::create_object_url_with_blob(blob.unchecked_ref()).map_err(reason)?;
    let link: web_sys::HtmlAnchorElement = document
        .create_element("a")
        .map_err(reason)?
        .unchecked_into();
    link.set_href(&address);
    link.set_download(name);
    link.click();
    // By then the browser has begun to read it.
    web_sys::Url::revoke_object_url(&address).map_err(reason)
}
