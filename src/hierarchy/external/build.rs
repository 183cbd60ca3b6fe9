//! Builds an input region by region: its surfels, blocks of them, and the blocks in the file.

use super::{
    super::{
        Block,
        build::{Builder, WORK, block_of, check_splats},
        partition,
        sphere::Sphere,
    },
    ExternalOptions, OF_POINT, Stage, StageWatch,
    bins::Bins,
    distribute::Distributed,
    survey::Triangulated,
    tell,
};
use crate::{
    Deadline, Error, Result,
    formats::StreamPoint,
    math::Bounds,
    memory,
    parallel::{self, prelude::*},
    splat::{Payload, Splat, SplatSet, decode_normal},
    surface::{EXTENT, Known, Mesh, SurfelOptions, cloud_piece},
};
use glam::{DVec3, Vec3};
use std::path::Path;

/// How far the surfels of a point cloud are assumed to reach, as a fraction of the core's radius.
/// If one reaches farther, its block's sphere sticks out, and the spheres above grow with it.
const CLOUD_REACH: f64 = 0.01;

/// The result of all inputs so far.
pub struct Work<'a> {
    pub builder: Builder,
    pub origin: DVec3,
    pub bounds: Bounds,
    pub options: &'a ExternalOptions,
    /// Points of all inputs.
    pub points: u64,
    /// Points in finished regions.
    pub built: u64,
    pub splats: u64,
    pub watch: StageWatch<'a>,
    /// Seconds that a region may take, and the deadline of the current one.
    pub seconds: u64,
    pub deadline: Deadline,
}

/// The index of a point, and the packed normal of its surfel.
type Side = [u32; 2];

impl Distributed<'_> {
    /// Returns a sphere around all footprints, relative to `origin`.
    pub fn around(&self, origin: DVec3, options: &ExternalOptions) -> Sphere {
        let scale = f64::from(options.surfels.radius_scale);
        let reach = match &self.input.mesh {
            Some(mesh) => f64::from(EXTENT * mesh.longest) * scale,
            None => self.input.core.radius * CLOUD_REACH * scale,
        };
        let center = self.input.core.center + (self.input.stream.origin() - origin);
        Sphere { center, radius: (self.radius + reach) * (1.0 + 1e-6) }
    }
}

impl Work<'_> {
    /// Builds all regions of an input.
    pub fn input(&mut self, mut input: Distributed, wanted: &Path) -> Result<()> {
        let regions = input.input.regions() as u32;
        let orients = input.input.mesh.is_none() && !input.input.stream.has_normals();
        let mut sides = match orients {
            true => Some(Bins::<Side>::beside(wanted, regions as usize, self.options.memory)?),
            false => None,
        };
        tell(self.watch, Stage::Building, self.built, self.points);
        for region in 0..regions {
            self.deadline = Deadline::after(self.seconds);
            let surfels = SurfelOptions { deadline: self.deadline, ..self.options.surfels.clone() };
            memory::room(WORK, OF_POINT.saturating_mul(input.points.count(region) as u64))?;
            let part = Part::read(&mut input, region)?;
            let splats = match &input.input.mesh {
                Some(mesh) => {
                    part.of_mesh(mesh, Some(region) == input.input.long_region(), &surfels)?
                }
                None => part.of_cloud(&input, sides.as_mut(), region, &surfels)?,
            };
            let owned = part.owned.iter().filter(|owned| **owned).count() as u64;
            drop(part);
            let stream = &input.input.stream;
            self.add(splats, stream.origin()).map_err(|error| match error {
                Error::Argument(message) => stream.error("content", message),
                other => other,
            })?;
            self.built += owned;
            tell(self.watch, Stage::Building, self.built, self.points);
        }
        Ok(())
    }

    /// Builds blocks of the splats, which are relative to the origin of their input.
    fn add(&mut self, splats: Vec<Splat>, origin: DVec3) -> Result<()> {
        if splats.is_empty() {
            return Ok(());
        }
        self.splats += splats.len() as u64;
        let mut set =
            SplatSet { origin, payload: Payload::Radiance, splats, extent: EXTENT, overlap: 1.0 };
        set.move_origin(self.origin)?;
        check_splats(&set)?;
        self.bounds = self.bounds.union(set.bounds());
        let parts = partition::blocks(&set.splats, self.options.block_splats.max(64));
        for parts in parts.chunks(2 * parallel::current_num_threads()) {
            let block = |part: &Vec<u32>| {
                self.deadline.check(WORK)?;
                Ok(block_of(&set, part, self.options.preset, self.builder.outer))
            };
            let blocks: Result<Vec<Block>> = parts.par_iter().map(block).collect();
            self.builder.add(blocks?)?;
        }
        Ok(())
    }
}

/// A region as a separate mesh.
struct Part {
    mesh: Mesh,
    /// The index of each point in the input, ascending.
    indices: Vec<u32>,
    /// Whether the region owns each point.
    owned: Vec<bool>,
}

impl Part {
    fn read(input: &mut Distributed, region: u32) -> Result<Self> {
        let mut points: Vec<StreamPoint> = input.points.read(region)?;
        points.par_sort_by_key(|point| point.index);
        points.dedup_by_key(|point| point.index);
        let owner = |point: &StreamPoint| input.input.owner(Vec3::from(point.position)) == region;
        let owned = points.par_iter().map(owner).collect();
        let indices: Vec<u32> = points.par_iter().map(|point| point.index).collect();
        let stream = &input.input.stream;
        let mut mesh = Mesh { origin: stream.origin(), ..Mesh::default() };
        mesh.positions = points.par_iter().map(|point| Vec3::from(point.position)).collect();
        if stream.has_normals() {
            mesh.normals = points.par_iter().map(|point| Vec3::from(point.normal)).collect();
        }
        if stream.has_colors() {
            mesh.colors = points.par_iter().map(|point| point.color).collect();
        }
        if let Some(scale) = stream.scale() {
            mesh.values = points.par_iter().map(StreamPoint::value).collect();
            mesh.scale = Some(scale);
        }
        drop(points);
        if let Some(triangles) = &mut input.triangles {
            mesh.triangles = triangles.read(region)?;
            let place = |index: u32| indices.binary_search(&index).unwrap_or(0) as u32;
            mesh.triangles.par_iter_mut().for_each(|triangle| *triangle = triangle.map(place));
        }
        Ok(Self { mesh, indices, owned })
    }

    fn of_mesh(
        &self,
        mesh: &Triangulated,
        is_long: bool,
        options: &SurfelOptions,
    ) -> Result<Vec<Splat>> {
        if self.mesh.triangles.is_empty() {
            return Ok(Vec::new());
        }
        mesh.pieces.surfels(&self.mesh, &self.owned, is_long, options)
    }

    /// Orients normals like those that other regions passed on, and passes on normals near other
    /// regions to those that come later.
    fn of_cloud(
        &self,
        input: &Distributed,
        sides: Option<&mut Bins<Side>>,
        region: u32,
        options: &SurfelOptions,
    ) -> Result<Vec<Splat>> {
        let spacing = Some(input.input.regions.spacing);
        let mut known = Known { spacing, center: Some(input.input.center), normals: Vec::new() };
        let Some(sides) = sides else {
            let splats = cloud_piece(&self.mesh, &self.owned, known, options)?;
            return Ok(splats.into_iter().map(|(_, splat)| splat).collect());
        };
        known.normals =
            sides.read(region)?.into_iter().filter_map(|side| self.known(side)).collect();
        let splats = cloud_piece(&self.mesh, &self.owned, known, options)?;
        let mut around = Vec::new();
        for (point, splat) in &splats {
            input.input.regions.around(Vec3::from(splat.center), &mut around);
            for &other in around.iter().filter(|&&other| other > region) {
                sides.push(other, [self.indices[*point as usize], splat.normal])?;
            }
        }
        Ok(splats.into_iter().map(|(_, splat)| splat).collect())
    }

    fn known(&self, [index, normal]: Side) -> Option<(u32, Vec3)> {
        let point = self.indices.binary_search(&index).ok()?;
        Some((point as u32, decode_normal(normal)?))
    }
}
