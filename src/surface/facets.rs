//! From meshes to facets: splats whose footprint is a triangle.

use super::{
    Mesh, SurfelOptions,
    adjacency::{Connected, is_split},
    bands::{Bands, Corner},
    paint::{corner_tint, of_normal, pack, texture_of},
    refine::{Cutting, Origin, Refined, refine},
    smooth::{Grouping, corner_normals},
    surfels::largest_edge,
};
use crate::{
    Result,
    facet::{Facet, FacetSet, Image, Sides, TextureCoordinates},
    memory,
    parallel::prelude::*,
    splat::encode_normal,
};
use glam::Vec3;
use std::{collections::HashMap, sync::Arc};

/// Facets may be this many times as long as the triangles that surfels are made of: the sheets that
/// a facet meets, not its outline, limit its size.
const LONGER: f32 = 3.0;

/// The name of this module's work in errors.
const WORK: &str = "making facets";

/// The normal at each corner of a mesh's triangles.
enum Normals<'a> {
    Own(Vec<[Vec3; 3]>),
    Interpolated(Origin<'a>),
}

/// The values that colour facets.
struct Banded<'a> {
    bands: &'a Bands,
    /// The value of each triangle; empty if values are those of vertices.
    of_triangles: Vec<f32>,
}

impl<'a> Banded<'a> {
    /// Takes the values of triangles, some of which are parts of these sources.
    fn new((bands, values): (&'a Bands, &[f32]), sources: Option<&[u32]>) -> Self {
        let of_triangles = match sources {
            Some(sources) if !values.is_empty() => {
                sources.iter().map(|source| values[*source as usize]).collect()
            }
            _ => values.to_vec(),
        };
        Self { bands, of_triangles }
    }

    /// Returns the values at the corners of a triangle.
    fn values(&self, mesh: &Mesh, number: usize) -> [f32; 3] {
        match self.of_triangles.get(number) {
            Some(value) => [*value; 3],
            None => mesh.triangles[number].map(|vertex| mesh.values[vertex as usize]),
        }
    }

    /// Adds the parts of a facet in the colours of the values at its corners.
    fn add(&self, facet: &Facet, values: [f32; 3], add: &mut impl FnMut(Facet)) {
        let normals = facet.decoded_normals();
        let corner = |at: usize| Corner {
            place: facet.corners[at].into(),
            normal: normals[at],
            value: values[at],
        };
        self.bands.add(&[corner(0), corner(1), corner(2)], add);
    }
}

impl Mesh {
    /// Makes facets of the triangles, which have their outlines exactly. Returns `None` for what
    /// surfels draw better: a point cloud, a mesh of more than
    /// [`most_facets`](SurfelOptions::most_facets) triangles, and one whose vertices or materials
    /// are not opaque. Lengths are in world units and corners are relative to the mesh's origin.
    /// The order depends on the input only.
    ///
    /// Colours are vertex colour × material, normals the file's, or those that
    /// [`surfels`](Self::surfels) have, interpolated over each triangle. Textures are images that
    /// the facets show, also where they are partly clear. Long triangles are cut. If the mesh is
    /// [solid](Self::is_solid), facets are turned outward.
    ///
    /// # Errors
    /// As [`surfels`](Self::surfels), except
    /// [`Error::NothingToDraw`](crate::Error::NothingToDraw): a mesh without area gives no facets.
    pub fn facets(&self, options: &SurfelOptions) -> Result<Option<FacetSet>> {
        self.facets_by(options, None)
    }

    /// Returns the length, in world units, from which on the edges of facets are cut.
    pub(crate) fn longest_facet(&self, options: &SurfelOptions) -> f32 {
        let Some(bounds) = self.local_bounds() else { return f32::INFINITY };
        largest_edge(bounds, self.area(), options) * LONGER
    }

    /// Like [`facets`](Self::facets). With `bands`, facets have the colours of the mesh's values,
    /// or of the values of its triangles, if there are any.
    ///
    /// # Errors
    /// Those of [`facets`](Self::facets).
    pub(crate) fn facets_by(
        &self,
        options: &SurfelOptions,
        bands: Option<(&Bands, &[f32])>,
    ) -> Result<Option<FacetSet>> {
        let _span = tracing::info_span!("facets").entered();
        self.check(options)?;
        let count = self.triangles.len();
        let is_opaque =
            || self.colors.par_iter().all(|color| color[3] == 255) && self.has_opaque_tints();
        if count == 0 || count > options.most_facets || !is_opaque() {
            return Ok(None);
        }
        let Some(bounds) = self.local_bounds() else { return Ok(None) };
        let largest = largest_edge(bounds, self.area(), options);
        self.check_extent(largest)?;
        let cutting = Cutting { length: largest * LONGER, to_texels: false };
        let Refined { mesh, sources } =
            refine(self, cutting, options.most_triangles, options.deadline)?;
        let crease = (options.crease_angle_degrees, Grouping::Whole);
        let banded = bands.map(|bands| Banded::new(bands, sources.as_deref()));
        let normals = match sources {
            Some(sources) => {
                Normals::Interpolated(Origin::new(self, sources, crease, options.deadline)?)
            }
            None => Normals::Own(corner_normals(self, crease, options.deadline)?),
        };
        let sides = self.sides()?;
        let is_turned = sides == Sides::Closed && self.is_inside_out();
        let traits = [is_turned, options.color_by_normal];
        memory::room(WORK, (size_of::<Facet>() * mesh.triangles.len()) as u64)?;
        let facets = |number: usize| {
            let facet = facet(&mesh, number, &normals, traits);
            let mut made = Vec::with_capacity(1);
            let mut add = |facet| made.push((number, facet));
            match (&banded, facet) {
                (Some(banded), Some(facet)) => {
                    let values = banded.values(&mesh, number);
                    banded.add(&facet, order(is_turned).map(|at| values[at]), &mut add);
                }
                (_, facet) => facet.into_iter().for_each(add),
            }
            made
        };
        let (numbers, facets): (Vec<usize>, Vec<Facet>) =
            (0..mesh.triangles.len()).into_par_iter().flat_map_iter(facets).unzip();
        options.deadline.check(WORK)?;
        let (images, mappings) = match options.color_by_normal {
            true => Default::default(),
            false => images(&mesh, &numbers, is_turned),
        };
        let (whole, rods) = (None, None);
        let set = FacetSet {
            origin: self.origin,
            facets,
            sides,
            images,
            texture_coordinates: mappings,
            whole,
            rods,
        };
        Ok((!set.facets.is_empty()).then_some(set))
    }

    /// Returns which sides of the mesh's triangles are seen.
    fn sides(&self) -> Result<Sides> {
        if self.is_solid() {
            return Ok(Sides::Closed);
        }
        let places = Connected::new(self, is_split(self))?.places;
        memory::room(WORK, 24 * self.triangles.len() as u64)?;
        // Where neighbours wind the same way, no edge is passed twice in the same direction.
        let mut edges: Vec<u64> = places
            .par_iter()
            .flat_map_iter(|&[a, b, c]| {
                [[a, b], [b, c], [c, a]].map(|[from, to]| u64::from(from) << 32 | u64::from(to))
            })
            .collect();
        edges.par_sort_unstable();
        let is_mixed = edges.par_windows(2).any(|pair| pair[0] == pair[1]);
        Ok(if is_mixed { Sides::Mixed } else { Sides::Oriented })
    }

    /// Whether the triangles of a closed mesh wind clockwise, seen from outside.
    fn is_inside_out(&self) -> bool {
        let volume = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| self.positions[vertex as usize].as_dvec3());
            a.cross(b).dot(c)
        };
        self.triangles.par_iter().with_min_len(1 << 12).map(volume).sum::<f64>() < 0.0
    }
}

/// Returns the facet of a triangle, turned and coloured by its normals as `traits` say; `None` if
/// the triangle has no area.
fn facet(
    mesh: &Mesh,
    number: usize,
    normals: &Normals,
    [is_turned, by_normal]: [bool; 2],
) -> Option<Facet> {
    let corners = mesh.triangles[number].map(|vertex| mesh.positions[vertex as usize]);
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    let has_area = (b - a).cross(c - a).length_squared() > 0.0;
    if !has_area {
        return None;
    }
    let normals = match normals {
        Normals::Own(normals) => normals[number],
        Normals::Interpolated(origin) => {
            [0, 1, 2].map(|corner| origin.normal(mesh, (3 * number + corner) as u32))
        }
    };
    let normals = normals.map(|normal| normal.normalize_or_zero());
    let colors = [0, 1, 2].map(|corner| {
        if by_normal {
            let outward = if is_turned { -normals[corner] } else { normals[corner] };
            let [red, green, blue, _] = pack(of_normal(encode_normal(outward))).to_le_bytes();
            return [red, green, blue];
        }
        let [red, green, blue, _] = corner_tint(mesh, number, corner);
        [red, green, blue].map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8)
    });
    let order = order(is_turned);
    let facet =
        Facet::new(order.map(|i| corners[i]), order.map(|i| normals[i]), order.map(|i| colors[i]));
    Some(if mesh.is_unlit(number) { facet.unlit() } else { facet })
}

/// Returns the order of a facet's corners among those of its triangle.
fn order(is_turned: bool) -> [usize; 3] {
    if is_turned { [0, 2, 1] } else { [0, 1, 2] }
}

/// Returns the images of a mesh, and what the facets of these triangles show of them.
fn images(
    mesh: &Mesh,
    triangles: &[usize],
    is_turned: bool,
) -> (Vec<Arc<Image>>, Vec<TextureCoordinates>) {
    let textured = |triangle: &usize| texture_of(mesh, *triangle);
    if mesh.uvs.is_empty() || !triangles.iter().any(|triangle| textured(triangle).is_some()) {
        return Default::default();
    }
    let (mut images, mut numbers) = (Vec::new(), HashMap::new());
    let mappings = triangles.iter().map(|triangle| {
        let image = textured(triangle).map_or(TextureCoordinates::PLAIN, |texture| {
            *numbers.entry(Arc::as_ptr(texture)).or_insert_with(|| {
                images.push(Arc::new(Image::new(texture)));
                images.len() as u32 - 1
            })
        });
        let vertices = order(is_turned).map(|corner| mesh.triangles[*triangle][corner]);
        TextureCoordinates { image, places: vertices.map(|vertex| mesh.uvs[vertex as usize]) }
    });
    let mappings = mappings.collect();
    (images, mappings)
}
