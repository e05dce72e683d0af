//! What can be chosen for a picture, by the words of links and those that people read.

use silmap_map::Method;
use silmap_study::{Antialias, Mode, Paint};

/// How one picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// The hull clipped to its outline: the method itself.
    Clipped,
    /// The full mesh.
    Original,
    /// The painted hull, not clipped.
    Textured,
    /// The facets of the hull.
    Coarse,
    /// The outline alone.
    Silhouette,
    /// Pixels that the outline gets wrong, over the full mesh.
    Difference,
}

/// A choice that a link knows by a word.
pub trait Named: Copy + PartialEq + 'static {
    /// All choices: what a link calls them, and what people read.
    const ALL: &'static [(Self, &'static str, &'static str)];

    /// What a link calls it.
    fn word(self) -> &'static str {
        Self::ALL.iter().find(|c| c.0 == self).map_or("", |c| c.1)
    }

    /// What people read.
    fn label(self) -> &'static str {
        Self::ALL.iter().find(|c| c.0 == self).map_or("", |c| c.2)
    }

    /// The choice of a word.
    fn of_word(word: &str) -> Option<Self> {
        Self::ALL.iter().find(|c| c.1 == word).map(|c| c.0)
    }
}

impl Named for Shown {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Clipped, "clipped", "Clipped hull"),
        (Self::Original, "original", "Original mesh"),
        (Self::Textured, "textured", "Textured hull"),
        (Self::Coarse, "coarse", "Coarse hull"),
        (Self::Silhouette, "silhouette", "Silhouette"),
        (Self::Difference, "difference", "Difference"),
    ];
}

impl Shown {
    /// The mode of the renderer.
    #[must_use]
    pub fn mode(self) -> Mode {
        match self {
            Self::Clipped => Mode::Clipped,
            Self::Original => Mode::Original,
            Self::Textured => Mode::Textured,
            Self::Coarse => Mode::Coarse,
            Self::Silhouette => Mode::Silhouette,
            Self::Difference => Mode::Difference,
        }
    }

    /// Whether it needs the full mesh.
    #[must_use]
    pub fn needs_model(self) -> bool {
        self.mode().needs_model()
    }

    /// Whether it needs an asset.
    #[must_use]
    pub fn needs_asset(self) -> bool {
        self != Self::Original
    }
}

/// A way to interpolate; `None` is the best that the asset has data for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MethodChoice(pub Option<Method>);

impl Named for MethodChoice {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self(None), "auto", "Best for the asset"),
        (Self(Some(Method::Tight)), "tight", "Tight"),
        (Self(Some(Method::Hull)), "hull", "Hull"),
        (Self(Some(Method::Paper)), "paper", "Paper"),
    ];
}

/// How two pictures share the window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// One picture, drawn one way on the left of a line and another way on its right.
    #[default]
    Split,
    /// Two whole pictures.
    Sides,
}

impl Named for Layout {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Split, "split", "Split at a line"),
        (Self::Sides, "sides", "Side by side"),
    ];
}

/// What is upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Upwards {
    /// As the photographs were taken, or y.
    #[default]
    Auto,
    /// The y axis.
    Y,
    /// The z axis.
    Z,
}

impl Named for Upwards {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Auto, "auto", "As captured, or y"),
        (Self::Y, "y", "y"),
        (Self::Z, "z", "z"),
    ];
}

impl Named for Paint {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Relief, "relief", "Relief"),
        (Self::Blended, "blended", "Blended views"),
        (Self::Nearest, "nearest", "Nearest view"),
        (Self::Views, "views", "Views alone"),
        (Self::Tiles, "tiles", "Atlas"),
        (Self::Lit, "lit", "One colour, lit"),
    ];
}

impl Named for Antialias {
    const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Soft, "soft", "Soft"),
        (Self::Msaa, "msaa", "Four samples"),
        (Self::None, "none", "None"),
    ];
}

/// What is drawn over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Overlays {
    /// The outline as lines.
    pub outline: bool,
    /// The polytope of viewpoints.
    pub polytope: bool,
    /// The triangle of views that faces the eye, with the contours of its corners.
    pub triangle: bool,
    /// Captured cameras.
    pub cameras: bool,
    /// Photographs.
    pub photographs: bool,
}

impl Overlays {
    /// Names in a link, what people read, and the flags.
    pub fn flags(&mut self) -> [(&'static str, &'static str, &mut bool); 5] {
        [
            ("outline", "Outline", &mut self.outline),
            ("polytope", "Polytope of viewpoints", &mut self.polytope),
            (
                "triangle",
                "Current triangle and its contours",
                &mut self.triangle,
            ),
            ("cameras", "Captured cameras", &mut self.cameras),
            ("photographs", "Photographs", &mut self.photographs),
        ]
    }
}
