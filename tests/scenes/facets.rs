//! Scenes of facets: closed, open, seen from within, clipped, and beside other items.

use super::{Case, ORIGIN, PERSPECTIVE, SLANT, camera, methods, mixed_scene, settings};
use glam::{DVec3, Vec2, Vec3};
use splatkit::{
    cells::{CellKind, Cells, Solid, SolidOptions, Tint},
    color::{ColorMap, ColorScale},
    facet::{Facet, FacetSet, Relief, Rod, Sides},
    math::{Bounds, Projection},
    scene::{Clip, ClipShape, Scene, Settings},
    surface::{Material, Mesh, SurfelOptions, Texture},
};
use std::sync::Arc;

/// The facets of a mesh around the origin of the scenes, coloured by place.
fn facets(mesh: Mesh, sides: Sides) -> FacetSet {
    let part = |value: f32| (127.5 + 120.0 * value).clamp(0.0, 255.0) as u8;
    let colors = mesh.positions.iter().map(|p| [part(p.x), part(p.y), part(p.z), 255]).collect();
    let mesh = Mesh { origin: ORIGIN, colors, ..mesh };
    let options = SurfelOptions { largest_spacing: 1.0 / 24.0, ..SurfelOptions::default() };
    let set = mesh.facets(&options).expect("facets").expect("a mesh of facets");
    assert_eq!(set.sides, sides);
    set
}

fn case(name: &'static str, scene: Scene, projection: Projection) -> Case {
    Case { name, scene, camera: camera(SLANT, projection), settings: settings() }
}

/// A closed part with bevels.
pub fn gear() -> Case {
    let mut mesh = Mesh::gear(9);
    mesh.positions.iter_mut().for_each(|p| *p *= 1.6);
    let set = facets(mesh, Sides::Closed);
    case("gear", Scene::new().with_facets(set), PERSPECTIVE)
}

/// A sheet of which both sides are seen, without light.
pub fn folded_sheet() -> Case {
    let set = facets(Mesh::folded_sheet(5), Sides::Oriented);
    let near = Projection::Orthographic { height: 1.6 };
    let case = case("folded_sheet", Scene::new().with_facets(set), near);
    Case { settings: Settings { surface_shade: None, ..settings() }, ..case }
}

/// A box whose sides wind in any way, from within: corners lie beside and behind the eye.
pub fn inside_a_box() -> Case {
    let mut mesh = Mesh::cube(1.9);
    mesh.triangles[0].swap(0, 1);
    mesh.triangles[5].swap(1, 2);
    let mut case = case(
        "inside_a_box",
        Scene::new().with_facets(facets(mesh, Sides::Mixed)),
        Projection::Perspective { view_angle: 80.0 },
    );
    case.camera.position = ORIGIN + glam::DVec3::new(0.3, -0.2, 0.1);
    case.camera.focal_point = ORIGIN + glam::DVec3::new(-1.0, 0.5, 0.2);
    case
}

/// Cut open: then the backs are seen.
pub fn clipped_gear() -> Case {
    let clips = methods::clipped_surface_in_a_volume().settings.clips;
    let camera = camera(0.6 * SLANT, PERSPECTIVE);
    Case { name: "clipped_gear", camera, settings: Settings { clips, ..settings() }, ..gear() }
}

/// Facets, surfels and a volume in the same sheets.
pub fn facets_in_a_volume() -> Case {
    let mut mesh = Mesh::slivers(24);
    mesh.positions.iter_mut().for_each(|p| *p = *p * 0.8 + Vec3::new(0.2, 0.0, 0.1));
    let scene = mixed_scene().with_facets(facets(mesh, Sides::Closed));
    case("facets_in_a_volume", scene, PERSPECTIVE)
}

/// A leaning square that shows a picture with holes.
pub fn textured() -> Case {
    let (width, height) = (60, 90);
    let texel = |i: u32| {
        let (x, y) = (i % width, i / width);
        let wave = |at: u32| (128.0 + 100.0 * (at as f32 / 6.0).sin()) as u8;
        [wave(x), wave(y), wave(x + y), if (x / 11 + y / 13) % 3 == 0 { 0 } else { 255 }]
    };
    let texels = (0..width * height).map(texel).collect();
    let corners = [[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]];
    let material = Material {
        color: [1.0, 0.9, 0.8, 1.0],
        texture: Some(Arc::new(Texture { width, height, texels })),
        ..Material::default()
    };
    let mesh = Mesh {
        origin: ORIGIN,
        positions: corners.map(|[x, y]| Vec3::new(x, y, 0.3 * x)).to_vec(),
        uvs: corners.map(|[x, y]| Vec2::new(x, y)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0; 2],
        materials: vec![material],
        ..Mesh::default()
    };
    let set = mesh.facets(&SurfelOptions::default()).expect("facets").expect("a mesh of facets");
    assert!(!set.texture_coordinates.is_empty());
    case("textured", Scene::new().with_facets(set), PERSPECTIVE)
}

/// Cells as a solid: the boundary in the colours of the values.
pub fn solid() -> Case {
    let mut cells = Cells::tube(CellKind::QuadraticHexahedron, 1).expect("a tube");
    cells.origin = ORIGIN;
    let scale = ColorScale { range: cells.range(), ..ColorScale::new(ColorMap::VIRIDIS) };
    let solid = Solid::new(cells, &SolidOptions::new(Tint::Values(scale))).expect("a solid");
    case("solid", Scene::new().with_solid(solid), PERSPECTIVE)
}

/// Cut by a plane, a box, and another box that is cut out: the field inside is seen.
pub fn cut_solid() -> Case {
    let half = ClipShape::HalfSpace {
        normal: DVec3::new(0.2, -0.1, 1.0),
        offset: 0.4 + DVec3::new(0.2, -0.1, 1.0).dot(ORIGIN),
    };
    let cuboid = |min: [f64; 3], max: [f64; 3]| {
        let [min, max] = [min, max].map(|end| ORIGIN + DVec3::from_array(end));
        ClipShape::Box(Bounds { min, max })
    };
    let clips = vec![
        Clip { shape: half, inside: true },
        Clip { shape: cuboid([-0.9, -0.95, -0.7], [0.97, 0.9, 0.9]), inside: true },
        Clip { shape: cuboid([0.2, -0.1, -0.1], [2.0, 2.0, 2.0]), inside: false },
    ];
    Case { name: "cut_solid", settings: Settings { clips, ..settings() }, ..solid() }
}

/// Tubes with bends, balls that meet, and discs, some of them thinner than a pixel.
fn rods() -> Vec<Rod> {
    let place = |i: usize| {
        let turn = i as f32 * 0.31;
        Vec3::new(0.8 * turn.cos(), 0.8 * turn.sin(), 0.04 * i as f32 - 0.8)
    };
    let color = |i: usize| [(40 + 5 * i) as u8, (250 - 5 * i) as u8, (80 + (97 * i) % 160) as u8];
    let tube = (0..40).map(|i| Rod {
        ends: [place(i), place(i + 1)],
        radii: [0.03 + 0.001 * i as f32, 0.031 + 0.001 * i as f32],
        pixels: 0.0,
        colors: [color(i), color(i + 1)],
        relief: Relief::Round,
        joints: ((i > 0).then(|| (place(i) - place(i.max(1) - 1)).normalize()), i < 39),
    });
    let thin = (0..12).map(|i| Rod {
        ends: [place(3 * i) * 0.6, Vec3::new(0.1, -0.2, 0.9 - 0.1 * i as f32)],
        radii: [0.0; 2],
        pixels: 0.2 + 0.3 * i as f32,
        colors: [color(i); 2],
        relief: if i % 3 == 0 { Relief::Flat(None) } else { Relief::Round },
        joints: (None, false),
    });
    let balls = (0..30).map(|i| {
        let radius = if i % 4 == 0 { 0.004 } else { 0.12 };
        let flat = Relief::Flat((i % 2 == 0).then_some(Vec3::new(0.6, 0.0, 0.8)));
        Rod {
            relief: if i % 5 == 0 { flat } else { Relief::Round },
            ..Rod::ball(place(7 * i) * Vec3::new(0.5, 0.5, 0.2), radius, color(i))
        }
    });
    tube.chain(thin).chain(balls).collect()
}

fn set_of(rods: Vec<Rod>) -> FacetSet {
    FacetSet::of_rods(ORIGIN, rods.into_iter().map(Facet::from).collect())
}

pub fn tubes_and_balls() -> Case {
    case("tubes_and_balls", Scene::new().with_facets(set_of(rods())), PERSPECTIVE)
}

/// The same with parallel rays, clipped.
pub fn clipped_tubes_and_balls() -> Case {
    let clips = methods::clipped_surface_in_a_volume().settings.clips;
    let parallel = Projection::Orthographic { height: 1.6 };
    let case = case("clipped_tubes_and_balls", Scene::new().with_facets(set_of(rods())), parallel);
    Case { settings: Settings { clips, ..settings() }, ..case }
}

/// The eye among rods, of which some pass it.
pub fn inside_rods() -> Case {
    let mut case = case(
        "inside_rods",
        Scene::new().with_facets(set_of(rods())),
        Projection::Perspective { view_angle: 80.0 },
    );
    case.camera.position = ORIGIN + glam::DVec3::new(0.3, -0.2, 0.1);
    case.camera.focal_point = ORIGIN + glam::DVec3::new(-1.0, 0.5, 0.2);
    case
}

/// Rods, triangles, surfels and a volume in the same sheets.
pub fn rods_among_others() -> Case {
    let triangles = facets(Mesh::slivers(24), Sides::Closed).facets;
    let all = triangles.into_iter().chain(set_of(rods()).facets).collect();
    let scene = mixed_scene().with_facets(FacetSet::of_rods(ORIGIN, all));
    case("rods_among_others", scene, PERSPECTIVE)
}

pub fn all() -> [Case; 11] {
    [
        gear(),
        folded_sheet(),
        inside_a_box(),
        clipped_gear(),
        facets_in_a_volume(),
        solid(),
        cut_solid(),
        tubes_and_balls(),
        clipped_tubes_and_balls(),
        inside_rods(),
        rods_among_others(),
    ]
}
