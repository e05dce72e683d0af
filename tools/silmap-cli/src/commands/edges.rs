//! `silmap edges`: exact silhouette edges of the full mesh.

use std::fmt::Write;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, ensure};
use clap::error::ErrorKind;
use glam::DVec3;
use serde::Serialize;
use silmap_capture::Drawing;
use silmap_exact::{
    ConeForest, DirectedEdge, EdgeMesh, ExtractionMethod, Extractor, Outliner, Viewpoint, Work,
    chain_loops, walk_around,
};
use silmap_geometry::{Camera, Loop, TriangleMesh, Watch};
use silmap_mesh_io::input;

use crate::args::{EdgesArgs, ExtractionArg, usage_error};
use crate::camera::{CameraJson, PictureCamera};
use crate::captured_camera;
use crate::files::load_model;
use crate::interrupt;
use crate::output::{self, OutputFile, Staging};
use crate::progress::Progress;
use crate::scene::Scene;
use crate::values::point_text;

/// Side of the drawing in pixels.
const DRAWING_PX: u32 = 1024;
/// How far the eye of a parallel projection's drawing is, in radii: the error is far below a hundredth of a pixel.
const PARALLEL_DISTANCE_REL: f64 = 1e8;

#[derive(Serialize)]
struct EdgesJson {
    method: &'static str,
    /// Of the last viewpoint, as are the following two.
    silhouette_edges: usize,
    tested_edges: usize,
    visited_nodes: usize,
    data_bytes: usize,
    build_seconds: f64,
    /// Of `--forest`.
    #[serde(skip_serializing_if = "Option::is_none")]
    forest: Option<ForestJson>,
    /// Over all viewpoints and repetitions.
    seconds_median: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    walk: Option<WalkJson>,
    #[serde(skip_serializing_if = "Option::is_none")]
    edges: Option<Vec<[u32; 2]>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    vertices: Option<Vec<[f64; 3]>>,
    /// From edges to the polygons of the outline, where they were asked for; over all repetitions.
    #[serde(skip_serializing_if = "Option::is_none")]
    outline_seconds_median: Option<f64>,
}

/// A file's worth of outline, with the names that `contour` has.
#[derive(Serialize)]
struct OutlineJson {
    camera: CameraJson,
    loops: Vec<Vec<[f64; 2]>>,
    /// From edges to polygons, over all repetitions.
    seconds: f64,
}

#[derive(Serialize)]
struct ForestJson {
    /// Whether it was in the file; otherwise it was built and written there.
    was_read: bool,
    /// Of reading or of building it, which are a part of `build_seconds`.
    seconds: f64,
    /// Size of the file.
    bytes: usize,
}

#[derive(Serialize)]
struct WalkJson {
    viewpoints: usize,
    silhouette_edges_mean: f64,
    tested_edges_mean: f64,
    visited_nodes_mean: f64,
}

pub(crate) fn run(args: &EdgesArgs) -> anyhow::Result<()> {
    let captured = captured_camera::named(&args.captured)?;
    let start = match &captured {
        Some((_, view)) => Viewpoint::Eye(view.camera.eye),
        None => viewpoint_from_args(args)?,
    };
    if args.forest.is_some() && args.method != ExtractionArg::Cones {
        usage_error(
            ErrorKind::ArgumentConflict,
            "--forest is of use with --method cones only",
        );
    }
    let file = args.svg.as_deref().map(OutputFile::check).transpose()?;
    let outline_file = args.outline.as_deref().map(OutputFile::check).transpose()?;
    let saved = args.forest.as_deref().map(SavedForest::look).transpose()?;
    let missing = match &saved {
        Some(SavedForest::Missing(forest)) => Some(forest),
        _ => None,
    };
    output::refuse_same_file([&file, &outline_file].into_iter().flatten().chain(missing));
    let written = || [&file, &outline_file].into_iter().flatten();
    written().for_each(|written| written.refuse_to_replace(&args.model.path));
    let mut staging = Staging::default();
    let model = load_model(&args.model.path, args.model.mending)?;
    let (center, radius) = (model.mesh.bounds().center, model.mesh.bounds().radius);
    let origin = model.mesh.origin();
    let start = match start {
        Viewpoint::Eye(eye) => Viewpoint::Eye(eye - origin),
        Viewpoint::Direction(_) => start,
    };
    let viewpoints: Vec<Viewpoint> = walk_around(start, center, args.walk as usize).collect();
    let is_seen = file.is_some() || outline_file.is_some();
    let scene = Scene::of_mesh(origin, model.mesh.bounds());
    let drawing = match (viewpoints.last(), &captured) {
        (Some(_), Some((file, view))) if is_seen => {
            let made = Drawing::new(&view.camera);
            let captured = captured_camera::of_view((file, view), made, &scene)?;
            written().for_each(|file| captured.refuse_to_be_replaced_by(file));
            Some(captured.into())
        }
        (Some(last), _) if is_seen => Some(PictureCamera {
            camera: camera_of(last, (center, radius), origin)?,
            captured: None,
        }),
        _ => None,
    };
    let mesh = EdgeMesh::from(&model.mesh);
    let method = ExtractionMethod::from(args.method);
    let Extracted {
        measured,
        data_bytes,
        build_seconds,
        forest,
        new_forest,
    } = extract(&mesh, method, saved, &viewpoints, args.repeat)?;
    if let Some((file, bytes)) = new_forest {
        staging.add(&file, &bytes)?;
    }
    let mut edges = measured.edges;
    edges.sort_unstable();

    if let (Some(file), Some(seen)) = (&file, &drawing) {
        staging.add(file, svg(model.mesh.mesh(), seen, &edges)?.as_bytes())?;
    }
    let mut outline_seconds_median = None;
    if let (Some(file), Some(seen)) = (&outline_file, &drawing) {
        let made = outline(model.mesh.mesh(), &seen.camera, &edges, args.repeat);
        let (loops, seconds) = made.with_context(|| args.model.path.display().to_string())?;
        outline_seconds_median = Some(seconds);
        let points = |points: &Loop| points.iter().map(|p| p.to_array()).collect();
        let json = serde_json::to_vec(&OutlineJson {
            camera: seen.json(&scene),
            loops: seen.loops(&loops).iter().map(points).collect(),
            seconds,
        })?;
        staging.add(file, &json)?;
    }
    staging.publish()?;
    let result = EdgesJson {
        method: method.name(),
        silhouette_edges: edges.len(),
        tested_edges: measured.last.tested_edges,
        visited_nodes: measured.last.visited_nodes,
        data_bytes,
        build_seconds,
        forest,
        seconds_median: measured.seconds_median,
        walk: (args.walk > 1).then_some(measured.walk),
        edges: args
            .list
            .then(|| edges.iter().map(|e| [e.from, e.to]).collect()),
        vertices: args.list.then(|| {
            let positions = &model.mesh.mesh().positions;
            positions.iter().map(|&p| (p + origin).to_array()).collect()
        }),
        outline_seconds_median,
    };
    if args.output.json {
        return output::print_json(&result);
    }
    tell(args, &result);
    if args.list {
        let mut text = String::new();
        for e in &edges {
            // Writing into a string cannot fail.
            let _ = writeln!(text, "{} {}", e.from, e.to);
        }
        output::print_bytes(text.as_bytes())?;
    }
    Ok(())
}

/// What was found, and how long that took.
struct Extracted {
    measured: Measured,
    data_bytes: usize,
    build_seconds: f64,
    /// Of `--forest`.
    forest: Option<ForestJson>,
    /// Where the forest goes, and its bytes, when it is new.
    new_forest: Option<(OutputFile, Vec<u8>)>,
}

/// Builds what is searched and extracts from every viewpoint.
fn extract(
    mesh: &EdgeMesh,
    method: ExtractionMethod,
    saved: Option<SavedForest>,
    viewpoints: &[Viewpoint],
    repeat: u32,
) -> anyhow::Result<Extracted> {
    let since = Instant::now();
    let (mut extractor, forest, new_forest) = match saved {
        None => {
            let build = |watch: &Watch<'_>| Extractor::watched(mesh, method, watch);
            (Progress::new().watch(build)?, None, None)
        }
        Some(saved) => {
            let (forest, told, new) = saved.forest_of(mesh)?;
            (Extractor::with_forest(mesh, &forest), Some(told), new)
        }
    };
    let build_seconds = since.elapsed().as_secs_f64();
    let measured = measure(&mut extractor, viewpoints, repeat)?;
    Ok(Extracted {
        data_bytes: extractor.data_bytes(),
        measured,
        build_seconds,
        forest,
        new_forest,
    })
}

/// The file of `--forest` before long work.
enum SavedForest {
    Present(PathBuf, Vec<u8>),
    Missing(OutputFile),
}

/// A forest, what is reported of it, and where its bytes go when it is new.
type ToldForest = (ConeForest, ForestJson, Option<(OutputFile, Vec<u8>)>);

impl SavedForest {
    /// Reads the file, or makes sure that it can be written.
    fn look(path: &Path) -> anyhow::Result<Self> {
        let owned = path.to_owned();
        match interrupt::unless_stopped(move || input::read(&owned))? {
            Ok(bytes) => Ok(Self::Present(path.to_owned(), bytes)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                OutputFile::check(path).map(Self::Missing)
            }
            Err(error) => Err(error).with_context(|| path.display().to_string()),
        }
    }

    fn forest_of(self, mesh: &EdgeMesh) -> anyhow::Result<ToldForest> {
        let since = Instant::now();
        let seconds = || since.elapsed().as_secs_f64();
        match self {
            Self::Present(path, bytes) => {
                let forest = ConeForest::from_bytes(mesh, &bytes)
                    .with_context(|| path.display().to_string())?;
                let told = ForestJson {
                    was_read: true,
                    seconds: seconds(),
                    bytes: bytes.len(),
                };
                Ok((forest, told, None))
            }
            Self::Missing(file) => {
                let build = |watch: &Watch<'_>| ConeForest::watched(mesh, watch);
                let forest = Progress::new().watch(build)?;
                let seconds = seconds();
                let bytes = forest.to_bytes(mesh);
                let told = ForestJson {
                    was_read: false,
                    seconds,
                    bytes: bytes.len(),
                };
                Ok((forest, told, Some((file, bytes))))
            }
        }
    }
}

fn viewpoint_from_args(args: &EdgesArgs) -> anyhow::Result<Viewpoint> {
    let (option, point, viewpoint) = match (args.eye, args.direction) {
        (Some(eye), _) => ("--eye", eye, Viewpoint::Eye(eye)),
        (None, Some(towards)) => ("--direction", towards, Viewpoint::Direction(towards)),
        (None, None) => usage_error(
            ErrorKind::MissingRequiredArgument,
            "a viewpoint is needed: --eye X,Y,Z, --direction X,Y,Z or --camera FILE --view NAME",
        ),
    };
    ensure!(
        point.is_finite(),
        "{option} {}: a viewpoint has finite coordinates",
        point_text(point)
    );
    if viewpoint == Viewpoint::Direction(DVec3::ZERO) {
        usage_error(
            ErrorKind::ValueValidation,
            "--direction 0,0,0 leads nowhere",
        );
    }
    Ok(viewpoint)
}

/// What a method did over all viewpoints.
struct Measured {
    /// From the last viewpoint.
    edges: Vec<DirectedEdge>,
    last: Work,
    walk: WalkJson,
    seconds_median: f64,
}

fn measure(
    extractor: &mut Extractor<'_>,
    viewpoints: &[Viewpoint],
    repeat: u32,
) -> anyhow::Result<Measured> {
    let mut edges = Vec::new();
    let mut last = Work::default();
    let mut times = Vec::with_capacity(viewpoints.len() * repeat as usize);
    let (mut found, mut tested, mut visited) = (0, 0, 0);
    for round in 0..repeat {
        extractor.forget();
        for viewpoint in viewpoints {
            interrupt::check()?;
            let since = Instant::now();
            last = extractor.extract(viewpoint, &mut edges);
            times.push(since.elapsed().as_secs_f64());
            if round == 0 {
                found += edges.len();
                tested += last.tested_edges;
                visited += last.visited_nodes;
            }
        }
    }
    times.sort_by(f64::total_cmp);
    let mean = |sum: usize| sum as f64 / viewpoints.len() as f64;
    Ok(Measured {
        edges,
        last,
        walk: WalkJson {
            viewpoints: viewpoints.len(),
            silhouette_edges_mean: mean(found),
            tested_edges_mean: mean(tested),
            visited_nodes_mean: mean(visited),
        },
        seconds_median: times[times.len() / 2],
    })
}

/// The camera of a drawing: the model's bounding sphere fits. Parallel projection is drawn from very far away.
fn camera_of(
    viewpoint: &Viewpoint,
    (center, radius): (DVec3, f64),
    origin: DVec3,
) -> anyhow::Result<Camera> {
    let eye = match *viewpoint {
        Viewpoint::Eye(eye) => eye,
        Viewpoint::Direction(towards) => {
            center + towards.normalize_or_zero() * (radius * PARALLEL_DISTANCE_REL)
        }
    };
    Camera::fit_sphere(eye, center, radius, None, (DRAWING_PX, DRAWING_PX))
        .with_context(|| format!("--eye {}", point_text(eye + origin)))
}

/// The outline as polygons in the image, and the median of the seconds that they take.
fn outline(
    mesh: &TriangleMesh,
    camera: &Camera,
    edges: &[DirectedEdge],
    repeat: u32,
) -> anyhow::Result<(Vec<Loop>, f64)> {
    let mut outliner = Outliner::new(&mesh.positions);
    let (mut loops, mut times) = (Vec::new(), Vec::new());
    for _ in 0..repeat {
        interrupt::check()?;
        let since = Instant::now();
        loops = outliner.outline(edges, camera)?;
        times.push(since.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok((loops, times[times.len() / 2]))
}

/// The loops of the silhouette as one path of lines.
fn svg(
    mesh: &TriangleMesh,
    seen: &PictureCamera,
    edges: &[DirectedEdge],
) -> anyhow::Result<String> {
    let (width, height) = seen.size();
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\">\n<path fill=\"none\" stroke=\"#000\" \
         stroke-linejoin=\"round\" d=\""
    );
    for vertices in chain_loops(edges)? {
        for (k, &v) in vertices.iter().enumerate() {
            let verb = if k == 0 { 'M' } else { 'L' };
            let point = seen.image(seen.camera.image_from_object(mesh.positions[v as usize]));
            // Writing into a string cannot fail.
            let _ = write!(text, "{verb}{:.3} {:.3}", point.x, point.y);
        }
        text.push('Z');
    }
    text.push_str("\"/>\n</svg>\n");
    Ok(text)
}

fn tell(args: &EdgesArgs, result: &EdgesJson) {
    output::say(&format!(
        "{}: {} silhouette edges by {} in {:.3} ms; {} edges and {} nodes tested",
        args.model.path.display(),
        result.silhouette_edges,
        result.method,
        1e3 * result.seconds_median,
        result.tested_edges,
        result.visited_nodes
    ));
    if let (Some(path), Some(forest)) = (&args.forest, &result.forest) {
        output::say(&format!(
            "{}: the forest was {} in {:.2} s",
            path.display(),
            if forest.was_read { "read" } else { "built" },
            forest.seconds
        ));
    }
}
