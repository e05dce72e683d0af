//! Plain 3×4 matrices: in a file for each view or in one for all, of text or of OpenCV; and PMVS, which has a folder of them.
//!
//! The matrices' sign is not agreed on: each is multiplied by ±1 so that its left block has a positive determinant, as that of a
//! photograph which is not mirrored has when the depth is positive in front.
//!
//! Source: Hartley, Zisserman, Multiple View Geometry, 2nd ed., section 6.2; Y. Furukawa, J. Ponce. Accurate, Dense, and Robust
//! Multi-View Stereopsis. IEEE PAMI 32(8), 2010, and the documentation of PMVS-2: a line `CONTOUR`, then the matrix, in
//! `txt/%08d.txt`; OpenCV, `FileStorage`.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use silmap_mesh_io::input;

use crate::declared::{Declared, DeclaredView, MaskPlace};
use crate::error::{CaptureError, CaptureFault};
use crate::find_mask::size_by_pictures;
use crate::lens::Distortion;
use crate::pictures;
use crate::pinhole::{Matrix34, Pinhole};
use crate::view::{CameraFormat, CaptureWarning};

/// The first pixel's centre, as PMVS and the tools of such sets have it.
const PIXEL_CENTRE: f64 = 0.0;

/// Numbers of a matrix.
const NUMBERS: usize = 12;

/// The word before the matrix in files of PMVS.
const CONTOUR: &str = "CONTOUR";

/// Folders of matrices in a capture's, those of PMVS first.
const FOLDERS: [&str; 6] = ["txt", "pmvs/txt", "", "cameras", "calib", "P"];

/// Extensions of their files.
const EXTENSIONS: [&str; 2] = ["P", "txt"];

/// A matrix, and what it is called where that is said.
#[derive(Clone, Debug, PartialEq)]
struct Named {
    name: Option<String>,
    matrix: Matrix34,
}

/// The file, or the first of the files, of matrices in a capture's folder.
pub(crate) fn find(folder: &Path) -> Option<PathBuf> {
    FOLDERS.iter().find_map(|place| {
        let found = pictures::files(&folder.join(place), is_of_matrices);
        found.into_iter().find(|file| {
            let text = input::read_text(file);
            text.is_ok_and(|text| parse(&text).is_ok_and(|found| !found.is_empty()))
        })
    })
}

/// Whether a file may hold matrices, by its name.
pub(crate) fn is_of_matrices(path: &Path) -> bool {
    let extension = path.extension();
    extension.is_some_and(|e| EXTENSIONS.iter().any(|known| e == *known))
}

/// Reads a file of matrices; where it has just one, those beside it too. Returns the folder of photographs and masks.
pub(crate) fn read(file: &Path) -> Result<(CameraFormat, Declared, PathBuf), CaptureError> {
    let folder = pictures::folder_of(file);
    let first = read_file(file)?;
    let is_pmvs = first.is_contour;
    if first.found.is_empty() {
        return Err(CaptureFault::NoViews.at(file));
    }
    let name = folder.file_name().and_then(|name| name.to_str());
    let root = match name.is_some_and(|name| FOLDERS.contains(&name)) {
        true => pictures::folder_of(&folder),
        false => folder.clone(),
    };
    let mut all = Vec::new();
    if first.found.len() > 1 {
        all.extend(first.found.into_iter().enumerate().map(|(k, found)| {
            let name = found.name.unwrap_or_else(|| k.to_string());
            (name, found.matrix, file.to_owned())
        }));
    } else {
        let same = |path: &Path| path.extension() == file.extension();
        let mut files = pictures::files(&folder, same);
        files
            .sort_by(|a, b| pictures::by_numbers(&pictures::file_name(a), &pictures::file_name(b)));
        let has_pictures = |name: &str| {
            let photo = pictures::find(&root, name).unwrap_or_else(|| root.join(name));
            size_by_pictures(&photo, &root).is_some()
        };
        for path in files {
            let name = path
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            match read_file(&path) {
                Ok(found) if found.found.len() == 1 || is_pmvs => {
                    let matrices = found.found.into_iter().map(|f| f.matrix);
                    all.extend(matrices.map(|matrix| (name.clone(), matrix, path.clone())));
                }
                Err(error) if is_pmvs || has_pictures(&name) => return Err(error),
                // What else lies in the folder, such as a text to read first, is none of them.
                Ok(_) | Err(_) => {}
            }
        }
    }
    let format = if is_pmvs {
        CameraFormat::Pmvs
    } else {
        CameraFormat::Matrices
    };
    let declared = declared(&all, &root)?;
    Ok((format, declared, root))
}

/// Views of matrices that another file holds, with their names.
pub(crate) fn of_list(
    list: Vec<(String, Matrix34)>,
    file: &Path,
    root: &Path,
) -> Result<Declared, CaptureError> {
    let all: Vec<_> = (list.into_iter())
        .map(|(name, matrix)| (name, matrix, file.to_owned()))
        .collect();
    match all.is_empty() {
        true => Err(CaptureFault::NoViews.at(file)),
        false => declared(&all, root),
    }
}

struct FileOfMatrices {
    is_contour: bool,
    found: Vec<Named>,
}

fn read_file(path: &Path) -> Result<FileOfMatrices, CaptureError> {
    let text = input::read_text(path).map_err(|e| CaptureFault::Unreadable(e).at(path))?;
    let found = parse(&text).map_err(|fault| fault.at(path))?;
    Ok(FileOfMatrices {
        is_contour: text.trim_start().starts_with(CONTOUR),
        found,
    })
}

/// Rows of four, three for a matrix, with a name's line before it or not; or lines of twelve, after a name or without.
fn parse(text: &str) -> Result<Vec<Named>, CaptureFault> {
    let mut found = Vec::new();
    let mut rows: Vec<[f64; 4]> = Vec::new();
    let mut name: Option<String> = None;
    let mut last_line = 0;
    for (k, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<&str> = line
            .split([' ', '\t', ',', ';', '\r'])
            .filter(|word| !word.is_empty())
            .collect();
        let fault = |reason: String| CaptureFault::Line {
            line: k + 1,
            reason,
        };
        if words.is_empty() {
            continue;
        }
        last_line = k + 1;
        let numbers = |words: &[&str]| -> Option<Vec<f64>> {
            words.iter().map(|word| word.parse().ok()).collect()
        };
        let behind_name = words.len().checked_sub(NUMBERS).filter(|&n| n > 0);
        let all = numbers(&words);
        match (all.as_deref(), words.len()) {
            (Some(&[a, b, c, d]), _) => {
                rows.push([a, b, c, d]);
                if let [first, second, third] = rows[..] {
                    let matrix = [first, second, third];
                    found.push(Named {
                        name: name.take(),
                        matrix,
                    });
                    rows.clear();
                }
            }
            (Some(numbers), NUMBERS) if rows.is_empty() && name.is_none() => {
                found.push(Named {
                    name: None,
                    matrix: of_numbers(numbers),
                });
            }
            // A count of the matrices.
            (Some(&[_]), 1) if found.is_empty() && rows.is_empty() && k == 0 => {}
            (None, 1) if rows.is_empty() && name.is_none() => match words[0] {
                CONTOUR => {}
                word if word.starts_with(CONTOUR) => {
                    return Err(fault(format!("{word} is no matrix: it needs {CONTOUR}")));
                }
                word => name = Some(word.to_owned()),
            },
            _ => {
                let behind = behind_name.filter(|_| rows.is_empty() && name.is_none());
                let Some((n, numbers)) = behind.and_then(|n| Some((n, numbers(&words[n..])?)))
                else {
                    return Err(fault(format!(
                        "a row of four numbers, or a name and {NUMBERS} numbers, is expected, and these are {} words",
                        words.len()
                    )));
                };
                found.push(Named {
                    name: Some(words[..n].join(" ")),
                    matrix: of_numbers(&numbers),
                });
            }
        }
    }
    if !rows.is_empty() || name.is_some() {
        return Err(CaptureFault::Line {
            line: last_line,
            reason: format!("it ends after {} of 3 rows of a matrix", rows.len()),
        });
    }
    Ok(found)
}

fn of_numbers(numbers: &[f64]) -> Matrix34 {
    std::array::from_fn(|r| std::array::from_fn(|c| numbers.get(4 * r + c).copied().unwrap_or(0.0)))
}

/// Views of matrices, each with its name and the file that it is of.
fn declared(list: &[(String, Matrix34, PathBuf)], root: &Path) -> Result<Declared, CaptureError> {
    let mut photos: Vec<Option<PathBuf>> = (list.iter())
        .map(|(name, ..)| pictures::find(root, name))
        .collect();
    let mut warnings = Vec::new();
    let has_mask = |name: &str| size_by_pictures(Path::new(name), root).is_some();
    let is_unnamed = photos.iter().all(Option::is_none) && !list.iter().any(|l| has_mask(&l.0));
    if let Some(found) = is_unnamed
        .then(|| pictures::in_order(root, list.len()))
        .flatten()
    {
        warnings.push(CaptureWarning::InOrder { count: list.len() });
        photos = found.into_iter().map(Some).collect();
    }
    let mut views = Vec::new();
    for ((name, matrix, file), photo) in list.iter().zip(photos) {
        let photo = photo.unwrap_or_else(|| root.join(name));
        let name = match Path::new(name).extension() {
            Some(_) if photo.is_file() && pictures::file_name(&photo) == *name => Path::new(name)
                .with_extension("")
                .to_string_lossy()
                .into_owned(),
            _ => name.clone(),
        };
        let size = size_by_pictures(&photo, root);
        let size = size.ok_or_else(|| CaptureFault::NoSize { view: name.clone() }.at(file))?;
        let camera = Pinhole::from_matrix(&in_front(matrix), 0.5 - PIXEL_CENTRE, size);
        let camera = camera.map_err(|fault| {
            let view = name.clone();
            CaptureFault::Camera { view, fault }.at(file)
        })?;
        views.push(DeclaredView {
            camera,
            distortion: Distortion::default(),
            mask: MaskPlace::ByConvention,
            photo: Some(photo),
            name,
        });
    }
    Ok(Declared::of(views, PIXEL_CENTRE, warnings))
}

/// The matrix, or its negative, whose left block has a positive determinant.
fn in_front(matrix: &Matrix34) -> Matrix34 {
    let largest = matrix
        .iter()
        .flatten()
        .fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
    let row = |r: usize| DVec3::new(matrix[r][0], matrix[r][1], matrix[r][2]) / largest;
    match DMat3::from_cols(row(0), row(1), row(2)).determinant() < 0.0 {
        true => matrix.map(|row| row.map(|v| -v)),
        false => *matrix,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_found_in_text_of_any_layout() {
        let rows = "1 2 3 4\n5 6 7 8\n9 10 11 12\n";
        let one_line = "1 2 3 4 5 6 7 8 9 10 11 12";
        let matrix = [
            [1.0, 2.0, 3.0, 4.0],
            [5.0, 6.0, 7.0, 8.0],
            [9.0, 10.0, 11.0, 12.0],
        ];
        let of = |text: &str| parse(text).unwrap();
        let named = |name: Option<&str>| Named {
            name: name.map(str::to_owned),
            matrix,
        };
        assert_eq!(of(rows), [named(None)]);
        assert_eq!(of(&format!("CONTOUR\n{rows}")), [named(None)]);
        assert_eq!(
            of(&format!("2\na.png {one_line}\nb c.png {one_line}")),
            [named(Some("a.png")), named(Some("b c.png"))]
        );
        assert_eq!(
            of(&format!("# these\na.png\n{rows}\nb.png\n{rows}")),
            [named(Some("a.png")), named(Some("b.png"))]
        );
        assert_eq!(of(&one_line.replace(' ', ", ")), [named(None)]);
        let told = |text: &str| parse(text).unwrap_err().to_string();
        assert!(told("1 2 3 4\n5 6 7 8\n").contains("line 2: it ends after 2 of 3 rows"));
        assert!(told("1 2 3\n").contains("line 1"));
        assert!(told("CONTOUR2\n1 2 3 4 5 6\n").contains("CONTOUR2 is no matrix"));
        assert!(told("what is this text about\n").contains("5 words"));
    }
}
