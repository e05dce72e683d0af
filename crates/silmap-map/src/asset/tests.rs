//! Random assets through the whole file format, and damaged files.

use glam::{DVec2, DVec3};
use proptest::prelude::*;
use silmap_geometry::{Camera, CoverageRule};

use super::*;
use crate::{CapturedView, ViewContour};

mod contours;
mod order;
mod random;
mod rewrite;

use random::{any_asset, picture};

/// The largest moves of a contour coordinate (pixels) and of a depth (radii), and whether all else is the same.
fn largest_moves(before: &SilhouetteMap, after: &SilhouetteMap) -> (f64, f64, bool) {
    let (mut pixels, mut radii) = (0.0_f64, 0.0_f64);
    let mut moved_back = after.clone();
    for (a, b) in before.views.iter().zip(&mut moved_back.views) {
        for (a, b) in a.contours.iter().zip(&mut b.contours) {
            for (p, q) in a.points.iter().zip(&mut b.points) {
                pixels = pixels.max((*p - *q).abs().max_element());
                *q = *p;
            }
            for (d, e) in a.depths.iter().zip(&mut b.depths) {
                radii = radii.max((d - *e).abs() / before.radius);
                *e = *d;
            }
            // A contour without levels among others comes back as always whole.
            if a.levels.is_empty() && b.levels.iter().all(|&l| l == ViewContour::COARSEST_LEVEL) {
                b.levels.clear();
            }
        }
    }
    (pixels, radii, &moved_back == before)
}

/// What was read, with another asset's place in the scene: the program that writes the scene decides where it puts a hull.
fn in_place(mut found: Asset, other: &Asset) -> Asset {
    found.placement.in_scene = other.placement.in_scene;
    found
}

proptest! {
    #[test]
    fn an_asset_survives_the_file(asset in any_asset()) {
        // Depths of a tiny radius can be too many steps away: then writing says so, and nothing else is to be seen.
        let file = match write(&asset) {
            Err(AssetError::OutOfRange { what: "depth", .. }) => return Ok(()),
            other => other.unwrap(),
        };
        let back = read(&file).unwrap();
        let rounded = quantise(&asset).unwrap();
        prop_assert_eq!(&back, &rounded);
        prop_assert_eq!(&quantise(&back).unwrap(), &back);
        prop_assert_eq!(&write(&back).unwrap(), &file);
        prop_assert_eq!(&write(&rounded).unwrap(), &file);

        prop_assert_eq!(&back.hull, &asset.hull);
        prop_assert_eq!(&back.textures, &asset.textures);
        let (pixels, radii, is_same) = largest_moves(&asset.map, &back.map);
        let slack = 1e-6;
        prop_assert!(pixels <= 0.5 / POINT_STEPS_PER_PX + slack, "{pixels} px");
        prop_assert!(radii <= 0.5 / depth_steps_per_radius(&asset.map) + slack, "{radii} R");
        prop_assert!(is_same);
        for (a, b) in asset.record.error_curve.iter().zip(&back.record.error_curve) {
            prop_assert!(a.0 == b.0 && (a.1 - b.1).abs() < 1e-7);
        }

        let parts = sizes(&file).unwrap();
        prop_assert_eq!(parts.total, file.len() as u64);
        prop_assert!(parts.map + parts.hull + parts.textures < parts.total);
        let rewritten = rewrite::by_another(&file);
        prop_assert_eq!(&in_place(read(&rewritten).unwrap(), &rounded), &rounded);
        let again = sizes(&rewritten).unwrap();
        prop_assert_eq!((again.map, again.hull, again.textures), (parts.map, parts.hull, parts.textures));
    }

    #[test]
    fn broken_bytes_are_noticed(
        asset in any_asset(),
        at in any::<prop::sample::Index>(),
        change in 1_u8..=255,
        cut in any::<prop::sample::Index>(),
    ) {
        if let Ok(mut file) = write(&asset) {
            prop_assert!(read(&file[..cut.index(file.len())]).is_err());
            let sound = read(&file).unwrap();
            let at = at.index(file.len());
            file[at] ^= change;
            // Noticed, or without effect: what is around the asset's own data may change.
            if let Ok(found) = read(&file) {
                prop_assert_eq!(&in_place(found, &sound), &sound, "byte {}", at);
            }
        }
    }

    /// The checksum made to fit the broken bytes: the checks behind it must hold by themselves.
    #[test]
    fn nothing_behind_the_checksum_panics(
        asset in any_asset(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        if let Ok(mut file) = write(&asset) {
            for (at, byte) in changes {
                // Past the headers, or the chunks are not found and nothing is tested.
                let range = 20..file.len();
                let at = range.start + at.index(range.len());
                file[at] = byte;
            }
            let _ = write::seal(&mut file);
            if let Ok(read_back) = read(&file) {
                // What was let in can be written.
                prop_assert!(write(&read_back).is_ok(), "{:?}", write(&read_back));
            }
            let _ = sizes(&file);
        }
    }

    #[test]
    fn any_bytes_are_no_asset(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(read(&bytes).is_err());
    }
}

fn small_asset() -> Asset {
    let camera = |x: f64| {
        Camera::fit_sphere(DVec3::new(x, 1.0, 2.5), DVec3::ZERO, 1.0, None, (512, 512)).unwrap()
    };
    let contour = ViewContour {
        part: 0,
        points: vec![
            DVec2::new(10.0, 10.0),
            DVec2::new(400.0, 20.0),
            DVec2::new(200.0, 300.0),
        ],
        depths: vec![2.5, 2.6, 2.7],
        levels: Vec::new(),
    };
    let view = |x| CapturedView {
        camera: camera(x),
        contours: vec![contour.clone()],
        photographed: None,
    };
    Asset {
        record: BuildRecord::default(),
        map: SilhouetteMap {
            center: DVec3::ZERO,
            radius: 1.0,
            resolution_px: 512,
            tolerance_px: 0.5,
            coverage: CoverageRule::Center,
            views: vec![view(0.0), view(0.5), view(-0.5)],
            triangles: vec![[0, 1, 2]],
        },
        hull: CoarseHull {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            faces: vec![[0, 1, 2]],
            surface_points: vec![[0.0; 3]; 3],
            volume_ratio: 1.0,
        },
        textures: TextureSet {
            views: vec![TextureView {
                camera: camera(1.0),
                image: picture(false, 1),
            }],
            visible_views: vec![1],
            atlas: None,
            relief: None,
        },
        placement: Placement::default(),
    }
}

#[test]
fn every_cut_and_every_flipped_byte_is_noticed() {
    let file = write(&small_asset()).unwrap();
    for length in 0..file.len() {
        assert!(read(&file[..length]).is_err(), "cut to {length}");
    }
    let mut longer = file.clone();
    longer.push(0);
    assert!(read(&longer).is_err());
    let sound = read(&file).unwrap();
    let (mut noticed, mut all) = (0, 0);
    for at in 0..file.len() {
        for mask in [1, 0x20, 0x80, 0xff] {
            let mut broken = file.clone();
            broken[at] ^= mask;
            all += 1;
            match read(&broken) {
                Ok(found) => assert_eq!(found, sound, "byte {at} ^ {mask}"),
                Err(_) => noticed += 1,
            }
        }
    }
    assert!(noticed > all / 2, "{noticed} of {all}");
}

/// Every byte that belongs to the extension is guarded, wherever it lies in the binary chunk.
#[test]
fn the_extensions_own_bytes_are_guarded() {
    let file = write(&small_asset()).unwrap();
    let chunks = container::split(&file).unwrap();
    let document: serde_json::Value = serde_json::from_slice(chunks.json).unwrap();
    let start = file.len() - chunks.binary.len();
    let mut guarded = 0;
    let views = document["bufferViews"].as_array().unwrap();
    let normals = &document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"];
    let normals = &document["accessors"][normals.as_u64().unwrap() as usize]["bufferView"];
    for (v, view) in views.iter().enumerate() {
        if Some(v as u64) == normals.as_u64() {
            continue;
        }
        let number = |key: &str| view[key].as_u64().unwrap() as usize;
        for at in (start + number("byteOffset")..).take(number("byteLength")) {
            let mut broken = file.clone();
            broken[at] ^= 0x10;
            assert!(read(&broken).is_err(), "byte {at} of view {v}");
            guarded += 1;
        }
    }
    assert!(guarded > 300, "{guarded}");
}

#[test]
fn refusals_name_their_reason() {
    assert!(matches!(read(b""), Err(AssetError::NotGlb { .. })));
    assert!(matches!(
        read(b"solid torus"),
        Err(AssetError::NotGlb { .. })
    ));
    let plain = container::join(r#"{"asset":{"version":"2.0"}}"#, &[]).unwrap();
    let refused = read(&plain).unwrap_err().to_string();
    assert!(
        refused.contains("no silhouette map (not a silmap asset)"),
        "{refused}"
    );

    let file = write(&small_asset()).unwrap();
    let key = b"\"formatVersion\":";
    let at = file.windows(key.len()).position(|w| w == key).unwrap() + key.len();
    let mut newer = file.clone();
    newer[at] = b'7';
    assert_eq!(
        read(&newer),
        Err(AssetError::UnknownVersion {
            found: 7,
            known: FORMAT_VERSION
        })
    );

    let mut damaged = file;
    let last = damaged.len() - 30;
    damaged[last] ^= 1;
    assert!(matches!(read(&damaged), Err(AssetError::Damaged { .. })));
}

/// What other programs leave of an asset, and what is said then.
#[test]
fn what_another_program_left_out_is_told() {
    let file = write(&small_asset()).unwrap();
    let generator = "Tool 1.2 (of theirs)";
    let told = |change: &dyn Fn(&mut serde_json::Value)| {
        let changed = rewrite::with_json(&file, |document| {
            document["asset"]["generator"] = generator.into();
            change(document);
        });
        read(&changed).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(told(&|_| {}), Ok(()));
    let left_out = told(&|d| d["extensions"] = serde_json::json!({})).unwrap_err();
    let words = [
        "no silhouette map any more",
        generator,
        "silmap attach",
        "tools/web",
    ];
    assert!(words.iter().all(|w| left_out.contains(w)), "{left_out}");
    // Nothing shows that it was an asset.
    let plain = told(&|d| {
        d["extensions"] = serde_json::json!({});
        d["extensionsUsed"] = serde_json::json!([]);
        d["meshes"][0]["extras"] = serde_json::json!({});
    });
    let plain = plain.unwrap_err();
    let words = ["not a silmap asset", "silmap build", "silmap attach"];
    assert!(words.iter().all(|w| plain.contains(w)), "{plain}");
    // The JSON is there, its data are not, or are others.
    for gone in [
        told(&|d| d["bufferViews"].as_array_mut().unwrap().truncate(4)),
        told(&|d| d["bufferViews"][5]["byteLength"] = 3.into()),
        told(&|d| d["accessors"] = serde_json::json!([])),
        told(&|d| d["images"] = serde_json::json!([])),
    ] {
        let gone = gone.unwrap_err();
        let words = ["lost its data", generator, "silmap attach"];
        assert!(words.iter().all(|w| gone.contains(w)), "{gone}");
    }
    let changed = told(&|d| d["extensions"][EXTENSION_NAME]["map"]["radius"] = 2.5.into());
    let changed = changed.unwrap_err();
    assert!(changed.contains("damaged, or Tool 1.2"), "{changed}");
}

/// The plain file may call a picture's type otherwise than an asset may: then the asset's own is put beside it.
#[test]
fn a_picture_by_another_name_is_not_shared() {
    let file = write(&small_asset()).unwrap();
    let plain = |mime_type: Option<&str>| {
        rewrite::with_json(&file, |d| {
            d["extensions"] = serde_json::json!({});
            let images = d["images"].as_array_mut().unwrap();
            images
                .iter_mut()
                .for_each(|i| i["mimeType"] = mime_type.map_or(i["mimeType"].clone(), Into::into));
        })
    };
    let added = [None, Some("image/jpg")].map(|mime_type| {
        let attached = attach(&plain(mime_type), &file, None).unwrap();
        assert_eq!(read(&attached.file).unwrap(), read(&file).unwrap());
        attached.added_bytes
    });
    assert!(added[0] < added[1], "{added:?}");
}

/// An asset of format 1, as earlier versions wrote them: read as it was, and every changed byte noticed.
#[test]
fn assets_of_version_1_are_read() {
    let file = include_bytes!("format-1.glb");
    let asset = read(file).unwrap();
    assert_eq!(asset.map.views.len(), 12);
    assert!(asset.textures.atlas.is_some());
    let rewritten = write(&asset).unwrap();
    assert_eq!(read(&rewritten).unwrap(), asset);
    for at in (0..file.len()).step_by(7) {
        let mut broken = file.to_vec();
        broken[at] ^= 1;
        assert!(read(&broken).is_err(), "byte {at}");
    }
}

/// A document with its data in itself, or in files beside it.
#[test]
fn data_may_lie_elsewhere() {
    use base64::Engine as _;
    let asset = small_asset();
    let file = write(&asset).unwrap();
    let rounded = quantise(&asset).unwrap();
    let chunks = container::split(&file).unwrap();
    let mut document: serde_json::Value = serde_json::from_slice(chunks.json).unwrap();
    document["buffers"][0]["uri"] = "data.bin".into();
    let beside = document.to_string();
    let binary = chunks.binary.to_vec();
    let found = read_with(beside.as_bytes(), &|name| {
        (name == "data.bin").then(|| binary.clone())
    });
    assert_eq!(found.unwrap(), rounded);
    let missing = read(beside.as_bytes()).unwrap_err();
    assert!(matches!(missing, AssetError::LostData { .. }), "{missing}");
    let text = base64::engine::general_purpose::STANDARD.encode(&binary);
    document["buffers"][0]["uri"] = format!("data:application/octet-stream;base64,{text}").into();
    assert_eq!(read(document.to_string().as_bytes()).unwrap(), rounded);
}

#[test]
fn what_contradicts_itself_is_not_written() {
    type Break = fn(&mut Asset);
    let breaks: [(&str, Break); 14] = [
        ("no hull", |a| a.hull.faces.clear()),
        ("face index", |a| a.hull.faces[0][1] = 3),
        ("hull number", |a| a.hull.positions[0][0] = f32::NAN),
        ("surface points", |a| a.hull.surface_points.truncate(1)),
        ("triangle", |a| a.map.triangles[0][2] = 3),
        ("depth count", |a| {
            a.map.views[0].contours[0].depths.truncate(2);
        }),
        ("NaN in a contour", |a| {
            a.map.views[0].contours[0].points[0].x = f64::NAN;
        }),
        ("foreign camera", |a| {
            a.map.views[0].camera.half_tangent *= 1.1;
        }),
        ("camera that looks beside its image", |a| {
            a.map.views[0].camera.center_offset.x = 1e-3;
        }),
        ("texture view that looks beside its picture", |a| {
            a.textures.views[0].camera.center_offset.y = -1e-3;
        }),
        ("visibility", |a| a.textures.visible_views[0] = 2),
        ("visibility count", |a| a.textures.visible_views.push(0)),
        ("picture", |a| a.textures.views[0].image.bytes[0] = 0),
        ("frame", |a| a.textures.views[0].camera.up *= 2.0),
    ];
    assert!(write(&small_asset()).is_ok());
    for (what, break_it) in breaks {
        let mut asset = small_asset();
        break_it(&mut asset);
        assert!(write(&asset).is_err(), "{what}");
    }
}
