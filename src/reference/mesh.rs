//! A mesh without splats: rays that intersect its triangles, as ground truth for surfels.

use super::{composite::Composite, composite::Medium, picture, ray::Ray, shade};
use crate::{
    Deadline, Error, Result,
    math::{Camera, View},
    parallel::prelude::*,
    picture::Picture,
    scene::{Scene, Settings},
    surface::{Grouping, Mesh, color_at, corner_normals},
};
use glam::{DMat3, DVec2, DVec3, Vec3, Vec3A};
use obvhs::{
    Boundable, BvhBuildParams,
    aabb::Aabb,
    bvh2::{Bvh2, builder::build_bvh2},
    ray::{Ray as Line, RayHit},
};
use std::time::Duration;

/// Draws the triangles of a mesh by ray tracing, with `side`² rays spread evenly over each pixel.
///
/// Colours (vertex colour × material × texture) and normals are interpolated over each triangle
/// (Phong 1975). The normals are the file's. Otherwise they are averaged over the triangles that
/// meet at a vertex without a crease of more than `crease_angle_degrees` between them, as for
/// [surfels](Mesh::surfels). The shading is that of surfaces, on both sides. A triangle blocks the
/// share of the light that its opacity gives. A pixel's depth is that of its nearest ray: the
/// distance at which half of the ray's light is absorbed.
///
/// Triangles are intersected in double precision, the boxes around them in single precision (BVH:
/// Meister & Bittner 2018).
///
/// # Errors
/// The errors of [`Camera::view`] and [`Scene::validate_settings`]; [`Error::NothingToDraw`] for a
/// mesh without triangles. [`Error::Argument`] if a pixel has no rays or more than 256², and for a
/// hand-made mesh that contradicts itself.
pub fn trace(
    mesh: &Mesh,
    crease_angle_degrees: f32,
    camera: &Camera,
    settings: &Settings,
    side: u32,
) -> Result<Picture> {
    let view = camera.view(settings.size)?;
    if mesh.triangles.is_empty() {
        return Err(Error::NothingToDraw("the mesh has no triangles".into()));
    }
    if !(1..=MOST_SIDE).contains(&side) {
        return Err(Error::Argument(format!("a pixel takes 1² to {MOST_SIDE}² rays, not {side}²")));
    }
    mesh.validate()?;
    Scene::new().validate_settings(settings)?;
    if let Some(bounds) = mesh.bounds() {
        view.validate_for(&bounds)?;
    }
    let traced = Traced::new(mesh, crease_angle_degrees, &view, settings)?;
    let [width, height] = settings.size;
    let row = |row: u32| {
        let pixel = |column: u32| {
            let mut sum = Composite::EMPTY;
            for i in 0..side * side {
                let within =
                    (DVec2::new((i % side).into(), (i / side).into()) + 0.5) / f64::from(side);
                let composite =
                    traced.follow(&Ray::new(&view, DVec2::new(column.into(), row.into()) + within));
                sum.color += composite.color;
                sum.opacity += composite.opacity;
                sum.half = sum.half.min(composite.half);
            }
            let share = 1.0 / f64::from(side * side);
            (sum.color, sum.opacity) = (sum.color * share, sum.opacity * share);
            sum
        };
        (0..width).map(pixel).collect()
    };
    Ok(picture(&view, (0..height).into_par_iter().map(row).collect()))
}

/// Maximum number of rays along each side of a pixel.
const MOST_SIDE: u32 = 256;

/// A ray with less light than this is not followed further.
const LEAST_LIGHT: f64 = 1e-3;

struct Traced<'a> {
    mesh: &'a Mesh,
    normals: Vec<[Vec3; 3]>,
    boxes: Bvh2,
    settings: &'a Settings,
    /// The rotation from the mesh's space to view space, and the eye in the mesh's space.
    rotation: DMat3,
    eye: DVec3,
    /// The largest coordinate, which sets the scale of rounding errors.
    size: f64,
}

/// A box around a triangle.
struct Around(Aabb);

impl Boundable for Around {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

impl<'a> Traced<'a> {
    fn new(
        mesh: &'a Mesh,
        crease_angle_degrees: f32,
        view: &View,
        settings: &'a Settings,
    ) -> Result<Self> {
        let eye = view.position - mesh.origin;
        let size = mesh.positions.iter().fold(0.0f32, |size, p| size.max(p.abs().max_element()));
        // Boxes are intersected in 32 bits; the margin covers the rounding.
        let margin = Vec3A::splat((size + eye.abs().max_element() as f32) * 4e-7);
        let around = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|vertex| Vec3A::from(mesh.positions[vertex as usize]));
            Around(Aabb::new(a.min(b).min(c) - margin, a.max(b).max(c) + margin))
        };
        let around: Vec<Around> = mesh.triangles.par_iter().map(around).collect();
        Ok(Self {
            mesh,
            normals: corner_normals(
                mesh,
                (crease_angle_degrees, Grouping::Whole),
                Deadline::NEVER,
            )?,
            boxes: build_bvh2(&around, BvhBuildParams::fast_build(), &mut Duration::default()),
            settings,
            rotation: view.rotation,
            eye,
            size: f64::from(size),
        })
    }

    /// Composites all triangles that a ray meets.
    fn follow(&self, ray: &Ray) -> Composite {
        let back = self.rotation.transpose();
        let (origin, direction) = (self.eye + back * ray.origin, back * ray.direction);
        let mut composite = Composite::EMPTY;
        let mut from = 0.0;
        while composite.opacity < 1.0 - LEAST_LIGHT {
            let Some((triangle, met)) = self.nearest(origin, direction, from) else { break };
            let [red, green, blue, opacity] =
                color_at(self.mesh, triangle, met.weights.map(|w| w as f32));
            let normal: DVec3 =
                self.normals[triangle].iter().zip(met.weights).map(|(n, w)| n.as_dvec3() * w).sum();
            let color = DVec3::new(red.into(), green.into(), blue.into());
            let color = match &self.settings.surface_shade {
                Some(shade) if !self.mesh.is_unlit(triangle) => {
                    let aside = self.settings.lighting.aside.as_ref();
                    shade::lit(color, self.rotation * normal, ray.direction, shade, aside)
                }
                _ => color,
            };
            composite.pass(
                Medium { depth: -(1.0 - f64::from(opacity.min(1.0))).ln(), color },
                [met.distance; 2],
            );
            from = met.distance + 1e-9 * (met.distance + self.size);
        }
        composite
    }

    /// Returns the nearest triangle beyond a distance.
    fn nearest(&self, origin: DVec3, direction: DVec3, from: f64) -> Option<(usize, Met)> {
        let line = Line::new_inf(origin.as_vec3a(), direction.as_vec3a());
        let mut nearest: Option<(usize, Met)> = None;
        self.boxes.ray_traverse(line, &mut RayHit::none(), |_, slot| {
            let triangle = self.boxes.primitive_indices[slot] as usize;
            let corners = self.mesh.triangles[triangle]
                .map(|vertex| self.mesh.positions[vertex as usize].as_dvec3());
            let Some(met) = meet(origin, direction, corners).filter(|met| met.distance > from)
            else {
                return f32::INFINITY;
            };
            if nearest.is_none_or(|(_, before)| met.distance < before.distance) {
                nearest = Some((triangle, met));
            }
            // Boxes beyond this distance are skipped. It is slightly larger, to allow for rounding.
            met.distance as f32 * 1.000_001
        });
        nearest
    }
}

/// The intersection of a ray with a triangle.
#[derive(Debug, Clone, Copy)]
struct Met {
    distance: f64,
    /// Barycentric coordinates.
    weights: [f64; 3],
}

/// Intersects a ray with a triangle, from either side (Möller & Trumbore 1997).
fn meet(origin: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<Met> {
    let (ab, ac, to) = (b - a, c - a, origin - a);
    let across = direction.cross(ac);
    let determinant = ab.dot(across);
    let v = to.dot(across) / determinant;
    let turned = to.cross(ab);
    let w = direction.dot(turned) / determinant;
    // A zero determinant gives NaN or infinity, which fails these comparisons.
    let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0;
    inside.then(|| Met { distance: ac.dot(turned) / determinant, weights: [1.0 - v - w, v, w] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        compare::compare_pictures,
        math::Projection,
        reference::render,
        scene::{Lighting, Scene},
        surface::SurfelOptions,
        volume::Shade,
    };

    fn camera(projection: Projection) -> Camera {
        let position = DVec3::new(0.6, 2.5, 3.0);
        Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Y, projection }
    }

    #[test]
    fn a_sphere_is_lit_as_by_hand() {
        let mut sphere = Mesh::sphere(5);
        sphere.colors = vec![[255, 128, 0, 255]; sphere.positions.len()];
        let camera = camera(Projection::Orthographic { height: 3.0 });
        let mut settings = Settings::new([48, 36]);
        let shade = Shade { ambient: 0.1, diffuse: 0.6, specular: 0.2, power: 8.0, certain: None };
        settings.surface_shade = Some(shade);
        settings.lighting = Lighting::head();
        let picture = trace(&sphere, 60.0, &camera, &settings, 1).unwrap();
        for (at, pixel) in picture.color.iter().enumerate() {
            let place = (DVec2::new((at % 48) as f64, (at / 48) as f64) + 0.5
                - DVec2::new(24.0, 18.0))
                / 12.0;
            let radius = place.length();
            if radius < 0.97 {
                let cosine = (1.0 - radius * radius).sqrt();
                let red = 0.7_f64.min(0.1 + 0.6 * cosine) + 0.2 * cosine.powi(8);
                assert!((f64::from(pixel[0]) - red).abs() < 0.01, "{place} {pixel:?} {red}");
                assert!(
                    (f64::from(pixel[2]) - 0.2 * cosine.powi(8)).abs() < 0.01 && pixel[3] > 0.999
                );
                let depth = camera.position.length() - cosine;
                assert!((f64::from(picture.depth[at]) - depth).abs() < 0.01);
            } else if radius > 1.01 {
                assert_eq!(*pixel, [0.0; 4]);
            }
        }
    }

    #[test]
    fn rays_are_spread_over_pixels_and_pass_what_is_thin() {
        // A half-opaque square from 0 to 1 whose edge cuts pixels in half, with another square
        // behind it.
        let square = |z: f32| {
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, z))
        };
        let mesh = Mesh {
            positions: [square(0.0), square(-1.0)].concat(),
            colors: [[[255, 255, 255, 128]; 4], [[0, 0, 0, 255]; 4]].concat(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]],
            ..Mesh::default()
        };
        let camera = Camera {
            position: DVec3::new(0.5, 0.5, 5.0),
            focal_point: DVec3::new(0.5, 0.5, 0.0),
            view_up: DVec3::Y,
            projection: Projection::Orthographic { height: 1.0 },
        };
        let mut settings = Settings::new([9, 8]);
        settings.surface_shade = None;
        let picture = trace(&mesh, 60.0, &camera, &settings, 4).unwrap();
        let row = &picture.color[3 * 9..4 * 9];
        let half = 128.0 / 255.0;
        assert!((row[4][0] - half).abs() < 1e-6 && row[4][3] == 1.0, "{:?}", row[4]);
        for edge in [row[0], row[8]] {
            assert!(
                (edge[3] - 0.5).abs() < 1e-6 && (edge[0] - 0.5 * half).abs() < 1e-6,
                "{edge:?}"
            );
        }
    }

    #[test]
    fn surfels_show_their_mesh() {
        let camera = camera(Projection::Perspective { view_angle: 38.0 });
        let settings = Settings::new([96, 96]);
        for (name, mesh, least) in [
            ("sphere", Mesh::sphere(3), 30.0),
            ("knot", knot(), 26.0),
            // Round splats reach over its edges, which are bright beside the background.
            ("cube", Mesh::cube(1.4), 22.5),
        ] {
            let options = SurfelOptions { largest_spacing: 1.0 / 24.0, ..SurfelOptions::default() };
            let scene = Scene::new().with_splats(mesh.surfels(&options).unwrap());
            let truth = trace(&mesh, options.crease_angle_degrees, &camera, &settings, 4).unwrap();
            let psnr = compare_pictures(&render(&scene, &camera, &settings).unwrap(), &truth)
                .unwrap()
                .psnr
                .unwrap();
            assert!(psnr > least, "{name}: {psnr} dB");
        }
    }

    /// A knot whose triangles face inward.
    fn knot() -> Mesh {
        let mut mesh = Mesh::knot(160, 20);
        mesh.positions.iter_mut().for_each(|place| *place *= 0.3);
        mesh.normals.clear();
        mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        mesh
    }

    #[test]
    fn what_cannot_be_traced_is_told() {
        let camera = camera(Projection::Perspective { view_angle: 30.0 });
        let settings = Settings::new([4, 4]);
        assert!(matches!(
            trace(&Mesh::default(), 60.0, &camera, &settings, 1),
            Err(Error::NothingToDraw(_))
        ));
        let refusal = |mesh: &Mesh, settings: &Settings, side: u32| match trace(
            mesh, 60.0, &camera, settings, side,
        ) {
            Err(Error::Argument(message)) => message,
            other => panic!("{:?}", other.map(|_| ())),
        };
        let cube = Mesh::cube(1.0);
        for side in [0, 257, 65_536, u32::MAX] {
            assert!(refusal(&cube, &settings, side).contains("rays"));
        }
        let beyond = Mesh { triangles: vec![[0, 1, 99]], ..cube.clone() };
        assert!(refusal(&beyond, &settings, 1).contains("beyond the mesh's 8 vertices"));
        let materials = Mesh { triangle_materials: vec![3; 12], ..cube.clone() };
        assert!(refusal(&materials, &settings, 1).contains("a material that is not there"));
        let mut nowhere = cube.clone();
        nowhere.positions[0] = Vec3::NAN;
        assert!(refusal(&nowhere, &settings, 1).contains("not finite"));
        let shade = Shade { ambient: f64::NAN, ..Shade::default() };
        let dark = Settings { surface_shade: Some(shade), ..settings.clone() };
        assert!(refusal(&cube, &dark, 1).contains("light"));
        trace(&cube, 60.0, &camera, &settings, 2).unwrap();
    }
}
