use super::*;
use crate::{
    math::Bounds,
    splat::decode_normal,
    surface::{Material, Texture},
};
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// The optical depth of a ray, by brute force: strength · exp(−ρ²/2), with ρ its whitened distance
/// from the centre.
fn depth(set: &Surfels, point: DVec3, direction: DVec3) -> f64 {
    set.splats
        .iter()
        .map(|splat| {
            let whiten = |v: DVec3| {
                let b = splat.factor.map(f64::from);
                let x = v.x / b[0];
                let y = (v.y - b[1] * x) / b[2];
                DVec3::new(x, y, (v.z - b[3] * x - b[4] * y) / b[5])
            };
            let offset = whiten(point - Vec3::from_array(splat.center).as_dvec3());
            let square = offset.reject_from(whiten(direction)).length_squared();
            let extent = f64::from(set.extent);
            if square > extent * extent {
                0.0
            } else {
                f64::from(splat.strength) * (-square / 2.0).exp()
            }
        })
        .sum()
}

/// The smallest optical depth seen along the triangles' normals, over points on up to 60 of the
/// triangles.
fn least_depth(mesh: &Mesh, set: &Surfels) -> f64 {
    let step = (mesh.triangles.len() / 60).max(1);
    let points = |n: usize| {
        (0..=n)
            .flat_map(move |i| (0..=n - i).map(move |j| (i as f64 / n as f64, j as f64 / n as f64)))
    };
    (mesh.triangles.par_iter().step_by(step))
        .map(|&t| {
            let [a, b, c] = t.map(|index| mesh.positions[index as usize].as_dvec3());
            let normal = (b - a).cross(c - a).normalize();
            let n = if mesh.triangles.len() < 100 { 60 } else { 8 };
            points(n)
                .map(|(u, v)| depth(set, a + (b - a) * u + (c - a) * v, normal))
                .fold(f64::INFINITY, f64::min)
        })
        .reduce(|| f64::INFINITY, f64::min)
}

fn surfels(mesh: &Mesh) -> Surfels {
    mesh.surfels(&SurfelOptions::default()).expect("surfels")
}

/// Long thin triangles: a fan, and strips with steps between them.
fn needles() -> Mesh {
    let mut mesh = Mesh { positions: vec![Vec3::ZERO], ..Mesh::default() };
    for i in 0..=40u32 {
        let angle = i as f32 * 0.02;
        mesh.positions.push(
            Vec3::new(angle.cos(), angle.sin(), 0.02 * (i % 3) as f32)
                * (1.0 + 0.3 * (i % 5) as f32),
        );
        if i > 0 {
            mesh.triangles.push([0, i, i + 1]);
        }
    }
    mesh
}

#[test]
fn surfaces_have_no_holes() {
    // At a boundary half of the light is gone. At a crease each side contributes as much.
    let bound = |name: &str| if name == "cube" || name == "needles" { 0.6 } else { 2.2 };
    let coarse = SurfelOptions { largest_spacing: 10.0, ..SurfelOptions::default() };
    for (name, mesh) in [
        ("sphere 1", Mesh::sphere(1)),
        ("sphere 3", Mesh::sphere(3)),
        ("cube", Mesh::cube(2.0)),
        ("needles", needles()),
        ("knot", Mesh::knot(120, 16)),
        ("knot of long quads", Mesh::knot(60, 48)),
    ] {
        let least = least_depth(&mesh, &mesh.surfels(&coarse).expect("surfels"));
        assert!(least >= bound(name), "{name}, not cut: {least}");
    }
    for (name, mesh) in
        [("cube", Mesh::cube(2.0)), ("needles", needles()), ("sphere 0", Mesh::sphere(0))]
    {
        let fine = SurfelOptions { largest_spacing: 0.05, ..SurfelOptions::default() };
        let least = least_depth(&mesh, &mesh.surfels(&fine).expect("surfels"));
        assert!(least >= bound(name), "{name}: {least}");
    }
}

#[test]
fn normals_point_outward() {
    let mesh = Mesh::sphere(4);
    for splat in surfels(&mesh).splats {
        let normal = decode_normal(splat.normal).expect("a normal");
        assert!(normal.dot(Vec3::from_array(splat.center).normalize()) > 0.999);
    }
    let mut knot = Mesh::knot(300, 40);
    let given = surfels(&knot);
    knot.normals.clear();
    let computed = surfels(&knot);
    let options = SurfelOptions { largest_spacing: 10.0, ..SurfelOptions::default() };
    assert_eq!(given.splats.len(), computed.splats.len());
    let uncut = knot.surfels(&options).expect("surfels");
    assert_eq!(uncut.splats.len(), knot.positions.len());
    for (a, b) in given.splats.iter().zip(&computed.splats) {
        let (a, b) = (
            decode_normal(a.normal).expect("a normal"),
            decode_normal(b.normal).expect("a normal"),
        );
        assert!(a.dot(b) > 0.95, "{a} {b}");
    }
}

#[test]
fn a_mesh_that_is_inside_out_is_turned() {
    let mut mesh = Mesh::sphere(3);
    let whole = surfels(&mesh).splats;
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    for (turned, splat) in surfels(&mesh).splats.iter().zip(&whole) {
        let [a, b] = [turned, splat].map(|splat| decode_normal(splat.normal).expect("a normal"));
        assert!(a.dot(b) > 0.9999);
        assert!(Vec3::from_array(turned.center).distance(Vec3::from_array(splat.center)) < 1e-4);
    }
    // Normals from the file are believed.
    mesh.normals = mesh.positions.iter().map(|p| -p.normalize()).collect();
    let inward = decode_normal(surfels(&mesh).splats[0].normal).expect("a normal");
    assert!(inward.dot(mesh.positions[0]) < 0.0);
}

#[test]
fn a_cube_keeps_its_creases() {
    let set = surfels(&Mesh::cube(2.0));
    for splat in &set.splats {
        let normal = decode_normal(splat.normal).expect("a normal");
        assert!(normal.abs().max_element() > 0.9999, "{normal}");
        // The centre is at most its thickness behind its side.
        assert!((0.99..=1.0).contains(&normal.dot(Vec3::from_array(splat.center))), "{splat:?}");
    }
    let whole = SurfelOptions { largest_spacing: 10.0, ..SurfelOptions::default() };
    assert_eq!(Mesh::cube(2.0).surfels(&whole).expect("surfels").splats.len(), 24);
}

#[test]
fn ellipses_stay_close_to_the_surface() {
    // For a square cut to 1/128 of its diagonal: half of the light is gone near its rim.
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let set = surfels(&mesh);
    let spacing = 2f64.sqrt() / 128.0;
    for along in 0..40 {
        let at = |below: f64| {
            depth(&set, DVec3::new(0.3 + 0.01 * f64::from(along), -spacing * below, 0.0), DVec3::Z)
        };
        assert!(at(0.3) < 0.6 && at(-0.1) > 0.8, "{} {}", at(0.3), at(-0.1));
    }
    assert!(depth(&set, DVec3::new(0.5, 0.5, spacing), DVec3::X) < 1e-3);
}

#[test]
fn useless_parts_are_left_out() {
    let mut mesh = Mesh::sphere(2);
    let whole = surfels(&mesh).splats;
    mesh.positions.push(Vec3::ONE * 0.1);
    mesh.triangles.extend([[0, 0, 1], [3, 3, 3], [0, 1, 0]]);
    assert_eq!(surfels(&mesh).splats, whole);
    let flat = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    assert!(matches!(flat.surfels(&SurfelOptions::default()), Err(Error::NothingToDraw(_))));
    assert!(matches!(
        Mesh::default().surfels(&SurfelOptions::default()),
        Err(Error::NothingToDraw(_))
    ));
}

#[test]
fn a_mesh_that_contradicts_itself_is_an_argument_error() {
    let check = |change: fn(&mut Mesh)| {
        let mut mesh = Mesh::cube(1.0);
        change(&mut mesh);
        assert!(matches!(mesh.surfels(&SurfelOptions::default()), Err(Error::Argument(_))));
    };
    check(|mesh| mesh.triangles[3][1] = 8);
    check(|mesh| mesh.colors.push([0; 4]));
    check(|mesh| mesh.triangle_materials = vec![0; 12]);
    check(|mesh| mesh.positions[2].y = f32::NAN);
    let options = SurfelOptions { radius_scale: f32::NAN, ..SurfelOptions::default() };
    assert!(matches!(Mesh::cube(1.0).surfels(&options), Err(Error::Argument(_))));
}

#[test]
fn textures_are_shown() {
    let texels = (0..64 * 64)
        .map(|i| if (i / 8 + i / 512) % 2 == 0 { [255, 0, 0, 255] } else { [0, 0, 255, 255] })
        .collect();
    let texture = Some(Arc::new(Texture { width: 64, height: 64, texels }));
    let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y];
    let mesh = Mesh {
        positions: corners.map(|uv| uv.extend(0.0)).to_vec(),
        uvs: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        materials: vec![Material { color: [1.0, 1.0, 0.5, 1.0], texture, ..Material::default() }],
        ..Mesh::default()
    };
    let set = surfels(&mesh);
    let inside = |x: f32| (x * 8.0).fract() > 0.2 && (x * 8.0).fract() < 0.8;
    let mut seen = [0, 0];
    for splat in set.splats.iter().filter(|s| inside(s.center[0]) && inside(s.center[1])) {
        let odd = ((splat.center[0] * 8.0) as u32 + (splat.center[1] * 8.0) as u32) % 2;
        assert_eq!(
            splat.color,
            if odd == 0 { 0xff00_00ff } else { 0xff80_0000 },
            "{:?}",
            splat.center
        );
        seen[odd as usize] += 1;
    }
    assert!(seen.iter().all(|&count| count > 500), "{seen:?}");
}

#[test]
fn clouds_of_all_sorts() {
    // A square grid of points is covered and faces up.
    let grid = |i: u32| Vec3::new((i % 30) as f32, (i / 30) as f32, 0.0);
    let mut cloud = Mesh { positions: (0..900).map(grid).collect(), ..Mesh::default() };
    let set = surfels(&cloud);
    for i in 0..400 {
        let at = DVec3::new(5.0 + f64::from(i % 20) * 0.63, 5.0 + f64::from(i / 20) * 0.63, 0.0);
        assert!(depth(&set, at, DVec3::Z) >= 5.9);
    }
    for splat in &set.splats {
        assert!(decode_normal(splat.normal).expect("a normal").z.abs() > 0.99);
    }
    // Duplicates change nothing; a distant point keeps a moderate size; normals from the file are
    // kept.
    cloud.positions.extend((0..900).map(grid));
    assert_eq!(surfels(&cloud).splats, set.splats);
    cloud.positions.push(Vec3::new(1e6, 0.0, 0.0));
    assert!(surfels(&cloud).splats.iter().all(|splat| splat.factor.iter().all(|b| b.abs() < 5.0)));
    cloud.normals = vec![Vec3::NEG_Z; cloud.positions.len()];
    assert!(
        surfels(&cloud)
            .splats
            .iter()
            .all(|splat| decode_normal(splat.normal).expect("a normal").z < -0.99)
    );
    for positions in [
        vec![Vec3::ONE; 5000],
        vec![Vec3::ZERO],
        vec![Vec3::X, Vec3::Y],
        (0..50).map(|i| Vec3::X * i as f32).collect(),
    ] {
        let set = surfels(&Mesh { positions, ..Mesh::default() });
        for splat in set.splats {
            let [xx, _, yy, _, _, zz] = splat.factor;
            assert!(xx > 0.0 && yy > 0.0 && zz > 0.0, "{splat:?}");
        }
    }
}

#[test]
fn a_split_mesh_is_as_a_whole_one() {
    let mesh = Mesh::sphere(3);
    let positions =
        mesh.triangles.iter().flatten().map(|&index| mesh.positions[index as usize]).collect();
    let triangles =
        (0..mesh.triangles.len() as u32).map(|i| [i * 3, i * 3 + 1, i * 3 + 2]).collect();
    let soup = Mesh { positions, triangles, ..Mesh::default() };
    let (whole, soup) = (surfels(&mesh), surfels(&soup));
    assert_eq!(whole.splats.len(), soup.splats.len());
    assert!(least_depth(&mesh, &soup) >= 2.2);
    for splat in &soup.splats {
        let normal = decode_normal(splat.normal).expect("a normal");
        assert!(normal.dot(Vec3::from_array(splat.center).normalize()) > 0.99);
    }
}

#[test]
fn a_fine_texture_on_coarse_triangles_is_averaged() {
    let texels = (0..1024 * 1024)
        .map(|i: u32| if (i ^ (i / 1024)) & 1 == 0 { [255; 4] } else { [0, 0, 0, 255] })
        .collect();
    let texture = Some(Arc::new(Texture { width: 1024, height: 1024, texels }));
    let mut mesh = Mesh::sphere(2);
    mesh.uvs = mesh.positions.iter().map(|p| p.truncate() * 0.437).collect();
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    mesh.materials = vec![Material { color: [1.0; 4], texture, ..Material::default() }];
    let coarse =
        SurfelOptions { largest_spacing: 10.0, most_triangles: 300, ..SurfelOptions::default() };
    for splat in mesh.surfels(&coarse).expect("surfels").splats {
        let red = splat.color & 255;
        assert!((70..186).contains(&red), "{red}");
    }
}

/// The budget holds, whatever the texture coordinates are.
#[test]
fn textures_keep_to_the_budget() {
    let texture =
        Some(Arc::new(Texture { width: 1024, height: 1024, texels: vec![[99; 4]; 1024 * 1024] }));
    for far in [1.0, 5.0, 1e3, 1e5, 1e20, f32::MAX] {
        for across in [0.0, 0.01, far] {
            let mesh = Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y],
                triangles: vec![[0, 1, 2], [0, 2, 3]],
                uvs: [[0.0, 0.0], [far, 0.0], [far, across], [0.0, across]]
                    .map(glam::Vec2::from_array)
                    .to_vec(),
                triangle_materials: vec![0; 2],
                materials: vec![Material {
                    color: [1.0; 4],
                    texture: texture.clone(),
                    ..Material::default()
                }],
                ..Mesh::default()
            };
            let options = SurfelOptions { most_triangles: 30_000, ..SurfelOptions::default() };
            let (counted, made) = (
                mesh.triangles_once_cut(&options, usize::MAX).unwrap(),
                surfels_of(&mesh, &options),
            );
            // The minimum that its size requires is 35,000.
            assert!(
                made < 100_000 && 2 * counted > made,
                "{far} {across}: {made} surfels, {counted} triangles told"
            );
        }
    }
}

fn surfels_of(mesh: &Mesh, options: &SurfelOptions) -> usize {
    mesh.surfels(options).expect("surfels").splats.len()
}

#[test]
fn bounds_are_in_the_world() {
    let mut mesh = Mesh::cube(2.0);
    mesh.origin = DVec3::X * 100.0;
    let (min, max) = (DVec3::new(99.0, -1.0, -1.0), DVec3::new(101.0, 1.0, 1.0));
    assert_eq!(mesh.bounds(), Some(Bounds { min, max }));
    assert_eq!(Mesh::default().bounds(), None);
}

#[test]
fn a_vertex_of_no_triangle_changes_nothing() {
    let mesh = Mesh::cube(2.0);
    let mut stray = mesh.clone();
    stray.positions.insert(0, Vec3::splat(300.0));
    stray.normals.clear();
    stray.triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(|vertex| vertex + 1));
    let mut alone = mesh;
    alone.normals.clear();
    assert_eq!(stray.bounds(), alone.bounds());
    assert_eq!(surfels(&stray).splats.len(), surfels(&alone).splats.len());
}

/// An object far from the world's origin keeps its size, even where 64 bits cannot resolve its
/// positions.
#[test]
fn a_far_origin_changes_nothing() {
    let mesh = Mesh::sphere(1);
    let cloud = Mesh { triangles: Vec::new(), ..mesh.clone() };
    for mesh in [mesh, cloud] {
        let near = surfels(&mesh);
        for origin in [DVec3::splat(1e16), DVec3::X * -1e300] {
            let far = Mesh { origin, ..mesh.clone() };
            let splats = surfels(&far).splats;
            assert!(
                splats.len() == near.splats.len()
                    && splats.iter().zip(&near.splats).all(|(a, b)| a == b)
            );
            let options = SurfelOptions::default();
            assert_eq!(
                far.triangles_once_cut(&options, usize::MAX).unwrap(),
                mesh.triangles_once_cut(&options, usize::MAX).unwrap()
            );
        }
        for origin in [DVec3::X * f64::NAN, DVec3::Y * f64::INFINITY] {
            let error = Mesh { origin, ..mesh.clone() }
                .surfels(&SurfelOptions::default())
                .unwrap_err()
                .to_string();
            assert!(error.contains("of the mesh is not finite"), "{error}");
        }
    }
}

/// Invalid normals are computed from the surroundings, like those that the file lacks.
#[test]
fn normals_that_are_not_finite_are_none() {
    let with = |normal: Vec3, triangles: bool| {
        let mut mesh = Mesh::sphere(1);
        mesh.normals = vec![normal; mesh.positions.len()];
        mesh.triangles.truncate(if triangles { usize::MAX } else { 0 });
        surfels(&mesh).splats
    };
    for triangles in [true, false] {
        let without = with(Vec3::ZERO, triangles);
        for normal in [Vec3::INFINITY, Vec3::NAN, Vec3::X * f32::NEG_INFINITY, Vec3::Y * 1e30] {
            let splats = with(normal, triangles);
            assert!(splats.iter().zip(&without).all(|(a, b)| a == b), "{normal}: {:?}", splats[0]);
        }
    }
}

#[test]
fn options_are_numbers_that_surfels_can_be_made_of() {
    let mesh = Mesh::cube(2.0);
    let fine = |options: SurfelOptions| {
        let set = mesh.surfels(&SurfelOptions { most_triangles: 1000, ..options })?;
        let is_sound =
            |splat: &Splat| splat.center.iter().chain(&splat.factor).all(|value| value.abs() < 9.0);
        assert!(set.splats.iter().all(is_sound));
        Ok(set.splats.len())
    };
    let spaced =
        |largest_spacing| fine(SurfelOptions { largest_spacing, ..SurfelOptions::default() });
    let deep = |optical_depth| fine(SurfelOptions { optical_depth, ..SurfelOptions::default() });
    let refused = |result: Result<usize>, message: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    };
    // However coarse the spacing is, everything is drawn.
    assert_eq!((spaced(1.0).unwrap(), spaced(f32::MAX).unwrap()), (24, 24));
    assert!((300..1000).contains(&spaced(1e-9).unwrap()));
    refused(spaced(1e-38), "largest_spacing is 1e-38; 1e-9 to ");
    assert!(deep(1e10).is_ok());
    refused(deep(1.1e10), "optical_depth is 1.1e10; 0e0 to 1e10 are allowed");
}

/// Something far away, such as a triangle of a broken scan, leaves the rest unchanged.
#[test]
fn a_triangle_far_off_takes_nothing_away() {
    let mesh = Mesh::sphere(3);
    for (far, size) in [(1e8, 16.0), (-3e9, 512.0)] {
        let mut both = mesh.clone();
        let first = mesh.positions.len() as u32;
        both.positions
            .extend([Vec3::ZERO, Vec3::X, Vec3::Y].map(|side| Vec3::X * far + side * size));
        both.triangles.push([first, first + 1, first + 2]);
        let count = surfels(&both).splats.len();
        assert!(count >= mesh.positions.len() + 3, "{far:e}: {count} surfels");
    }
}

/// A sheet of squares with a texture of 8 × 8 texels. Vertex 7 has different texture coordinates.
fn textured(uv: glam::Vec2) -> Mesh {
    const SIDE: u32 = 12;
    let texture = Some(Arc::new(Texture { width: 8, height: 8, texels: vec![[99; 4]; 64] }));
    let places = (0..(SIDE + 1).pow(2))
        .map(|vertex| [vertex % (SIDE + 1), vertex / (SIDE + 1)].map(|v| v as f32));
    let corners = (0..SIDE * SIDE).map(|square| square / SIDE * (SIDE + 1) + square % SIDE);
    let mut mesh = Mesh {
        positions: places.clone().map(|[x, y]| Vec3::new(x, y, (x + y).sin())).collect(),
        uvs: places.map(|place| glam::Vec2::from(place) / SIDE as f32).collect(),
        triangles: corners
            .flat_map(|a| [[a, a + 1, a + SIDE + 2], [a, a + SIDE + 2, a + SIDE + 1]])
            .collect(),
        materials: vec![Material { color: [1.0; 4], texture, ..Material::default() }],
        ..Mesh::default()
    };
    mesh.triangle_materials = vec![0; mesh.triangles.len()];
    mesh.uvs[7] = uv;
    mesh
}

/// One distant texture coordinate costs no more than the triangles around it.
#[test]
fn a_far_texture_coordinate_is_soon_done() {
    let options = SurfelOptions { deadline: Deadline::after(60), ..SurfelOptions::default() };
    let usual = surfels_of(&textured(glam::Vec2::ONE), &options);
    for far in [1e2, 1e3, 1e4, 1e6, 1e12, 1.8e19, f32::MAX] {
        for uv in [glam::Vec2::new(far, 0.5), glam::Vec2::new(far, -far)] {
            let made = surfels_of(&textured(uv), &options);
            assert!(made < usual + 1_000_000, "{uv}: {made} surfels, {usual} without");
        }
    }
    for value in [f32::NAN, f32::INFINITY] {
        let error =
            textured(glam::Vec2::new(0.5, value)).surfels(&options).unwrap_err().to_string();
        assert!(error.contains("of vertex 7 are not finite"), "{error}");
    }
}

/// The error comes before anything is cut.
#[test]
fn a_far_vertex_is_named() {
    for x in [1e13, 1e15, 1e17] {
        let mut mesh = textured(glam::Vec2::ONE);
        mesh.materials.clear();
        mesh.triangle_materials.clear();
        mesh.positions.iter_mut().for_each(|place| *place *= 0.1);
        mesh.positions[5].x = x;
        let begin = std::time::Instant::now();
        let error = mesh.surfels(&SurfelOptions::default()).unwrap_err().to_string();
        assert!(error.contains(&format!("vertex 5 at ({x:e}, ")), "{error}");
        assert!(mesh.triangles_once_cut(&SurfelOptions::default(), usize::MAX).is_err());
        assert!(begin.elapsed().as_secs() < 10, "{x}: {:?}", begin.elapsed());
    }
    let line = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let error = line.surfels(&SurfelOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no triangle has an area"), "{error}");
}

#[test]
fn every_step_keeps_to_the_deadline() {
    let options = SurfelOptions { deadline: Deadline::after(0), ..SurfelOptions::default() };
    let fine = Mesh::sphere(5);
    let cloud = Mesh { triangles: Vec::new(), ..Mesh::sphere(3) };
    for mesh in [Mesh::cube(1.0), fine, cloud, textured(glam::Vec2::ONE)] {
        let error = mesh.surfels(&options).unwrap_err();
        assert!(matches!(error, Error::Timeout { limit: 0, .. }), "{error}");
    }
    let error = Mesh::cube(1.0).triangles_once_cut(&options, usize::MAX).unwrap_err();
    assert!(error.to_string().contains("cutting long triangles takes longer"), "{error}");
    // Each step by itself.
    let mesh = Mesh::cube(1.0);
    assert!(super::refine(&mesh, 0.1, 1 << 20, options.deadline).is_err());
    assert!(
        super::super::corner_normals(&mesh, (60.0, super::Grouping::Cones), options.deadline)
            .is_err()
    );
}
