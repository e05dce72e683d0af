//! A mesh as a file gives it: polygons cut into triangles, nothing welded or checked yet.

use std::collections::BTreeSet;

use glam::DVec3;
use silmap_geometry::defects::counted;
use silmap_geometry::lighting;
use silmap_geometry::triangulate::triangulate_polygon;
use silmap_geometry::{Material, TriangleMesh};

use super::AlphaUse;
use crate::warning::MeshWarning;

/// Cutting a polygon takes time quadratic in its corners; this many take about a second.
pub(super) const MOST_CORNERS: usize = 10_000;

/// Stands for "no material" until a file is read to its end.
const NO_MATERIAL: u16 = u16::MAX;

/// The most materials that are distinguished; further ones are left out.
pub(super) const MOST_MATERIALS: usize = NO_MATERIAL as usize - 1;

/// What a reader makes of a file.
#[derive(Debug, Default)]
pub(super) struct RawMesh {
    /// Positions in file order, and triangles.
    pub(super) mesh: TriangleMesh,
    /// The file's face each triangle comes from, from 0.
    pub(super) face_of: Vec<u32>,
    /// What the file calls its first vertex and face: 0 or 1.
    pub(super) first_number: u32,
    /// What was odd.
    pub(super) warnings: Vec<MeshWarning>,
    /// What [`Self::ignore`] said already.
    ignored: BTreeSet<String>,
    /// What materials cut out.
    pub(super) alpha: CutOut,
    /// Most digits of a coordinate's decimal number; 0 when the numbers are binary.
    pub(super) digits: u8,
    /// Fewest digits that all numbers of a facet were rounded to; 0 when there is no such facet.
    pub(super) facet_digits: u8,
    /// The numbers were of single precision before they were transformed.
    pub(super) is_single: bool,
    /// Faces of the file so far.
    face_count: u32,
}

/// Triangles of which alpha leaves less than the whole.
#[derive(Debug, Default)]
pub(super) struct CutOut {
    /// Those of which nothing shows, rising.
    pub(super) hidden: Vec<u32>,
    /// How many others do not show wholly.
    pub(super) partly: usize,
}

/// The looks of one polygon.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PolygonLook<'a> {
    /// Texture coordinates per corner, v down.
    pub(super) uvs: Option<&'a [[f32; 2]]>,
    /// Linear colours per corner.
    pub(super) colours: Option<&'a [[f32; 3]]>,
    /// Index of a material.
    pub(super) material: Option<u16>,
}

/// What `%g` and single precision leave of a number; fewer digits are exact as they stand.
const ROUNDED_DIGITS: std::ops::RangeInclusive<u8> = 6..=9;
/// So many coordinates of a facet with the most digits are no chance.
const FEWEST_ROUNDED: usize = 3;

impl RawMesh {
    /// An empty mesh of a file that counts from `first_number`.
    pub(super) fn counting_from(first_number: u32) -> Self {
        Self {
            first_number,
            ..Self::default()
        }
    }

    /// Notes with how many digits a coordinate is written, and returns that.
    pub(super) fn note_digits(&mut self, word: &str) -> u8 {
        let mantissa = word.split(['e', 'E', 'd', 'D']).next().unwrap_or_default();
        let digits = mantissa
            .bytes()
            .filter(u8::is_ascii_digit)
            .skip_while(|&b| b == b'0')
            .count();
        let digits = digits.min(usize::from(u8::MAX)) as u8;
        self.digits = self.digits.max(digits);
        digits
    }

    /// Notes with how many digits the coordinates of one facet are written. VTK rounds those of polygons that it cuts to six
    /// and writes others with all.
    pub(super) fn note_facet_digits(&mut self, digits: &[u8]) {
        let most = digits.iter().copied().max().unwrap_or(0);
        let rounded = digits.iter().filter(|&&d| d == most).count();
        if ROUNDED_DIGITS.contains(&most) && rounded >= FEWEST_ROUNDED {
            self.facet_digits = match self.facet_digits {
                0 => most,
                before => before.min(most),
            };
        }
    }

    /// Adds a polygon with at most [`MOST_CORNERS`] corners, all of them existing vertices.
    pub(super) fn push_polygon(&mut self, vertices: &[u32], look: PolygonLook<'_>) {
        let file_face = self.face_count;
        self.face_count += 1;
        let triangles = if vertices.len() == 3 {
            vec![[0, 1, 2]]
        } else {
            let points: Vec<DVec3> = vertices
                .iter()
                .map(|&v| self.mesh.positions[v as usize])
                .collect();
            triangulate_polygon(&points)
        };
        let appearance = &mut self.mesh.appearance;
        for corners in triangles {
            let corners = corners.map(|k| k as usize);
            let face = self.mesh.faces.len();
            if let Some(uvs) = look.uvs {
                appearance.corner_uvs.resize(face, [[0.0; 2]; 3]);
                appearance.corner_uvs.push(corners.map(|k| uvs[k]));
            }
            if let Some(colours) = look.colours {
                appearance.corner_colours.resize(face, [[1.0; 3]; 3]);
                appearance.corner_colours.push(corners.map(|k| colours[k]));
            }
            if let Some(material) = look.material {
                appearance.face_materials.resize(face, NO_MATERIAL);
                appearance.face_materials.push(material);
            }
            self.mesh.faces.push(corners.map(|k| vertices[k]));
            self.face_of.push(file_face);
        }
    }

    /// Gives every corner the colour of its vertex, see [`linear_colours`]; says whether any is known.
    pub(super) fn spread_vertex_colours(&mut self, colours: &[Option<[f32; 3]>]) -> bool {
        let Some(linear) = linear_colours(colours) else {
            return false;
        };
        let colours_of = |face: &[u32; 3]| face.map(|v| linear[v as usize]);
        self.mesh.appearance.corner_colours = self.mesh.faces.iter().map(colours_of).collect();
        true
    }

    /// Gives every corner the colour of the file's face it belongs to, see [`linear_colours`]; nothing when none is known.
    pub(super) fn spread_face_colours(&mut self, colours: &[Option<[f32; 3]>]) {
        let Some(linear) = linear_colours(colours) else {
            return;
        };
        let colours_of = |&face: &u32| [linear[face as usize]; 3];
        self.mesh.appearance.corner_colours = self.face_of.iter().map(colours_of).collect();
    }

    /// Completes the looks of faces that have none while others do. Texture coordinates stay where there is no texture: it may be put on
    /// by hand.
    pub(super) fn finish(mut self) -> Self {
        let face_count = self.mesh.faces.len();
        let look = &mut self.mesh.appearance;
        if !look.corner_colours.is_empty() {
            look.corner_colours.resize(face_count, [[1.0; 3]; 3]);
        }
        if look.materials.is_empty() {
            look.face_materials.clear();
        }
        if !look.face_materials.is_empty() {
            look.face_materials.resize(face_count, NO_MATERIAL);
            if look.face_materials.contains(&NO_MATERIAL) {
                let default = look.materials.len() as u16;
                look.materials.push(Material {
                    base_colour: lighting::DEFAULT_ALBEDO,
                    ..Material::default()
                });
                for material in &mut look.face_materials {
                    if *material == NO_MATERIAL {
                        *material = default;
                    }
                }
            }
        } else {
            look.materials.clear();
        }
        if !look.corner_uvs.is_empty() {
            look.corner_uvs.resize(face_count, [[0.0; 2]; 3]);
        }
        self
    }

    /// Takes the faces out of which nothing shows, or says that they stay.
    pub(super) fn cut_out(&mut self, alpha: AlphaUse) {
        let CutOut { hidden, partly } = std::mem::take(&mut self.alpha);
        if partly > 0 {
            self.ignore(format!(
                "{} only partly drawn by a material that cuts out by alpha: taken whole",
                counted(partly, "face")
            ));
        }
        if hidden.is_empty() {
            return;
        }
        let faces = counted(hidden.len(), "face");
        match alpha {
            AlphaUse::Opaque => self.ignore(format!(
                "{faces} not drawn by a material that cuts out by alpha: taken as if opaque (--alpha mask takes them out)"
            )),
            AlphaUse::Mask => {
                let is_kept = |face: u32| hidden.binary_search(&face).is_err();
                self.mesh.retain_faces(|face| is_kept(face as u32));
                let mut face = 0..;
                self.face_of.retain(|_| face.next().is_some_and(is_kept));
                let what = format!("{faces} that a material cuts out by alpha: taken out");
                self.warnings.push(MeshWarning::Repaired { what });
            }
        }
    }

    /// Adds a warning about something left out.
    pub(super) fn ignore(&mut self, what: String) {
        if self.ignored.insert(what.clone()) {
            self.warnings.push(MeshWarning::Ignored { what });
        }
    }
}

/// The colours a file has, which are sRGB from 0 to 1, or to 255 where one of them is larger than 1; unknown ones become
/// white. `None` when none is known.
fn linear_colours(colours: &[Option<[f32; 3]>]) -> Option<Vec<[f32; 3]>> {
    let known = || colours.iter().flatten().flatten();
    known().next()?;
    let largest = known().fold(0.0_f32, |a, &b| a.max(b));
    let scale = if largest > 1.0 { 1.0 / 255.0 } else { 1.0 };
    let linear = |c: [f32; 3]| c.map(|x| lighting::linear_from_srgb((x * scale).min(1.0)));
    Some(colours.iter().map(|c| c.map_or([1.0; 3], linear)).collect())
}
