//! The format that an output file's name implies.

use std::path::Path;

use anyhow::bail;

/// Ends of names that promise some format of meshes, pictures or text. Any other name, and none, promises nothing.
const PROMISING: [&str; 25] = [
    "3ds", "blend", "bmp", "dae", "fbx", "gif", "glb", "gltf", "html", "jpeg", "jpg", "json",
    "obj", "off", "pdf", "ply", "png", "stl", "svg", "tga", "tif", "tiff", "usdz", "webp", "zip",
];

/// The end of a file's name in lower case, if it promises a format.
fn promised(path: &Path) -> Option<String> {
    let end = path.extension()?.to_string_lossy().to_lowercase();
    PROMISING.contains(&end.as_str()).then_some(end)
}

/// Refuses to write an asset under a name that promises something else.
///
/// # Errors
/// One sentence with the name.
pub(crate) fn check_asset(path: &Path) -> anyhow::Result<()> {
    match promised(path).as_deref() {
        None | Some("glb") => Ok(()),
        Some(end) => bail!(
            "{}: an asset is a binary glTF file, not .{end}: give it a name that ends in .glb",
            path.display()
        ),
    }
}

/// Refuses to write a page under a name that does not say so: most other files beside a capture are what it is read from.
///
/// # Errors
/// One sentence with the name.
pub(crate) fn check_page(path: &Path) -> anyhow::Result<()> {
    let end = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match end.as_deref() {
        None | Some("html" | "htm") => Ok(()),
        Some(end) => bail!(
            "{}: a page is written as HTML, not .{end}: give it a name that ends in .html",
            path.display()
        ),
    }
}

/// File formats of pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PictureKind {
    /// PNG
    Png,
    /// JPEG, without transparency
    Jpeg,
    /// WebP that loses nothing
    Webp,
}

impl PictureKind {
    /// The format that a file's name promises; PNG where it promises none.
    ///
    /// # Errors
    /// One sentence when the name promises what is not written.
    pub(crate) fn of(path: &Path) -> anyhow::Result<Self> {
        Ok(match promised(path).as_deref() {
            None | Some("png") => Self::Png,
            Some("jpg" | "jpeg") => Self::Jpeg,
            Some("webp") => Self::Webp,
            Some(end) => bail!(
                "{}: pictures are written as .png, .jpg or .webp, not .{end}",
                path.display()
            ),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_promises_something_else_is_refused() {
        for name in [
            "a.glb",
            "A.GLB",
            "a",
            "/dev/null",
            "a.asset",
            "v1.2",
            ".glb",
        ] {
            assert!(check_asset(Path::new(name)).is_ok(), "{name}");
        }
        for name in ["a.gltf", "a.OBJ", "a.glb.png"] {
            let refused = check_asset(Path::new(name)).unwrap_err().to_string();
            assert!(refused.starts_with(name), "{refused}");
        }
        for name in ["a.html", "A.HTM", "a", "/dev/null"] {
            assert!(check_page(Path::new(name)).is_ok(), "{name}");
        }
        for name in ["images.txt", "a.json", "a.html.png", "a.pgm"] {
            let refused = check_page(Path::new(name)).unwrap_err().to_string();
            assert!(refused.starts_with(name), "{refused}");
        }
        let kind = |name: &str| PictureKind::of(Path::new(name)).ok();
        assert_eq!(kind("a.JPG"), Some(PictureKind::Jpeg));
        assert_eq!(kind("/dev/stdout"), Some(PictureKind::Png));
        assert_eq!(kind("a.webp"), Some(PictureKind::Webp));
        assert_eq!(kind("a.glb"), None);
    }
}
