//! `silmap inspect`: what is in an asset.

use anyhow::bail;
use serde::Serialize;
use silmap_geometry::camera::in_short;
use silmap_map::{Asset, Relief, asset};
use silmap_report::coverage_map;

use crate::args::InspectArgs;
use crate::commands::build::TextureJson;
use crate::files::read_asset;
use crate::numbers::{coordinate, point};
use crate::output::{self, OutputFile};

#[derive(Serialize)]
struct Inspection<'a> {
    format_version: u32,
    model: ModelJson<'a>,
    map: MapJson,
    hull: HullJson,
    textures: TexturesJson,
    bytes: u64,
    generator: &'a str,
    options: &'a str,
    /// The options as data, by which `build --params-from` builds it again; null in files of earlier versions.
    #[serde(skip_serializing_if = "Option::is_none")]
    params: Option<&'a serde_json::Value>,
    /// Views kept and mean share of misclassified pixels, as the map was simplified.
    #[serde(skip_serializing_if = "Option::is_none")]
    error_curve: Option<&'a [(u32, f64)]>,
    /// The same for the views that `build --from` can go down to.
    #[serde(skip_serializing_if = "Option::is_none")]
    order_curve: Option<Vec<(u32, f64)>>,
    /// The same for maps of evenly spread views.
    #[serde(skip_serializing_if = "Option::is_none")]
    uniform_curve: Option<&'a [(u32, f64)]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    views: Option<Vec<ViewJson>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    triangles: Option<&'a [[u32; 3]]>,
}

#[derive(Serialize)]
struct ModelJson<'a> {
    name: &'a str,
    faces: u64,
    vertices: u64,
    center: [f64; 3],
    radius: f64,
}

#[derive(Serialize)]
struct MapJson {
    views: usize,
    triangles: usize,
    resolution: u32,
    /// Parts of the model whose outlines are interpolated by themselves.
    parts: usize,
    contour_vertices_mean: f64,
    contour_vertices_max: usize,
    /// Mean contour vertices of a view at each level of detail; null where contours have no levels.
    level_vertices_mean: Option<Vec<f64>>,
    has_depth: bool,
    /// Share of all directions, by which outlines rest on photographs; null where the map is of a mesh.
    covered: Option<f64>,
    bytes: u64,
    /// Fewest views that `build --from` can go down to; null when the file has no collapse order.
    fewest_views: Option<usize>,
}

#[derive(Serialize)]
struct HullJson {
    faces: usize,
    vertices: usize,
    volume_ratio: f64,
    bytes: u64,
}

#[derive(Serialize)]
struct TexturesJson {
    #[serde(flatten)]
    figures: TextureJson,
    /// Null where texture views have no depths.
    relief: Option<ReliefJson>,
    /// Pictures, cameras, visibility bits and depths.
    bytes: u64,
}

/// The depths of texture views.
#[derive(Serialize)]
struct ReliefJson {
    bits: u32,
    size: [u32; 2],
    /// Share of their pixels that show something.
    seen: f64,
    /// Mean of the codes of those.
    code_mean: f64,
}

impl ReliefJson {
    fn of(relief: &Relief) -> Self {
        let codes = || relief.views.iter().flat_map(|view| &view.codes);
        let (mut sum, mut seen) = (0_u64, 0_u64);
        for &code in codes().filter(|&&code| code > 0) {
            sum += u64::from(code);
            seen += 1;
        }
        Self {
            bits: relief.bits,
            size: [relief.width_px, relief.height_px],
            seen: seen as f64 / codes().count().max(1) as f64,
            code_mean: sum as f64 / seen.max(1) as f64,
        }
    }
}

#[derive(Serialize)]
struct ViewJson {
    eye: [f64; 3],
    contour_vertices: usize,
    /// Share of its outline that a photograph shows; null where the map is of a mesh.
    photographed: Option<f64>,
}

pub(crate) fn run(args: &InspectArgs) -> anyhow::Result<()> {
    let (asset, bytes) = read_asset(&args.asset)?;
    let sizes = asset::sizes_with(&bytes, &silmap_mesh_io::input::beside(&args.asset))?;
    let inspection = inspect(&asset, &sizes, args.full);
    if let Some(path) = &args.coverage {
        let file = OutputFile::check(path)?;
        file.refuse_to_replace(&args.asset);
        let Some(svg) = coverage_map(&asset.map) else {
            bail!(
                "{}: no photographs are in it: its silhouettes are those of a mesh",
                args.asset.display()
            );
        };
        file.write(svg.as_bytes())?;
    }
    if args.output.json {
        return output::print_json(&inspection);
    }
    output::print_bytes(describe(&inspection).as_bytes())
}

fn inspect<'a>(asset: &'a Asset, sizes: &asset::AssetSizes, full: bool) -> Inspection<'a> {
    let (record, map) = (&asset.record, &asset.map);
    let counts: Vec<usize> = map.contour_vertex_counts().collect();
    let total: usize = counts.iter().sum();
    let origin = asset.placement.in_scene;
    Inspection {
        format_version: sizes.format_version,
        model: ModelJson {
            name: &record.name,
            faces: record.model_faces,
            vertices: record.model_vertices,
            center: (map.center + origin).to_array(),
            radius: map.radius,
        },
        map: MapJson {
            views: map.views.len(),
            triangles: map.triangles.len(),
            resolution: map.resolution_px,
            parts: map.part_count(),
            contour_vertices_mean: total as f64 / counts.len().max(1) as f64,
            contour_vertices_max: counts.iter().copied().max().unwrap_or(0),
            level_vertices_mean: map.has_levels().then(|| {
                let per_view = |n: usize| n as f64 / counts.len().max(1) as f64;
                map.level_vertex_counts()
                    .into_iter()
                    .map(per_view)
                    .collect()
            }),
            has_depth: map.has_depth(),
            covered: map.covered_on_average(),
            bytes: sizes.map,
            fewest_views: (record.order.as_ref())
                .map(|order| map.views.len().saturating_sub(order.steps.len())),
        },
        hull: HullJson {
            faces: asset.hull.faces.len(),
            vertices: asset.hull.positions.len(),
            volume_ratio: asset.hull.volume_ratio,
            bytes: sizes.hull,
        },
        textures: TexturesJson {
            figures: TextureJson::of(asset),
            relief: asset.textures.relief.as_ref().map(ReliefJson::of),
            bytes: sizes.textures,
        },
        bytes: sizes.total,
        generator: &record.generator,
        options: &record.options,
        params: full.then_some(&record.params),
        error_curve: full.then_some(&record.error_curve),
        order_curve: (record.order.as_ref())
            .filter(|_| full)
            .map(|order| order.curve(map.views.len() as u32)),
        uniform_curve: full.then_some(&record.uniform_curve),
        views: full.then(|| {
            map.views
                .iter()
                .zip(&counts)
                .map(|(view, &contour_vertices)| ViewJson {
                    eye: (view.camera.eye + origin).to_array(),
                    contour_vertices,
                    photographed: view.photographed,
                })
                .collect()
        }),
        triangles: full.then_some(&map.triangles),
    }
}

/// The same for people.
fn describe(i: &Inspection<'_>) -> String {
    let radius = i.model.radius;
    let mut text = format!(
        "model     {}: {} faces, {} vertices, center {}, radius {}\n\
         map       {} views, {} triangles, captured at {}², {:.0} contour vertices a view (most {}), {} bytes\n\
         detail    {}\n\
         order     {}\n\
         hull      {} faces, {} vertices, {} times the model's volume, {} bytes\n\
         textures  {} views of {}², {}, {} bytes\n\
         paint     {}\n\
         file      {} bytes, format {}, made by {} with {}\n",
        i.model.name,
        i.model.faces,
        i.model.vertices,
        point(i.model.center, radius),
        coordinate(radius, radius),
        i.map.views,
        i.map.triangles,
        i.map.resolution,
        i.map.contour_vertices_mean,
        i.map.contour_vertices_max,
        i.map.bytes,
        match &i.map.level_vertices_mean {
            Some(means) => {
                let means: Vec<String> = means.iter().map(|n| format!("{n:.0}")).collect();
                format!(
                    "{} contour vertices a view, level by level",
                    means.join(", ")
                )
            }
            None => "one level: contours are always whole".to_owned(),
        },
        match i.map.fewest_views {
            Some(fewest) => format!("views can be removed down to {fewest} (build --from)"),
            None => "none: views cannot be removed without the model".to_owned(),
        },
        i.hull.faces,
        i.hull.vertices,
        ratio(i.hull.volume_ratio),
        i.hull.bytes,
        i.textures.figures.views,
        i.textures.figures.size,
        i.textures.figures.atlas(),
        i.textures.bytes,
        i.textures.figures.describe(),
        i.bytes,
        i.format_version,
        i.generator,
        i.options,
    );
    if let Some(covered) = i.map.covered {
        text.push_str(&format!(
            "seen      {:.0} % of all outlines rest on photographs, the others on the hull that these leave\n",
            100.0 * covered
        ));
    }
    if let Some(params) = i.params {
        text.push_str(&format!("params    {params}\n"));
    }
    for (k, view) in i.views.iter().flatten().enumerate() {
        text.push_str(&format!(
            "view {k}  eye {}  {} contour vertices\n",
            point(view.eye, radius),
            view.contour_vertices
        ));
    }
    for (k, [a, b, c]) in i.triangles.into_iter().flatten().enumerate() {
        text.push_str(&format!("triangle {k}  {a} {b} {c}\n"));
    }
    let order_curve = i.order_curve.as_deref();
    for (what, curve) in [
        ("views", i.error_curve),
        // The first is the map as it is, which the curve before ends with.
        ("views", order_curve.and_then(|curve| curve.get(1..))),
        ("evenly spread views", i.uniform_curve),
    ] {
        for (views, share) in curve.into_iter().flatten() {
            text.push_str(&format!(
                "with {views} {what}  {:.4} % of the pixels are misclassified\n",
                100.0 * share
            ));
        }
    }
    text
}

/// A ratio of volumes: near 1 as people expect it, else in short.
fn ratio(value: f64) -> String {
    if (0.01..1e4).contains(&value) {
        format!("{value:.4}")
    } else {
        in_short(value)
    }
}
