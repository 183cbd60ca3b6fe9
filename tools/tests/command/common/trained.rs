//! A scene of trained Gaussians, its files, and how far two scenes are apart.

use super::Folder;
use glam::{DVec3, Quat, Vec3};
use image_webp::{ColorType, WebPEncoder};
use serde_json::{Value, json};
use splatkit::{
    compare::compare_files,
    formats::{self, ReadOptions},
    gaussians::{Gaussians, harmonics::terms},
    input::Limits,
};
use std::{array, collections::BTreeSet, f32::consts::PI, f64::consts::SQRT_2, fs, path::Path};

/// Gaussians along each side of the scene.
const SIDE: usize = 7;

/// The number of Gaussians.
pub const COUNT: usize = SIDE * SIDE * SIDE;

/// The logarithms of deviations lie between these, constant terms and the others within these.
const LOGS: [f32; 2] = [-4.0, -1.5];
const CONSTANT: f32 = 1.7;
const REST: f32 = 0.3;

/// Numbers without a pattern.
struct Random(u64);

impl Random {
    fn within(&mut self, low: f32, high: f32) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        low + (high - low) * (self.0 >> 40) as f32 / (1 << 24) as f32
    }
}

/// Gaussians of every shape and turn near the places of a grid, with colours of this degree.
pub fn scene(degree: u32) -> Gaussians {
    const SPACING: f32 = 0.5;
    let mut random = Random(7);
    let mut set = Gaussians { degree, ..Gaussians::default() };
    for index in 0..COUNT {
        let cell = [index % SIDE, index / SIDE % SIDE, index / SIDE / SIDE];
        let mut place = |at: usize| SPACING * (at as f32 - 3.0 + random.within(-0.25, 0.25));
        set.centers.push(Vec3::from(cell.map(&mut place)));
        let [low, high] = LOGS;
        let scale: [f32; 3] = array::from_fn(|_| random.within(low, high).exp());
        set.scales.push(Vec3::from(scale));
        let turn: [f32; 4] = array::from_fn(|_| random.within(-1.0, 1.0));
        set.rotations.push(Quat::from_array(turn).normalize());
        set.opacities.push(random.within(0.02, 0.98));
        for term in 0..terms(degree) {
            let most = if term == 0 { CONSTANT } else { REST };
            set.harmonics.push(array::from_fn(|_| random.within(-most, most)));
        }
    }
    set
}

fn place(set: &Gaussians, index: usize) -> DVec3 {
    set.origin + set.centers[index].as_dvec3()
}

/// Whether the terms change their sign where x, y or z does.
const ODD: [[bool; 3]; 16] = {
    let [none, x, y, z] =
        [[false; 3], [true, false, false], [false, true, false], [false, false, true]];
    let [xy, yz, xz, xyz] =
        [[true, true, false], [false, true, true], [true, false, true], [true; 3]];
    [none, y, z, x, xy, yz, none, xz, none, y, xyz, y, z, x, z, x]
};

/// Turns a scene by 180° about x, y or z.
pub fn half_turn(mut set: Gaussians, axis: usize) -> Gaussians {
    let sign = |at: usize| if at == axis { 1.0 } else { -1.0 };
    let signs = Vec3::new(sign(0), sign(1), sign(2));
    set.origin *= signs.as_dvec3();
    set.centers.iter_mut().for_each(|center| *center *= signs);
    let turn = Quat::from_axis_angle([Vec3::X, Vec3::Y, Vec3::Z][axis], PI);
    set.rotations.iter_mut().for_each(|rotation| *rotation = turn * *rotation);
    for harmonics in set.harmonics.chunks_exact_mut(terms(set.degree)) {
        for (term, odd) in harmonics.iter_mut().zip(ODD) {
            let is_turned = (0..3).filter(|at| *at != axis && odd[*at]).count() == 1;
            *term = term.map(|part| if is_turned { -part } else { part });
        }
    }
    set
}

/// The largest differences between the Gaussians of two scenes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Apart {
    /// Of centres, in world units.
    pub center: f64,
    /// Of the logarithms of deviations.
    pub scale: f64,
    /// Of quaternions.
    pub turn: f64,
    pub opacity: f64,
    /// Of the constant terms of colours.
    pub constant: f64,
    /// Of the other terms that both scenes have.
    pub rest: f64,
}

impl Apart {
    /// What 32-bit numbers and their logarithms keep.
    pub const EXACT: Self =
        Self { center: 1e-5, scale: 1e-5, turn: 1e-5, opacity: 1e-5, constant: 1e-5, rest: 1e-5 };

    /// Measures each Gaussian of a scene beside the nearest one that was found.
    pub fn of(actual: &Gaussians, wanted: &Gaussians) -> Self {
        assert_eq!((actual.len(), actual.validate()), (wanted.len(), Ok(())));
        let mut apart = Self::default();
        let mut met = BTreeSet::new();
        for index in 0..wanted.len() {
            let away = |other: usize| place(actual, other).distance(place(wanted, index));
            let nearest = (0..actual.len()).min_by(|a, b| away(*a).total_cmp(&away(*b)));
            let nearest = nearest.expect("a Gaussian");
            assert!(met.insert(nearest), "two Gaussians are nearest to number {nearest}");
            apart.widen((actual, nearest), (wanted, index));
        }
        apart
    }

    /// Adds the differences of two Gaussians.
    fn widen(&mut self, (a, i): (&Gaussians, usize), (b, j): (&Gaussians, usize)) {
        let widen = |most: &mut f64, miss: f64| *most = most.max(miss);
        widen(&mut self.center, place(a, i).distance(place(b, j)));
        let ratio = a.scales[i].as_dvec3() / b.scales[j].as_dvec3();
        ratio.to_array().iter().for_each(|ratio| widen(&mut self.scale, ratio.ln().abs()));
        // Both signs of a quaternion are the same turn.
        let [p, q] = [a.rotations[i], b.rotations[j]].map(|turn| turn.as_dquat().normalize());
        widen(&mut self.turn, (p - q).length().min((p + q).length()));
        widen(&mut self.opacity, f64::from((a.opacities[i] - b.opacities[j]).abs()));
        let pairs = a.harmonics_of(i).iter().zip(b.harmonics_of(j));
        for (term, (a, b)) in pairs.enumerate() {
            let miss = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            widen(if term == 0 { &mut self.constant } else { &mut self.rest }, miss.into());
        }
    }

    /// Asserts that nothing is further apart than this.
    pub fn within(&self, most: &Self, what: &str) {
        for (name, distance, most) in [
            ("centres", self.center, most.center),
            ("deviations", self.scale, most.scale),
            ("turns", self.turn, most.turn),
            ("opacities", self.opacity, most.opacity),
            ("constant terms", self.constant, most.constant),
            ("other terms", self.rest, most.rest),
        ] {
            assert!(distance <= most, "{what}: {name} are {distance} apart, more than {most}");
        }
    }
}

/// The formats that are written: the extension, the highest degree, and half a step of each number,
/// with a little more.
pub const WRITTEN: [(&str, u32, Apart); 6] = [
    ("ply", 3, Apart::EXACT),
    (
        "compressed.ply",
        3,
        Apart {
            center: 0.0022,
            scale: 0.0014,
            turn: 0.003,
            opacity: 0.002,
            constant: 0.007,
            rest: 0.0158,
        },
    ),
    ("splat", 0, Apart { turn: 0.012, opacity: 0.002, constant: 0.007, ..Apart::EXACT }),
    (
        "spz",
        3,
        Apart {
            center: 0.00025,
            scale: 0.0315,
            turn: 0.003,
            opacity: 0.002,
            constant: 0.0132,
            rest: 0.004,
        },
    ),
    ("sog", 3, Apart { scale: 0.025, constant: 0.014, rest: 0.003, ..OF_SOG }),
    ("glb", 3, Apart::EXACT),
];

/// Half a step of [`sog`]. Codebooks that are made for a scene have some larger steps.
pub const OF_SOG: Apart = Apart {
    center: 0.0001,
    scale: 0.005,
    turn: 0.012,
    opacity: 0.002,
    constant: 0.007,
    rest: 0.0013,
};

/// Writes a scene in one of the formats of [`WRITTEN`].
pub fn write(set: &Gaussians, extension: &str, path: &Path) {
    let written = match extension {
        "ply" => formats::ply::write_gaussians(set, path),
        "compressed.ply" => formats::ply::write_compressed_gaussians(set, path),
        "splat" => formats::splat::write(set, path),
        "spz" => formats::spz::write(set, path),
        "sog" => formats::sog::write(set, path),
        _ => formats::gltf::write_gaussians(set, path),
    };
    written.expect(extension);
}

/// Reads a scene.
pub fn load(folder: &Folder, name: &str) -> Gaussians {
    let (limits, options) = (Limits::default(), ReadOptions::default());
    formats::load_gaussians(folder.path(name), &limits, &options).expect(name)
}

/// Returns how alike two pictures are, in dB.
pub fn psnr(folder: &Folder, a: &str, b: &str) -> f64 {
    let comparison = compare_files(&folder.path(a), &folder.path(b), &Limits::default());
    comparison.expect("pictures of one size").psnr.unwrap_or(f64::INFINITY)
}

/// A codebook of equal steps.
#[derive(Clone, Copy)]
struct Codebook([f32; 2]);

impl Codebook {
    fn list(self) -> Vec<f32> {
        let Self([low, high]) = self;
        (0..256).map(|byte| low + (high - low) * byte as f32 / 255.0).collect()
    }

    fn byte(self, value: f32) -> u8 {
        let Self([low, high]) = self;
        ((value - low) / (high - low) * 255.0).round() as u8
    }
}

/// Writes a scene as SOG, version 2: a text of this name, and planes beside it.
pub fn sog(folder: &Folder, name: &str, set: &Gaussians) {
    let path = folder.path(name);
    let means = positions(&path, set);
    let [scales, constants] = [LOGS, [-CONSTANT, CONSTANT]].map(Codebook);
    let of_scale = |scale: &Vec3| {
        let [x, y, z] = scale.to_array().map(|side| scales.byte(side.ln()));
        [x, y, z, 255]
    };
    plane(&path, "s.webp", WIDTH, set.scales.iter().map(of_scale).collect());
    plane(&path, "q.webp", WIDTH, set.rotations.iter().map(|turn| of_turn(*turn)).collect());
    let of_color = |index: usize| {
        let [r, g, b] = set.harmonics_of(index)[0].map(|term| constants.byte(term));
        [r, g, b, (set.opacities[index] * 255.0).round() as u8]
    };
    plane(&path, "c.webp", WIDTH, (0..set.len()).map(of_color).collect());
    let mut meta = json!({
        "version": 2,
        "count": set.len(),
        "means": means,
        "scales": {"codebook": scales.list(), "files": ["s.webp"]},
        "quats": {"files": ["q.webp"]},
        "sh0": {"codebook": constants.list(), "files": ["c.webp"]},
    });
    if set.degree > 0 {
        meta["shN"] = palette(&path, set);
    }
    fs::write(&path, meta.to_string()).expect("a file");
}

/// Texels in a row of most planes.
const WIDTH: usize = 20;

/// Writes a plane beside a file.
fn plane(path: &Path, name: &str, width: usize, mut texels: Vec<[u8; 4]>) {
    let height = texels.len().div_ceil(width);
    texels.resize(width * height, [0, 0, 0, 255]);
    let mut bytes = Vec::new();
    let encoder = WebPEncoder::new(&mut bytes);
    let (width, height) = (width as u32, height as u32);
    encoder.encode(texels.as_flattened(), width, height, ColorType::Rgba8).expect("a picture");
    fs::write(path.with_file_name(name), bytes).expect("a file");
}

/// Writes the planes of the centres: 16 bits of sign(x) · ln(1 + |x|).
fn positions(path: &Path, set: &Gaussians) -> Value {
    let log = |x: f64| x.abs().ln_1p().copysign(x);
    let logs: Vec<[f64; 3]> =
        (0..set.len()).map(|index| place(set, index).to_array().map(log)).collect();
    let ends: [[f64; 2]; 3] = array::from_fn(|axis| {
        let all = || logs.iter().map(|log| log[axis]);
        [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
    });
    for (half, name) in ["l.webp", "u.webp"].into_iter().enumerate() {
        let texel = |log: &[f64; 3]| {
            let byte = |axis: usize| {
                let [least, most] = ends[axis];
                let step = ((log[axis] - least) / (most - least) * 65535.0).round() as u16;
                step.to_le_bytes()[half]
            };
            [byte(0), byte(1), byte(2), 255]
        };
        plane(path, name, WIDTH, logs.iter().map(texel).collect());
    }
    json!({
        "mins": ends.map(|[least, _]| least),
        "maxs": ends.map(|[_, most]| most),
        "files": ["l.webp", "u.webp"],
    })
}

/// Writes the planes of the terms above the constant. Each Gaussian has its own entry.
fn palette(path: &Path, set: &Gaussians) -> Value {
    let codebook = Codebook([-REST, REST]);
    let of_term = |term: &[f32; 3]| {
        let [r, g, b] = term.map(|part| codebook.byte(part));
        [r, g, b, 255]
    };
    let entries = (0..set.len()).flat_map(|index| set.harmonics_of(index)[1..].iter());
    plane(path, "p.webp", 64 * (terms(set.degree) - 1), entries.map(of_term).collect());
    let label = |index: usize| {
        let [low, high] = (index as u16).to_le_bytes();
        [low, high, 0, 255]
    };
    plane(path, "n.webp", WIDTH, (0..set.len()).map(label).collect());
    let files = ["p.webp", "n.webp"];
    json!({
        "count": set.len(), "bands": set.degree, "codebook": codebook.list(), "files": files})
}

/// Returns the texel of a turn: three of w, x, y, z, without the largest, whose number follows.
fn of_turn(turn: Quat) -> [u8; 4] {
    let [x, y, z, w] = turn.to_array().map(f64::from);
    let parts = [w, x, y, z];
    let larger = |a: usize, b: usize| if parts[b].abs() > parts[a].abs() { b } else { a };
    let largest = (1..4).fold(0, larger);
    let byte = |part: usize| {
        let value = parts[part] * parts[largest].signum();
        ((value / SQRT_2 + 0.5) * 255.0).round() as u8
    };
    let mut others = (0..4).filter(|part| *part != largest).map(byte);
    let mut next = || others.next().expect("three parts");
    [next(), next(), next(), 252 + largest as u8]
}
