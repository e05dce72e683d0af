//! What one thread does: making an outline, or one that is seen from the polytope.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use silmap_curve::cells::{Cell, ReuseError};
use silmap_curve::curve::{CurveBuilder, Frame, Sorting, Texel};
use silmap_curve::of_cell::{camera_of, sorting_of};
use silmap_map::{Interpolation, MapReader, Method, PolytopeOutline};

use crate::ClipBy;
use crate::asset::AssetData;
use crate::polytope_cache::{Aim, PointKey, PolytopeCache};

/// What all outlines are made by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HowToMake {
    pub(crate) clip: ClipBy,
    pub(crate) method: Option<Method>,
    pub(crate) error: ReuseError,
}

/// An outline to be made.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    pub(crate) asset: Arc<AssetData>,
    pub(crate) cell: Cell,
    /// How far off what there is would be, in pixels; infinite where there is nothing.
    pub(crate) urgency_px: f64,
}

/// An outline that was made: where its texels are, and how many points it has; no points where there is no outline.
#[derive(Clone, Debug)]
pub(crate) struct Made {
    pub(crate) cell: Cell,
    pub(crate) texels: Range<usize>,
    pub(crate) points: u32,
}

/// Buffers of one thread.
#[derive(Debug, Default)]
pub(crate) struct Worker {
    pub(crate) builder: CurveBuilder,
    pub(crate) texels: Vec<Texel>,
    pub(crate) made: Vec<Made>,
    /// Outlines seen from the polytope that were made, packed.
    pub(crate) rows: Vec<[f32; 4]>,
    pub(crate) made_rows: Vec<(PointKey, Range<usize>)>,
    /// What the sectors of an outline look at, and one that is being made.
    sectors: Vec<PolytopeOutline>,
    sector: PolytopeOutline,
}

/// The points that the sectors of an outline look from, and what is seen from there.
pub(crate) type Sources<'a> = (&'a [Aim], &'a PolytopeCache);

/// How it is interpolated.
pub(crate) fn how_of(asset: &AssetData, how: &HowToMake) -> Interpolation {
    Interpolation {
        method: how.method.unwrap_or(asset.method),
        ..Interpolation::default()
    }
}

impl Worker {
    /// Appends the texels of the outline that was built: the stencil needs no bands. Returns the number of its points.
    pub(crate) fn encode(
        &mut self,
        clip: ClipBy,
        frame: &Frame,
        origin: DVec3,
        sorting: &Sorting,
    ) -> Option<u32> {
        let (builder, texels) = (&mut self.builder, &mut self.texels);
        match clip {
            ClipBy::Stencil => Some(builder.encode_windings(frame, origin, sorting, texels)),
            ClipBy::Coverage => builder.encode(frame, origin, sorting, texels),
        }
    }

    /// Makes and packs the outline seen from a point of the polytope.
    pub(crate) fn make_sector(
        &mut self,
        reader: &mut MapReader,
        asset: &AssetData,
        aim: &Aim,
        how: &HowToMake,
    ) {
        let start = self.rows.len();
        if self.pack_sector(reader, asset, aim, how).is_some() {
            self.made_rows.push((aim.key, start..self.rows.len()));
        }
    }

    /// Appends the rows of the outline seen from a point of the polytope.
    fn pack_sector(
        &mut self,
        reader: &mut MapReader,
        asset: &AssetData,
        aim: &Aim,
        how: &HowToMake,
    ) -> Option<()> {
        let contours = (how_of(asset, how).method, aim.key.level);
        let sector = &mut self.sector;
        let made = reader.interpolate_at(&asset.map, aim.direction, contours, sector);
        made.ok()?;
        sector.pack(&mut self.rows);
        Some(())
    }

    /// Makes an outline from what its sectors look at.
    pub(crate) fn make_one(
        &mut self,
        reader: &mut MapReader,
        wanted: &Wanted,
        (aims, polytope): Sources<'_>,
        how: &HowToMake,
    ) {
        let start = self.texels.len();
        let points = self.interpolate(reader, wanted, (aims, polytope), how);
        self.made.push(Made {
            cell: wanted.cell,
            texels: start..self.texels.len(),
            points: points.unwrap_or(0),
        });
    }

    /// Appends the texels of an outline; returns the number of its points.
    fn interpolate(
        &mut self,
        reader: &mut MapReader,
        wanted: &Wanted,
        (aims, polytope): Sources<'_>,
        how: &HowToMake,
    ) -> Option<u32> {
        let Wanted { asset, cell, .. } = wanted;
        let map = &asset.map;
        let camera = camera_of(&map.bounding_sphere(), cell).ok()?;
        let interpolation = how_of(asset, how);
        if aims.is_empty() {
            reader.interpolate(map, &camera, interpolation).ok()?;
        } else {
            self.read_sectors(reader, asset, (aims, polytope), how)?;
            let sectors = self.sectors[..aims.len()].iter();
            reader.join(map, &camera, interpolation, sectors);
        }
        (self.builder).assign_seen(reader.seen_loops(), &camera, (map.center, map.radius));
        let frame = Frame::new(camera.eye.extend(1.0), map.center, map.radius);
        let sorting = sorting_of(cell, &how.error);
        self.encode(how.clip, &frame, asset.origin, &sorting)
    }

    /// Fetches what the sectors look at; makes what found no room.
    fn read_sectors(
        &mut self,
        reader: &mut MapReader,
        asset: &AssetData,
        (aims, polytope): Sources<'_>,
        how: &HowToMake,
    ) -> Option<()> {
        let count = self.sectors.len().max(aims.len());
        (self.sectors).resize_with(count, PolytopeOutline::default);
        for (k, aim) in aims.iter().enumerate() {
            if polytope.read(&aim.key, &mut self.sectors[k]).is_none() {
                // As exact as if it had been kept.
                let start = self.rows.len();
                self.pack_sector(reader, asset, aim, how)?;
                self.sectors[k].unpack(&self.rows[start..]);
                self.rows.truncate(start);
            }
        }
        Some(())
    }
}
