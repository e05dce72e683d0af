//! Colours of a PLY file: of vertices, faces or corners, and how large the numbers are.

use ply_rs_bw::ply::{PropertyType, ScalarType};
use silmap_geometry::lighting::linear_from_srgb;

use super::Builder;
use super::elements::Record;

/// How colours are stored.
#[derive(Clone, Copy, Debug)]
pub(super) enum ColourKind {
    /// To this value.
    To(f64),
    /// To 1, or to 255 where one of them is larger than 1.
    Real,
}

impl ColourKind {
    pub(super) fn of(kind: &PropertyType) -> Self {
        match kind {
            PropertyType::Scalar(scalar) | PropertyType::List(_, scalar) => match scalar {
                ScalarType::Float | ScalarType::Double => Self::Real,
                ScalarType::UShort | ScalarType::Short => Self::To(65_535.0),
                _ => Self::To(255.0),
            },
        }
    }

    fn largest<'a>(self, mut all: impl Iterator<Item = &'a f64>) -> f64 {
        match self {
            Self::To(largest) => largest,
            Self::Real if all.any(|&c| c > 1.0) => 255.0,
            Self::Real => 1.0,
        }
    }
}

/// Linear colours of values that reach to `largest`; white where they are not numbers.
fn linear(colour: [f64; 3], largest: f64) -> [f32; 3] {
    let linear = colour.map(|c| linear_from_srgb((c / largest).clamp(0.0, 1.0) as f32));
    if linear.iter().all(|c| c.is_finite()) {
        linear
    } else {
        [1.0; 3]
    }
}

/// Which colours count, and what they are.
pub(super) enum Painter {
    Plain,
    /// Linear.
    Vertices(Vec<[f32; 3]>),
    /// By the largest value.
    Faces(f64),
    Corners(f64),
}

impl Painter {
    pub(super) fn new(builder: &Builder) -> Self {
        let [vertex, face, corner] = builder.colour_kinds;
        let are_alike = builder.colours.windows(2).all(|pair| pair[0] == pair[1]);
        if let Some(kind) = corner {
            let all = builder.faces.iter().flat_map(|f| &f.corner_colours);
            return Self::Corners(kind.largest(all));
        }
        match (vertex, face) {
            (Some(kind), None) => Self::vertices(kind, &builder.colours),
            (Some(kind), Some(_)) if !are_alike => Self::vertices(kind, &builder.colours),
            (_, Some(kind)) => {
                let all = builder.faces.iter().flat_map(|f| &f.colour);
                Self::Faces(kind.largest(all))
            }
            (None, None) => Self::Plain,
        }
    }

    fn vertices(kind: ColourKind, colours: &[[f64; 3]]) -> Self {
        let largest = kind.largest(colours.as_flattened().iter());
        Self::Vertices(colours.iter().map(|&c| linear(c, largest)).collect())
    }

    /// Linear colours of a face's corners.
    pub(super) fn colours(&self, record: &Record, vertices: &[u32]) -> Option<Vec<[f32; 3]>> {
        match self {
            Self::Plain => None,
            Self::Vertices(colours) => {
                Some(vertices.iter().map(|&v| colours[v as usize]).collect())
            }
            Self::Faces(largest) => Some(vec![linear(record.colour, *largest); vertices.len()]),
            Self::Corners(largest) => {
                let values = &record.corner_colours;
                if values.len() == 3 {
                    let whole = [values[0], values[1], values[2]];
                    return Some(vec![linear(whole, *largest); vertices.len()]);
                }
                // Three numbers a corner, or four with the opacity.
                let step = values.len() / vertices.len().max(1);
                if !(3..=4).contains(&step) || values.len() != step * vertices.len() {
                    return Some(vec![[1.0; 3]; vertices.len()]);
                }
                let corners = values.chunks_exact(step);
                Some(
                    corners
                        .map(|c| linear([c[0], c[1], c[2]], *largest))
                        .collect(),
                )
            }
        }
    }
}
