//! From a mask to the loops around its pixels, along the cracks between covered and uncovered ones.
//!
//! The loops bound exactly the covered pixel squares, the image border included: their signed areas add up to the number
//! of covered pixels, and filling them gives the mask back. Covered pixels hang together by their sides (4-connected),
//! uncovered ones also by their corners.
//!
//! Source: A. Rosenfeld. Connectivity in digital pictures. Journal of the ACM 17(1), 1970 (border following).
//! Deviations: runs on the pixel lattice instead of pixel centres, and from turn to turn instead of pixel to pixel. One
//! sweep over the words of the mask finds the corners where cracks turn and links those that a straight run of cracks
//! joins; following a loop is following links. Where a loop would touch itself in a corner it is cut in two, so that every
//! loop is simple; loops may still touch each other in such corners.

use crate::{Loop, Mask};
use glam::DVec2;

/// A corner of the pixel lattice.
type Corner = [i32; 2];

/// Traces the outlines of a mask.
///
/// Each loop is simple and holds only the corners where it turns. Outer loops have positive area, holes negative. A loop
/// begins at its topmost corner, the leftmost of these; the loops are ordered by it.
#[must_use]
pub fn trace_contours(mask: &Mask) -> Vec<Loop> {
    let mut turns = find_turns(mask);
    let mut loops: Vec<Loop> = Vec::new();
    let mut walk = Walk::default();
    let mut is_sorted = true;
    // Turns are numbered in reading order, so the first one of a loop is where it begins.
    for start in FIRST..turns.len() {
        let Turn { at, beyond, .. } = turns[start];
        if beyond == NOWHERE {
            continue;
        }
        walk.follow(&mut turns, start, mask.get(at[0].into(), at[1].into()));
        if walk.contacts.len() < 2 {
            loops.push(points(&walk.corners));
            continue;
        }
        for mut corners in walk.split_simple() {
            let top_left = (0..corners.len()).min_by_key(|&k| (corners[k][1], corners[k][0]));
            corners.rotate_left(top_left.unwrap_or(0));
            loops.push(points(&corners));
            is_sorted = false;
        }
    }
    if !is_sorted {
        // No two loops begin at one corner: only one of those that meet there leaves it to the right and downwards.
        loops.sort_unstable_by(|a, b| {
            let by_row = a[0].y.total_cmp(&b[0].y);
            by_row.then_with(|| a[0].x.total_cmp(&b[0].x))
        });
    }
    loops
}

fn points(corners: &[Corner]) -> Loop {
    let point = |&[x, y]: &Corner| DVec2::new(f64::from(x), f64::from(y));
    corners.iter().map(point).collect()
}

/// In place of a turn: no crack is open, or the turn has been passed.
const NOWHERE: u32 = 0;
/// The number of the first turn; even, see [`Turn`].
const FIRST: usize = 2;

/// Where a horizontal run of cracks meets a vertical one.
///
/// Turns are numbered in reading order. Along a row of the lattice, horizontal runs begin and end in turn, so that the
/// other end of the horizontal run of turn k is turn k ^ 1.
#[derive(Clone, Copy)]
struct Turn {
    at: Corner,
    /// The turn at the other end of the vertical run.
    beyond: u32,
    /// Whether two covered pixels meet in this corner only. Then there are two turns, one around each of them.
    is_contact: bool,
}

/// The turns of a mask, from number [`FIRST`] on.
fn find_turns(mask: &Mask) -> Vec<Turn> {
    let nothing = vec![0; mask.words_per_row()];
    let mut sweep = Sweep {
        turns: Vec::new(),
        open: vec![NOWHERE; 64 * nothing.len() + 1],
    };
    for _ in 0..FIRST {
        sweep.push([0; 2], false);
    }
    let mut above = nothing.as_slice();
    for y in 0..=mask.height() {
        let below = if y < mask.height() {
            mask.row(y)
        } else {
            &nothing
        };
        if above != below {
            sweep.add_row(y as i32, above, below);
        }
        above = below;
    }
    sweep.turns
}

/// Finds turns from the top row of the lattice to the bottom one.
struct Sweep {
    turns: Vec<Turn>,
    /// The turn at the upper end of the vertical run that is open in each column.
    open: Vec<u32>,
}

impl Sweep {
    /// Adds the turns between two rows of pixels.
    fn add_row(&mut self, y: i32, above: &[u64], below: &[u64]) {
        // The last crack of the word before, and the last pixel above it.
        let (mut last_crack, mut last_above) = (0, 0);
        for (word, (&a, &b)) in above.iter().zip(below).enumerate() {
            let cracks = a ^ b;
            if cracks | last_crack != 0 {
                // Bit k of these stands for the corner left of pixel k, whose cracks are k - 1 and k.
                let cracks_left = cracks << 1 | last_crack;
                let contacts = cracks & cracks_left & (a ^ (a << 1 | last_above));
                let mut turns = (cracks ^ cracks_left) | contacts;
                while turns != 0 {
                    let k = turns.trailing_zeros();
                    let at = [64 * word as i32 + k as i32, y];
                    if contacts >> k & 1 == 0 {
                        self.add_turn(at);
                    } else {
                        self.add_contact(at, b >> k & 1 == 1);
                    }
                    turns &= turns - 1;
                }
            }
            (last_crack, last_above) = (cracks >> 63, a >> 63);
        }
        if last_crack != 0 {
            self.add_turn([64 * above.len() as i32, y]);
        }
    }

    fn push(&mut self, at: Corner, is_contact: bool) -> u32 {
        self.turns.push(Turn {
            at,
            beyond: NOWHERE,
            is_contact,
        });
        self.turns.len() as u32 - 1
    }

    /// Adds a turn, which ends the vertical run that is open in its column, or begins one.
    fn add_turn(&mut self, at: Corner) {
        let turn = self.push(at, false);
        let open = &mut self.open[at[0] as usize];
        let end = *open;
        // No branch, which would be guessed wrong half of the time: what stands at `NOWHERE` is never read.
        self.turns[turn as usize].beyond = end;
        self.turns[end as usize].beyond = turn;
        *open = if end == NOWHERE { turn } else { NOWHERE };
    }

    /// Adds both turns of a corner where two covered pixels meet: the one that ends a horizontal run, then the one that
    /// begins the next.
    fn add_contact(&mut self, at: Corner, is_lower_right_covered: bool) {
        let (left, right) = (self.push(at, true), self.push(at, true));
        let (up, down) = if is_lower_right_covered {
            (left, right)
        } else {
            (right, left)
        };
        let open = &mut self.open[at[0] as usize];
        self.turns[up as usize].beyond = *open;
        self.turns[*open as usize].beyond = up;
        *open = down;
    }
}

/// One loop being followed.
#[derive(Default)]
struct Walk {
    corners: Vec<Corner>,
    /// Places in `corners` where two covered pixels meet only in the corner.
    contacts: Vec<usize>,
}

impl Walk {
    /// Follows the loop that begins at `start`, with the covered pixels on the right hand, and marks its turns as passed.
    fn follow(&mut self, turns: &mut [Turn], start: usize, is_outer: bool) {
        self.corners.clear();
        self.contacts.clear();
        let mut turn = start;
        // The run to the right has the covered pixels below it on its right hand only in an outer loop.
        let mut is_across = is_outer;
        loop {
            let Turn {
                at,
                beyond,
                is_contact,
            } = turns[turn];
            turns[turn].beyond = NOWHERE;
            if is_contact {
                self.contacts.push(self.corners.len());
            }
            self.corners.push(at);
            turn = if is_across { turn ^ 1 } else { beyond as usize };
            is_across = !is_across;
            if turn == start {
                return;
            }
        }
    }

    /// The followed loop, cut in two wherever it touches itself.
    fn split_simple(&mut self) -> Vec<Vec<Corner>> {
        let corners = &self.corners;
        let mut found = Vec::new();
        self.contacts.sort_unstable_by_key(|&k| (corners[k], k));
        // Each corner is passed at most twice.
        let mut repeats: Vec<(usize, usize)> = self
            .contacts
            .windows(2)
            .filter(|pair| corners[pair[0]] == corners[pair[1]])
            .map(|pair| (pair[1], pair[0]))
            .collect();
        repeats.sort_unstable();
        // Loops cut off never interleave, so what lies on the path since the first passing is one whole loop.
        let mut path: Vec<usize> = Vec::new();
        let mut begin = 0;
        for (second, first) in repeats {
            path.extend(begin..second);
            begin = second + 1;
            if let Some(cut) = path.iter().rposition(|&k| k == first) {
                found.push(path[cut..].iter().map(|&k| corners[k]).collect());
                path.truncate(cut + 1);
            }
        }
        path.extend(begin..corners.len());
        found.push(path.into_iter().map(|k| corners[k]).collect());
        found
    }
}

#[cfg(test)]
mod tests;
