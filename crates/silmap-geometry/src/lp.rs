//! Linear programs in three variables, a few dozen constraints, about a microsecond each.
//!
//! Constraints are added one at a time. While the best point so far satisfies the next one, nothing happens; otherwise
//! the new best point lies on the new constraint's plane, which leaves a program in two variables, and in turn one.
//!
//! Source: R. Seidel. Small-Dimensional Linear Programming and Convex Hulls Made Easy. Discrete & Computational Geometry
//! 6, 1991.
//! Deviations: a box stands for infinity; where the objective leaves a choice, the point nearest the origin of
//! coordinates is preferred, so that a program without a unique answer still has a sensible one.

use glam::{DVec2, DVec3};

/// The points `x` with `normal · x >= offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, towards the allowed side.
    pub normal: DVec3,
    /// Distance of the plane from the origin, along the normal.
    pub offset: f64,
}

/// What a linear program came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Solution {
    /// A best point.
    Optimal(DVec3),
    /// No point satisfies all constraints (within the bound).
    Infeasible,
    /// The objective falls for ever.
    Unbounded,
}

/// A constraint counts as satisfied when it is missed by less than this share of the bound.
const SLACK_REL: f64 = 1e-12;
/// An objective counts as constant within a plane or line when less than this share of it is left there.
const LEVEL_REL: f64 = 1e-11;
/// Two planes (of unit normals) count as parallel below this sine of their angle.
const PARALLEL_SINE: f64 = 1e-9;
/// A direction of about unit length keeps to a plane when it leaves it by less than this.
const DIRECTION_SLACK: f64 = 1e-11;

/// Minimises `objective · x` over the intersection of half spaces.
///
/// Coordinates at or beyond `bound` count as infinite, so choose it some orders of magnitude above the lengths at hand,
/// and the origin near them. The half spaces are reordered, always in the same way.
#[must_use]
pub fn minimise(objective: DVec3, half_spaces: &mut [HalfSpace], bound: f64) -> Solution {
    shuffle(half_spaces);
    let program = Program {
        slack: bound * SLACK_REL,
        bound,
    };
    match program.in_space(objective, half_spaces) {
        None => Solution::Infeasible,
        Some(x) if x.abs().max_element() < bound => Solution::Optimal(x),
        Some(x) => {
            if falls_for_ever(objective, half_spaces) {
                Solution::Unbounded
            } else {
                Solution::Optimal(x)
            }
        }
    }
}

struct Program {
    /// Length by which a constraint may be missed.
    slack: f64,
    bound: f64,
}

impl Program {
    fn in_space(&self, objective: DVec3, half_spaces: &[HalfSpace]) -> Option<DVec3> {
        let level = objective.abs().max_element() * LEVEL_REL;
        let far = |c: f64| {
            if c.abs() <= level {
                0.0
            } else {
                -c.signum() * self.bound
            }
        };
        let mut best = DVec3::new(far(objective.x), far(objective.y), far(objective.z));
        for (i, h) in half_spaces.iter().enumerate() {
            if h.normal.dot(best) < h.offset - self.slack {
                best = self.in_plane(objective, h, &half_spaces[..i])?;
            }
        }
        Some(best)
    }

    fn in_plane(
        &self,
        objective: DVec3,
        plane: &HalfSpace,
        half_spaces: &[HalfSpace],
    ) -> Option<DVec3> {
        let (u, w) = plane.normal.any_orthonormal_pair();
        let foot = plane.normal * plane.offset;
        let flat = |v: DVec3| DVec2::new(u.dot(v), w.dot(v));
        let level = objective.length() * LEVEL_REL;
        let slope = flat(objective);
        let far = |c: f64| {
            if c.abs() <= level {
                0.0
            } else {
                -c.signum() * self.bound * 2.0
            }
        };
        let mut best = DVec2::new(far(slope.x), far(slope.y));
        for (i, h) in half_spaces.iter().enumerate() {
            let normal = flat(h.normal);
            let offset = h.offset - h.normal.dot(foot);
            if normal.dot(best) >= offset - self.slack {
                continue;
            }
            let length = normal.length();
            if length < PARALLEL_SINE {
                return None;
            }
            // The line where both planes are tight, by its point nearest the plane's foot.
            let on_line = normal * (offset / (length * length));
            let along = normal.perp() / length;
            let parameter = self.on_line(
                slope.dot(along),
                level,
                half_spaces[..i].iter().map(|h| {
                    let normal = flat(h.normal);
                    (
                        normal.dot(along),
                        h.offset - h.normal.dot(foot) - normal.dot(on_line),
                    )
                }),
            )?;
            best = on_line + along * parameter;
        }
        Some(foot + u * best.x + w * best.y)
    }

    /// The best `s` with `rate · s >= offset` for all constraints `(rate, offset)`.
    fn on_line(
        &self,
        slope: f64,
        level: f64,
        constraints: impl Iterator<Item = (f64, f64)>,
    ) -> Option<f64> {
        // Far beyond the bound, so that a line that leaves a thin wedge out there is not taken for an empty one.
        let far = self.bound * 1e3;
        let (mut low, mut high) = (-far, far);
        for (rate, offset) in constraints {
            if rate.abs() < PARALLEL_SINE {
                if offset > self.slack {
                    return None;
                }
            } else if rate > 0.0 {
                low = low.max(offset / rate);
            } else {
                high = high.min(offset / rate);
            }
        }
        if low > high {
            // Within the slack both ends are the same point.
            return (low - high <= self.slack).then_some(low.midpoint(high));
        }
        Some(if slope.abs() <= level {
            0.0_f64.clamp(low, high)
        } else if slope > 0.0 {
            low
        } else {
            high
        })
    }
}

/// Whether some direction keeps to all half spaces while the objective falls.
fn falls_for_ever(objective: DVec3, half_spaces: &[HalfSpace]) -> bool {
    let sides = [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .map(|normal| HalfSpace {
            normal,
            offset: -1.0,
        });
    let directions: Vec<HalfSpace> = half_spaces
        .iter()
        .map(|h| HalfSpace {
            normal: h.normal,
            offset: 0.0,
        })
        .chain(sides)
        .collect();
    let program = Program {
        slack: DIRECTION_SLACK,
        bound: 4.0,
    };
    let least = objective.length() * 1e-9;
    program
        .in_space(objective, &directions)
        .is_some_and(|direction| objective.dot(direction) < -least)
}

/// Seidel's expected time needs a random order; a fixed one suffices, as no input is chosen adversarially.
fn shuffle(half_spaces: &mut [HalfSpace]) {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    for i in (1..half_spaces.len()).rev() {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        half_spaces.swap(i, (state % (i as u64 + 1)) as usize);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use microlp::{ComparisonOp, OptimizationDirection, Problem};
    use proptest::prelude::*;

    const BOUND: f64 = 1e6;

    fn half_space(normal: DVec3, through: DVec3) -> HalfSpace {
        let normal = normal.normalize_or_zero();
        HalfSpace {
            normal,
            offset: normal.dot(through),
        }
    }

    #[test]
    fn the_corner_of_a_box() {
        let mut sides = [DVec3::X, DVec3::Y, DVec3::Z].map(|n| half_space(n, DVec3::splat(2.0)));
        let Solution::Optimal(x) = minimise(DVec3::new(1.0, 2.0, 3.0), &mut sides, BOUND) else {
            panic!("the corner is the answer");
        };
        assert!(x.distance(DVec3::splat(2.0)) < 1e-9);
        assert_eq!(minimise(-DVec3::X, &mut sides, BOUND), Solution::Unbounded);
    }

    #[test]
    fn a_level_program_takes_the_point_nearest_the_origin() {
        let tilted = DVec3::new(1.0, 2.0, -2.0);
        let mut planes = [half_space(tilted, tilted); 5];
        let Solution::Optimal(x) = minimise(tilted * 7.0, &mut planes, BOUND) else {
            panic!("any point of the plane is an answer");
        };
        assert!(x.distance(tilted) < 1e-9, "{x}");
    }

    #[test]
    fn opposite_planes_apart_are_infeasible() {
        let mut planes = [
            half_space(DVec3::Z, DVec3::Z),
            half_space(-DVec3::Z, DVec3::ZERO),
        ];
        assert_eq!(minimise(DVec3::X, &mut planes, BOUND), Solution::Infeasible);
    }

    /// What microlp says of the program of planes `(normal, through)`, moved outwards by `margin`: its best value. It gets
    /// whole numbers, so that normals that cancel do so exactly.
    fn reference(
        objective: DVec3,
        planes: &[(DVec3, DVec3)],
        margin: f64,
    ) -> Result<f64, microlp::Error> {
        let mut problem = Problem::new(OptimizationDirection::Minimize);
        let variables = [objective.x, objective.y, objective.z]
            .map(|c| problem.add_var(c, (f64::NEG_INFINITY, f64::INFINITY)));
        for (normal, through) in planes {
            let row: Vec<_> = variables
                .into_iter()
                .zip(normal.to_array())
                .filter(|(_, c)| *c != 0.0)
                .collect();
            problem.add_constraint(&row, ComparisonOp::Ge, normal.dot(*through) + margin);
        }
        let solution = problem.solve()?;
        Ok(solution
            .into_solution()
            .expect("no time limit is set")
            .objective())
    }

    fn small_vector() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-4_i32..5)
            .prop_filter("no direction", |v| *v != [0, 0, 0])
            .prop_map(|v| DVec3::from_array(v.map(f64::from)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn agrees_with_another_solver(
            objective in small_vector(),
            planes in prop::collection::vec((small_vector(), small_vector()), 1..20),
        ) {
            let mut half_spaces: Vec<HalfSpace> =
                planes.iter().map(|&(normal, through)| half_space(normal, through)).collect();
            let expected = reference(objective, &planes, 0.0);
            // The other solver reports when it could not decide.
            prop_assume!(!matches!(expected, Err(microlp::Error::InternalError(_))));
            // Where a hair's breadth changes the answer (a feasible set without inside), solvers may differ.
            let moved = [-1e-5, 1e-5].map(|margin| reference(objective, &planes, margin));
            prop_assume!(moved.iter().all(|m| match (m, &expected) {
                (Ok(a), Ok(b)) => (a - b).abs() < 1e-3,
                (Err(a), Err(b)) => a == b,
                _ => false,
            }));
            match (minimise(objective, &mut half_spaces, BOUND), expected) {
                (Solution::Optimal(x), Ok(value)) => {
                    prop_assert!((objective.dot(x) - value).abs() < 1e-5, "{x} against {value}");
                    for h in &half_spaces {
                        prop_assert!(h.normal.dot(x) >= h.offset - 1e-6);
                    }
                }
                (Solution::Infeasible, Err(microlp::Error::Infeasible))
                | (Solution::Unbounded, Err(microlp::Error::Unbounded)) => {}
                (ours, theirs) => prop_assert!(false, "{ours:?} against {theirs:?}"),
            }
        }

        #[test]
        fn an_objective_within_the_cone_of_normals_is_never_unbounded(
            planes in prop::collection::vec((small_vector(), small_vector(), 0.1_f64..3.0), 1..20),
        ) {
            let mut half_spaces: Vec<HalfSpace> =
                planes.iter().map(|&(normal, through, _)| half_space(normal, through)).collect();
            let objective =
                half_spaces.iter().zip(&planes).map(|(h, (_, _, weight))| h.normal * *weight).sum();
            prop_assert_ne!(minimise(objective, &mut half_spaces, BOUND), Solution::Unbounded);
        }
    }
}
