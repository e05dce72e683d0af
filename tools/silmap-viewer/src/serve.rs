//! `silmap view --web`: serves the viewer's page with an asset, on this machine alone.

use std::io::Cursor;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::{Component, Path, PathBuf};

use anyhow::{Context, bail};
use silmap_mesh_io::input;
use tiny_http::{Header, Request, Response, Server};

/// What the page's folder is called.
const FOLDER: &str = "silmap-web";

/// What is served.
#[derive(Clone, Debug)]
pub struct Served {
    /// The asset that the page shows.
    pub asset: Option<PathBuf>,
    /// The page's folder, where it is not beside the program.
    pub page: Option<PathBuf>,
    /// The port; any that is free where 0.
    pub port: u16,
    /// How it is looked at, as a link.
    pub link: String,
}

/// Serves until the program is ended; `ready` gets the address.
///
/// # Errors
/// When the page's folder is not there, the asset cannot be read, or the port is taken.
pub fn serve(served: &Served, ready: impl FnOnce(&str)) -> anyhow::Result<()> {
    let page = page_folder(served.page.as_deref())?;
    let asset = served.asset.as_deref().map(|path| {
        let bytes = input::read(path).with_context(|| path.display().to_string())?;
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        Ok::<_, anyhow::Error>((name, bytes))
    });
    let asset = asset.transpose()?;
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, served.port));
    let server =
        Server::http(address).map_err(|error| anyhow::anyhow!("port {}: {error}", served.port))?;
    let port = server
        .server_addr()
        .to_ip()
        .map_or(served.port, |ip| ip.port());
    let mut query: Vec<String> = Vec::new();
    if let Some((name, _)) = &asset {
        query.push(format!("asset=asset/{}", encoded(name)));
    }
    if !served.link.is_empty() {
        query.push(served.link.clone());
    }
    let query = if query.is_empty() {
        String::new()
    } else {
        format!("?{}", query.join("&"))
    };
    ready(&format!("http://127.0.0.1:{port}/{query}"));
    for request in server.incoming_requests() {
        // A browser that goes away in the middle of an answer is no reason to end.
        let _ = answer(request, &page, asset.as_ref());
    }
    Ok(())
}

/// Where the page is: as told, or beside the program.
fn page_folder(told: Option<&Path>) -> anyhow::Result<PathBuf> {
    if let Some(folder) = told {
        if !folder.join("index.html").is_file() {
            bail!("{}: there is no index.html in it", folder.display());
        }
        return Ok(folder.to_owned());
    }
    let program = std::env::current_exe().context("this program's own folder is not known")?;
    let near = program.parent().map(Path::to_path_buf).unwrap_or_default();
    let places = [
        near.join(FOLDER),
        near.join("..").join(FOLDER),
        near.join("../share").join(FOLDER),
    ];
    let found = places
        .iter()
        .find(|folder| folder.join("index.html").is_file());
    found.cloned().with_context(|| {
        format!(
            "the page is not beside the program: make it with `cargo xtask web --release {}`",
            places[1].display()
        )
    })
}

/// Letters and digits as they are, the rest as %XX.
fn encoded(name: &str) -> String {
    let keep = |b: u8| b.is_ascii_alphanumeric() || b"-_.".contains(&b);
    name.bytes()
        .map(|b| {
            if keep(b) {
                char::from(b).to_string()
            } else {
                format!("%{b:02X}")
            }
        })
        .collect()
}

/// A file as an answer.
fn file(bytes: Vec<u8>, headers: &[(&str, &str)]) -> Response<Cursor<Vec<u8>>> {
    // All of them are known, and none is refused.
    let headers = headers
        .iter()
        .filter_map(|(name, value)| Header::from_bytes(*name, *value).ok());
    headers.fold(Response::from_data(bytes), Response::with_header)
}

fn type_of(path: &Path) -> &'static str {
    match path.extension().and_then(|e| e.to_str()) {
        Some("html") => "text/html; charset=utf-8",
        Some("js" | "mjs") => "text/javascript",
        Some("wasm") => "application/wasm",
        Some("glb") => "model/gltf-binary",
        Some("webp") => "image/webp",
        Some("png") => "image/png",
        _ => "application/octet-stream",
    }
}

fn answer(request: Request, page: &Path, asset: Option<&(String, Vec<u8>)>) -> std::io::Result<()> {
    let path = request.url().split('?').next().unwrap_or("/").to_owned();
    let name = if path == "/" {
        "index.html"
    } else {
        path.trim_start_matches('/')
    };
    if let Some((of, bytes)) = asset.filter(|(of, _)| name == format!("asset/{}", encoded(of))) {
        let kind = type_of(Path::new(of));
        return request.respond(file(bytes.clone(), &[("Content-Type", kind)]));
    }
    let is_plain = |part| matches!(part, Component::Normal(_));
    let path = page.join(name);
    if !Path::new(name).components().all(is_plain) || !path.is_file() {
        return request.respond(Response::from_string("not found").with_status_code(404));
    }
    let takes_gzip = request
        .headers()
        .iter()
        .any(|h| h.field.equiv("Accept-Encoding") && h.value.as_str().contains("gzip"));
    let mut packed = path.clone().into_os_string();
    packed.push(".gz");
    let packed = PathBuf::from(packed);
    let kind = ("Content-Type", type_of(&path));
    let answer = if takes_gzip && packed.is_file() {
        file(
            std::fs::read(&packed)?,
            &[kind, ("Content-Encoding", "gzip")],
        )
    } else {
        file(std::fs::read(&path)?, &[kind])
    };
    request.respond(answer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_into_addresses() {
        assert_eq!(encoded("bunny-1.glb"), "bunny-1.glb");
        assert_eq!(encoded("a b&c.glb"), "a%20b%26c.glb");
    }
}
