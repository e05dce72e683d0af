//! Material libraries of OBJ files, and the textures they name.
//!
//! Read by `tobj`, after everything but names, diffuse colours and diffuse textures is taken out: that crate panics on a
//! colour with fewer than three numbers, and gives up the whole library on a number it cannot read. Whatever is missing
//! or broken here costs colour and a warning, never the mesh.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use silmap_geometry::{ColourImage, Material};

use super::raw::RawMesh;

/// The materials of the libraries opened so far.
pub(super) struct MaterialLibrary<'a> {
    folder: &'a Path,
    materials: Vec<(PathBuf, tobj::Material)>,
    images: Vec<(PathBuf, Option<ColourImage>)>,
    has_library: bool,
}

impl<'a> MaterialLibrary<'a> {
    /// No library yet; `folder` is where the OBJ file lies.
    pub(super) fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            materials: Vec::new(),
            images: Vec::new(),
            has_library: false,
        }
    }

    /// Reads a library.
    pub(super) fn open(&mut self, name: &str, raw: &mut RawMesh) {
        self.has_library = true;
        let path = self.folder.join(portable(name));
        let text = match std::fs::read(&path) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) => {
                raw.ignore(format!("material library `{name}` cannot be read: {error}"));
                return;
            }
        };
        let folder = path.parent().unwrap_or(self.folder).to_owned();
        match tobj::load_mtl_buf(&mut Cursor::new(colour_lines(&text))) {
            Ok((materials, _)) => {
                let found = materials.into_iter().map(|m| (folder.clone(), m));
                self.materials.extend(found);
            }
            Err(error) => raw.ignore(format!("material library `{name}`: {error}")),
        }
    }

    /// A material by its name, with its texture.
    pub(super) fn material(&mut self, name: &str, raw: &mut RawMesh) -> Option<Material> {
        let found = self.materials.iter().rev().find(|(_, m)| m.name == name);
        let Some((folder, material)) = found.cloned() else {
            if self.has_library {
                raw.ignore(format!("material `{name}` is not in the material library"));
            } else {
                raw.ignore(format!("material `{name}` has no material library"));
            }
            return None;
        };
        let texture = material
            .diffuse_texture
            .and_then(|file| self.image(&folder.join(portable(file_name(&file))), raw));
        let mut base_colour = material.diffuse.unwrap_or([1.0; 3]);
        // Exporters write black where the texture says it all.
        if texture.is_some() && base_colour == [0.0; 3] {
            base_colour = [1.0; 3];
        }
        Some(Material {
            base_colour,
            texture,
            ..Material::default()
        })
    }

    fn image(&mut self, path: &Path, raw: &mut RawMesh) -> Option<ColourImage> {
        if let Some((_, image)) = self.images.iter().find(|(known, _)| known == path) {
            return image.clone();
        }
        let image = match std::fs::read(path) {
            Ok(bytes) => decode_image(&bytes),
            Err(error) => Err(error.to_string()),
        };
        let image = image
            .map_err(|reason| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                raw.ignore(format!("texture `{name}` cannot be read: {reason}"));
            })
            .ok();
        self.images.push((path.to_owned(), image.clone()));
        image
    }
}

/// Decodes a PNG or JPEG; the limits of the crate keep a header from claiming absurd sizes.
pub(super) fn decode_image(bytes: &[u8]) -> Result<ColourImage, String> {
    let reader = image::ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|e| e.to_string())?;
    let decoded = reader.decode().map_err(|e| e.to_string())?.into_rgba8();
    Ok(ColourImage {
        width: decoded.width(),
        height: decoded.height(),
        rgba: decoded.into_raw(),
    })
}

/// Paths written on Windows.
fn portable(name: &str) -> String {
    name.replace('\\', "/")
}

/// The file of a texture statement, which may begin with options (`-s 1 1 1 file.png`); names may hold blanks.
fn file_name(statement: &str) -> &str {
    let statement = statement.trim();
    if statement.starts_with('-') {
        statement.split_whitespace().last().unwrap_or(statement)
    } else {
        statement
    }
}

/// The lines of a library that name a material or its diffuse colour or texture, as far as they can be read.
fn colour_lines(text: &str) -> String {
    let mut kept = String::new();
    for line in text.lines().map(str::trim) {
        let (keyword, rest) = line
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((line, ""));
        let rest = rest.trim();
        let is_readable = match keyword {
            "newmtl" | "map_Kd" => !rest.is_empty(),
            "Kd" => {
                let numbers: Vec<Option<f32>> = rest
                    .split_whitespace()
                    .map(|w| w.parse().ok().filter(|x: &f32| x.is_finite()))
                    .collect();
                numbers.len() == 3 && numbers.iter().all(Option::is_some)
            }
            _ => false,
        };
        if is_readable {
            kept.push_str(keyword);
            kept.push(' ');
            kept.push_str(rest);
            kept.push('\n');
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_broken_colour_does_not_reach_the_parser() {
        let lines = colour_lines(
            "newmtl a b\t\n Kd 1\nKd 0 1 nan\nillum 4.5e-304\n\tmap_Kd my file.png \nKd .1 .2 .3",
        );
        assert_eq!(lines, "newmtl a b\nmap_Kd my file.png\nKd .1 .2 .3\n");
        let (materials, _) = tobj::load_mtl_buf(&mut Cursor::new(lines)).unwrap();
        assert_eq!(materials[0].name, "a b");
        assert_eq!(materials[0].diffuse, Some([0.1, 0.2, 0.3]));
        assert_eq!(materials[0].diffuse_texture.as_deref(), Some("my file.png"));
    }

    #[test]
    fn options_before_a_texture_name_are_skipped() {
        assert_eq!(file_name("-s 1 1 1 -o 0 0 skin.png"), "skin.png");
        assert_eq!(file_name("fuze uv.jpg"), "fuze uv.jpg");
    }
}
