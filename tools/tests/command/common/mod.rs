//! Runs the command, `splatkit` or `splatkit-measure`, in a folder of its own, on files that the
//! tests write.

#![allow(dead_code, reason = "each test file uses only a part")]

#[path = "../../../../tests/testing/folder.rs"]
mod folder;
pub mod trained;

pub use folder::Folder;

use std::{
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Command, Output},
};

impl Folder {
    /// Writes an input and returns its name.
    pub fn put<'a>(&self, name: &'a str, bytes: impl AsRef<[u8]>) -> &'a str {
        self.write(name, bytes);
        name
    }

    /// Runs the command in the folder; arguments are separated by spaces.
    pub fn run(&self, arguments: &str) -> Run {
        self.run_with(&arguments.split_whitespace().collect::<Vec<_>>())
    }

    pub fn run_with(&self, arguments: &[impl AsRef<OsStr>]) -> Run {
        Run::of(&mut self.command(), arguments)
    }

    /// Returns the command in the folder, without arguments.
    pub fn command(&self) -> Command {
        let mut command = Command::new(crate::COMMAND);
        command.current_dir(self).env("NO_COLOR", "1").env_remove("RUST_LOG");
        command
    }

    /// Runs a command that must succeed, with a JSON result.
    pub fn json(&self, arguments: &str) -> serde_json::Value {
        serde_json::from_slice(&self.run(arguments).ok().stdout).unwrap()
    }
}

/// A finished run: its arguments and its output.
pub struct Run(String, Output);

impl Run {
    /// Runs a command with these arguments.
    pub fn of(command: &mut Command, arguments: &[impl AsRef<OsStr>]) -> Self {
        let output = command.args(arguments).output();
        let words: Vec<_> =
            arguments.iter().map(|argument| argument.as_ref().to_string_lossy()).collect();
        Self(words.join(" "), output.unwrap())
    }

    pub fn code(&self) -> Option<i32> {
        self.1.status.code()
    }

    pub fn stderr(&self) -> String {
        // Messages are wrapped at the terminal's width; only their words matter.
        let text = String::from_utf8_lossy(&self.1.stderr).replace(['│', '╰', '├', '─', '▶'], " ");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Returns all that was printed, as it was printed.
    pub fn printed(&self) -> String {
        format!("{}{}", self.stdout(), String::from_utf8_lossy(&self.1.stderr))
    }

    pub fn stdout(&self) -> String {
        String::from_utf8_lossy(&self.1.stdout).into_owned()
    }

    /// Asserts that the run succeeded.
    pub fn ok(self) -> Output {
        assert!(self.1.status.success(), "splatkit {}: {}", self.0, self.stderr());
        self.1
    }

    /// Asserts that the run failed with this exit code and a message that contains each of these
    /// words.
    pub fn fails(self, code: i32, words: &[&str]) {
        let message = self.stderr();
        assert_eq!(self.1.status.code(), Some(code), "splatkit {}: {message}", self.0);
        assert!(!message.contains("panicked"), "splatkit {}: {message}", self.0);
        for word in words {
            assert!(message.contains(word), "splatkit {}: no “{word}” in: {message}", self.0);
        }
        assert!(
            self.1.stdout.is_empty() || code == 5,
            "splatkit {}: a failure writes nothing to stdout",
            self.0
        );
    }
}

/// A tetrahedron.
pub const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
    property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0 255 0 0\n7 0 0 0 255 0\n0 7 0 0 0 255\n0 0 7 255 255 255\n\
    3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

/// A square.
pub const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

/// A ball of 16³ samples.
pub fn ball() -> Vec<u8> {
    let part = |i: usize| (i as f64 - 7.5).powi(2);
    let value = |i: usize| {
        let r = (part(i % 16) + part(i / 16 % 16) + part(i / 256)).sqrt();
        (255.0 * (1.0 - r / 7.0).clamp(0.0, 1.0)) as u8
    };
    (0..4096).map(value).collect()
}

pub fn nrrd(type_name: &str, samples: &[u8]) -> Vec<u8> {
    let header = format!(
        "NRRD0004\ntype: {type_name}\ndimension: 3\nsizes: 16 16 16\nendian: little\n\
         encoding: raw\n\n"
    );
    [header.as_bytes(), samples].concat()
}

pub fn vti() -> String {
    let values: Vec<String> = ball().iter().map(u8::to_string).collect();
    format!(
        "<?xml version=\"1.0\"?>\n\
         <VTKFile type=\"ImageData\" version=\"0.1\" byte_order=\"LittleEndian\">\n\
         <ImageData WholeExtent=\"0 15 0 15 0 15\" Origin=\"0 0 0\" Spacing=\"1 1 1\">\n\
         <Piece Extent=\"0 15 0 15 0 15\"><PointData Scalars=\"v\">\n\
         <DataArray type=\"UInt8\" Name=\"v\" format=\"ascii\">{}</DataArray>\n\
         </PointData></Piece></ImageData></VTKFile>\n",
        values.join(" ")
    )
}

/// Returns a square with a texture of four colours, all in one file.
pub fn glb() -> Vec<u8> {
    let color = [[255u8, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    let pixels: Vec<[f32; 4]> =
        color.map(|c| [c[0], c[1], c[2], 255].map(|v| f32::from(v) / 255.0)).to_vec();
    let texture =
        splatkit::picture::Picture { width: 2, height: 2, color: pixels, depth: Vec::new() };
    let png = texture
        .encode(&splatkit::picture::Encoding::new(splatkit::picture::PictureFormat::Png))
        .unwrap();
    let positions = [[0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let uvs = [[0f32, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
    let indices = [0u16, 1, 2, 0, 2, 3];
    let mut binary: Vec<u8> = positions
        .iter()
        .flatten()
        .chain(uvs.iter().flatten())
        .flat_map(|v| v.to_le_bytes())
        .collect();
    binary.extend(indices.iter().flat_map(|v| v.to_le_bytes()));
    binary.extend(&png);
    let size = png.len();
    let mut json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,
        "scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[
        {{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"bufferView":3,"mimeType":"image/png"}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3",
        "min":[0,0,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},
        {{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},
        {{"buffer":0,"byteOffset":48,"byteLength":32}},
        {{"buffer":0,"byteOffset":80,"byteLength":12}},
        {{"buffer":0,"byteOffset":92,"byteLength":{size}}}],
        "buffers":[{{"byteLength":{}}}]}}"#,
        binary.len()
    )
    .into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |v: usize| (v as u32).to_le_bytes();
    let mut file = [b"glTF".as_slice(), &word(2), &word(28 + json.len() + binary.len())].concat();
    file.extend([word(json.len()).as_slice(), b"JSON", &json].concat());
    file.extend([word(binary.len()).as_slice(), b"BIN\0", &binary].concat());
    file
}

/// Returns a wavy sheet of triangles as binary PLY.
pub fn sheet(side: u32) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        side * side,
        (side - 1) * (side - 1) * 2
    )
    .into_bytes();
    for i in 0..side * side {
        let (x, y) = ((i % side) as f32, (i / side) as f32);
        for value in [x, y, (0.1 * x).sin() * (0.07 * y).cos() * 5.0] {
            out.extend(value.to_le_bytes());
        }
    }
    for i in (0..side * (side - 1)).filter(|i| i % side + 1 < side) {
        for triangle in [[i, i + 1, i + side], [i + 1, i + side + 1, i + side]] {
            out.push(3);
            triangle.iter().for_each(|index| out.extend(index.to_le_bytes()));
        }
    }
    out
}

/// Whether the bytes are a whole PNG of this size, by its header and its end.
pub fn is_png(bytes: &[u8], width: u32, height: u32) -> bool {
    bytes.starts_with(b"\x89PNG\r\n\x1a\n")
        && bytes.get(16..24) == Some(&[width.to_be_bytes(), height.to_be_bytes()].concat()[..])
        && bytes.ends_with(b"IEND\xaeB`\x82")
}

/// Returns the folder of real scans, if there is one.
pub fn real_data() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("SPLATKIT_DATA").map_or_else(beside, PathBuf::from);
    folder.is_dir().then_some(folder)
}
