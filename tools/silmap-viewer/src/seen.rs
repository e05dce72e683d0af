//! The picture that is seen, read back from the device: one, or two as they share the window.

use silmap_gpu::{Gpu, PendingRead};

use crate::viewer::Viewer;

/// A picture's pixels, four bytes each, and its size.
pub(crate) type Pixels = (Vec<u8>, (u32, u32));

/// A picture that is being read back.
pub(crate) struct Seen {
    gpu: Gpu,
    reads: Vec<PendingRead>,
    /// Size of each picture, pixels.
    own_px: (u32, u32),
    /// The column at which the second one begins, and how far to the right of the first it lies, pixels.
    split_px: f32,
    shift_px: u32,
}

impl Seen {
    /// Begins to read what is seen.
    pub(crate) fn of(viewer: &Viewer) -> Result<Self, String> {
        let stage = viewer.stage.as_ref().ok_or("there is no picture")?;
        let (mut reads, mut own_px) = (Vec::new(), (0, 0));
        for pane in 0..if viewer.look.beside.is_some() { 2 } else { 1 } {
            let (pending, size_px) = stage.read_back(pane)?;
            if pane > 0 && size_px != own_px {
                return Err("the picture is not drawn yet".to_owned());
            }
            reads.push(pending);
            own_px = size_px;
        }
        Ok(Self {
            gpu: stage.gpu.clone(),
            reads,
            own_px,
            split_px: viewer.panes.split_px,
            shift_px: viewer.panes.shift_px as u32,
        })
    }

    /// Waits for the device.
    #[cfg(not(target_arch = "wasm32"))]
    pub(crate) fn wait(mut self) -> Result<Pixels, String> {
        let reads = std::mem::take(&mut self.reads).into_iter();
        let pictures = reads.map(|read| read.wait(&self.gpu).map(|(rgba, _)| rgba));
        let pictures: Result<Vec<_>, _> = pictures.collect();
        Ok(self.composed(&pictures.map_err(|e| e.to_string())?))
    }

    /// Comes back when the device is done.
    #[cfg(target_arch = "wasm32")]
    pub(crate) async fn finish(mut self) -> Result<Pixels, String> {
        let mut pictures = Vec::new();
        for read in std::mem::take(&mut self.reads) {
            let (rgba, _) = read.finish(&self.gpu).await.map_err(|e| e.to_string())?;
            pictures.push(rgba);
        }
        Ok(self.composed(&pictures))
    }

    /// The pictures as they share the window.
    fn composed(&self, pictures: &[Vec<u8>]) -> Pixels {
        composed(pictures, self.own_px, (self.split_px, self.shift_px))
    }
}

fn composed(
    pictures: &[Vec<u8>],
    (width, height): (u32, u32),
    (split_px, shift_px): (f32, u32),
) -> Pixels {
    let [left, right] = pictures else {
        return (pictures.concat(), (width, height));
    };
    let begins = (split_px.round().max(0.0) as u32).min(width + shift_px);
    let mut rgba = Vec::with_capacity(4 * ((width + shift_px) * height) as usize);
    for row in 0..height {
        let at = |x: u32| 4 * (row * width + x) as usize;
        rgba.extend_from_slice(&left[at(0)..at(begins.min(width))]);
        rgba.extend_from_slice(&right[at(begins - shift_px.min(begins))..at(width)]);
    }
    (rgba, (width + shift_px, height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_pictures_share_a_file_as_they_share_the_window() {
        let picture = |value: u8| (0..6).flat_map(|k| [value, k, 0, 255]).collect::<Vec<u8>>();
        let pictures = [picture(1), picture(2)];
        let columns = |pixels: Pixels| {
            let ((rgba, size), mut found) = (pixels, Vec::new());
            for pixel in rgba.chunks(4) {
                found.push((pixel[0], pixel[1]));
            }
            (found, size)
        };
        let one = columns(composed(&pictures[..1], (3, 2), (9.0, 0)));
        assert_eq!(one.1, (3, 2));
        let split = columns(composed(&pictures, (3, 2), (1.0, 0)));
        let expected = [(1, 0), (2, 1), (2, 2), (1, 3), (2, 4), (2, 5)];
        assert_eq!(split, (expected.to_vec(), (3, 2)));
        let (sides, size) = columns(composed(&pictures, (3, 2), (3.0, 3)));
        assert_eq!(size, (6, 2));
        let top = [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)];
        assert_eq!(sides[..6], top);
    }
}
