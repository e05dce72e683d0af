//! What can be wrong with a mesh file.

use std::io;
use std::path::PathBuf;

use silmap_geometry::MeshDefects;
use silmap_geometry::camera::in_short;
use silmap_geometry::defects::counted;
use thiserror::Error;

/// A mesh file that could not be read, used or written: one sentence that names the file and the first offending
/// element.
#[derive(Debug, Error)]
#[error("{}: {fault}", path.display())]
pub struct MeshIoError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub fault: MeshFault,
}

/// What is wrong with a mesh file. Lines and faces count from 1, vertices as their
/// format counts them.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MeshFault {
    /// The operating system refused.
    #[error("cannot be read: {source}")]
    Unreadable {
        /// Its answer.
        #[source]
        source: io::Error,
    },
    /// The operating system refused.
    #[error("cannot be written: {source}")]
    Unwritable {
        /// Its answer.
        #[source]
        source: io::Error,
    },
    /// Zero bytes.
    #[error("the file is empty")]
    Empty,
    /// Neither the name nor the content identifies the format.
    #[error("not a kind of mesh file that is known here ({known})")]
    UnknownFormat {
        /// The file name extensions that are known.
        known: &'static str,
    },
    /// The content is plainly something else than a mesh that is read here.
    #[error("this is {what}: {way_out}")]
    Foreign {
        /// What it is, with its article.
        what: &'static str,
        /// What to do about it.
        way_out: &'static str,
    },
    /// Larger or smaller than the single precision of assets and devices can hold.
    #[error(
        "it is {size:.1e} units across: sizes from {least:.0e} to {most:.0e} are read, as assets hold single precision; scale it"
    )]
    Size {
        /// The longest side of its box, model units.
        size: f64,
        /// The smallest size.
        least: f64,
        /// The largest size.
        most: f64,
    },
    /// Binary data, or text in 16-bit characters, where 8-bit text was expected.
    #[error("not UTF-8 text")]
    NotText,
    /// One line of a text file.
    #[error("line {line}: {fault}")]
    Line {
        /// Which.
        line: usize,
        /// What is wrong with it.
        fault: LineFault,
    },
    /// Something before the first data.
    #[error("header: {0}")]
    Header(HeaderFault),
    /// Fewer elements than announced.
    #[error("{element} {number} of {count} is missing: the file ends before it")]
    Missing {
        /// "vertex" or "face".
        element: &'static str,
        /// Which, counting from 1.
        number: u64,
        /// How many were announced.
        count: u64,
    },
    /// Ends in the middle of an element.
    #[error("the file ends inside {element} {number} of {count}")]
    EndsInside {
        /// "vertex" or "face".
        element: String,
        /// Which, counting from 1.
        number: u64,
        /// How many were announced.
        count: u64,
    },
    /// An announced count that the file cannot hold.
    #[error("says {claimed} {element}, but has {found}")]
    CountMismatch {
        /// "triangles", "vertices" or "faces".
        element: &'static str,
        /// What the header says.
        claimed: u64,
        /// What is there: whole elements, or lines of data.
        found: String,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face}: vertex {vertex}, but the file has {count} vertices")]
    IndexOutOfRange {
        /// The face, from 1.
        face: u64,
        /// The vertex it names.
        vertex: i64,
        /// How many there are.
        count: usize,
    },
    /// A face with one or two corners.
    #[error("face {face} has {corners} corners")]
    TooFewCorners {
        /// The face, from 1.
        face: u64,
        /// How many corners.
        corners: usize,
    },
    /// A face with more corners than are cut in reasonable time.
    #[error("face {face} has {corners} corners; at most {most} are read")]
    TooManyCorners {
        /// The face, from 1.
        face: u64,
        /// How many corners.
        corners: usize,
        /// How many would do.
        most: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex, as the format counts.
        vertex: u64,
    },
    /// More vertices or faces than 32-bit numbers count.
    #[error("more vertices or faces than can be handled (about four thousand million corners)")]
    TooLarge,
    /// Numbers lie too far apart so far from the origin.
    #[error(
        "the model lies {} from the origin, where coordinates have steps of {}, too coarse for its radius of {}: move it nearer",
        in_short(*.distance),
        in_short(*.step),
        in_short(*.radius)
    )]
    TooFar {
        /// The largest coordinate of its middle.
        distance: f64,
        /// Its radius.
        radius: f64,
        /// How far numbers of double precision lie apart there.
        step: f64,
    },
    /// There is no vertex.
    #[error("no vertices")]
    NoVertices,
    /// There is no face.
    #[error("no faces")]
    NoFaces,
    /// There are vertices and no face.
    #[error("no faces, only {}: {way_out}", counted(*.vertices, "vertex"))]
    PointsOnly {
        /// How many vertices there are.
        vertices: usize,
        /// What to do about it.
        way_out: &'static str,
    },
    /// There are faces, and none has an area.
    #[error("no area: corners lie at the same place in every one of its faces ({faces})")]
    NoArea {
        /// How many faces there are.
        faces: usize,
    },
    /// A fault of a glTF file.
    #[error("{0}")]
    Gltf(GltfFault),
    /// The mesh is read, and is not a closed, oriented manifold.
    #[error("{defects}{hint}")]
    NotClosed {
        /// Why, numbered as in the file.
        #[source]
        defects: MeshDefects,
        /// Which option would help, with its punctuation.
        hint: String,
    },
    /// Repair was asked for and is not possible.
    #[error("cannot be repaired: {0}")]
    Unrepairable(#[from] silmap_geometry::repair::RepairError),
    /// A format that cannot hold this mesh, or is not written.
    #[error("cannot be written as this kind of file (known: {known})")]
    UnknownOutput {
        /// The file name extensions that are written.
        known: &'static str,
    },
}

/// What is wrong with one line of a text file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum LineFault {
    /// A vertex without three readable coordinates.
    #[error("vertex {vertex} does not have three numbers as coordinates")]
    Coordinates {
        /// The vertex, as the format counts.
        vertex: u64,
    },
    /// A coordinate is infinite or not a number.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// The vertex, as the format counts.
        vertex: u64,
    },
    /// A face names a vertex that is not there (yet).
    #[error("vertex {vertex}, but there are only {count} so far")]
    IndexOutOfRange {
        /// The vertex it names.
        vertex: i64,
        /// How many there are up to here.
        count: usize,
    },
    /// OBJ counts from 1.
    #[error("vertex index 0: OBJ counts from 1")]
    IndexZero,
    /// Something else than a number.
    #[error("`{token}` is not a vertex number")]
    NotAnIndex {
        /// What stands there.
        token: String,
    },
    /// A face needs three corners.
    #[error("a face with {corners} corner{}", if *corners == 1 { "" } else { "s" })]
    TooFewCorners {
        /// How many it has.
        corners: usize,
    },
    /// A face with more corners than are cut in reasonable time.
    #[error("a face with {corners} corners; at most {most} are read")]
    TooManyCorners {
        /// How many it has.
        corners: usize,
        /// How many would do.
        most: usize,
    },
    /// A face line of an OFF or PLY file.
    #[error("face {face} is not of the form `{form}`")]
    FaceLine {
        /// The face, from 1.
        face: u64,
        /// What it should look like.
        form: &'static str,
    },
    /// Something else was expected here.
    #[error("expected {expected}, found `{found}`")]
    Expected {
        /// What.
        expected: &'static str,
        /// What stands there instead, shortened.
        found: String,
    },
}

/// What is wrong with a header.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum HeaderFault {
    /// The first word is not the format's.
    #[error("does not begin with `{expected}`")]
    Magic {
        /// What a file of this format begins with.
        expected: &'static str,
    },
    /// The header never ends.
    #[error("no `end_header`")]
    Endless,
    /// A PLY header line that makes no sense.
    #[error("line {line} cannot be read: `{text}`")]
    Unreadable {
        /// Which.
        line: usize,
        /// What stands there, shortened.
        text: String,
    },
    /// A PLY header without `format`.
    #[error("no `format` line")]
    NoFormat,
    /// The same element twice.
    #[error("element `{name}` appears twice")]
    RepeatedElement {
        /// Its name.
        name: String,
    },
    /// An element that is needed.
    #[error("no {name} element")]
    NoElement {
        /// Its name.
        name: &'static str,
    },
    /// A property that is needed.
    #[error("element `{element}` has no property {property}")]
    NoProperty {
        /// The element.
        element: &'static str,
        /// The property.
        property: &'static str,
    },
    /// The counts of an OFF file.
    #[error("the vertex and face counts cannot be read: `{found}`")]
    Counts {
        /// What stands there, shortened.
        found: String,
    },
    /// A variant of the format that is not read.
    #[error("{what} is not supported")]
    Unsupported {
        /// Which variant.
        what: &'static str,
    },
}

/// What is wrong with a glTF file.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum GltfFault {
    /// A `.glb` that does not begin with `glTF`.
    #[error("not a binary glTF: it does not begin with `glTF`")]
    Magic,
    /// A binary glTF of another version.
    #[error("binary glTF version {version} is not supported, only 2")]
    Version {
        /// Which.
        version: u32,
    },
    /// The header's length is not the file's.
    #[error("the length in the header is wrong: {claimed} bytes, but the file has {found}")]
    Length {
        /// What the header says.
        claimed: u64,
        /// How long the file is.
        found: u64,
    },
    /// A chunk that runs past the end.
    #[error("truncated: the file ends inside a chunk")]
    TruncatedChunk,
    /// The JSON does not parse, or breaks glTF's own rules.
    #[error("the JSON {part}cannot be read: {reason}")]
    Json {
        /// "chunk " in a `.glb`.
        part: &'static str,
        /// The reader's answer.
        reason: String,
    },
    /// A buffer file that cannot be read.
    #[error("buffer {buffer}: `{uri}` not found ({reason})")]
    MissingBuffer {
        /// Which buffer.
        buffer: usize,
        /// The file it names.
        uri: String,
        /// The operating system's answer.
        reason: String,
    },
    /// A data URI that is not base64.
    #[error("buffer {buffer}: its data URI is not base64")]
    DataUri {
        /// Which buffer.
        buffer: usize,
    },
    /// A buffer that names no data.
    #[error("buffer {buffer} has no data")]
    NoBufferData {
        /// Which buffer.
        buffer: usize,
    },
    /// A buffer shorter than it says.
    #[error("buffer {buffer} says {claimed} bytes, but has {found}")]
    ShortBuffer {
        /// Which buffer.
        buffer: usize,
        /// What the JSON says.
        claimed: u64,
        /// What is there.
        found: u64,
    },
    /// An element that names one which does not exist.
    #[error("{element} is {index}: there is no such element")]
    NoSuchElement {
        /// Where the index stands, as a path in the JSON.
        element: String,
        /// The index.
        index: u64,
    },
    /// A glTF document of another version.
    #[error("glTF {version} is not supported, only 2")]
    OtherVersion {
        /// Which.
        version: String,
    },
    /// An extension that the file needs.
    #[error("needs {name}, which is not read here{way_out}")]
    NeedsExtension {
        /// Its name.
        name: String,
        /// What else can be done, with its punctuation.
        way_out: &'static str,
    },
    /// An extension's object that has another form than its specification says.
    #[error("extension {name} cannot be read: {reason}")]
    Extension {
        /// Which.
        name: &'static str,
        /// What is wrong.
        reason: String,
    },
    /// A buffer view that reaches past its buffer.
    #[error("buffer view {view} reaches past the end of its buffer")]
    ViewRange {
        /// Which.
        view: usize,
    },
    /// A compressed buffer view.
    #[error("buffer view {view} cannot be decoded: {reason}")]
    Compressed {
        /// Which.
        view: usize,
        /// Why not.
        reason: String,
    },
    /// A primitive compressed by Draco.
    #[error(
        "mesh {mesh}, primitive {primitive} cannot be decoded (KHR_draco_mesh_compression): {reason}"
    )]
    Draco {
        /// Which mesh.
        mesh: usize,
        /// Which of its primitives.
        primitive: usize,
        /// Why not.
        reason: String,
    },
    /// A skin that cannot be used.
    #[error("skin {skin} {what}")]
    Skin {
        /// Which.
        skin: usize,
        /// Why not.
        what: &'static str,
    },
    /// A vertex that names a joint that does not exist.
    #[error("skin {skin}: joint {joint} out of range, past the last of {count}")]
    Joint {
        /// Which skin.
        skin: usize,
        /// The joint.
        joint: u64,
        /// How many there are.
        count: usize,
    },
    /// Attributes of instances that differ in length.
    #[error("node {node}: the attributes of its instances have different lengths")]
    Instances {
        /// Which node.
        node: usize,
    },
    /// An accessor that reaches past its data.
    #[error("accessor {accessor} reaches past the end of its buffer view")]
    AccessorRange {
        /// Which accessor.
        accessor: usize,
    },
    /// An accessor of a kind that is not read here.
    #[error("accessor {accessor}: {what}")]
    AccessorKind {
        /// Which accessor.
        accessor: usize,
        /// Why not.
        what: &'static str,
    },
    /// A face names a vertex that does not exist.
    #[error(
        "mesh {mesh}, primitive {primitive}: index {vertex} out of range, past the last vertex of {count}"
    )]
    IndexOutOfRange {
        /// Which mesh.
        mesh: usize,
        /// Which of its primitives.
        primitive: usize,
        /// The index.
        vertex: u32,
        /// How many vertices there are.
        count: usize,
    },
    /// A node that is its own descendant, or has two parents.
    #[error("node loop: node {node} is reached twice")]
    NodeLoop {
        /// Which.
        node: usize,
    },
    /// There is no triangle anywhere in the scene.
    #[error("no mesh: the scene has no triangles")]
    NoMesh,
}

impl MeshFault {
    /// A fault of line `line`, counting from 1.
    pub(super) fn at_line(line: usize, fault: LineFault) -> Self {
        Self::Line { line, fault }
    }
}

/// The first part of what stands in a file, fit to be shown in a sentence.
pub(super) fn excerpt(text: &str) -> String {
    const LONGEST: usize = 40;
    let mut shown: String = text
        .trim()
        .chars()
        .take(LONGEST)
        .map(|c| if c.is_control() { '?' } else { c })
        .collect();
    if text.trim().chars().count() > LONGEST {
        shown.push('…');
    }
    shown
}
