//! Files on a page: they come by address, or are dropped.

use wasm_bindgen::JsCast;
use wasm_bindgen_futures::{JsFuture, spawn_local};

use crate::loader::{Loading, News, Teller};
use crate::making::{Maker, Shape};
use crate::scene::Scene;

/// What makes an asset ready, and the shape that it is to have.
type How = (Maker, Shape);

/// Assets larger than this are not fetched, bytes.
const MOST_BYTES: f64 = 512.0 * 1024.0 * 1024.0;

/// Begins to fetch an asset.
pub(crate) fn fetch(context: &egui::Context, address: String, how: How) -> Loading {
    let name = address.clone();
    Loading::begin(context, &name, |teller, _| {
        spawn_local(async move {
            let name = address.rsplit('/').next().unwrap_or(&address).to_owned();
            let source = address.clone();
            let news = match bytes_of(&address).await {
                Ok(bytes) => read((&name, &source), &bytes, how),
                Err(reason) => News::Failed(format!("{address}: {reason}")),
            };
            teller.tell(news);
        });
    })
}

/// Begins to read a file that was dropped.
pub(crate) fn read_dropped(
    context: &egui::Context,
    file: egui::DroppedFileHandle,
    how: How,
) -> Loading {
    let name = file.path().display().to_string();
    Loading::begin(context, &name.clone(), |teller: Teller, _| {
        spawn_local(async move {
            let source = format!("dropped {name}");
            let news = match file.bytes_async().await {
                Ok(bytes) => read((&name, &source), &bytes, how),
                Err(reason) => News::Failed(format!("{name}: {reason}")),
            };
            teller.tell(news);
        });
    })
}

fn read((name, source): (&str, &str), bytes: &[u8], (maker, shape): How) -> News {
    let made = silmap_map::asset::read(bytes)
        .map_err(|error| format!("{name}: {error}"))
        .and_then(|asset| {
            let mut scene = Scene::of_asset(name, bytes.len() as u64, asset);
            source.clone_into(&mut scene.source);
            maker.make(scene, (shape, None), &silmap_geometry::Watch::silent())
        });
    match made {
        Ok(Some(ready)) => News::Done(Box::new(ready)),
        Ok(None) => News::Stopped,
        Err(error) => News::Failed(error),
    }
}

/// What an address holds.
async fn bytes_of(address: &str) -> Result<Vec<u8>, String> {
    let window = web_sys::window().ok_or("this is no page")?;
    let unreachable = |_| "it cannot be reached".to_owned();
    let response = JsFuture::from(window.fetch_with_str(address))
        .await
        .map_err(unreachable)?;
    let response: web_sys::Response = response.unchecked_into();
    if !response.ok() {
        return Err(format!("the server answers {}", response.status()));
    }
    let length = response.headers().get("content-length").ok().flatten();
    let length: Option<f64> = length.and_then(|length| length.parse().ok());
    if length.is_some_and(|bytes| bytes > MOST_BYTES) {
        return Err("it is too large for a page".to_owned());
    }
    let cut_off = |_| "the connection broke off".to_owned();
    let buffer = response.array_buffer().map_err(cut_off)?;
    let buffer = JsFuture::from(buffer).await.map_err(cut_off)?;
    Ok(js_sys::Uint8Array::new(&buffer).to_vec())
}
