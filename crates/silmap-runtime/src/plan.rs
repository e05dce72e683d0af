//! What a frame draws, and with which outlines. Nothing here touches the device, and nothing is allocated once buffers are
//! warm.

use std::ops::Range;
use std::sync::Arc;

use glam::{DVec2, DVec3, DVec4, Mat4, Vec4Swizzles};
use silmap_curve::block_cache::{BlockCache, KeptRef};
use silmap_curve::cells::{Bearing, Cell, CellKey, ReuseError};
use silmap_curve::curve::{Frame, Texel, points_of};
use silmap_curve::of_cell::sorting_of;
use silmap_geometry::Loop;

use crate::asset::AssetData;
use crate::draws::{Draw, DrawOrder, Hull, Record, Visible};
use crate::instance::{Instance, Outline};
use crate::interpolate::Maker;
use crate::normals::to_light;
use crate::view::{Eye, Rect, View};
use crate::worker::{HowToMake, Wanted};
use crate::{Paint, PrepareError, RendererOptions};

/// What a frame came to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct FrameStats {
    /// Instances that are drawn.
    pub drawn: usize,
    /// Instances out of the picture, or clipped by no loop at all.
    pub out_of_view: usize,
    /// Instances drawn whole: their outline was not asked for, the eye is within the model's bounding sphere, or there is no outline.
    pub whole: usize,
    /// Outlines that were interpolated.
    pub interpolated: usize,
    /// Instances with an outline that should be renewed and has to wait.
    pub waiting: usize,
    /// Outlines that are kept.
    pub kept: usize,
    /// Draw calls.
    pub draw_calls: usize,
}

/// Texels to be written.
#[derive(Clone, Debug)]
pub(crate) struct Upload {
    pub(crate) worker: usize,
    pub(crate) texels: Range<usize>,
    /// First texel of the place in the cache.
    pub(crate) to: u32,
}

/// The outline that an instance had in the frame before.
#[derive(Clone, Copy, Debug)]
struct Before {
    asset: u64,
    outline: KeptRef,
}

/// What is known of an outline that is kept.
#[derive(Clone, Copy, Debug)]
struct KeptOutline {
    /// Its points.
    points: u32,
    /// The eye it was made for.
    middle: Bearing,
}

/// What frames are planned with.
#[derive(Debug)]
pub(crate) struct Plan {
    most_made: usize,
    cache: BlockCache<CellKey, KeptOutline>,
    maker: Maker,
    wanted: Vec<Wanted>,
    visible: Vec<Visible>,
    /// Whether hulls can show relief.
    has_relief: bool,
    before: Vec<Option<Before>>,
    order: DrawOrder,
    frame: u64,
    /// What the device's texture holds.
    texels: Vec<Texel>,
    pub(crate) assets: Vec<Arc<AssetData>>,
    pub(crate) records: Vec<Record>,
    pub(crate) draws: Vec<Draw>,
    pub(crate) uploads: Vec<Upload>,
    pub(crate) stats: FrameStats,
}

/// Number of an asset whose outlines belong to one frame.
const GIVEN: u64 = u64::MAX;

/// How much larger than the hull's sphere the place of an instance on the screen counts as.
const ROOM: f64 = 1.02;

/// The sphere that holds all of a given outline that can be seen on the hull: the hull's own, or where the eye is within that, the
/// model's.
fn sphere_of_given(asset: &AssetData, eye: DVec4) -> (DVec3, f64) {
    let is_within = eye.w > 0.0 && eye.xyz().distance(asset.origin) <= asset.radius;
    if is_within {
        (asset.map.center, asset.map.radius)
    } else {
        (asset.origin, asset.radius)
    }
}

/// A sphere as shaders read it.
fn record_sphere(asset: &AssetData, (center, radius): (DVec3, f64)) -> [f32; 4] {
    let place = center - asset.origin;
    place.extend(radius).as_vec4().to_array()
}

impl Plan {
    pub(crate) fn new(options: &RendererOptions, texels: u32) -> Self {
        let how = HowToMake {
            clip: options.clip,
            method: options.method,
            error: ReuseError {
                allowed_px: options.reuse_error_px,
            },
        };
        Self {
            most_made: options.outlines_per_frame,
            cache: BlockCache::new(texels),
            maker: Maker::new(how, options.polytope_bytes),
            wanted: Vec::new(),
            visible: Vec::new(),
            before: Vec::new(),
            order: DrawOrder::new(options),
            has_relief: options.has_relief(),
            frame: 0,
            texels: vec![[0; 4]; texels as usize],
            assets: Vec::new(),
            records: Vec::new(),
            draws: Vec::new(),
            uploads: Vec::new(),
            stats: FrameStats::default(),
        }
    }

    /// Texels of an upload.
    pub(crate) fn texels(&self, upload: &Upload) -> &[Texel] {
        &self.maker.workers[upload.worker].texels[upload.texels.clone()]
    }

    /// The loops that an instance is clipped to, in pixels; `None` where it is not drawn or drawn whole.
    pub(crate) fn outline_px(&self, instance: usize, size_px: DVec2) -> Option<Vec<Loop>> {
        let is_it = |v: &&Visible| v.instance == instance && v.points > 0;
        let visible = self.visible.iter().find(is_it)?;
        let clip = Mat4::from_cols_array_2d(&visible.record.clip_from_object).as_dmat4();
        let texels = &self.texels[visible.record.outline[0] as usize..];
        let mut loops = vec![Loop::new()];
        for (point, begins_edge) in points_of(texels) {
            let seen = clip.project_point3(point).truncate();
            let seen = (seen * DVec2::new(0.5, -0.5) + 0.5) * size_px;
            if begins_edge {
                loops.last_mut()?.push(seen);
            } else {
                loops.push(Loop::new());
            }
        }
        loops.pop();
        Some(loops)
    }

    /// Plans a frame.
    pub(crate) fn make(
        &mut self,
        view: &View,
        eye: &Eye,
        instances: &[Instance<'_>],
    ) -> Result<(), PrepareError> {
        self.clear();
        if view.size_px.0 == 0 || view.size_px.1 == 0 {
            return Ok(());
        }
        self.cache.begin_frame();
        self.frame += 1;
        self.before.resize(instances.len(), None);
        for (k, instance) in instances.iter().enumerate() {
            self.add(k, instance, eye)?;
        }
        self.make_wanted();
        self.take_outlines();
        (self.order).put(&mut self.visible, eye.size_px, &mut self.draws);
        self.records.extend(self.visible.iter().map(|v| v.record));
        self.stats.kept = self.cache.len();
        self.stats.draw_calls = self.draws.len();
        Ok(())
    }

    pub(crate) fn clear(&mut self) {
        self.wanted.clear();
        self.visible.clear();
        self.assets.clear();
        self.records.clear();
        self.draws.clear();
        self.uploads.clear();
        self.stats = FrameStats::default();
        self.maker.clear();
    }

    /// Takes an instance that is in the picture, and notes which outline it wants.
    fn add(&mut self, k: usize, instance: &Instance<'_>, eye: &Eye) -> Result<(), PrepareError> {
        let asset = &instance.asset.0;
        let transform = &instance.transform;
        if let Outline::Given(given) = instance.outline
            && given.loops.iter().all(|points| points.len() < 3)
        {
            // Nothing is inside of no loops.
            self.stats.out_of_view += 1;
            return Ok(());
        }
        let to_light = |direction| to_light(direction).ok_or(PrepareError::NoLight);
        let light = instance.light.map(to_light).transpose()?;
        let light = light.map_or(DVec4::ZERO, |l| transform.object_direction(l).extend(1.0));
        let middle = transform.point(asset.origin);
        let radius = asset.radius * transform.scale * ROOM;
        let Some(rect) = eye.rect(middle, radius) else {
            self.stats.out_of_view += 1;
            return Ok(());
        };
        let place = if eye.place.w > 0.0 {
            transform.object_point(eye.place.xyz()).extend(1.0)
        } else {
            transform.object_direction(eye.place.xyz()).extend(0.0)
        };
        let matrix = eye.clip_from_world * transform.matrix(asset.origin);
        let local_eye = place - asset.origin.extend(0.0) * place.w;
        let has_relief = instance.paint == Paint::Relief && asset.has_relief && self.has_relief;
        let paint = match instance.paint {
            Paint::Relief => Paint::Blended,
            other => other,
        };
        let asset_at = self.asset_index(asset);
        let mut visible = Visible {
            record: Record {
                clip_from_object: matrix.as_mat4().to_cols_array_2d(),
                eye: local_eye.as_vec4().to_array(),
                outline: [0, 0, paint as u32, 0],
                sphere: record_sphere(asset, (asset.map.center, asset.map.radius)),
                light: light.as_vec4().to_array(),
            },
            instance: k,
            hull: Hull {
                asset: asset_at,
                has_relief,
            },
            depth: eye.depth_of(middle),
            rect,
            wanted: None,
            outline: None,
            points: 0,
            batch: 0,
            order: 0,
            rank: 0,
        };
        match instance.outline {
            Outline::Whole => {}
            Outline::Given(loops) => {
                let loops = loops.loops.iter().map(Vec::as_slice);
                let sphere = sphere_of_given(asset, place);
                visible.record.sphere = record_sphere(asset, sphere);
                let seen = (place, sphere);
                visible.outline = self.add_given(k, asset, seen, loops, (&rect, eye));
            }
            Outline::OfAsset => self.add_own(asset, place, eye, &mut visible),
        }
        self.visible.push(visible);
        Ok(())
    }

    fn asset_index(&mut self, asset: &Arc<AssetData>) -> usize {
        let is_same = |other: &Arc<AssetData>| other.id == asset.id;
        self.assets.iter().position(is_same).unwrap_or_else(|| {
            self.assets.push(Arc::clone(asset));
            self.assets.len() - 1
        })
    }

    /// Finds the outline of an instance's cell, or asks for it.
    fn add_own(&mut self, asset: &Arc<AssetData>, place: DVec4, eye: &Eye, visible: &mut Visible) {
        let map = &asset.map;
        let Some(bearing) = Bearing::new(place, map.center, map.radius) else {
            return;
        };
        // The rectangle is that of the hull's sphere, which is the larger one.
        let radius_px = visible.rect.radius_px(eye.size_px) * map.radius / (asset.radius * ROOM);
        let error = self.maker.how.error;
        let cell = Cell::of(asset.id, bearing, radius_px, &error);
        if let Some(outline) = self.cache.find(&cell.key) {
            visible.outline = Some(outline);
            self.before[visible.instance] = Some(Before {
                asset: asset.id,
                outline,
            });
            return;
        }
        visible.wanted = Some(cell.key);
        // What it had may serve until its turn comes.
        let before = self.before[visible.instance].filter(|b| b.asset == asset.id);
        let kept = before.and_then(|b| Some((b.outline, self.cache.kept(b.outline)?)));
        let off_px =
            kept.map(|(_, k)| error.bound_px(k.value.middle.angle_to(&bearing), radius_px));
        if let (Some((outline, _)), Some(off_px)) = (kept, off_px)
            && off_px <= 2.0 * error.allowed_px
        {
            visible.outline = self.cache.revive(outline);
        }
        self.wanted.push(Wanted {
            asset: Arc::clone(asset),
            cell,
            urgency_px: match visible.outline {
                Some(_) => off_px.unwrap_or(f64::INFINITY),
                None => f64::INFINITY,
            },
        });
    }

    /// Takes an outline of the caller's for this frame.
    fn add_given<'l>(
        &mut self,
        k: usize,
        asset: &Arc<AssetData>,
        (place, (center, radius)): (DVec4, (DVec3, f64)),
        loops: impl Iterator<Item = &'l [DVec3]>,
        (rect, eye): (&Rect, &Eye),
    ) -> Option<KeptRef> {
        let bearing = Bearing::new(place, center, radius)?;
        let radius_px = rect.radius_px(eye.size_px);
        let exact = ReuseError { allowed_px: 0.0 };
        let mut cell = Cell::of(GIVEN, bearing, radius_px, &exact);
        cell.key.place = [self.frame, k as u64, 0, 0];
        let worker = self.maker.workers.first_mut()?;
        let start = worker.texels.len();
        worker.builder.assign(loops);
        let frame = Frame::new(place, center, radius);
        let sorting = sorting_of(&cell, &exact);
        let points = worker.encode(self.maker.how.clip, &frame, asset.origin, &sorting)?;
        let texels = start..worker.texels.len();
        self.keep(&cell, 0, texels, points)
    }

    /// Keeps an outline that a worker made.
    fn keep(
        &mut self,
        cell: &Cell,
        worker: usize,
        texels: Range<usize>,
        points: u32,
    ) -> Option<KeptRef> {
        let count = texels.len().max(1) as u32;
        let middle = cell.middle;
        let kept = KeptOutline { points, middle };
        let kept = self.cache.insert(cell.key, count, kept)?;
        let to = self.cache.kept(kept)?.start;
        if !texels.is_empty() {
            let made = &self.maker.workers[worker].texels[texels.clone()];
            self.texels[to as usize..][..made.len()].copy_from_slice(made);
            self.uploads.push(Upload { worker, texels, to });
        }
        Some(kept)
    }

    /// Makes the outlines that are wanted most.
    fn make_wanted(&mut self) {
        let by_key = |w: &Wanted| (w.cell.key.asset, w.cell.key.size, w.cell.key.place);
        // Of each cell the most urgent.
        self.wanted.sort_unstable_by(|a, b| {
            let by_urgency = b.urgency_px.total_cmp(&a.urgency_px);
            by_key(a).cmp(&by_key(b)).then(by_urgency)
        });
        self.wanted
            .dedup_by(|later, first| later.cell.key == first.cell.key);
        self.wanted.sort_unstable_by(|a, b| {
            let by_urgency = b.urgency_px.total_cmp(&a.urgency_px);
            by_urgency.then(by_key(a).cmp(&by_key(b)))
        });
        let must = self.wanted.partition_point(|w| w.urgency_px.is_infinite());
        let made = must.max(self.most_made.min(self.wanted.len()));
        self.wanted.truncate(made);
        // Neighbours one after the other: they read the same views.
        self.wanted.sort_unstable_by_key(by_key);
        self.maker.make_all(&self.wanted);
        self.stats.interpolated = made;
        for worker in 0..self.maker.workers.len() {
            for k in 0..self.maker.workers[worker].made.len() {
                let made = self.maker.workers[worker].made[k].clone();
                self.keep(&made.cell, worker, made.texels, made.points);
            }
        }
    }

    /// Gives the outlines that were made to the instances that want them, and each instance's to its record.
    fn take_outlines(&mut self) {
        for visible in &mut self.visible {
            if let Some(key) = &visible.wanted {
                match self.cache.find(key) {
                    Some(outline) => {
                        visible.outline = Some(outline);
                        self.before[visible.instance] = Some(Before {
                            asset: key.asset,
                            outline,
                        });
                    }
                    None => self.stats.waiting += usize::from(visible.outline.is_some()),
                }
            }
            if let Some(kept) = visible.outline.and_then(|o| self.cache.kept(o)) {
                visible.points = kept.value.points;
                visible.record.outline[0] = kept.start;
                visible.record.outline[1] = kept.value.points;
            }
            visible.order = visible.points.max(1).next_power_of_two().trailing_zeros() as u8;
            self.stats.whole += usize::from(visible.points == 0);
        }
        self.stats.drawn = self.visible.len();
    }
}
