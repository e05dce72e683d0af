//! All shaders, without a device: each file is used, each program is valid with no optional capability, each uniform struct
//! lies in memory as the shader reads it, and what must run on WebGL2 can be written as GLSL ES 3.00.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

use std::collections::BTreeSet;
use std::mem::offset_of;
use std::path::Path;

use naga::back::glsl;
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use silmap_gpu::shaders::{self, Shader};
use silmap_study::{EdgeLinesUniform, GroundUniform, MaterialUniform, TintUniform, ViewUniform};

/// Crates that have shaders, and theirs.
const TABLES: &[(&str, &[Shader])] = &[
    ("silmap-gpu", shaders::ALL),
    ("silmap-runtime", silmap_runtime::shaders::ALL),
];

/// All of them.
fn all() -> impl Iterator<Item = &'static Shader> {
    TABLES.iter().flat_map(|(_, table)| *table)
}

fn parsed(shader: &Shader) -> (naga::Module, ModuleInfo) {
    let source = shader.source();
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&source)));
    let info = Validator::new(ValidationFlags::all(), Capabilities::empty())
        .validate(&module)
        .unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&source)));
    (module, info)
}

#[test]
fn every_program_is_valid_and_has_its_entry_points() {
    for (of, table) in TABLES {
        assert!(!table.is_empty(), "nothing was checked of {of}");
    }
    for shader in all() {
        let (module, _) = parsed(shader);
        let names: Vec<&str> = module
            .entry_points
            .iter()
            .map(|e| e.name.as_str())
            .collect();
        assert_eq!(names.len(), 2, "{}: {names:?}", shader.name);
        assert!(
            names.contains(&"vs_main") && names.contains(&"fs_main"),
            "{}",
            shader.name
        );
    }
}

#[test]
fn an_invalid_program_is_noticed() {
    let broken = "@fragment fn fs_main() -> @location(0) vec4f { return vec3f(1.0); }";
    let module = naga::front::wgsl::parse_str(broken).ok();
    let valid = module.is_some_and(|m| {
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&m)
            .is_ok()
    });
    assert!(!valid, "a vec3f passed for a vec4f");
}

/// Words and operators of a shader, without comments.
fn tokens(source: &str) -> Vec<String> {
    const LONG: [&str; 17] = [
        "<<=", ">>=", "->", "&&", "||", "==", "!=", "<=", ">=", "<<", ">>", "+=", "-=", "*=", "|=",
        "&=", "^=",
    ];
    let lines = source
        .lines()
        .map(|line| line.split("//").next().unwrap_or(line));
    let text: String = lines.collect::<Vec<_>>().join("\n");
    let mut rest = text.as_str();
    let mut found = Vec::new();
    while let Some(first) = rest.chars().next() {
        let is_word = |c: char| c.is_alphanumeric() || c == '_' || c == '.';
        let length = if is_word(first) {
            rest.find(|c| !is_word(c)).unwrap_or(rest.len())
        } else {
            let long = LONG.iter().find(|op| rest.starts_with(**op));
            long.map_or(first.len_utf8(), |op| op.len())
        };
        if !first.is_whitespace() {
            found.push(rest[..length].to_owned());
        }
        rest = &rest[length..];
    }
    found
}

/// The first pair of operators beside each other that WGSL gives no precedence ("Operator Precedence and Associativity"): browsers
/// refuse them, naga takes them.
fn mixed_operators(source: &str) -> Option<(String, String)> {
    const TEMPLATES: [&str; 9] = [
        "bitcast",
        "vec2",
        "vec3",
        "vec4",
        "array",
        "var",
        "ptr",
        "texture_2d",
        "texture_2d_array",
    ];
    let binary = |op: &str| match op {
        "|" | "&" | "^" => Some(0),
        "<<" | ">>" => Some(1),
        "+" | "-" | "*" | "/" | "%" => Some(2),
        "<" | ">" | "<=" | ">=" | "==" | "!=" => Some(3),
        "&&" | "||" => Some(4),
        _ => None,
    };
    let may_mix = |a: &str, b: &str| match (binary(a), binary(b)) {
        (Some(0), _) | (_, Some(0)) | (Some(4), Some(4)) => a == b,
        (Some(1), Some(1 | 2)) | (Some(2), Some(1)) | (Some(3), Some(3)) => false,
        _ => true,
    };
    // Of each bracket that is open: the operators since the last comma or the like.
    let mut levels: Vec<Vec<String>> = vec![Vec::new()];
    let mut before = String::new();
    let mut templates = 0;
    for token in tokens(source) {
        let is_operand = before.ends_with(|c: char| c.is_alphanumeric() || ")]_".contains(c))
            && before != "return";
        match token.as_str() {
            "<" if TEMPLATES.contains(&before.as_str()) => templates += 1,
            ">" if templates > 0 => templates -= 1,
            "(" | "[" => levels.push(Vec::new()),
            ")" | "]" => {
                levels.pop();
            }
            op if binary(op).is_some() && is_operand => {
                let level = levels.last_mut()?;
                // A comparison ends where an && begins.
                let near = level
                    .iter()
                    .rev()
                    .take_while(|other| binary(op) != Some(3) || binary(other) != Some(4));
                // Shifts are beside what stands beside them; the rest is of the whole expression.
                let is_near = |k: usize, other: &str| {
                    k == 0 || !(binary(op) == Some(1) || binary(other) == Some(1))
                };
                let clash = near
                    .enumerate()
                    .find(|(k, other)| is_near(*k, other) && !may_mix(other, op));
                if let Some((_, other)) = clash {
                    return Some((other.clone(), op.to_owned()));
                }
                level.push(op.to_owned());
            }
            op if binary(op).is_none()
                && !op.starts_with(|c: char| c.is_alphanumeric() || c == '_')
                && op != "!"
                && op != "~" =>
            {
                levels.last_mut()?.clear();
            }
            _ => {}
        }
        before = token;
    }
    None
}

#[test]
fn no_program_mixes_operators_that_browsers_do_not_let_mix() {
    for shader in all() {
        assert_eq!(mixed_operators(&shader.source()), None, "{}", shader.name);
    }
}

#[test]
fn mixed_operators_are_noticed() {
    let body = |e: &str| {
        format!("fn f(a: vec2<u32>) -> u32 {{ let b = array<u32, 2>(1u, 2u); return {e}; }}")
    };
    for bad in [
        "a | b << 2u",
        "a & b + 1u",
        "a ^ b | 1u",
        "a << b << 1u",
        "a == b == c",
        "a < b == c",
        "a & 1u != 0u",
        "a && b || c",
        "(a + 1u) * b << 2u",
        "f(a | b << 2u, 1)",
    ] {
        assert!(mixed_operators(&body(bad)).is_some(), "{bad}");
    }
    for good in [
        "a | (b << 2u) | c",
        "(a & b) + 1u",
        "a << 1u",
        "a == b && c == d",
        "a + b * c - -d",
        "x < 1.0 || y > 2.0",
        "f(a | b, c + 1u)",
        "(a & 1u) != 0u",
        "b[i + 1u] << 2u",
    ] {
        assert_eq!(mixed_operators(&body(good)), None, "{good}");
    }
}

/// Texts of all files of a folder and of those in it.
fn texts(folder: &Path, into: &mut Vec<(String, String)>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            texts(&path, into);
        } else if path.extension().is_some_and(|e| e == "wgsl") {
            into.push((
                path.display().to_string(),
                std::fs::read_to_string(&path).unwrap(),
            ));
        }
    }
}

#[test]
fn every_file_is_part_of_a_program() {
    for (of, table) in TABLES {
        let crates = Path::new(env!("CARGO_MANIFEST_DIR")).join("../crates");
        let mut files = Vec::new();
        texts(&crates.join(of).join("shaders"), &mut files);
        assert!(!files.is_empty(), "no shader file of {of} was found");
        let parts = table.iter().flat_map(|s| s.parts.iter().copied());
        let used: BTreeSet<&str> = parts.collect();
        for (path, text) in &files {
            assert!(used.contains(text.as_str()), "{path} belongs to no shader");
        }
        assert_eq!(
            files.len(),
            used.len(),
            "a shader of {of} has a part that is no file"
        );
    }
}

/// Name, offset and size of each member of a WGSL struct, and the struct's size.
fn wgsl_layout(shader: &Shader, name: &str) -> (Vec<(String, u32)>, u32) {
    let (module, _) = parsed(shader);
    let (_, found) = module
        .types
        .iter()
        .find(|(_, t)| t.name.as_deref() == Some(name))
        .unwrap_or_else(|| panic!("{} has no struct {name}", shader.name));
    let naga::TypeInner::Struct { members, span } = &found.inner else {
        panic!("{name} is no struct");
    };
    let members = members
        .iter()
        .map(|m| (m.name.clone().unwrap_or_default(), m.offset))
        .collect();
    (members, *span)
}

/// Offsets of a Rust struct's fields, by name.
macro_rules! rust_layout {
    ($type:ty, $($field:ident),*) => {
        (
            vec![$((stringify!($field).to_owned(), offset_of!($type, $field) as u32)),*],
            size_of::<$type>() as u32,
        )
    };
}

#[test]
fn uniforms_lie_in_memory_as_the_shaders_read_them() {
    let pairs = [
        (
            wgsl_layout(&shaders::SHADE_MODEL, "View"),
            rust_layout!(ViewUniform, clip_from_object, lights, size_px, ambient, dim),
        ),
        (
            wgsl_layout(&shaders::SHADE_MODEL, "ModelMaterial"),
            rust_layout!(MaterialUniform, base_colour),
        ),
        (
            wgsl_layout(&shaders::TINT, "Tint"),
            rust_layout!(TintUniform, colour),
        ),
        (
            wgsl_layout(&shaders::GROUND_SHADOW, "Ground"),
            rust_layout!(GroundUniform, corners, strength, texel, room),
        ),
        (
            wgsl_layout(&shaders::SOUP_NEAR, "EdgeLines"),
            rust_layout!(
                EdgeLinesUniform,
                eye_in_object,
                width_px,
                depth_scale,
                slope_depth,
                charcoal,
                by_tag
            ),
        ),
    ];
    for (wgsl, rust) in pairs {
        assert_eq!(wgsl, rust);
    }
}

#[test]
fn a_struct_in_another_order_is_noticed() {
    let swapped = rust_layout!(ViewUniform, clip_from_object, lights, ambient, size_px, dim);
    assert_ne!(wgsl_layout(&shaders::SHADE_MODEL, "View"), swapped);
}

#[test]
fn web_programs_can_be_written_for_webgl2() {
    let mut written = 0;
    for shader in all().filter(|s| s.web) {
        let (module, info) = parsed(shader);
        // Constants that a pipeline sets keep their defaults here.
        let (module, info) = naga::back::pipeline_constants::process_overrides(
            &module,
            &info,
            None,
            &naga::back::PipelineConstants::default(),
        )
        .unwrap_or_else(|e| panic!("{}: {e}", shader.name));
        let options = glsl::Options {
            version: glsl::Version::new_gles(300),
            ..Default::default()
        };
        for entry in &module.entry_points {
            let pipeline = glsl::PipelineOptions {
                shader_stage: entry.stage,
                entry_point: entry.name.clone(),
                multiview: None,
            };
            let mut text = String::new();
            glsl::Writer::new(
                &mut text,
                &module,
                &info,
                &options,
                &pipeline,
                naga::proc::BoundsCheckPolicies::default(),
            )
            .and_then(|mut writer| writer.write())
            .unwrap_or_else(|e| panic!("{} {}: {e}", shader.name, entry.name));
            assert!(text.starts_with("#version 300 es"), "{}", shader.name);
            written += 1;
        }
    }
    assert!(written > 0, "nothing was written");
}
