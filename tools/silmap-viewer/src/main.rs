//! `silmap-viewer`: the window, from the command line; `silmap view` starts it. On a page: the beginning of the program.

#[cfg(target_arch = "wasm32")]
fn main() {
    // What the page calls is linked where something of it is named.
    let _ = silmap_viewer::page::backend();
}

#[cfg(not(target_arch = "wasm32"))]
fn main() -> std::process::ExitCode {
    desktop::main()
}

#[cfg(not(target_arch = "wasm32"))]
mod desktop {
    use std::path::PathBuf;
    use std::process::ExitCode;

    use clap::Parser;
    use clap::error::ErrorKind;
    use silmap_viewer::look::Look;
    use silmap_viewer::serve::{self, Served};
    use silmap_viewer::{Opened, Start, window};

    /// Exit codes of `silmap`.
    const NO_ADAPTER: u8 = 3;

    /// Look at an asset, or at a mesh or a capture while its asset is built
    #[derive(Debug, Parser)]
    #[command(
        name = "silmap view",
        version,
        after_help = "Example: silmap view bunny.glb --model bunny.off --beside clipped --mode original"
    )]
    struct Args {
        /// The asset, a mesh, or a capture's folder or camera file; without one what was open last
        file: Option<PathBuf>,
        /// The full mesh of the asset, to compare with
        #[arg(long, requires = "file", conflicts_with = "web")]
        model: Option<PathBuf>,
        /// The capture that the asset was built of, for its cameras and photographs
        #[arg(long, requires = "file", conflicts_with = "web")]
        capture: Option<PathBuf>,
        /// The eye, as for `silmap render`
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        eye: Option<String>,
        /// What the eye looks at
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        target: Option<String>,
        /// Upwards in the picture
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        up: Option<String>,
        /// Vertical field of view, degrees
        #[arg(long, value_name = "DEGREES")]
        fov: Option<String>,
        /// The axis that is upwards: y, z, or auto for that of the photographs
        #[arg(long, value_name = "AXIS")]
        upwards: Option<String>,
        /// clipped, original, textured, coarse, silhouette or difference
        #[arg(long)]
        mode: Option<String>,
        /// The mode of a second picture, to the right of a line that can be dragged
        #[arg(long, value_name = "MODE")]
        beside: Option<String>,
        /// How the two share the window: split or sides
        #[arg(long)]
        layout: Option<String>,
        /// auto, tight, hull or paper
        #[arg(long)]
        method: Option<String>,
        /// The method of the second picture, where it is another
        #[arg(long, value_name = "METHOD")]
        beside_method: Option<String>,
        /// relief, blended, nearest, views, tiles or lit
        #[arg(long)]
        paint: Option<String>,
        /// soft, msaa or none
        #[arg(long)]
        antialias: Option<String>,
        /// The direction to a light that shines instead of the studio's
        #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
        light: Option<String>,
        /// Overlays: outline, polytope, triangle, cameras, photographs
        #[arg(long, value_name = "LIST")]
        show: Option<String>,
        /// How many instances
        #[arg(long, value_name = "N")]
        instances: Option<String>,
        /// How many views the map keeps
        #[arg(long, value_name = "N")]
        keep: Option<String>,
        /// How many faces the hull has, where the full mesh is at hand
        #[arg(long, value_name = "N")]
        faces: Option<String>,
        /// A view as "Copy a link to this view" gives it; other options win
        #[arg(long, value_name = "LINK", allow_hyphen_values = true)]
        look: Option<String>,
        /// Serve it as a page for the browser, on this machine alone, and print its address
        #[arg(long)]
        web: bool,
        /// The port of --web; any that is free where 0
        #[arg(long, default_value_t = 0, requires = "web")]
        port: u16,
        /// The folder of the page, as `cargo xtask web` makes it; beside the program without
        #[arg(long, value_name = "FOLDER", requires = "web")]
        page: Option<PathBuf>,
    }

    impl Args {
        /// All of it as a link.
        fn link(&self) -> String {
            let options = [
                ("eye", &self.eye),
                ("target", &self.target),
                ("up", &self.up),
                ("fov", &self.fov),
                ("upwards", &self.upwards),
                ("mode", &self.mode),
                ("beside", &self.beside),
                ("layout", &self.layout),
                ("method", &self.method),
                ("beside-method", &self.beside_method),
                ("paint", &self.paint),
                ("antialias", &self.antialias),
                ("light", &self.light),
                ("show", &self.show),
                ("instances", &self.instances),
                ("keep", &self.keep),
                ("faces", &self.faces),
            ];
            let told = options.into_iter();
            let told = told.filter_map(|(key, v)| v.as_ref().map(|v| format!("{key}={v}")));
            let look = self.look.iter().cloned();
            look.chain(told).collect::<Vec<_>>().join("&")
        }
    }

    pub(crate) fn main() -> ExitCode {
        let args = Args::parse();
        let link = args.link();
        let look = Look::read_link(&link).unwrap_or_else(|error| {
            let command = <Args as clap::CommandFactory>::command();
            let mut command = command.bin_name("silmap view");
            command.error(ErrorKind::ValueValidation, error).exit()
        });
        if args.web {
            let served = Served {
                asset: args.file,
                page: args.page,
                port: args.port,
                link,
            };
            let said = serve::serve(&served, |address| eprintln!("{address}  (Ctrl-C ends it)"));
            return match said {
                Ok(()) => ExitCode::SUCCESS,
                Err(error) => {
                    eprintln!("error: {error:#}");
                    ExitCode::FAILURE
                }
            };
        }
        let file = args.file.map(|path| Opened {
            path,
            model: args.model,
            capture: args.capture,
        });
        let start = Start {
            look,
            is_given: !link.is_empty(),
            is_bare: false,
            file,
        };
        match window::open(start) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::from(NO_ADAPTER)
            }
        }
    }
}
