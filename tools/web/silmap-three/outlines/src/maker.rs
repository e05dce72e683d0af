//! Making outlines, as the texels that shaders read.

use glam::DVec3;
use js_sys::Uint8Array;
use silmap_curve::cells::{Bearing, Cell, CellKey, ReuseError};
use silmap_curve::curve::{CurveBuilder, Frame};
use silmap_curve::of_cell::{camera_of, sorting_of};
use silmap_map::{Interpolation, MapReader, Method, SilhouetteMap, asset};
use wasm_bindgen::prelude::*;

/// Numbers of a request: unit direction to the eye, angle between the sphere's rim and its middle, radius of the sphere in pixels.
pub(crate) const REQUEST: usize = 5;

/// A silhouette map that is read for one eye after the other.
#[wasm_bindgen]
#[derive(Debug)]
pub struct OutlineMaker {
    map: SilhouetteMap,
    reader: MapReader,
    method: Method,
    error: ReuseError,
    builder: CurveBuilder,
    texels: Vec<[u32; 4]>,
}

#[wasm_bindgen]
impl OutlineMaker {
    /// Reads an asset: the bytes of a `.glb`, or the text of a `.gltf` with the files that it names. An outline may be off by so many
    /// pixels where another eye nearby uses it; at zero each eye has its own.
    ///
    /// # Errors
    /// In one sentence, when the file is no asset or is damaged.
    #[wasm_bindgen(constructor)]
    pub fn new(
        file: &[u8],
        names: Vec<String>,
        files: Vec<Uint8Array>,
        allowed_px: f64,
    ) -> Result<OutlineMaker, JsError> {
        let beside = |name: &str| {
            let at = names.iter().position(|n| n == name)?;
            Some(files.get(at)?.to_vec())
        };
        let map = asset::read_map(file, &beside)?;
        Ok(Self {
            reader: MapReader::new(&map)?,
            method: Method::best_for(&map),
            map,
            error: ReuseError { allowed_px },
            builder: CurveBuilder::default(),
            texels: Vec::new(),
        })
    }

    /// Middle and radius of the sphere about the model.
    #[must_use]
    pub fn sphere(&self) -> Vec<f64> {
        (self.map.center.extend(self.map.radius).to_array()).to_vec()
    }

    /// The texels of an outline that [`crate::OutlineCells::take_wanted`] asked for; none where there is no outline.
    pub fn make(&mut self, request: &[f64]) -> Vec<u32> {
        self.texels.clear();
        match self.interpolate(request) {
            Some(points) if points > 0 => self.texels.as_flattened().to_vec(),
            _ => Vec::new(),
        }
    }
}

impl OutlineMaker {
    fn interpolate(&mut self, request: &[f64]) -> Option<u32> {
        let &[x, y, z, rim_angle, radius_px] = request.first_chunk::<REQUEST>()?;
        let cell = Cell {
            key: CellKey {
                asset: 0,
                size: 0,
                place: [0; 4],
            },
            middle: Bearing {
                direction: DVec3::new(x, y, z),
                rim_angle,
            },
            radius_px,
        };
        let sphere = self.map.bounding_sphere();
        let camera = camera_of(&sphere, &cell).ok()?;
        let how = Interpolation::from(self.method);
        self.reader.interpolate(&self.map, &camera, how).ok()?;
        let seen = self.reader.seen_loops();
        let (center, radius) = (sphere.center, sphere.radius);
        self.builder.assign_seen(seen, &camera, (center, radius));
        let frame = Frame::new(camera.eye.extend(1.0), center, radius);
        let sorting = sorting_of(&cell, &self.error);
        (self.builder).encode(&frame, DVec3::ZERO, &sorting, &mut self.texels)
    }
}
