//! Pictures out: what is seen in the window, as a file.

use std::io::Write;
use std::path::{Path, PathBuf};

use silmap_gpu::Readback;

use crate::viewer::Viewer;

/// Saves the picture that is seen, the left one where there are two, in the size that it has in the window.
pub(crate) fn save_picture(viewer: &mut Viewer) {
    match read(viewer) {
        Ok((rgba, size_px)) => write(viewer, rgba, size_px),
        Err(reason) => viewer.say(format!("{}: {reason}", viewer.export.name), true),
    }
}

/// The pixels of the left picture.
fn read(viewer: &Viewer) -> Result<(Vec<u8>, (u32, u32)), String> {
    let stage = viewer.stage.as_ref().ok_or("there is no picture")?;
    let (texture, size_px) = stage.texture(0).ok_or("there is no picture")?;
    let gpu = &stage.gpu;
    let readback = Readback::new(gpu, size_px, texture.format()).map_err(|e| e.to_string())?;
    let encoder = gpu
        .device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let (rgba, _) = readback
        .start(gpu, encoder, texture)
        .wait(gpu)
        .map_err(|e| e.to_string())?;
    Ok((rgba, size_px))
}

fn write(viewer: &mut Viewer, rgba: Vec<u8>, (width, height): (u32, u32)) {
    let path = PathBuf::from(&viewer.export.name);
    let written = image::RgbaImage::from_raw(width, height, rgba)
        .ok_or_else(|| "the picture has no pixels".to_owned())
        .and_then(|picture| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            let encoded = picture.write_to(&mut bytes, image::ImageFormat::Png);
            encoded.map_err(|e| e.to_string())?;
            write_whole(&path, &bytes.into_inner()).map_err(|e| e.to_string())
        });
    match written {
        Ok(()) => viewer.say(
            format!("{} is written: {width} × {height} pixels", path.display()),
            false,
        ),
        Err(reason) => viewer.say(format!("{}: {reason}", path.display()), true),
    }
}

/// The file appears whole or not at all.
fn write_whole(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let mut file = tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
    file.write_all(bytes)?;
    file.persist(path)?;
    Ok(())
}
