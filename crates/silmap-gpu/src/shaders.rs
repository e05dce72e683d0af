//! The table of all shaders. A shader is its parts put one after the other; there is no preprocessor.

/// A WGSL program with entry points `vs_main` and `fs_main`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shader {
    /// Name of its last part, and label on the device.
    pub name: &'static str,
    /// Texts that make up the program, in order.
    pub parts: &'static [&'static str],
    /// Whether it must also run where there is only WebGL2.
    pub web: bool,
}

impl Shader {
    /// The whole program.
    #[must_use]
    pub fn source(&self) -> String {
        self.parts.concat()
    }

    /// Compiles it.
    #[must_use]
    pub fn module(&self, device: &wgpu::Device) -> wgpu::ShaderModule {
        device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.name),
            source: wgpu::ShaderSource::Wgsl(self.source().into()),
        })
    }
}

const VIEW: &str = include_str!("../shaders/shared/view.wgsl");
const SCREEN: &str = include_str!("../shaders/shared/screen.wgsl");
const SOUP: &str = include_str!("../shaders/shared/soup.wgsl");

macro_rules! shaders {
    ($($(#[$doc:meta])* $constant:ident = $name:literal after [$($part:ident),*];)*) => {
        $(
            $(#[$doc])*
            pub const $constant: Shader = Shader {
                name: $name,
                parts: &[$($part,)* include_str!(concat!("../shaders/", $name, ".wgsl"))],
                web: true,
            };
        )*
        /// All shaders.
        pub const ALL: &[Shader] = &[$($constant),*];
    };
}

shaders! {
    /// One value wherever a mesh covers a pixel's centre.
    CAPTURE_MASK = "capture_mask" after [VIEW];
    /// The full mesh, lit.
    SHADE_MODEL = "shade_model" after [VIEW];
    /// Loops as triangle fans, for their effect on the stencil.
    STENCIL_FILL = "stencil_fill" after [VIEW];
    /// One everywhere, where the stencil lets it.
    STENCIL_COVER = "stencil_cover" after [SCREEN];
    /// Coverage near the segments of the outline.
    EDGE_COVERAGE = "edge_coverage" after [VIEW];
    /// The shadow on the ground, by a light's depths.
    GROUND_SHADOW = "ground_shadow" after [];
    /// One colour by a coverage.
    TINT = "tint" after [SCREEN];
    /// Where two masks differ.
    DIFFERENCE = "difference" after [SCREEN];
    /// The nearest layer of a full mesh's faces, for edges at image precision.
    SOUP_NEAR = "soup_near" after [VIEW, SOUP];
    /// The number of the nearest face at each pixel.
    SOUP_ITEMS = "soup_items" after [VIEW, SOUP];
    /// The layer behind as it is or pulled forward.
    EDGES_TRANSLATE = "edges_translate" after [VIEW, SOUP];
    /// The edges of the layer behind as lines.
    EDGES_WIREFRAME = "edges_wireframe" after [VIEW, SOUP];
    /// The layer behind, fattened.
    EDGES_FATTEN = "edges_fatten" after [VIEW, SOUP];
}
