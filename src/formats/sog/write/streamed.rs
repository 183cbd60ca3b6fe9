//! Writes streamed SOG: a scene in levels of detail, cut into chunks in space.
//!
//! A tree of boxes divides all levels by the places of the finest one. Each leaf refers to its
//! Gaussians in a file of each level. A file holds those of neighbouring leaves.

use super::{META, Named, Size, pack, place, write_beside};
use crate::{
    Error, Result, disk,
    formats::shared::{curve, trained::check_places},
    gaussians::Gaussians,
    math::keep::single,
    memory,
};
use glam::DVec3;
use serde::Serialize;
use serde_json::{Value, json};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// Most Gaussians of the finest level in a leaf.
const LEAF: usize = 1 << 14;

/// Most Gaussians in a file, if a leaf has no more.
const FILE: usize = 1 << 17;

/// Bytes of memory for each Gaussian while the tree is made.
const MEMORY: usize = 32;

/// The Gaussians of each level in a box, along the curve of Morton.
type Members = Vec<Vec<u32>>;

/// Writes a scene in levels of detail, the finest first, as an index, `lod-meta.json`, with the
/// files of Gaussians in folders beside it: `0_0/meta.json` has the first of level 0. All are as
/// [`write`](super::write) writes them, but each leaf's Gaussians are together.
///
/// # Errors
/// [`Error::Argument`] for a level that is empty or contradicts itself; [`Error::Memory`] if there
/// is too little of it; [`Error::Output`] if a file cannot be written. Then the files that were
/// written are removed.
pub fn write(levels: &[Gaussians], path: impl AsRef<Path>) -> Result<()> {
    let path = path.as_ref();
    for level in levels {
        level.validate().map_err(Error::Argument)?;
        check_places("SOG", level, single)?;
    }
    if levels.is_empty() || levels.iter().any(Gaussians::is_empty) {
        return Err(Error::Argument("there are no Gaussians to write".into()));
    }
    let counts: Vec<usize> = levels.iter().map(Gaussians::len).collect();
    let count: usize = counts.iter().sum();
    memory::room("packing Gaussians", (MEMORY * count) as u64)?;
    let members = levels
        .iter()
        .map(|level| curve::order(level).into_iter().map(|(_, index)| index as u32).collect());
    let members = members.collect();
    let mut files = Files { levels, files: Vec::new(), last: vec![None; levels.len()] };
    let tree = files.node(members);
    let index = Index {
        version: 1,
        levels: levels.len(),
        generator: json!({ "generator": concat!("splatkit ", env!("CARGO_PKG_VERSION")) }),
        count,
        counts,
        names: files.files.iter().map(Chunk::name).collect(),
        tree,
    };
    let text = serde_json::to_vec(&index).map_err(|error| Error::output(path, error.into()))?;
    let before = folders_of(path);
    let mut written = Written(Vec::new());
    files.write(path, &mut written)?;
    disk::write(path, &text)?;
    written.0.clear();
    let is_old = |name: &&String| !files.files.iter().any(|chunk| chunk.folder() == **name);
    before.iter().filter(is_old).for_each(|name| remove(&disk::folder(path).join(name)));
    Ok(())
}

/// Most bytes of an index whose folders are removed when it is replaced.
const MOST_INDEX: u64 = 1 << 26;

/// Returns the folders of Gaussians beside an index that is there, by their names.
fn folders_of(index: &Path) -> Vec<String> {
    let is_short = fs::metadata(index).is_ok_and(|meta| meta.len() <= MOST_INDEX);
    let text = is_short.then(|| fs::read_to_string(index).ok()).flatten().unwrap_or_default();
    let value: Value = serde_json::from_str(&text).unwrap_or_default();
    let names = value["filenames"].as_array().into_iter().flatten().filter_map(Value::as_str);
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    // Names as they are written here, which lead nowhere else.
    let of_level = |folder: &&str| {
        folder.split_once('_').is_some_and(|(level, number)| is_number(level) && is_number(number))
    };
    let folders = names.filter_map(|name| name.strip_suffix(META)?.strip_suffix('/'));
    folders.filter(of_level).map(str::to_owned).collect()
}

/// Removes a folder of Gaussians, unless other files are there.
fn remove(folder: &Path) {
    let is_plain = folder.symlink_metadata().is_ok_and(|meta| meta.is_dir());
    let Some(entries) = is_plain.then(|| fs::read_dir(folder).ok()).flatten() else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let is_plane = path.extension().is_some_and(|extension| extension == "webp");
        if is_plane || path.file_name().is_some_and(|name| name == META) {
            let _ = fs::remove_file(path);
        }
    }
    let _ = fs::remove_dir(folder);
}

/// What an index says. The number of levels, by which it is known, comes early.
#[derive(Serialize)]
struct Index {
    version: u64,
    #[serde(rename = "lodLevels")]
    levels: usize,
    #[serde(rename = "asset")]
    generator: Value,
    count: usize,
    counts: Vec<usize>,
    #[serde(rename = "filenames")]
    names: Vec<String>,
    tree: Value,
}

/// The Gaussians of a file, in its order.
struct Chunk {
    level: usize,
    /// The number of files of the level before it.
    number: usize,
    indices: Vec<u32>,
}

impl Chunk {
    fn name(&self) -> String {
        format!("{}/{META}", self.folder())
    }

    fn folder(&self) -> String {
        format!("{}_{}", self.level, self.number)
    }
}

/// The files of all levels.
struct Files<'a> {
    levels: &'a [Gaussians],
    files: Vec<Chunk>,
    /// The last file of each level.
    last: Vec<Option<usize>>,
}

impl Files<'_> {
    /// Returns the node of a box, and adds its Gaussians to files.
    fn node(&mut self, members: Members) -> Value {
        match self.halves(members) {
            Ok(halves) => {
                let [a, b] = halves.map(|half| self.node(half));
                let bound = |end: &str, choose: fn(f64, f64) -> f64| -> Vec<f64> {
                    let [a, b] = [&a, &b].map(|node| coordinates(&node["bound"][end]));
                    (0..3).map(|axis| choose(a[axis], b[axis])).collect()
                };
                let bound = json!({ "min": bound("min", f64::min), "max": bound("max", f64::max) });
                json!({ "bound": bound, "children": [a, b] })
            }
            Err(members) => self.leaf(&members),
        }
    }

    /// Divides a box in the middle of the finest level's Gaussians, along their longest axis.
    /// Returns it as it is if it is a leaf.
    fn halves(&self, members: Members) -> std::result::Result<[Members; 2], Members> {
        if members[0].len() <= LEAF {
            return Err(members);
        }
        let places = || members[0].iter().map(|&index| place(&self.levels[0], index as usize));
        let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let [low, high] = places().fold(none, |[low, high], at| [low.min(at), high.max(at)]);
        let axis = (high - low).max_position();
        let mut along: Vec<f64> = places().map(|at| at[axis]).collect();
        let middle = along.len() / 2;
        let (_, &mut plane, _) = along.select_nth_unstable_by(middle, f64::total_cmp);
        // All in one plane cannot be divided, and neither can those at one place.
        let plane = if plane > low[axis] { plane } else { plane.next_up() };
        if plane > high[axis] {
            return Err(members);
        }
        let is_before = |level: &Gaussians, index: u32| place(level, index as usize)[axis] < plane;
        let halves = members.into_iter().zip(self.levels);
        let halves = halves.map(|(members, level)| {
            members.into_iter().partition(|&index| is_before(level, index))
        });
        let (a, b) = halves.unzip();
        Ok([a, b])
    }

    /// Adds the Gaussians of a leaf to files, and returns it.
    fn leaf(&mut self, members: &Members) -> Value {
        let mut bound = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let mut lods = serde_json::Map::new();
        for (number, members) in members.iter().enumerate().filter(|(_, m)| !m.is_empty()) {
            let level = &self.levels[number];
            for &index in members {
                let axes = level.axes(index as usize);
                let reach = DVec3::from_array([0, 1, 2].map(|row| axes.row(row).length().into()));
                let at = place(level, index as usize);
                bound = [bound[0].min(at - reach), bound[1].max(at + reach)];
            }
            let file = self.room(number, members.len());
            let indices = &mut self.files[file].indices;
            let range = json!({ "file": file, "offset": indices.len(), "count": members.len() });
            indices.extend(members);
            lods.insert(number.to_string(), range);
        }
        let [low, high] = bound.map(|corner| corner.to_array());
        json!({ "bound": { "min": low, "max": high }, "lods": lods })
    }

    /// Returns a file of a level with room for so many Gaussians, or an empty one.
    fn room(&mut self, level: usize, count: usize) -> usize {
        let last = self.last[level];
        if let Some(last) = last.filter(|&last| self.files[last].indices.len() + count <= FILE) {
            return last;
        }
        let number = last.map_or(0, |last| self.files[last].number + 1);
        self.files.push(Chunk { level, number, indices: Vec::new() });
        self.last[level] = Some(self.files.len() - 1);
        self.files.len() - 1
    }

    /// Writes all files into folders beside the index.
    fn write(&self, index: &Path, written: &mut Written) -> Result<()> {
        let may_replace = disk::is_replaceable(index);
        for chunk in &self.files {
            let folder = disk::folder(index).join(chunk.folder());
            let is_new = !folder.exists();
            fs::create_dir_all(&folder).map_err(|error| Error::output(&folder, error))?;
            if is_new {
                written.0.push(folder.clone());
            }
            let set = self.levels[chunk.level].chosen(&chunk.indices);
            let order: Vec<usize> = (0..set.len()).collect();
            let (meta, planes): (Vec<u8>, Vec<Named>) = pack(&set, Size::of(set.len())?, &order);
            let path = folder.join(META);
            if !may_replace && path.symlink_metadata().is_ok() {
                let message = "exists already, but a level is written there; give another folder";
                return Err(Error::output(&path, std::io::Error::other(message)));
            }
            disk::may_replace(&path, may_replace);
            write_beside(&path, &meta, &planes)?;
        }
        Ok(())
    }
}

/// Folders that were made, and vanish again unless all is written.
struct Written(Vec<PathBuf>);

impl Drop for Written {
    fn drop(&mut self) {
        for folder in &self.0 {
            // What cannot be removed stays; the error that is on its way says more.
            let _ = fs::remove_dir_all(folder);
        }
    }
}

/// Returns the coordinates of a corner.
fn coordinates(corner: &Value) -> [f64; 3] {
    [0, 1, 2].map(|axis| corner[axis].as_f64().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        formats::sog::{INDEX, read},
        input::testing::*,
    };
    use glam::{Quat, Vec3};

    /// Gaussians on a square of this width, so many along each edge. Their opacities tell the
    /// levels apart.
    fn square(edge: usize, opacity: f32) -> Gaussians {
        let step = 100.0 / edge as f32;
        let at = |i: usize| Vec3::new((i % edge) as f32 * step, (i / edge) as f32 * step, 0.0);
        let count = edge * edge;
        Gaussians {
            origin: DVec3::new(10.0, 0.0, -4.0),
            centers: (0..count).map(at).collect(),
            scales: vec![Vec3::new(0.5 * step, 0.25 * step, 0.01); count],
            rotations: vec![Quat::IDENTITY; count],
            opacities: vec![opacity; count],
            degree: 0,
            harmonics: vec![[0.5; 3]; count],
            ..Gaussians::default()
        }
    }

    /// Visits all leaves, with the corners of their boxes and those of the nodes above.
    fn leaves<'a>(
        node: &'a Value,
        above: Vec<&'a Value>,
        all: &mut Vec<(Vec<&'a Value>, &'a Value)>,
    ) {
        let bounds = above.into_iter().chain([&node["bound"]]).collect::<Vec<_>>();
        match node["children"].as_array() {
            Some(children) => children.iter().for_each(|child| leaves(child, bounds.clone(), all)),
            None => all.push((bounds, &node["lods"])),
        }
    }

    #[test]
    fn leaves_have_all_gaussians_of_each_level() {
        let folder = Folder::new();
        let path = folder.path(INDEX);
        let levels = [square(400, 1.0), square(200, 0.6), square(20, 0.2)];
        write(&levels, &path).unwrap();
        let index: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(index["counts"], json!([160_000, 40_000, 400]));
        // More than one file of the finest level, and one of the others.
        assert_eq!(index["filenames"].as_array().unwrap().len(), 4);
        let names = index["filenames"].as_array().unwrap().iter();
        let files: Vec<Gaussians> = names
            .map(|name| read_with(&folder.path(name.as_str().unwrap()), read).unwrap())
            .collect();
        let mut all = Vec::new();
        leaves(&index["tree"], Vec::new(), &mut all);
        assert!(all.len() >= 16);
        let mut counts = [0; 3];
        for (bounds, lods) in all {
            for (level, range) in lods.as_object().unwrap() {
                let [file, first, count] =
                    ["file", "offset", "count"].map(|key| range[key].as_u64().unwrap() as usize);
                let level: usize = level.parse().unwrap();
                counts[level] += count;
                assert!(level > 0 || count <= LEAF);
                let opacity = levels[level].opacities[0];
                for index in first..first + count {
                    let set = &files[file];
                    assert!((set.opacities[index] - opacity).abs() < 0.01);
                    let at = place(set, index);
                    for bound in &bounds {
                        let [low, high] = ["min", "max"].map(|end| coordinates(&bound[end]));
                        let is_in = |axis: usize| {
                            low[axis] <= at[axis] + 1e-3 && at[axis] <= high[axis] + 1e-3
                        };
                        assert!((0..3).all(is_in), "{at} {bound}");
                    }
                }
            }
        }
        assert_eq!(counts, [160_000, 40_000, 400]);
        let finest = read_with(&path, read).unwrap();
        assert_eq!((finest.len(), finest.validate()), (160_000, Ok(())));
    }

    #[test]
    fn gaussians_at_one_place_are_one_leaf() {
        let folder = Folder::new();
        let path = folder.path(INDEX);
        let mut set = square(200, 1.0);
        set.centers.fill(Vec3::ONE);
        write(&[set], &path).unwrap();
        let index: Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        assert_eq!(index["tree"]["lods"]["0"]["count"], 40_000);
        assert_eq!(read_with(&path, read).unwrap().len(), 40_000);
    }

    #[test]
    fn a_replaced_scene_leaves_no_levels() {
        let folder = Folder::new();
        let path = folder.path(INDEX);
        write(&[square(30, 1.0), square(20, 0.6), square(10, 0.2)], &path).unwrap();
        // Files of others stay.
        let put = |name: &str| {
            let file = folder.path(name);
            fs::create_dir_all(disk::folder(&file)).unwrap();
            fs::write(file, "mine").unwrap();
        };
        ["1_0/notes.txt", "3_0/meta.json", "mine/meta.json"].into_iter().for_each(put);
        write(&[square(3, 1.0)], &path).unwrap();
        assert!(folder.path("0_0/meta.json").exists() && !folder.path("2_0").exists());
        let left: Vec<_> = fs::read_dir(folder.path("1_0")).unwrap().flatten().collect();
        assert_eq!(left.len(), 1);
        assert!(folder.path("1_0/notes.txt").exists() && folder.path("3_0/meta.json").exists());
        assert_eq!(read_with(&path, read).unwrap().len(), 9);
        // An index that leads elsewhere removes nothing there.
        let names = json!({ "filenames": ["mine/meta.json", "../0_0/meta.json", "0_0/x.json", 3] });
        folder.write(INDEX, names.to_string());
        assert_eq!(folders_of(&path), [""; 0]);
        write(&[square(3, 1.0)], &path).unwrap();
        assert!(folder.path("mine/meta.json").exists());
    }

    #[test]
    fn what_cannot_be_written_leaves_nothing() {
        let folder = Folder::new();
        let path = folder.path(INDEX);
        let error = write(&[square(3, 1.0), Gaussians::default()], &path).unwrap_err();
        assert!(error.to_string().contains("no Gaussians to write"), "{error}");
        // The second level's folder is a file.
        folder.write("1_0", "mine");
        let levels = [square(3, 1.0), square(2, 1.0)];
        assert!(matches!(write(&levels, &path).unwrap_err(), Error::Output { .. }));
        assert!(!path.exists() && !folder.path("0_0").exists());
        // Nothing is replaced unless it may be.
        fs::remove_file(folder.path("1_0")).unwrap();
        write(&levels, &path).unwrap();
        fs::remove_file(&path).unwrap();
        disk::may_replace(&path, false);
        let error = write(&levels, &path).unwrap_err().to_string();
        assert!(error.contains("exists already"), "{error}");
        assert!(folder.path("0_0/meta.json").exists() && !path.exists());
        disk::may_replace(&path, true);
        write(&levels, &path).unwrap();
    }
}
