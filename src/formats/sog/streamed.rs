//! Streamed SOG: a scene in levels of detail and chunks, for viewers that load what they show. The
//! index, `lod-meta.json`, has a tree whose leaves refer to ranges of Gaussians in SOG files beside
//! it, for each level. All chunks of the finest level are read here as one scene, with the scene
//! around it (`environment`) if there is one.

use super::{INDEX, META, Scene, planes};
use crate::{Result, formats::shared::trained::settle, gaussians::Gaussians, input::Source};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Most bytes of an index. That of a scene of 100 million Gaussians has about 1 MB.
const MOST_INDEX: usize = 1 << 26;

/// Bytes of memory for each byte of an index.
const TREE: u64 = 40;

/// What the index says.
#[derive(Deserialize)]
struct Index {
    version: Option<u64>,
    filenames: Vec<String>,
    environment: Option<String>,
    tree: Node,
}

/// A node of the tree.
#[derive(Deserialize)]
struct Node {
    #[serde(default)]
    children: Vec<Node>,
    /// The Gaussians of the node, by level. 0 is the finest.
    #[serde(default)]
    lods: BTreeMap<u32, Range>,
}

/// Gaussians of a file.
#[derive(Deserialize, Clone, Copy)]
struct Range {
    /// The number of the file.
    file: usize,
    offset: u64,
    count: u64,
}

/// Gaussians that follow each other, in the scene and in the file of a chunk.
struct Run {
    /// The number of Gaussians before them in the scene.
    first: usize,
    chunk: usize,
    /// The number of Gaussians before them in the chunk.
    offset: usize,
}

/// A file of Gaussians.
struct Chunk {
    scene: Scene,
    count: usize,
}

/// Reads the finest level of a scene from its index.
pub fn read(source: &Source) -> Result<Gaussians> {
    let text = source.small_text("an index of chunks", MOST_INDEX)?;
    source.spend("the size of the index in bytes", TREE * text.len() as u64)?;
    let index: Index =
        serde_json::from_str(&text).map_err(|error| source.error(INDEX, error.to_string()))?;
    if let Some(version @ (0 | 2..)) = index.version {
        let message = format!("has the version {version}, but only 1 is supported");
        return Err(source.error(INDEX, message).hint("write the scene as PLY or as one .sog"));
    }
    let ranges = finest(source, &index)?;
    let mut scene = Streamed { chunks: Vec::new(), runs: Vec::new(), count: 0 };
    for (file, ranges) in &ranges {
        let name = index.filenames.get(*file).ok_or_else(|| {
            let message = format!("refers to file {file}, but names {}", index.filenames.len());
            source.error(INDEX, message)
        })?;
        scene.add(source, &format!("filenames[{file}]"), name, Some(ranges))?;
    }
    if let Some(name) = &index.environment {
        scene.add(source, "environment", name, None)?;
    }
    let count = source.check_points("the number of Gaussians", scene.count as u64)?;
    let degree = scene.chunks.iter().map(|chunk| chunk.scene.degree()).max().unwrap_or_default();
    settle(source, count, degree, |index, color| {
        let run = &scene.runs[scene.runs.partition_point(|run| run.first <= index) - 1];
        color.fill([0.0; 3]);
        scene.chunks[run.chunk].scene.gaussian(source, run.offset + index - run.first, color)
    })
}

/// Returns the ranges of the finest level that the tree has, by their files. Those without
/// Gaussians are left out.
fn finest(source: &Source, index: &Index) -> Result<BTreeMap<usize, Vec<Range>>> {
    let mut levels: BTreeMap<u32, BTreeMap<usize, Vec<Range>>> = BTreeMap::new();
    let mut nodes = vec![&index.tree];
    while let Some(node) = nodes.pop() {
        for (&level, &range) in node.lods.iter().filter(|(_, range)| range.count > 0) {
            levels.entry(level).or_default().entry(range.file).or_default().push(range);
        }
        nodes.extend(&node.children);
    }
    let Some((level, mut files)) = levels.pop_first() else {
        return Err(source.error(INDEX, "has a tree that refers to no Gaussians"));
    };
    tracing::info!(level, files = files.len(), "the finest level is read");
    for ranges in files.values_mut() {
        ranges.sort_unstable_by_key(|range| range.offset);
    }
    Ok(files)
}

/// A scene of several files.
struct Streamed {
    chunks: Vec<Chunk>,
    /// In the order of the scene.
    runs: Vec<Run>,
    count: usize,
}

impl Streamed {
    /// Adds the Gaussians of a file: these ranges, which are sorted, or all.
    fn add(
        &mut self,
        source: &Source,
        place: &str,
        name: &str,
        ranges: Option<&[Range]>,
    ) -> Result<()> {
        let path = source.neighbour(place, name)?;
        let file = source.open_beside(&path)?;
        let chunk = file.unless_changed(Chunk::load(&file))?;
        let all = [Range { file: 0, offset: 0, count: chunk.count as u64 }];
        let mut end = 0;
        for range in ranges.unwrap_or(&all) {
            let next = range.offset.saturating_add(range.count);
            if range.offset < end || next > chunk.count as u64 {
                let message = format!(
                    "the Gaussians {} to {next} of “{name}” are in another range too, or beyond \
                     its {} Gaussians",
                    range.offset, chunk.count
                );
                return Err(source.error(place, message));
            }
            end = next;
            let (first, offset) = (self.count, range.offset as usize);
            self.runs.push(Run { first, chunk: self.chunks.len(), offset });
            self.count += range.count as usize;
        }
        self.chunks.push(chunk);
        source.check_points("the number of Gaussians", self.count as u64)?;
        Ok(())
    }
}

impl Chunk {
    fn load(file: &Source) -> Result<Self> {
        let (text, mut files) = planes::open(file)?;
        if super::is_streamed(text.as_bytes()) {
            return Err(file.error(META, "is an index of chunks itself"));
        }
        let meta = super::Meta::parse(file, &text)?;
        let count = meta.count(file)?;
        Ok(Self { scene: Scene::load(file, &mut files, &meta, count)?, count })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Error,
        formats::sog::{self, write},
        input::{Limits, testing::*},
    };
    use glam::{DVec3, Quat, Vec3};
    use serde_json::{Value, json};
    use std::path::PathBuf;

    /// Gaussians along x, from a place on.
    fn set(first: usize, count: usize, degree: u32) -> Gaussians {
        Gaussians {
            centers: (0..count).map(|i| Vec3::X * (first + i) as f32).collect(),
            scales: vec![Vec3::ONE; count],
            rotations: vec![Quat::IDENTITY; count],
            opacities: vec![1.0; count],
            degree,
            harmonics: vec![[0.5; 3]; count * crate::gaussians::harmonics::terms(degree)],
            ..Gaussians::default()
        }
    }

    fn index() -> Value {
        json!({
            "version": 1, "asset": { "generator": "a test" }, "count": 12, "lodLevels": 2,
            "counts": [9, 3], "environment": "env.sog",
            "filenames": ["1_0/meta.json", "0_0/meta.json", "0_1/meta.json"],
            "tree": { "bound": { "min": [0, 0, 0], "max": [9, 1, 1] }, "children": [
                { "lods": { "0": { "file": 1, "offset": 2, "count": 3 },
                            "1": { "file": 0, "offset": 0, "count": 3 } } },
                { "children": [
                    { "lods": { "0": { "file": 1, "offset": 0, "count": 2 } } },
                    { "lods": { "0": { "file": 2, "offset": 0, "count": 4 } } }
                ] }
            ] }
        })
    }

    /// Writes the chunks and this index.
    fn folder_of(folder: &Folder, index: &Value) -> PathBuf {
        for (name, set) in [
            ("1_0/meta.json", set(100, 3, 0)),
            ("0_0/meta.json", set(0, 5, 1)),
            ("0_1/meta.json", set(5, 4, 0)),
            ("env.sog", set(50, 2, 0)),
        ] {
            let path = folder.path(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            write(&set, path).unwrap();
        }
        folder.write(INDEX, index.to_string())
    }

    #[test]
    fn the_finest_level_is_one_scene() {
        let folder = Folder::new();
        let set = read_with(&folder_of(&folder, &index()), sog::read).unwrap();
        assert_eq!((set.len(), set.degree, set.validate()), (11, 1, Ok(())));
        let mut places: Vec<i64> =
            set.centers.iter().map(|c| (set.origin + c.as_dvec3()).x.round() as i64).collect();
        assert!((set.origin + set.centers[3].as_dvec3()).distance(DVec3::X * 3.0) < 1e-3);
        places.sort_unstable();
        assert_eq!(places, [0, 1, 2, 3, 4, 5, 6, 7, 8, 50, 51]);
        assert!(set.harmonics_of(0)[1] != [0.0; 3] && set.harmonics_of(7)[1] == [0.0; 3]);
        // Without a version, and with one level more.
        let mut other = index();
        let lods = json!({ "3": { "file": 0, "offset": 0, "count": 3 } });
        other["tree"] = json!({ "lods": lods });
        other.as_object_mut().unwrap().remove("version");
        let coarse = read_with(&folder_of(&folder, &other), sog::read).unwrap();
        assert_eq!(coarse.len(), 5);
    }

    #[test]
    fn contradictions_are_errors() {
        let folder = Folder::new();
        let leaf = |file: usize, offset: u64, count: u64| {
            let range = json!({ "file": file, "offset": offset, "count": count });
            json!({ "lods": { "0": range } })
        };
        let cases: [(&str, Value, &str); 9] = [
            ("version", json!(2), "has the version 2, but only 1"),
            ("tree", json!({}), "a tree that refers to no Gaussians"),
            ("tree", leaf(9, 0, 1), "refers to file 9, but names 3"),
            ("tree", leaf(1, 3, 3), "the Gaussians 3 to 6 of “0_0/meta.json”"),
            ("tree", json!({ "children": [leaf(1, 0, 3), leaf(1, 2, 1)] }), "another range too"),
            ("tree", leaf(1, 1, u64::MAX), "beyond its 5 Gaussians"),
            ("filenames", json!([]), "refers to file 1, but names 0"),
            ("filenames", json!(["a", "../a/meta.json", "b"]), "filenames[1]"),
            ("environment", json!("inner.json"), "inner.json: meta.json: is an index of chunks"),
        ];
        folder.write("inner.json", index().to_string());
        for (key, value, word) in cases {
            let mut index = index();
            index[key] = value;
            let error = read_with(&folder_of(&folder, &index), sog::read).unwrap_err().to_string();
            assert!(error.contains(word), "{error}, not {word}");
        }
        let path = folder_of(&folder, &index());
        let itself = folder.write("itself.json", index().to_string());
        assert!(sog::is_meta(&std::fs::read(itself).unwrap()));
        every_cut(&folder, INDEX, index().to_string().as_bytes(), sog::read);
        let limits = Limits { points: 8, ..Limits::default() };
        let error = sog::read(&Source::open(&path, &limits).unwrap()).unwrap_err();
        assert!(matches!(error, Error::Limit { .. }), "{error}");
        std::fs::remove_file(folder.path("0_1/scales.webp")).unwrap();
        let error = read_with(&path, sog::read).unwrap_err().to_string();
        assert!(error.contains("0_1/meta.json: scales.files[0]"), "{error}");
    }
}
