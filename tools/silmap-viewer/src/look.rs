//! What is looked at and how: everything that a link, or a command line, reproduces.

use glam::DVec3;
use silmap_study::{Antialias, Paint};
use thiserror::Error;

pub use crate::choices::{Layout, MethodChoice, Named, Overlays, Shown, Upwards};

/// Where the eye is, as typed: coordinates of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The eye.
    pub eye: DVec3,
    /// What it looks at; the model's middle without.
    pub target: Option<DVec3>,
    /// Upwards in the picture.
    pub up: Option<DVec3>,
    /// Vertical field of view, degrees.
    pub fov_y_degrees: Option<f64>,
}

/// How it is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The picture, or the left one.
    pub shown: Shown,
    /// The right one, where there are two.
    pub beside: Option<Shown>,
    /// How the two share the window.
    pub layout: Layout,
    /// Where they meet, 0 to 1 across the window.
    pub split: f32,
    /// What is upwards.
    pub upwards: Upwards,
    /// How outlines are interpolated.
    pub method: MethodChoice,
    /// How they are in the right picture, where that differs.
    pub beside_method: Option<MethodChoice>,
    /// What the hull shows.
    pub paint: Paint,
    /// How edges are smoothed.
    pub antialias: Antialias,
    /// What is drawn over it.
    pub overlays: Overlays,
    /// The direction to a light that shines instead of the studio's.
    pub light: Option<DVec3>,
    /// How many instances are drawn.
    pub instances: u32,
    /// How many views the map keeps; all where `None`.
    pub keep: Option<u32>,
    /// How many faces the hull has at most; as many as the asset's where `None`.
    pub faces: Option<u32>,
    /// Where the eye is; it is framed where `None`.
    pub pose: Option<Pose>,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            shown: Shown::Clipped,
            beside: None,
            layout: Layout::Split,
            split: 0.5,
            upwards: Upwards::Auto,
            method: MethodChoice(None),
            beside_method: None,
            paint: Paint::default(),
            antialias: Antialias::default(),
            overlays: Overlays::default(),
            light: None,
            instances: 1,
            keep: None,
            faces: None,
            pose: None,
        }
    }
}

/// Instances that a link may ask for.
pub const MOST_INSTANCES: u32 = 10_000;

/// Faces of a hull that a link may ask for.
pub const FACES: std::ops::RangeInclusive<u32> = 20..=20_000;

/// What is wrong with a link.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum LinkError {
    /// A key that is not known.
    #[error("a link has no \"{key}\"")]
    Key {
        /// The key.
        key: String,
    },
    /// A value that does not fit its key.
    #[error("\"{key}={value}\": {wanted}")]
    Value {
        /// The key.
        key: String,
        /// The value.
        value: String,
        /// What it should be.
        wanted: &'static str,
    },
}

/// Three numbers with commas between them.
fn vector(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text
        .split(',')
        .map(|n| n.trim().parse().ok().filter(|x: &f64| x.is_finite()))
        .collect::<Option<_>>()?;
    let [x, y, z] = numbers[..] else { return None };
    Some(DVec3::new(x, y, z))
}

fn in_text(v: DVec3) -> String {
    // Adding zero turns −0 into 0.
    let [x, y, z] = v.to_array().map(|x| (x * 1e9).round() / 1e9 + 0.0);
    format!("{x},{y},{z}")
}

impl Look {
    /// Takes over what a link says, `key=value` with `&` between.
    ///
    /// # Errors
    /// At the first key or value that is not understood.
    pub fn read_link(link: &str) -> Result<Self, LinkError> {
        let mut look = Self::default();
        let mut pose = Pose {
            eye: DVec3::ZERO,
            target: None,
            up: None,
            fov_y_degrees: None,
        };
        let mut has_eye = false;
        let mut of_eye = None;
        for pair in link.split('&').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
            let wrong = |wanted: &'static str| LinkError::Value {
                key: key.to_owned(),
                value: value.to_owned(),
                wanted,
            };
            const VECTOR: &str = "three finite numbers with commas between them are wanted";
            let point = || vector(value).ok_or_else(|| wrong(VECTOR));
            if ["target", "up", "fov"].contains(&key) {
                of_eye = Some(wrong("it is of use with an eye alone"));
            }
            match key {
                "eye" => {
                    pose.eye = point()?;
                    has_eye = true;
                }
                "target" => pose.target = Some(point()?),
                "up" => pose.up = Some(point()?),
                "fov" => {
                    let degrees = value.parse().ok().filter(|d| (0.1..179.0).contains(d));
                    let wanted = "an angle of 0.1 to 179 degrees is wanted";
                    pose.fov_y_degrees = Some(degrees.ok_or_else(|| wrong(wanted))?);
                }
                "mode" => look.shown = word(value, &wrong)?,
                "beside" => look.beside = Some(word(value, &wrong)?),
                "split" => {
                    let share = value.parse().ok().filter(|s| (0.0..=1.0).contains(s));
                    look.split = share.ok_or_else(|| wrong("a number from 0 to 1 is wanted"))?;
                }
                "layout" => look.layout = word(value, &wrong)?,
                "upwards" => look.upwards = word(value, &wrong)?,
                "method" => look.method = word(value, &wrong)?,
                "beside-method" => look.beside_method = Some(word(value, &wrong)?),
                "paint" => look.paint = word(value, &wrong)?,
                "antialias" => look.antialias = word(value, &wrong)?,
                "light" => {
                    let light = point()?;
                    if light == DVec3::ZERO {
                        return Err(wrong("a direction is wanted, and it has none"));
                    }
                    look.light = Some(light);
                }
                "instances" => {
                    let count = value.parse().ok();
                    let count = count.filter(|n| (1..=MOST_INSTANCES).contains(n));
                    look.instances = count.ok_or_else(|| wrong("1 to 10000 is wanted"))?;
                }
                "keep" => {
                    let count = value.parse().ok().filter(|n| (4..=100_000).contains(n));
                    look.keep = Some(count.ok_or_else(|| wrong("4 views or more are wanted"))?);
                }
                "faces" => {
                    let count = value.parse().ok().filter(|n| FACES.contains(n));
                    look.faces = Some(count.ok_or_else(|| wrong("20 to 20000 is wanted"))?);
                }
                "show" => {
                    look.overlays = Overlays::default();
                    for name in value.split(',').filter(|name| !name.is_empty()) {
                        let flags = look.overlays.flags().into_iter();
                        let flag = flags.into_iter().find(|(known, ..)| *known == name);
                        let wanted =
                            "outline, polytope, triangle, cameras or photographs is wanted";
                        *flag.ok_or_else(|| wrong(wanted))?.2 = true;
                    }
                }
                other => {
                    let key = other.to_owned();
                    return Err(LinkError::Key { key });
                }
            }
        }
        if let Some(error) = of_eye.filter(|_| !has_eye) {
            return Err(error);
        }
        look.pose = has_eye.then_some(pose);
        Ok(look)
    }

    /// The link that [`Look::read_link`] reads; what is as it is by default is left out.
    #[must_use]
    pub fn link(&self) -> String {
        let plain = Self::default();
        let mut pairs: Vec<(&str, String)> = Vec::new();
        if let Some(pose) = self.pose {
            pairs.push(("eye", in_text(pose.eye)));
            pairs.extend(pose.target.map(|t| ("target", in_text(t))));
            pairs.extend(pose.up.map(|u| ("up", in_text(u))));
            let degrees = |d: f64| format!("{}", (d * 1e6).round() / 1e6);
            pairs.extend(pose.fov_y_degrees.map(|d| ("fov", degrees(d))));
        }
        let mut word = |key, differs: bool, word: &str| {
            if differs {
                pairs.push((key, word.to_owned()));
            }
        };
        word("mode", self.shown != plain.shown, self.shown.word());
        if let Some(beside) = self.beside {
            word("beside", true, beside.word());
            word("layout", self.layout != plain.layout, self.layout.word());
            word(
                "split",
                (self.split - plain.split).abs() > 1e-4,
                &format!("{:.4}", self.split),
            );
        }
        word(
            "upwards",
            self.upwards != plain.upwards,
            self.upwards.word(),
        );
        word("method", self.method != plain.method, self.method.word());
        if let Some(method) = self.beside_method {
            word("beside-method", true, method.word());
        }
        word("paint", self.paint != plain.paint, self.paint.word());
        word(
            "antialias",
            self.antialias != plain.antialias,
            self.antialias.word(),
        );
        if let Some(light) = self.light {
            word("light", true, &in_text(light));
        }
        word(
            "instances",
            self.instances != 1,
            &self.instances.to_string(),
        );
        if let Some(keep) = self.keep {
            word("keep", true, &keep.to_string());
        }
        if let Some(faces) = self.faces {
            word("faces", true, &faces.to_string());
        }
        let mut overlays = self.overlays;
        let flags = overlays.flags().into_iter();
        let on: Vec<_> = flags
            .filter(|(.., on)| **on)
            .map(|(name, ..)| name)
            .collect();
        word("show", !on.is_empty(), &on.join(","));
        let pairs = pairs.iter().map(|(key, value)| format!("{key}={value}"));
        pairs.collect::<Vec<_>>().join("&")
    }
}

fn word<T: Named>(value: &str, wrong: &dyn Fn(&'static str) -> LinkError) -> Result<T, LinkError> {
    T::of_word(value).ok_or_else(|| wrong("it is not one of the choices"))
}

#[cfg(test)]
mod tests {
    use silmap_map::Method;

    use super::*;

    #[test]
    fn a_link_says_everything_and_nothing_by_default() {
        assert_eq!(Look::default().link(), "");
        assert_eq!(Look::read_link(""), Ok(Look::default()));
        let look = Look {
            shown: Shown::Original,
            beside: Some(Shown::Clipped),
            layout: Layout::Sides,
            split: 0.25,
            upwards: Upwards::Z,
            method: MethodChoice(Some(Method::Paper)),
            beside_method: Some(MethodChoice(Some(Method::Hull))),
            paint: Paint::Tiles,
            antialias: Antialias::Msaa,
            overlays: Overlays {
                outline: true,
                polytope: false,
                triangle: true,
                cameras: false,
                photographs: true,
            },
            light: Some(DVec3::new(0.5, 1.0, -2.0)),
            instances: 1000,
            keep: Some(32),
            faces: Some(120),
            pose: Some(Pose {
                eye: DVec3::new(-0.25, 1e-7, 3.0),
                target: Some(DVec3::new(0.0, 0.5, 0.0)),
                up: Some(DVec3::new(0.0, 0.0, 1.0)),
                fov_y_degrees: Some(20.5),
            }),
        };
        assert_eq!(Look::read_link(&look.link()), Ok(look), "{}", look.link());
    }

    #[test]
    fn what_is_not_understood_is_named() {
        let message = |link: &str| Look::read_link(link).map(|_| ()).map_err(|e| e.to_string());
        assert_eq!(message("eye=0,0,2&"), Ok(()));
        assert_eq!(
            message("eye=1,2"),
            Err("\"eye=1,2\": three finite numbers with commas between them are wanted".into())
        );
        assert!(message("eye=1,2,nan").is_err());
        assert_eq!(
            message("moed=clipped"),
            Err("a link has no \"moed\"".into())
        );
        assert!(message("mode=clip").is_err());
        assert!(message("show=outline,hull").is_err());
        assert!(message("instances=0").is_err());
        assert!(message("faces=4").is_err());
        assert!(message("target=0,0,0").is_err());
        assert_eq!(message("fov=20&eye=1,2,3"), Ok(()));
        assert!(message("light=0,0,0").is_err());
    }
}
