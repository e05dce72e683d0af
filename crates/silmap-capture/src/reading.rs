//! Other ways to read the cameras of a file, each a likely slip of whoever wrote it.
//!
//! Each is a function from a camera as it was read to the camera that was meant. What turns the whole object is left out of it: masks do
//! not tell that.

use glam::{DMat3, DVec3};

use crate::pinhole::Pinhole;

/// A slip that all cameras of a file may share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Reading {
    /// Pictures whose columns count from the right.
    MirroredPictures,
    /// Pictures whose rows count from below.
    UpsideDownMirrored,
    /// Pictures that are turned by half a turn.
    HalfTurn,
    /// The camera's axes have y up and z backward where y down and z forward is expected, or the other way round.
    YUpZBack,
    /// The camera's y axis points up where it should point down, or the other way round.
    YUp,
    /// The camera's z axis points backward where it should point forward, or the other way round.
    ZBack,
    /// The pose from world to camera stands where that from camera to world is expected, or the other way round.
    OtherDirection,
    /// As [`Self::OtherDirection`], and y and z have the other sign.
    OtherDirectionYUpZBack,
    /// The rotation is transposed, the camera's position right.
    TransposedAboutEye,
    /// The rotation is transposed, the translation from world to camera right.
    TransposedBeforeTranslation,
}

/// All of them; those that change less come first.
pub(crate) const ALL: [Reading; 10] = [
    Reading::MirroredPictures,
    Reading::YUp,
    Reading::UpsideDownMirrored,
    Reading::YUpZBack,
    Reading::OtherDirection,
    Reading::TransposedBeforeTranslation,
    Reading::TransposedAboutEye,
    Reading::HalfTurn,
    Reading::ZBack,
    Reading::OtherDirectionYUpZBack,
];

/// The sign of axes that are right, down and forward on one side, right, up and backward on the other.
const FLIP: DMat3 = DMat3::from_cols(DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z);

impl Reading {
    /// What is wrong, as what a sentence is about.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MirroredPictures => "pictures are mirrored left to right",
            Self::UpsideDownMirrored => "pictures are mirrored top to bottom",
            Self::HalfTurn => "pictures are turned by 180 degrees",
            Self::YUpZBack => {
                "cameras have y up and z backward for y down and z forward, or the other way round"
            }
            Self::YUp => "cameras have y up for y down, or the other way round",
            Self::ZBack => "cameras have z backward for z forward, or the other way round",
            Self::OtherDirection => {
                "poses from world to camera are taken for poses from camera to world, or the other way round"
            }
            Self::OtherDirectionYUpZBack => {
                "poses from world to camera are taken for poses from camera to world, or the other way round, and their y and z axes have the \
                 other sign"
            }
            Self::TransposedAboutEye | Self::TransposedBeforeTranslation => {
                "rotations are transposed"
            }
        }
    }

    /// A word for programs.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::MirroredPictures => "mirrored-pictures",
            Self::UpsideDownMirrored => "mirrored-pictures-top-to-bottom",
            Self::HalfTurn => "half-turn",
            Self::YUpZBack => "y-up-z-backward",
            Self::YUp => "y-up",
            Self::ZBack => "z-backward",
            Self::OtherDirection => "other-direction",
            Self::OtherDirectionYUpZBack => "other-direction-y-up-z-backward",
            Self::TransposedAboutEye | Self::TransposedBeforeTranslation => "transposed-rotation",
        }
    }

    /// The camera that was meant, if this is the slip. `is_y_up` says that the file's own axes have y up and z backward.
    #[must_use]
    pub fn apply(self, camera: &Pinhole, is_y_up: bool) -> Pinhole {
        let own = if is_y_up { FLIP } else { DMat3::IDENTITY };
        // From the camera's own axes to the world.
        let turn = DMat3::from_cols_array_2d(&camera.axes.map(|a| a.to_array())) * own;
        let posed = |turn: DMat3, eye: DVec3| {
            let axes = turn * own;
            Pinhole {
                axes: [axes.x_axis, axes.y_axis, axes.z_axis],
                eye,
                ..*camera
            }
        };
        let back = turn.transpose();
        match self {
            Self::MirroredPictures => mirrored(camera),
            Self::UpsideDownMirrored => half_turned(&mirrored(camera)),
            Self::HalfTurn => half_turned(camera),
            Self::YUpZBack => posed(turn * FLIP, camera.eye),
            Self::YUp => posed(
                turn * DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0)),
                camera.eye,
            ),
            Self::ZBack => posed(
                turn * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)),
                camera.eye,
            ),
            Self::OtherDirection => posed(back, -(back * camera.eye)),
            Self::OtherDirectionYUpZBack => posed(back * FLIP, -(back * camera.eye)),
            Self::TransposedAboutEye => posed(back, camera.eye),
            Self::TransposedBeforeTranslation => posed(back, back * (back * camera.eye)),
        }
    }
}

/// The camera of the picture whose columns count from the right.
fn mirrored(camera: &Pinhole) -> Pinhole {
    let mut mirrored = *camera;
    mirrored.focal.x = -camera.focal.x;
    mirrored.skew = -camera.skew;
    mirrored.principal.x = f64::from(camera.width) - camera.principal.x;
    mirrored
}

fn half_turned(camera: &Pinhole) -> Pinhole {
    let mut turned = mirrored(camera);
    turned.focal.y = -camera.focal.y;
    turned.principal.y = f64::from(camera.height) - camera.principal.y;
    turned
}

/// What makes the masks agree better than the cameras as they were read.
#[derive(Clone, Debug, PartialEq)]
pub struct Misread {
    /// Median overlap of masks and a coarse hull as read; zero where nothing is left.
    pub as_read: f64,
    /// The median overlap with each of `likely`, at least.
    pub otherwise: f64,
    /// What may be wrong: one thing, or a few that these masks do not tell apart.
    pub likely: Vec<Reading>,
}

impl Misread {
    /// Words for programs, each once.
    #[must_use]
    pub fn keys(&self) -> Vec<&'static str> {
        let mut keys: Vec<&str> = self.likely.iter().map(|r| r.key()).collect();
        // Two kinds of transposed rotations have one word.
        keys.dedup();
        keys
    }
}

impl std::fmt::Display for Misread {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut names: Vec<&str> = self.likely.iter().map(|r| r.name()).collect();
        names.dedup();
        let untold = match names.len() {
            1 => "",
            _ => " (these masks do not tell which)",
        };
        write!(
            f,
            "the likely cause is that the {}{untold}: read so, a coarse hull overlaps the masks by {:.2}, and as they stand by {:.2}",
            names.join(", or that the "),
            self.otherwise,
            self.as_read
        )
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec2};

    use super::*;

    fn camera() -> Pinhole {
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.2, 0.6);
        let lens = (DVec2::new(300.0, 310.0), DVec2::new(70.0, 90.0));
        let axes = [DVec3::X, DVec3::Y, DVec3::Z].map(|a| turn * a);
        Pinhole {
            skew: 2.0,
            ..Pinhole::from_pose(DVec3::new(1.0, 2.0, -5.0), axes, lens, (160, 140)).unwrap()
        }
    }

    #[test]
    fn mirrored_pictures_are_those_of_the_file_mirrored() {
        let point = camera().eye + camera().direction(DVec2::new(12.0, 34.0)) * 3.0;
        let at = |reading: Reading| reading.apply(&camera(), false).project(point).unwrap().0;
        assert!(at(Reading::MirroredPictures).distance(DVec2::new(148.0, 34.0)) < 1e-9);
        assert!(at(Reading::UpsideDownMirrored).distance(DVec2::new(12.0, 106.0)) < 1e-9);
        assert!(at(Reading::HalfTurn).distance(DVec2::new(148.0, 106.0)) < 1e-9);
    }

    #[test]
    fn what_has_one_word_is_named_once() {
        let misread = Misread {
            as_read: 0.2,
            otherwise: 0.9,
            likely: ALL.to_vec(),
        };
        let (keys, said) = (misread.keys(), misread.to_string());
        assert_eq!(keys.len(), ALL.len() - 1);
        for reading in ALL {
            let of_it = keys.iter().filter(|&&key| key == reading.key());
            assert_eq!(of_it.count(), 1, "{reading:?}");
        }
        assert_eq!(
            said.matches("rotations are transposed").count(),
            1,
            "{said}"
        );
    }

    /// What was misread by the same slip is right again, but for a turn of all.
    #[test]
    fn each_slip_undoes_itself() {
        for reading in ALL {
            for is_y_up in [false, true] {
                let twice = reading.apply(&reading.apply(&camera(), is_y_up), is_y_up);
                // A turn of all keeps what the camera sees of itself.
                let seen = |c: &Pinhole| DVec3::from_array(c.axes.map(|a| a.dot(c.eye)));
                let flips = [DVec3::ONE, DVec3::new(1.0, -1.0, -1.0)];
                let is_alike = flips
                    .iter()
                    .any(|&f| (seen(&twice) * f).distance(seen(&camera())) < 1e-9);
                assert!(is_alike, "{reading:?} {is_y_up}");
                assert!(twice.principal.distance(camera().principal) < 1e-9);
            }
        }
    }
}
