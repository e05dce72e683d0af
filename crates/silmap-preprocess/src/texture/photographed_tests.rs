//! Bakes out of photographs whose colours are not those of the mesh, so that each texel says where it came from.

use glam::{DVec2, DVec3, DVec4};
use silmap_geometry::lighting::srgb_from_linear;
use silmap_geometry::photograph::INSIDE_STEPS;
use silmap_geometry::{Bvh, ColourImage, Photograph, Watch};
use silmap_map::TextureSet;

use super::tests::{SIDE_COLOURS, coloured_cube, cube_hull, decode, has_hue, small_params};
use super::{HullFaces, PictureFormat, TextureParams, bake_photographed};

const SIZE: u32 = 160;

/// No side of the cube is like it.
const BACKGROUND: [f32; 3] = [0.9, 0.9, 0.9];

/// The colours of the sides in photographs: those of the mesh, with red and blue exchanged.
fn photographed_colour(side: usize) -> [f32; 3] {
    let [r, g, b] = SIDE_COLOURS[side];
    [b, g, 0.6 * r]
}

/// The cube seen from a direction, rolled and off the picture's middle.
fn photograph(direction: DVec3, roll: f64) -> Photograph {
    let (_, bvh) = coloured_cube();
    let eye = 5.0 * direction.normalize_or_zero();
    let forward = -direction.normalize_or_zero();
    let side = forward.cross(DVec3::new(0.1, 1.0, 0.2)).normalize_or_zero();
    let turn = glam::DQuat::from_axis_angle(forward, roll);
    let (right, down) = (turn * side, turn * forward.cross(side));
    let (focal, principal) = (180.0, DVec2::new(84.0, 77.0));
    let row = |axis: DVec3, offset: f64| {
        let row = focal * axis + offset * forward;
        DVec4::from((row, -row.dot(eye)))
    };
    let rows = [
        row(right, principal.x),
        row(down, principal.y),
        DVec4::from((forward, -forward.dot(eye))),
    ];
    let hit = |x: f64, y: f64| {
        let offset = (DVec2::new(x, y) - principal) / focal;
        let ray = forward + right * offset.x + down * offset.y;
        bvh.first_hit(eye, ray, 0.0, f64::INFINITY)
    };
    let mut rgba = Vec::new();
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        let colour = hit(x, y).map_or(BACKGROUND, |h| photographed_colour(h.face as usize / 2));
        // How far inside, up to six pixels.
        let is_inside = |r: f64| {
            let around = (0..16).map(|k| f64::from(k) * std::f64::consts::TAU / 16.0);
            let mut around = around.map(|t| (x + r * t.cos(), y + r * t.sin()));
            around.all(|(x, y)| hit(x, y).is_some())
        };
        let inside = (1..=12)
            .map(|k| 0.5 * f64::from(k))
            .take_while(|&r| is_inside(r));
        let inside = inside.last().unwrap_or(0.0);
        rgba.extend(colour.map(|c| (255.0 * srgb_from_linear(c)).round() as u8));
        rgba.push((inside * INSIDE_STEPS) as u8);
    }
    Photograph {
        eye,
        image_from_object: rows,
        picture: ColourImage {
            width: SIZE,
            height: SIZE,
            rgba,
        },
        border_px: 1.5,
        gain: [1.0; 3],
    }
}

/// From all around and above; below is left out.
fn photographs() -> Vec<Photograph> {
    (0..8)
        .map(|k| {
            let turn = 0.4 + f64::from(k) * std::f64::consts::FRAC_PI_4;
            let direction = DVec3::new(turn.cos(), 0.7, turn.sin());
            photograph(direction, 0.7 * f64::from(k))
        })
        .collect()
}

fn bake(photographs: &[Photograph]) -> TextureSet {
    let (mesh, bvh) = coloured_cube();
    // Nothing is lost, so that each texel has its own colour.
    let params = TextureParams {
        format: PictureFormat::Png,
        ..small_params()
    };
    let model = (&mesh, &bvh);
    bake_photographed(model, &cube_hull(), photographs, &params, &Watch::silent()).unwrap()
}

/// The side of the cube that looks down.
const BELOW: usize = 2;

#[test]
fn views_are_photographs_and_where_none_sees_pictures_of_the_mesh() {
    let photographs = photographs();
    let textures = bake(&photographs);
    let hull = HullFaces::new(&cube_hull());
    let taken = |eye: DVec3| photographs.iter().any(|p| p.eye.distance(eye) < 1e-9);
    let (mut photographed, mut completed) = (0, 0);
    for (v, view) in textures.views.iter().enumerate() {
        let picture = decode(&view.image);
        let is_taken = taken(view.camera.eye);
        for face in 0..12 {
            if textures.visible_views[face] >> v & 1 == 0 {
                continue;
            }
            let middle = hull.surface_corners[face].iter().copied().sum::<DVec3>() / 3.0;
            let at = view.camera.image_from_object(middle);
            let side = face / 2;
            let (expected, count) = match is_taken {
                true => (photographed_colour(side), &mut photographed),
                false => (SIDE_COLOURS[side], &mut completed),
            };
            assert!(has_hue(&picture, at, expected), "view {v}, face {face}");
            assert_eq!(side == BELOW, !is_taken, "view {v}, face {face}");
            *count += 1;
        }
    }
    assert!(
        photographed >= 10 && completed >= 2,
        "{photographed}, {completed}"
    );
    assert!(textures.visible_views.iter().all(|&bits| bits != 0));
}

#[test]
fn no_background_comes_into_a_picture() {
    for view in bake(&photographs()).views {
        let picture = decode(&view.image);
        let is_grey = |p: &image::Rgb<u8>| {
            let [low, high] = [p.0.iter().min(), p.0.iter().max()].map(|v| *v.unwrap());
            high - low < 30 && low > 180
        };
        assert!(!picture.pixels().any(is_grey));
    }
}

#[test]
fn the_atlas_has_the_photographs_colours() {
    let atlas = bake(&photographs()).atlas.unwrap();
    let picture = decode(&atlas.image);
    let size = DVec2::new(atlas.size_px[0].into(), atlas.size_px[1].into());
    for face in 0..12 {
        let uv: DVec2 = (0..3)
            .map(|k| DVec2::from(atlas.corner_uvs[face][k].map(f64::from)) / 3.0)
            .sum();
        let expected = match face / 2 {
            BELOW => SIDE_COLOURS[BELOW],
            side => photographed_colour(side),
        };
        assert!(has_hue(&picture, uv * size, expected), "face {face}");
    }
}

#[test]
fn a_view_at_a_photographs_eye_shows_the_photograph() {
    let photograph = photograph(DVec3::new(0.5, 0.7, 1.0), 0.9);
    let hull = HullFaces::new(&cube_hull());
    let camera = super::photographed::camera_at(&photograph, DVec3::ZERO, 240).unwrap();
    let camera = super::fit_to_hull(&camera, &hull);
    let picture = super::photographed::resampled(&photograph, &camera);
    let (_, bvh) = coloured_cube();
    let (mut right, mut all) = (0, 0);
    for k in 0..2000 {
        let at = DVec2::new(f64::from(k % 48), f64::from(k / 48)) * 5.0 + 2.5;
        let ray = camera.direction_from_image(at);
        let Some(hit) = Bvh::first_hit(&bvh, camera.eye, ray, 0.0, f64::INFINITY) else {
            continue;
        };
        let pixel = at.y as usize * picture.width + at.x as usize;
        if picture.pixels[pixel][3] == 0.0 {
            continue;
        }
        all += 1;
        let expected = photographed_colour(hit.face as usize / 2);
        let off = (0..3).map(|c| (picture.colour(pixel)[c] - expected[c]).abs());
        right += usize::from(off.fold(0.0, f32::max) < 0.02);
    }
    // Beside the cube's edges two colours mix.
    assert!(all > 500 && right * 100 > all * 93, "{right} of {all}");
}

#[test]
fn a_photograph_does_not_paint_what_its_mask_leaves_out() {
    let whole = photograph(DVec3::new(0.3, 0.9, 0.2), 0.0);
    let mut bitten = whole.clone();
    let corners = HullFaces::new(&cube_hull()).surface_corners;
    // The middle of one of the two faces of the upper side.
    let middle = corners[6].iter().copied().sum::<DVec3>() / 3.0;
    let middle = bitten.project(middle).unwrap();
    for k in 0..SIZE * SIZE {
        let at = DVec2::new(f64::from(k % SIZE) + 0.5, f64::from(k / SIZE) + 0.5);
        if at.distance(middle) < 16.0 {
            bitten.picture.rgba[4 * k as usize + 3] = 0;
        }
    }
    let shows = |p: &Photograph, face: usize| super::photographed::shows_face(p, corners[face]);
    assert!(shows(&whole, 6) && shows(&whole, 7));
    assert!(!shows(&bitten, 6) && shows(&bitten, 7));
}
