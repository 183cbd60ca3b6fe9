use super::*;
use crate::{splat::decode_normal, surface::Sensor};
use std::f32::consts::TAU;

fn random() -> impl FnMut() -> f32 {
    let mut state = 7u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    }
}

/// Points spread evenly over a sphere of radius 1, along a spiral.
fn sphere(count: usize, center: Vec3) -> Vec<Vec3> {
    let golden = TAU * (3.0 - 5f32.sqrt()) / 2.0;
    (0..count)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f32 / count as f32;
            let (sin, cos) = (golden * i as f32).sin_cos();
            center + Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
        })
        .collect()
}

fn torus(count: usize) -> Vec<Vec3> {
    let mut random = random();
    (0..count)
        .map(|_| {
            let (around, along) = (random() * TAU, random() * TAU);
            let ring = 2.0 + around.cos();
            Vec3::new(ring * along.cos(), ring * along.sin(), around.sin())
        })
        .collect()
}

fn cloud(positions: Vec<Vec3>) -> Mesh {
    Mesh { positions, ..Mesh::default() }
}

/// The normals of the surfels, one for each point.
fn normals(mesh: &Mesh) -> Vec<Vec3> {
    let splats = all_surfels(mesh, &SurfelOptions::default());
    assert_eq!(splats.len(), mesh.positions.len());
    splats.iter().map(|splat| decode_normal(splat.normal).expect("a normal")).collect()
}

/// The fraction of the points whose normal is on the same side as `outward`.
fn agreement(mesh: &Mesh, outward: impl Fn(Vec3) -> Vec3) -> f64 {
    let right = normals(mesh)
        .iter()
        .zip(&mesh.positions)
        .filter(|(n, p)| n.dot(outward(**p)) > 0.0)
        .count();
    right as f64 / mesh.positions.len() as f64
}

#[test]
fn closed_surfaces_face_outward() {
    let center = Vec3::new(40.0, -7.0, 3.0);
    assert!(agreement(&cloud(sphere(5000, center)), |p| p - center) >= 0.999);
    let ring = |p: Vec3| p - Vec3::new(p.x, p.y, 0.0).normalize() * 2.0;
    assert!(agreement(&cloud(torus(20_000)), ring) >= 0.999);
    // Two separate spheres, then one inside another.
    let far = Vec3::X * 5.0;
    let both = [sphere(2000, Vec3::ZERO), sphere(2000, far)].concat();
    assert!(agreement(&cloud(both), |p| if p.x < 2.5 { p } else { p - far }) >= 0.999);
    let inner =
        sphere(3000, Vec3::ZERO).iter().map(|&p| p * 3.0).chain(sphere(3000, Vec3::ZERO)).collect();
    assert!(agreement(&cloud(inner), |p| p) >= 0.999);
}

/// Points on the plane z = `height`, about 1 apart.
fn sheet(height: f32) -> Vec<Vec3> {
    let mut random = random();
    (0..2500)
        .map(|i| {
            Vec3::new((i % 50) as f32 + 0.6 * random(), (i / 50) as f32 + 0.6 * random(), height)
        })
        .collect()
}

#[test]
fn sheets_near_each_other_each_have_one_side() {
    let mesh = cloud([sheet(0.0), sheet(5.0)].concat());
    assert!(agreement(&mesh, |p| Vec3::Z * (p.z - 2.5)) >= 0.999, "both face away from the middle");
    assert!(agreement(&cloud(sheet(3.0)), |_| Vec3::Z) >= 0.999, "one alone faces up");
}

#[test]
fn what_a_scanner_saw_faces_it_and_what_the_file_says_stays() {
    let mut mesh = cloud([sheet(0.0), sheet(5.0)].concat());
    // Each sheet was seen from the gap between them.
    mesh.sensors = vec![Sensor { position: Vec3::new(25.0, 25.0, 2.5), points: 0..5000 }];
    assert!(agreement(&mesh, |p| Vec3::Z * (2.5 - p.z)) == 1.0);
    mesh.sensors[0].points = 2500..9999;
    assert!(agreement(&mesh, |_| Vec3::NEG_Z) == 1.0, "the other one is free, and faces outward");
    mesh.normals = (0..5000).map(|i| if i % 2 == 0 { Vec3::X } else { Vec3::ZERO }).collect();
    let normals = normals(&mesh);
    assert!((0..5000).all(|i| if i % 2 == 0 {
        normals[i].x > 0.999
    } else {
        normals[i].z < -0.999
    }));
}

#[test]
fn strays_that_are_neighbours_are_small_and_coarse_sheets_stay_closed() {
    let width = |splat: &Splat| splat.factor.iter().fold(0f32, |most, part| most.max(part.abs()));
    let widths = |others: Vec<Vec3>| -> Vec<f32> {
        let mesh = cloud([sheet(0.0), others].concat());
        all_surfels(&mesh, &SurfelOptions::default()).iter().map(width).collect()
    };
    let widest = |widths: &[f32]| widths.iter().copied().fold(0.0, f32::max);
    // Twenty points, about 8 from each other.
    let mut random = random();
    let mut place = || Vec3::new(random(), random(), random()) * 25.0 + Vec3::Z * 40.0;
    let strays = widths((0..20).map(|_| place()).collect());
    assert!(widest(&strays[2500..]) <= widest(&strays[..2500]), "{:?}", &strays[2500..]);
    // A sheet of a hundred points, 8 from each other.
    let coarse = |at: usize| Vec3::new((at % 10) as f32, (at / 10) as f32, 0.0) * 8.0;
    let sheets = widths((0..100).map(|at| coarse(at) + Vec3::Z * 90.0).collect());
    let narrowest = sheets[2500..].iter().copied().fold(f32::INFINITY, f32::min);
    assert!(narrowest > 3.0 * widest(&sheets[..2500]), "{narrowest}");
}

#[test]
fn lone_points_are_small_and_change_no_others() {
    let plain = cloud(sheet(0.0));
    let options = SurfelOptions::default();
    let before = all_surfels(&plain, &options);
    let mut mesh = plain;
    // One just above the sheet, one far away, and a pair.
    mesh.positions.extend(
        [[25.5, 25.5, 12.0], [1e5, 0.0, 0.0], [-300.0, 0.0, 7.0], [-300.0, 0.0, 8.0]]
            .map(Vec3::from),
    );
    let after = all_surfels(&mesh, &options);
    assert_eq!(before, after[..2500]);
    let widest = |splats: &[Splat]| {
        splats.iter().flat_map(|s| s.factor).fold(0f32, |widest, b| widest.max(b.abs()))
    };
    assert!(
        widest(&after[2500..]) <= 1.5 * widest(&before),
        "{} {}",
        widest(&after[2500..]),
        widest(&before)
    );
}

/// A part that was scanned from further away is sampled more coarsely, and still covered.
#[test]
fn coarse_parts_keep_their_width() {
    let coarse = sheet(0.0).iter().map(|&p| p * 10.0 + Vec3::X * 100.0).collect::<Vec<_>>();
    let splats =
        all_surfels(&cloud([sheet(0.0), sheet(9.0), coarse].concat()), &SurfelOptions::default());
    let mean = |splats: &[Splat]| {
        splats.iter().map(|s| f64::from(s.factor[0])).sum::<f64>() / splats.len() as f64
    };
    let ratio = mean(&splats[5000..]) / mean(&splats[..2500]);
    assert!((9.0..11.0).contains(&ratio), "{ratio}");
}

#[test]
fn the_same_each_time() {
    let mesh = cloud(torus(3000));
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let once = all_surfels(&mesh, &SurfelOptions::default());
    assert_eq!(once, alone.install(|| all_surfels(&mesh, &SurfelOptions::default())));
    for count in 0..25 {
        assert_eq!(all_surfels(&cloud(torus(count)), &SurfelOptions::default()).len(), count);
    }
}

fn all_surfels(mesh: &Mesh, options: &SurfelOptions) -> Vec<Splat> {
    surfels(mesh, options).expect("surfels")
}

/// Scans that were registered and joined: several points at each place, within their noise.
#[test]
fn several_points_at_a_place_close_the_surface() {
    let place = |i: usize, k: usize| {
        let noise = |factor: f64| ((((4 * i + k) as f64) * factor).fract() - 0.5) as f32 * 0.02;
        let (x, y) = ((i % 40) as f32, (i / 40) as f32);
        Vec3::new(x + noise(0.754_877), y + noise(0.569_840), noise(0.430_159))
    };
    let sizes = |copies: usize| {
        let positions = (0..1600).flat_map(|i| (0..copies).map(move |k| place(i, k))).collect();
        let mesh = Mesh { positions, ..Mesh::default() };
        let splats = mesh.surfels(&SurfelOptions::default()).unwrap().splats;
        let mut sizes: Vec<f32> = splats.iter().map(|splat| splat.deviations().x).collect();
        sizes.sort_by(f32::total_cmp);
        (splats.len(), sizes[sizes.len() / 2])
    };
    let (_, alone) = sizes(1);
    for copies in [2, 4] {
        let (count, together) = sizes(copies);
        assert_eq!(count, 1600 * copies);
        assert!((0.8..1.3).contains(&(together / alone)), "{copies}: {together} {alone}");
    }
}
