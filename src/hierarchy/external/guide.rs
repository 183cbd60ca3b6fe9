//! Which side of a point cloud is outside, decided once for all regions.
//!
//! The normals of a cloud are oriented along the neighbours of points, and a region knows only
//! those nearby. So a sample of the whole cloud is oriented first, as a small cloud of its own.
//! Each region then orients its points as if they were alone. It turns every connected part as most
//! of the sample's points in it are turned. No region needs the result of another.

use crate::{
    Deadline, Result,
    splat::{NO_NORMAL, decode_normal},
    surface::{Known, Mesh, SurfelOptions, cloud_piece},
};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// The number of points in a sample, about. Tests have smaller clouds.
const POINTS: u64 = if cfg!(test) { 1 << 11 } else { 1 << 18 };

/// A choice among the points of a cloud that depends on their indices only.
pub struct Sample {
    /// Those are taken whose mixed index is below this.
    below: u64,
}

/// A point and its normal, packed.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct Side {
    pub point: u32,
    normal: u32,
}

/// Oriented normals of a sample, by ascending index of the point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Guide(pub Vec<Side>);

impl Sample {
    /// Chooses among this many points.
    pub fn of(points: u64) -> Self {
        Self { below: ((POINTS << 32) / points.max(1)).min(if points > 0 { 1 << 32 } else { 0 }) }
    }

    /// Returns whether a point is chosen. Scanners write points row by row, so that every n-th of
    /// them could be one column.
    pub fn takes(&self, point: u32) -> bool {
        let mut mixed = point.wrapping_add(0x9e37_79b9);
        mixed = (mixed ^ mixed >> 16).wrapping_mul(0x85eb_ca6b);
        mixed = (mixed ^ mixed >> 13).wrapping_mul(0xc2b2_ae35);
        u64::from(mixed ^ mixed >> 16) < self.below
    }
}

impl Guide {
    /// Orients a sample of a cloud around a centre.
    ///
    /// # Errors
    /// Those of [`Mesh::surfels`].
    pub fn of(sample: &[(u32, Vec3)], center: DVec3, options: &SurfelOptions) -> Result<Self> {
        let mesh =
            Mesh { positions: sample.iter().map(|(_, place)| *place).collect(), ..Mesh::default() };
        let known = Known { spacing: None, center: Some(center), normals: Vec::new() };
        let owned = vec![true; sample.len()];
        // It takes about a second, however long reading took.
        let options = SurfelOptions { deadline: Deadline::NEVER, ..options.clone() };
        let splats = cloud_piece(&mesh, &owned, known, &options)?;
        let side = |(at, normal): (u32, u32)| Side { point: sample[at as usize].0, normal };
        let mut sides: Vec<Side> = splats
            .into_iter()
            .map(|(at, splat)| (at, splat.normal))
            .filter(|(_, normal)| *normal != NO_NORMAL)
            .map(side)
            .collect();
        sides.sort_unstable_by_key(|side| side.point);
        Ok(Self(sides))
    }

    /// Returns the normals of those of a region's points that are in the sample, by their places in
    /// `indices`, which ascend.
    pub fn of_points(&self, indices: &[u32]) -> Vec<(u32, Vec3)> {
        let known = |side: &Side| {
            let place = indices.binary_search(&side.point).ok()?;
            Some((place as u32, decode_normal(side.normal)?))
        };
        self.0.iter().filter_map(known).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ExternalOptions, convert};
    use crate::{
        formats::ply,
        hierarchy::{Hierarchy, Preset, file::WriteOptions},
        input::{Limits, testing::Folder},
        splat::{Splat, decode_normal},
        surface::{Mesh, SurfelOptions},
    };
    use std::collections::HashMap;

    /// A sample of a 35th decides the sides of a bent and bumpy tube in 72 regions. All but a few
    /// points face as they do if the cloud is oriented as a whole.
    #[test]
    fn regions_agree_on_the_outside() {
        let folder = Folder::new();
        let mut cloud = Mesh::knot(900, 80);
        cloud.triangles.clear();
        cloud.normals.clear();
        cloud.colors.clear();
        let path = folder.path("cloud.ply");
        ply::write(&cloud, &path).unwrap();
        let out = folder.path("out.splk");
        let options = ExternalOptions {
            memory: 1,
            preset: Preset::Fastest,
            block_splats: 1 << 9,
            ..ExternalOptions::default()
        };
        let write = WriteOptions { lossless: true, ..WriteOptions::default() };
        let done = convert(&[path], &Limits::default(), &out, &options, &write, None).unwrap();
        assert!(done.regions > 60, "{}", done.regions);
        let parts = Hierarchy::open(&out, &Limits::default()).unwrap().leaves().unwrap().splats;
        let whole = cloud.surfels(&SurfelOptions::default()).unwrap().splats;
        let name = |splat: &Splat| splat.center.map(f32::to_bits);
        let whole: HashMap<_, _> = whole.iter().map(|splat| (name(splat), splat.normal)).collect();
        let faces_away = |splat: &&Splat| {
            let normals = decode_normal(splat.normal).zip(decode_normal(whole[&name(splat)]));
            normals.is_none_or(|(one, other)| one.dot(other) < 0.0)
        };
        let away = parts.iter().filter(faces_away).count();
        println!("{away} of {} face away", parts.len());
        assert!(parts.len() == whole.len() && away <= parts.len() / 500, "{away} face away");
    }
}
