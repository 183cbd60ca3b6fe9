//! Builds an input region by region: its surfels, blocks of them, and the blocks in the file.

use super::{
    super::{
        Block,
        build::{WORK, block_of, check_splats},
        partition,
        sphere::Sphere,
    },
    ExternalOptions, OF_POINT, Shape, Stage, StageWatch,
    distribute::{Distributed, distribute},
    made::PartWriter,
    survey::{Surveyed, Triangulated},
    tell,
};
use crate::{
    Deadline, Error, Result,
    formats::StreamPoint,
    memory,
    parallel::{self, prelude::*},
    splat::{Splat, Surfels},
    surface::{EXTENT, Known, Mesh, SurfelOptions, cloud_piece},
};
use glam::{DVec3, Vec3};
use std::{io::Write, ops::Range, path::Path};

/// How far the surfels of a point cloud are assumed to reach, as a fraction of the core's radius.
/// If one reaches farther, its block's sphere sticks out, and the spheres above grow with it.
const CLOUD_REACH: f64 = 0.01;

/// The regions of a part while they are built.
pub struct Work<'a, W: Write> {
    pub part: PartWriter<W>,
    pub shape: &'a Shape,
    pub options: &'a ExternalOptions,
    /// The points of the part's regions, and those built so far.
    pub points: u64,
    pub built: u64,
    pub watch: StageWatch<'a>,
    /// Seconds that a region may take, and the deadline of the current one.
    pub seconds: u64,
    pub deadline: Deadline,
}

impl Surveyed<'_> {
    /// Returns a sphere around all footprints, relative to `origin`.
    pub fn around(&self, origin: DVec3, options: &ExternalOptions) -> Sphere {
        let scale = f64::from(options.surfels.radius_scale);
        let Sphere { center, radius } = self.facts.around;
        let reach = match &self.facts.mesh {
            Some(mesh) => f64::from(EXTENT * mesh.longest) * scale,
            None => radius * CLOUD_REACH * scale,
        };
        let center = center + (self.stream.origin() - origin);
        Sphere { center, radius: (radius + reach) * (1.0 + 1e-6) }
    }
}

impl<W: Write> Work<'_, W> {
    /// Builds the `wanted` regions of an input, with temporary files beside `path`.
    pub fn input(&mut self, input: &Surveyed, wanted: Range<u32>, path: &Path) -> Result<()> {
        let limits = [self.shape.most, self.options.memory];
        let mut shares = distribute(input, &wanted, limits, path, self.watch)?;
        tell(self.watch, Stage::Building, self.built, self.points);
        for region in wanted.clone() {
            self.deadline = Deadline::after(self.seconds);
            let surfels = SurfelOptions { deadline: self.deadline, ..self.options.surfels.clone() };
            let bin = region - wanted.start;
            memory::room(WORK, OF_POINT.saturating_mul(shares.points.count(bin) as u64))?;
            let piece = Piece::read(input, &mut shares, region, bin)?;
            let splats = match &input.facts.mesh {
                Some(mesh) => {
                    let whole = input.stream.counts().triangles as usize;
                    let is_long = Some(region) == input.long_region();
                    let most = is_long.then(|| surfels.most_once_cut(whole));
                    piece.of_mesh(mesh, most, &surfels)?
                }
                None => piece.of_cloud(input, &surfels)?,
            };
            let owned = piece.owned.iter().filter(|owned| **owned).count() as u64;
            drop(piece);
            let stream = &input.stream;
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
        let mut set = Surfels { origin, splats, extent: EXTENT };
        set.move_origin(self.shape.origin)?;
        check_splats(&set)?;
        let parts = partition::blocks(&set.splats, self.options.block_splats.max(64));
        for parts in parts.chunks(2 * parallel::current_num_threads()) {
            let block = |part: &Vec<u32>| {
                self.deadline.check(WORK)?;
                Ok(block_of(&set, part, self.options.preset, self.shape.outer))
            };
            let blocks: Result<Vec<Block>> = parts.par_iter().map(block).collect();
            self.part.add(&blocks?)?;
        }
        self.part.made.bounds = self.part.made.bounds.union(set.bounds());
        self.part.made.splats += set.splats.len() as u64;
        Ok(())
    }
}

/// A region as a separate mesh.
struct Piece {
    mesh: Mesh,
    /// The index of each point in the input, ascending.
    indices: Vec<u32>,
    /// Whether the region owns each point.
    owned: Vec<bool>,
}

impl Piece {
    fn read(input: &Surveyed, shares: &mut Distributed, region: u32, bin: u32) -> Result<Self> {
        let mut points: Vec<StreamPoint> = shares.points.read(bin)?;
        points.par_sort_by_key(|point| point.index);
        points.dedup_by_key(|point| point.index);
        let owner = |point: &StreamPoint| input.owner(Vec3::from(point.position)) == region;
        let owned = points.par_iter().map(owner).collect();
        let indices: Vec<u32> = points.par_iter().map(|point| point.index).collect();
        let stream = &input.stream;
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
        if let Some(triangles) = &mut shares.triangles {
            mesh.triangles = triangles.read(bin)?;
            let place = |index: u32| indices.binary_search(&index).unwrap_or(0) as u32;
            mesh.triangles.par_iter_mut().for_each(|triangle| *triangle = triangle.map(place));
        }
        Ok(Self { mesh, indices, owned })
    }

    fn of_mesh(
        &self,
        mesh: &Triangulated,
        most: Option<usize>,
        options: &SurfelOptions,
    ) -> Result<Vec<Splat>> {
        if self.mesh.triangles.is_empty() {
            return Ok(Vec::new());
        }
        mesh.pieces.surfels(&self.mesh, &self.owned, most, options)
    }

    fn of_cloud(&self, input: &Surveyed, options: &SurfelOptions) -> Result<Vec<Splat>> {
        let known = Known {
            spacing: Some(input.regions.ranges().spacing),
            center: Some(input.facts.center),
            normals: input.guide.of_points(&self.indices),
        };
        let splats = cloud_piece(&self.mesh, &self.owned, known, options)?;
        Ok(splats.into_iter().map(|(_, splat)| splat).collect())
    }
}
