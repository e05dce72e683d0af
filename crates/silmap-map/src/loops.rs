//! Closed loops in one flat buffer, so that a chain of steps reuses its storage.

use glam::{DVec2, DVec3, DVec4, Vec3Swizzles, Vec4Swizzles};
use silmap_geometry::Loop;

/// Closed loops of some kind of point, one after the other: loop i ends before `ends[i]`. Each bounds something of one part of the model;
/// parts may lie before each other, so that their loops overlap.
#[derive(Clone, Debug, PartialEq)]
pub struct Loops<P> {
    points: Vec<P>,
    ends: Vec<u32>,
    /// The part that each loop is of.
    parts: Vec<u16>,
    /// The part that loops are of from here on.
    part: u16,
}

/// Loops in a plane.
pub type FlatLoops = Loops<DVec2>;

/// Loops in an image, and where in space they are: the third coordinate is the inverse depth of the point that is seen there, zero
/// where that is not known.
pub type SeenLoops = Loops<DVec3>;

/// Loops in an image. The third coordinate is the inverse depth of the point that is seen there; the fourth is how fast that point's
/// depth changes per unit of the way along the pair of views it was interpolated between, zero where that is not known.
pub type DeepLoops = Loops<DVec4>;

/// A point with a place in a plane.
pub(crate) trait InPlane: Copy {
    /// Its place.
    fn place(self) -> DVec2;
}

impl InPlane for DVec2 {
    fn place(self) -> DVec2 {
        self
    }
}

impl InPlane for DVec3 {
    fn place(self) -> DVec2 {
        self.xy()
    }
}

impl InPlane for DVec4 {
    fn place(self) -> DVec2 {
        self.xy()
    }
}

impl<P> Default for Loops<P> {
    fn default() -> Self {
        Self {
            points: Vec::new(),
            ends: Vec::new(),
            parts: Vec::new(),
            part: 0,
        }
    }
}

impl<P: Copy> Loops<P> {
    /// Removes all loops, keeping the storage.
    pub fn clear(&mut self) {
        self.points.clear();
        self.ends.clear();
        self.parts.clear();
        self.part = 0;
    }

    /// Loops that end from here on are of this part, until everything is removed.
    pub fn set_part(&mut self, part: u16) {
        self.part = part;
    }

    /// Appends a point to the loop being written.
    pub fn push(&mut self, point: P) {
        self.points.push(point);
    }

    /// Ends the loop being written; a loop of fewer than three points is dropped.
    pub fn close(&mut self) {
        let start = self.ends.last().map_or(0, |&e| e as usize);
        if self.points.len() < start + 3 {
            self.points.truncate(start);
        } else {
            self.ends.push(self.points.len() as u32);
            self.parts.push(self.part);
        }
    }

    /// Ends the loop being written, or drops it where `is_nothing` says so.
    pub(crate) fn close_unless(&mut self, is_nothing: impl Fn(&[P]) -> bool) {
        let start = self.finished_points();
        if is_nothing(&self.points[start..]) {
            self.points.truncate(start);
        }
        self.close();
    }

    /// The points of the loop being written.
    pub(crate) fn open_loop(&mut self) -> &mut Vec<P> {
        &mut self.points
    }

    /// Number of points in finished loops.
    #[must_use]
    pub fn finished_points(&self) -> usize {
        self.ends.last().map_or(0, |&e| e as usize)
    }

    /// All loops, in order.
    pub fn iter(&self) -> impl Iterator<Item = &[P]> + '_ {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts
            .zip(&self.ends)
            .map(|(start, &end)| &self.points[start as usize..end as usize])
    }

    /// Number of finished loops.
    pub(crate) fn n_loops(&self) -> usize {
        self.ends.len()
    }

    /// Removes those of the loops from number `first` on that `is_kept` says no to; it is given their numbers from there. No loop is
    /// being written.
    pub(crate) fn retain_from(&mut self, first: usize, is_kept: impl Fn(usize) -> bool) {
        let mut from = first.checked_sub(1).map_or(0, |k| self.ends[k] as usize);
        let (mut n_kept, mut end) = (first, from);
        for k in first..self.ends.len() {
            let range = from..self.ends[k] as usize;
            from = range.end;
            if is_kept(k - first) {
                let count = range.len();
                self.points.copy_within(range, end);
                end += count;
                self.ends[n_kept] = end as u32;
                self.parts[n_kept] = self.parts[k];
                n_kept += 1;
            }
        }
        self.points.truncate(end);
        self.ends.truncate(n_kept);
        self.parts.truncate(n_kept);
    }

    /// All loops, in order, each with the part that it is of.
    pub fn of_parts(&self) -> impl Iterator<Item = (u16, &[P])> + '_ {
        self.parts.iter().copied().zip(self.iter())
    }

    /// Whether loops are of more than one part, so that they may overlap.
    #[must_use]
    pub fn may_overlap(&self) -> bool {
        self.parts.windows(2).any(|w| w[0] != w[1])
    }

    /// Whether there is no loop.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// Applies `map` to every point.
    pub fn transform(&mut self, map: impl Fn(P) -> P) {
        for p in &mut self.points {
            *p = map(*p);
        }
    }

    /// Replaces the content by copies of `loops`.
    pub fn assign<'a>(&mut self, loops: impl IntoIterator<Item = &'a [P]>)
    where
        P: 'a,
    {
        self.clear();
        for points in loops {
            self.points.extend_from_slice(points);
            self.close();
        }
    }
}

impl SeenLoops {
    /// Copies the loops to `output`, without depths.
    pub fn flatten_to(&self, output: &mut FlatLoops) {
        output.clear();
        output.points.extend(self.points.iter().map(|p| p.xy()));
        output.ends.extend_from_slice(&self.ends);
        output.parts.extend_from_slice(&self.parts);
    }
}

impl FlatLoops {
    /// Copies the loops out, each as a vector of its own.
    #[must_use]
    pub fn to_loops(&self) -> Vec<Loop> {
        self.iter().map(<[DVec2]>::to_vec).collect()
    }
}
