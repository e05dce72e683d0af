//! Material libraries of OBJ files, and the textures they name.
//!
//! Names, diffuse colours and diffuse textures are taken. Libraries are read here, because `tobj` hands on the options
//! before a texture's name as part of the name, panics on a colour with fewer than three numbers, and gives up the whole
//! library on a number it cannot read. Whatever is missing or broken here costs colour and a warning, never the mesh.
//!
//! A texture's offset (`-o`) and scale (`-s`) go into the texture coordinates: `u' = s u + o`, as renderers of today have
//! it. Options that only change how a renderer filters are passed over; those that change colours are left out with a
//! warning.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use silmap_geometry::{ColourImage, Material, TextureWrap};

use super::raw::RawMesh;
use super::text::find_file;

/// The most blanks, and one more, in the name of one library among several.
const MOST_WORDS: usize = 16;

/// The materials of the libraries opened so far.
pub(super) struct MaterialLibrary<'a> {
    folder: &'a Path,
    materials: BTreeMap<String, Entry>,
    images: BTreeMap<PathBuf, Option<ColourImage>>,
    has_library: bool,
}

/// One material of a library.
#[derive(Clone, Debug, Default)]
struct Entry {
    name: String,
    folder: PathBuf,
    diffuse: Option<[f32; 3]>,
    /// What follows `map_Kd`.
    texture: Option<String>,
    is_transparent: bool,
}

/// A material as faces use it.
#[derive(Clone, Debug)]
pub(super) struct Painted {
    pub(super) material: Material,
    pub(super) placement: Placement,
}

/// Where a texture lies on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    offset: [f32; 2],
    scale: [f32; 2],
    /// Beside the picture there is nothing.
    pub(super) is_clamped: bool,
}

impl Default for Placement {
    fn default() -> Self {
        Self {
            offset: [0.0; 2],
            scale: [1.0; 2],
            is_clamped: false,
        }
    }
}

impl Placement {
    /// Texture coordinates of the picture, of those of the surface; v points down in both.
    pub(super) fn apply(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        if *self == Self::default() {
            return [u, v];
        }
        let along = |a: usize, x: f32| self.scale[a] * x + self.offset[a];
        [along(0, u), 1.0 - along(1, 1.0 - v)]
    }
}

impl<'a> MaterialLibrary<'a> {
    /// No library yet; `folder` is where the OBJ file lies.
    pub(super) fn new(folder: &'a Path) -> Self {
        Self {
            folder,
            materials: BTreeMap::new(),
            images: BTreeMap::new(),
            has_library: false,
        }
    }

    /// Reads the libraries of one statement: several names, each of which may hold blanks.
    pub(super) fn open(&mut self, statement: &str, raw: &mut RawMesh) {
        self.has_library = true;
        let words: Vec<&str> = statement.split_whitespace().collect();
        let mut from = 0;
        // Of libraries with a material of the same name, the one that is named first counts; of statements, the last.
        let mut found = Vec::new();
        while from < words.len() {
            let whole = [statement.trim()];
            let runs = (from + 1..=words.len().min(from + MOST_WORDS)).rev();
            let known = runs.clone().find_map(|to| {
                let name = words[from..to].join(" ");
                Some((to, find_file(self.folder, &name)?))
            });
            let known = known.or_else(|| {
                let path = find_file(self.folder, whole[0]).filter(|_| from == 0)?;
                Some((words.len(), path))
            });
            let Some((to, path)) = known else {
                let ends_name = |w: &&str| w.to_ascii_lowercase().ends_with(".mtl");
                let to = words[from..]
                    .iter()
                    .position(ends_name)
                    .map_or(words.len(), |at| from + at + 1);
                let name = words[from..to].join(" ");
                raw.ignore(format!(
                    "material library `{name}` cannot be read: there is no such file"
                ));
                from = to;
                continue;
            };
            match crate::input::read(&path) {
                Ok(bytes) => {
                    let folder = path.parent().unwrap_or(self.folder);
                    let library = entries(&String::from_utf8_lossy(&bytes), folder);
                    found.splice(0..0, library);
                }
                Err(error) => {
                    let name = words[from..to].join(" ");
                    raw.ignore(format!("material library `{name}` cannot be read: {error}"));
                }
            }
            from = to;
        }
        let named = found.into_iter().map(|entry| (entry.name.clone(), entry));
        self.materials.extend(named);
    }

    /// A material by its name, with its texture.
    pub(super) fn material(&mut self, name: &str, raw: &mut RawMesh) -> Option<Painted> {
        let Some(entry) = self.materials.get(name).cloned() else {
            if self.has_library {
                raw.ignore(format!("material `{name}` is not in the material library"));
            } else {
                raw.ignore(format!("material `{name}` has no material library"));
            }
            return None;
        };
        if entry.is_transparent {
            raw.ignore(format!(
                "material `{name}` lets light through: it is taken as opaque"
            ));
        }
        let mut placement = Placement::default();
        let texture = entry.texture.as_deref().and_then(|statement| {
            let map = TextureStatement::parse(statement, &entry.folder);
            placement = map.placement;
            for option in &map.left_out {
                raw.ignore(format!("option {option} of a texture is left out"));
            }
            self.image(&map, &entry.folder, raw)
        });
        let mut base_colour = entry.diffuse.unwrap_or([1.0; 3]);
        // Exporters write black where the texture says it all.
        if texture.is_some() && base_colour == [0.0; 3] {
            base_colour = [1.0; 3];
        }
        Some(Painted {
            material: Material {
                base_colour,
                texture,
                wrap: if placement.is_clamped {
                    [TextureWrap::ClampToEdge; 2]
                } else {
                    <[TextureWrap; 2]>::default()
                },
            },
            placement,
        })
    }

    fn image(
        &mut self,
        map: &TextureStatement,
        folder: &Path,
        raw: &mut RawMesh,
    ) -> Option<ColourImage> {
        let path = map
            .path
            .clone()
            .unwrap_or_else(|| folder.join(map.name.replace('\\', "/")));
        if let Some(image) = self.images.get(&path) {
            return image.clone();
        }
        let image = read_image(&path)
            .map_err(|reason| {
                let name = path.file_name().unwrap_or_default().to_string_lossy();
                raw.ignore(format!("texture `{name}` cannot be read: {reason}"));
            })
            .ok();
        self.images.insert(path, image.clone());
        image
    }
}

/// Reads a picture file.
pub(super) fn read_image(path: &Path) -> Result<ColourImage, String> {
    let bytes = crate::input::read(path).map_err(|e| e.to_string())?;
    decode_image(&bytes)
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

/// What a texture statement says: options, then a name.
#[derive(Debug, Default)]
struct TextureStatement {
    placement: Placement,
    name: String,
    /// The file of that name, if there is one.
    path: Option<PathBuf>,
    /// Options that change colours and are not carried out.
    left_out: Vec<String>,
}

impl TextureStatement {
    /// Reads a statement. Some writers put options behind the name, and a name may begin with a number as an option's
    /// values do: the reading for which there is a file counts.
    fn parse(statement: &str, folder: &Path) -> Self {
        let map = Self::options_first(statement, folder);
        if map.path.is_none()
            && let Some((name, options)) = map.name.split_once(" -")
            && let Some(path) = find_file(folder, unquoted(name))
        {
            let behind = Self::options_first(&format!("-{options} {name}"), folder);
            return Self {
                path: Some(path),
                ..behind
            };
        }
        map
    }

    /// Reads a statement whose options stand before the name.
    fn options_first(statement: &str, folder: &Path) -> Self {
        let mut map = Self::default();
        let mut rest = statement.trim();
        while let Some((option, values)) = split_option(rest) {
            let words: Vec<&str> = leading_words(values, option.most_values());
            let mut taken = option.count_values(&words);
            // Numbers may belong to the name.
            while taken > option.least_values() && leads_to_file(values, taken, folder).is_none() {
                match (option.least_values()..taken)
                    .rev()
                    .find(|&fewer| leads_to_file(values, fewer, folder).is_some())
                {
                    Some(fewer) => taken = fewer,
                    None => break,
                }
            }
            option.apply(&words[..taken.min(words.len())], &mut map);
            rest = after_words(values, taken);
        }
        map.name = unquoted(rest).to_owned();
        map.path = find_file(folder, &map.name);
        map
    }
}

fn unquoted(name: &str) -> &str {
    let name = name.trim();
    name.strip_prefix('"')
        .and_then(|n| n.strip_suffix('"'))
        .unwrap_or(name)
}

/// Whether what follows some words of a statement is a file's name, if it is not another option.
fn leads_to_file(values: &str, words: usize, folder: &Path) -> Option<()> {
    let rest = after_words(values, words);
    if split_option(rest).is_some() {
        return Some(());
    }
    find_file(folder, unquoted(rest)).map(|_| ())
}

fn leading_words(text: &str, most: usize) -> Vec<&str> {
    text.split_whitespace().take(most).collect()
}

fn after_words(text: &str, count: usize) -> &str {
    (0..count).fold(text.trim_start(), |rest, _| {
        rest.split_once(|c: char| c.is_whitespace())
            .map_or("", |(_, rest)| rest.trim_start())
    })
}

/// An option of a texture statement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum TextureOption {
    Offset,
    Scale,
    Turbulence,
    Clamp,
    /// Base and gain of the texture's values.
    Range,
    /// One word that says how to filter, correct or pick a channel.
    Filter,
    /// One word that names a projection.
    Projection,
}

/// The option a statement begins with, and what follows it.
fn split_option(rest: &str) -> Option<(TextureOption, &str)> {
    let (word, values) = rest.split_once(|c: char| c.is_whitespace())?;
    let option = match word.to_ascii_lowercase().as_str() {
        "-o" => TextureOption::Offset,
        "-s" => TextureOption::Scale,
        "-t" => TextureOption::Turbulence,
        "-clamp" => TextureOption::Clamp,
        "-mm" => TextureOption::Range,
        "-bm" | "-blendu" | "-blendv" | "-boost" | "-texres" | "-imfchan" | "-cc" => {
            TextureOption::Filter
        }
        "-type" => TextureOption::Projection,
        _ => return None,
    };
    Some((option, values.trim_start()))
}

impl TextureOption {
    fn most_values(self) -> usize {
        match self {
            Self::Offset | Self::Scale | Self::Turbulence => 3,
            Self::Range => 2,
            Self::Clamp | Self::Filter | Self::Projection => 1,
        }
    }

    fn least_values(self) -> usize {
        match self {
            Self::Range => 2,
            _ => 1,
        }
    }

    /// How many of some words are this option's values.
    fn count_values(self, words: &[&str]) -> usize {
        match self {
            Self::Clamp | Self::Filter | Self::Projection => words.len().min(1),
            _ => {
                let is_number = |w: &&&str| w.parse::<f32>().is_ok();
                words.iter().take_while(is_number).count()
            }
        }
    }

    fn apply(self, words: &[&str], map: &mut TextureStatement) {
        let numbers: Vec<f32> = words
            .iter()
            .filter_map(|w| w.parse().ok())
            .filter(|x: &f32| x.is_finite())
            .collect();
        let said = |option: &str| format!("`{option} {}`", words.join(" "));
        match self {
            Self::Offset => map.placement.offset.iter_mut().zip(numbers).for_each(put),
            Self::Scale => map.placement.scale.iter_mut().zip(numbers).for_each(put),
            Self::Clamp => map.placement.is_clamped = words == ["on"],
            Self::Turbulence if numbers.iter().any(|&x| x != 0.0) => {
                map.left_out.push(said("-t"));
            }
            Self::Range if numbers != [0.0, 1.0] => map.left_out.push(said("-mm")),
            Self::Projection => map.left_out.push(said("-type")),
            _ => {}
        }
    }
}

fn put((slot, value): (&mut f32, f32)) {
    *slot = value;
}

/// The materials of a library, as far as they can be read.
fn entries(text: &str, folder: &Path) -> Vec<Entry> {
    let mut entries: Vec<Entry> = Vec::new();
    for line in text.lines().map(str::trim) {
        let (keyword, rest) = line
            .split_once(|c: char| c.is_whitespace())
            .unwrap_or((line, ""));
        let rest = rest.trim();
        let keyword = keyword.to_ascii_lowercase();
        if keyword == "newmtl" && !rest.is_empty() {
            entries.push(Entry {
                name: rest.to_owned(),
                folder: folder.to_owned(),
                ..Entry::default()
            });
            continue;
        }
        let Some(entry) = entries.last_mut() else {
            continue;
        };
        match keyword.as_str() {
            "kd" => entry.diffuse = read_colour(rest).or(entry.diffuse),
            "map_kd" if !rest.is_empty() => entry.texture = Some(rest.to_owned()),
            "map_d" | "map_tr" if !rest.is_empty() => entry.is_transparent = true,
            // `d -halo 0.5` too.
            "d" => {
                let opacity = rest.split_whitespace().find_map(|w| w.parse::<f32>().ok());
                entry.is_transparent |= opacity.is_some_and(|d| d < 1.0);
            }
            // Writers disagree on which end of it is opaque.
            "tr" => {
                let is_between = |t: f32| t > 0.0 && t < 1.0;
                entry.is_transparent |= rest.parse().is_ok_and(is_between);
            }
            _ => {}
        }
    }
    entries
}

/// Three numbers, or one for all three.
fn read_colour(rest: &str) -> Option<[f32; 3]> {
    let numbers: Vec<f32> = rest
        .split('#')
        .next()?
        .split_whitespace()
        .map(|w| w.parse().ok().filter(|x: &f32| x.is_finite()))
        .collect::<Option<_>>()?;
    match numbers[..] {
        [grey] => Some([grey; 3]),
        [red, green, blue, ..] => Some([red, green, blue]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_read_in_a_library_is_passed_over() {
        let text = "Kd 1 1 1\nnewmtl a b\t\n Kd 1\nKd 0 1 nan\nKd 0 1\nillum 4.5e-304\n\tmap_Kd my file.png \nKd .1 .2 .3\n\
                    newmtl grey\nKd 0.5\nd 0.25\nnewmtl spectral\nKd spectral a.rfl\nd 1\nTr 1";
        let found = entries(text, Path::new(""));
        let named = |i: usize| (found[i].name.as_str(), found[i].diffuse);
        assert_eq!(named(0), ("a b", Some([0.1, 0.2, 0.3])));
        assert_eq!(named(1), ("grey", Some([0.5; 3])));
        assert_eq!(named(2), ("spectral", None));
        assert_eq!(found[0].texture.as_deref(), Some("my file.png"));
        assert_eq!(
            found.iter().map(|e| e.is_transparent).collect::<Vec<_>>(),
            [false, true, false]
        );
    }

    #[test]
    fn options_of_a_texture_are_told_from_its_name() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["skin.png", "06 b.png", "a -b.png"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let parse = |statement: &str| TextureStatement::parse(statement, folder.path());
        let name = |statement: &str| {
            let map = parse(statement);
            assert_eq!(map.path.is_some(), map.name != "gone.png", "{statement}");
            map.name
        };
        for statement in [
            "skin.png",
            "-s 1 1 1 -o 0 0 skin.png",
            "-o 0.5 skin.png",
            "-bm 0.3 -clamp on -mm 0 1 skin.png",
            "-texres 512 -blendu off -blendv on -imfchan r -cc on -boost 2 \"skin.png\"",
            "-t 1 1 1 -type sphere skin.png",
            "skin.png -s 2 2 1",
        ] {
            assert_eq!(name(statement), "skin.png", "{statement}");
        }
        assert_eq!(name("-s 2 2 06 b.png"), "06 b.png");
        assert_eq!(name("06 b.png"), "06 b.png");
        assert_eq!(name("a -b.png"), "a -b.png");
        assert_eq!(name("-s 2 gone.png"), "gone.png");
        assert_eq!(parse("-s 2 2 06 b.png").placement.scale, [2.0; 2]);
        assert_eq!(parse("skin.png -s 2 3 1").placement.scale, [2.0, 3.0]);
        // Names that look like options lead around in a circle.
        for name in ["-y", "-z"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        assert!(parse("-y -z").path.is_some());
        assert!(parse("-clamp on skin.png").placement.is_clamped);
        assert_eq!(parse("-mm 0.5 2 skin.png").left_out, ["`-mm 0.5 2`"]);
        let moved = parse("-o 0.25 0.5 -s 2 4 1 skin.png").placement;
        // v up is 0.25, which becomes 4 × 0.25 + 0.5.
        assert_eq!(moved.apply([0.5, 0.75]), [1.25, -0.5]);
    }

    #[test]
    fn a_statement_may_name_several_libraries_and_names_hold_blanks() {
        let folder = tempfile::tempdir().unwrap();
        let write =
            |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("a.mtl", "newmtl one\nKd 1 0 0\nnewmtl two\nKd 0 1 0\n");
        write(
            "my second.mtl",
            "newmtl two\nKd 0 0 1\nnewmtl three\nKd 0.5 0.5 0.5\n",
        );
        let colours = |statement: &str| {
            let mut raw = RawMesh::counting_from(1);
            let mut library = MaterialLibrary::new(folder.path());
            library.open(statement, &mut raw);
            let colours = ["one", "two", "three"]
                .map(|name| Some(library.material(name, &mut raw)?.material.base_colour));
            (colours, raw.warnings.len())
        };
        let (red, green, blue, grey) =
            ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5; 3]);
        let (all, warnings) = colours("a.mtl my second.mtl");
        assert_eq!((all, warnings), ([Some(red), Some(green), Some(grey)], 0));
        let (all, _) = colours("my second.mtl A.MTL");
        assert_eq!(all, [Some(red), Some(blue), Some(grey)]);
        // One is missing, and so are its materials.
        let (all, warnings) = colours("no such.mtl my second.mtl");
        assert_eq!((all, warnings), ([None, Some(blue), Some(grey)], 2));
        // Names are looked for among a bounded number of words each.
        let (all, warnings) = colours(&("no.mtl ".repeat(2000) + "my second.mtl"));
        assert_eq!((all, warnings), ([None, Some(blue), Some(grey)], 2));
    }
}
