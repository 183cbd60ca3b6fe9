//! Shapes that people know the right way up, in every direction of the axes.

use super::*;
use glam::DQuat;

/// Adds a box, given by its middle and its sides.
fn add_box(mesh: &mut Mesh, middle: [f32; 3], sides: [f32; 3]) {
    let first = mesh.positions.len() as u32;
    let corner = |i: u32| {
        let half = 0.5 * Vec3::from(sides);
        let sign = |bit: u32| if i >> bit & 1 == 0 { -1.0 } else { 1.0 };
        Vec3::from(middle) + half * Vec3::new(sign(0), sign(1), sign(2))
    };
    mesh.positions.extend((0..8).map(corner));
    let faces =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for [a, b, c, d] in faces.map(|face| face.map(|corner| corner + first)) {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
}

/// Adds a surface of revolution around an axis through `middle`; the profile gives distances from
/// that axis and places along it.
fn add_turned(mesh: &mut Mesh, middle: Vec3, axis: Vec3, profile: &[[f32; 2]]) {
    const SIDES: u32 = 32;
    let first = mesh.positions.len() as u32;
    let (u, v) = axis.any_orthonormal_pair();
    for &[radius, along] in profile {
        mesh.positions.extend((0..SIDES).map(|side| {
            let (sin, cos) = (std::f32::consts::TAU * side as f32 / SIDES as f32).sin_cos();
            middle + along * axis + radius * (cos * u + sin * v)
        }));
    }
    for ring in 0..profile.len() as u32 - 1 {
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let [a, b] = [side, next].map(|side| first + ring * SIDES + side);
            mesh.triangles.extend([[a, b, a + SIDES], [b, b + SIDES, a + SIDES]]);
        }
    }
}

fn of(add: impl FnOnce(&mut Mesh)) -> Mesh {
    let mut mesh = Mesh::default();
    add(&mut mesh);
    mesh
}

fn turned(profile: &[[f32; 2]]) -> Mesh {
    of(|mesh| add_turned(mesh, Vec3::ZERO, Vec3::Z, profile))
}

fn table() -> Mesh {
    of(|mesh| {
        add_box(mesh, [0.0, 0.0, 1.0], [2.0, 1.2, 0.1]);
        for (x, y) in [(-0.9, -0.5), (0.9, -0.5), (-0.9, 0.5), (0.9, 0.5)] {
            add_box(mesh, [x, y, 0.5], [0.1, 0.1, 1.0]);
        }
    })
}

fn chair() -> Mesh {
    of(|mesh| {
        add_box(mesh, [0.0, 0.0, 1.0], [1.0, 1.0, 0.1]);
        add_box(mesh, [0.0, 0.45, 1.5], [1.0, 0.1, 1.0]);
        for (x, y) in [(-0.45, -0.45), (0.45, -0.45), (-0.45, 0.45), (0.45, 0.45)] {
            add_box(mesh, [x, y, 0.5], [0.1, 0.1, 1.0]);
        }
    })
}

fn car() -> Mesh {
    of(|mesh| {
        add_box(mesh, [0.0, 0.0, 0.6], [4.2, 1.7, 0.6]);
        add_box(mesh, [-0.4, 0.0, 1.15], [2.0, 1.5, 0.5]);
        let wheel = [[0.0, -0.1], [0.3, -0.1], [0.3, 0.1], [0.0, 0.1]];
        for (x, y) in [(-1.3, -0.8), (1.35, -0.8), (-1.3, 0.8), (1.35, 0.8)] {
            add_turned(mesh, Vec3::new(x, y, 0.3), Vec3::Y, &wheel);
        }
    })
}

fn bowl() -> Mesh {
    let wall = |step: u32, thickness: f32| {
        let z = step as f32 / 20.0;
        [(0.35 + 0.65 * z.sqrt() - thickness).max(0.0), z.max(thickness)]
    };
    let outside = (0..=20).map(|step| wall(step, 0.0));
    let inside = (0..=20).rev().map(|step| wall(step, 0.08));
    let profile: Vec<[f32; 2]> =
        [[0.0, 0.0]].into_iter().chain(outside).chain(inside).chain([[0.0, 0.08]]).collect();
    turned(&profile)
}

fn bottle() -> Mesh {
    turned(&[[0.0, 0.0], [0.4, 0.0], [0.4, 1.0], [0.15, 1.4], [0.13, 1.8], [0.0, 1.8]])
}

/// Wheels with a hole, in which about as many teeth as gaps are left of the rim.
fn gear() -> Mesh {
    of(|mesh| {
        let hub = [[0.3, 0.0], [0.85, 0.0], [0.85, 0.2], [0.3, 0.2], [0.3, 0.0]];
        add_turned(mesh, Vec3::ZERO, Vec3::Z, &hub);
        for tooth in 0..24 {
            let (sin, cos) = (std::f32::consts::TAU * tooth as f32 / 24.0).sin_cos();
            add_box(mesh, [0.92 * cos, 0.92 * sin, 0.1], [0.1, 0.1, 0.2]);
        }
    })
}

/// A figure on two legs, with a head.
fn figure() -> Mesh {
    of(|mesh| {
        for side in [-1.0, 1.0] {
            add_box(mesh, [0.15 * side, 0.03, 0.45], [0.2, 0.3, 0.9]);
            add_box(mesh, [0.4 * side, 0.0, 1.2], [0.12, 0.15, 0.7]);
        }
        add_box(mesh, [0.0, 0.0, 1.25], [0.6, 0.3, 0.7]);
        add_box(mesh, [0.0, -0.03, 1.75], [0.25, 0.25, 0.3]);
    })
}

/// The rotations that turn +Z to each of the six directions.
fn turns() -> impl Iterator<Item = (DVec3, DQuat)> {
    DVec3::AXES
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .map(|up| (up, DQuat::from_rotation_arc(DVec3::Z, up)))
}

fn rotated(mesh: &Mesh, turn: DQuat) -> Mesh {
    let mut mesh = mesh.clone();
    mesh.positions.iter_mut().for_each(|p| *p = (turn * p.as_dvec3()).as_vec3());
    mesh
}

#[test]
fn things_stand_as_people_know_them() {
    let shapes = [
        ("table", table()),
        ("chair", chair()),
        ("car", car()),
        ("bowl", bowl()),
        ("bottle", bottle()),
        ("figure", figure()),
    ];
    let mut wrong = Vec::new();
    for (name, mesh) in &shapes {
        for (up, turn) in turns() {
            let mut mesh = rotated(mesh, turn);
            // Hardly anything stands on its head, or on its side along x: that takes more evidence
            // than most shapes have.
            let is_usual = up == DVec3::Y || up == DVec3::Z;
            let may_be =
                |guess: DVec3| guess == up || !is_usual && [DVec3::Y, DVec3::Z].contains(&guess);
            let guess = mesh.guess_orientation().expect("an orientation").up;
            if !may_be(guess) {
                wrong.push(format!("{name} with {up} up: {guess}"));
            }
            if *name == "bowl" && up.min_element() < 0.0 {
                // Its points alone hide its inside too little to count against the habit.
                continue;
            }
            // Points without triangles stand as the surface does.
            mesh.positions = mesh.spread();
            mesh.triangles.clear();
            let guess = mesh.guess_orientation().expect("an orientation").up;
            if !may_be(guess) {
                wrong.push(format!("points of a {name} with {up} up: {guess}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_plate_lies() {
    for (up, turn) in turns() {
        let guess = rotated(&gear(), turn).guess_orientation().expect("an orientation").up;
        assert!(guess.dot(up).abs() > 0.999, "{up}: {guess}");
    }
}

/// Hills, whose two sides are much alike.
#[test]
fn a_terrain_is_seen_from_above() {
    let place = |i: u32| {
        let (x, y) = ((i % 90) as f32 / 90.0, (i / 90) as f32 / 90.0);
        Vec3::new(x, y, 0.1 * (9.0 * x).sin() * (7.0 * y).cos())
    };
    let terrain = Mesh { positions: (0..8100).map(place).collect(), ..Mesh::default() };
    for (up, turn) in turns().filter(|(up, _)| up.min_element() >= 0.0) {
        assert_eq!(rotated(&terrain, turn).guess_orientation().expect("an orientation").up, up);
    }
}

#[test]
fn a_few_points_far_away_do_not_turn_a_shape() {
    let mut mesh = Mesh { positions: bottle().spread(), ..Mesh::default() };
    let count = mesh.positions.len();
    mesh.positions.extend((0..count / 1500).map(|n| Vec3::new(40.0, 3.0 * n as f32, -9.0)));
    assert_eq!(mesh.guess_orientation().expect("an orientation").up, DVec3::Z);
}

#[test]
fn balls_stand_and_flat_and_empty_shapes_do_not() {
    assert!(Mesh::sphere(4).guess_orientation().is_some());
    assert_eq!(Mesh::default().guess_orientation(), None);
    let square = of(|mesh| add_box(mesh, [0.0; 3], [1.0, 1.0, 0.0]));
    assert_eq!(square.guess_orientation(), None);
    let broken = Mesh {
        positions: vec![Vec3::NAN, Vec3::ONE, Vec3::INFINITY],
        triangles: vec![[0, 1, 2], [9, 1, 1]],
        ..Mesh::default()
    };
    assert_eq!(broken.guess_orientation(), None);
}

/// An animal that looks along +X: a body on four legs, a neck and a head, and a tail.
fn animal() -> Mesh {
    of(|mesh| {
        add_box(mesh, [0.0, 0.0, 1.1], [1.8, 0.6, 0.6]);
        for (x, y) in [(-0.75, -0.22), (0.75, -0.22), (-0.75, 0.22), (0.75, 0.22)] {
            add_box(mesh, [x, y, 0.4], [0.16, 0.14, 0.8]);
        }
        add_box(mesh, [0.95, 0.0, 1.6], [0.3, 0.25, 0.7]);
        add_box(mesh, [1.2, 0.0, 1.9], [0.7, 0.3, 0.3]);
        add_box(mesh, [-0.95, 0.0, 1.1], [0.1, 0.1, 0.7]);
    })
}

/// A person who looks along +X, with feet.
fn person() -> Mesh {
    of(|mesh| {
        for side in [-1.0, 1.0] {
            add_box(mesh, [0.0, 0.15 * side, 0.45], [0.2, 0.2, 0.9]);
            add_box(mesh, [0.08, 0.15 * side, 0.04], [0.36, 0.14, 0.08]);
            add_box(mesh, [0.0, 0.4 * side, 1.2], [0.15, 0.12, 0.7]);
        }
        add_box(mesh, [0.0, 0.0, 1.25], [0.3, 0.6, 0.7]);
        add_box(mesh, [0.03, 0.0, 1.75], [0.25, 0.25, 0.3]);
    })
}

#[test]
fn animals_and_people_look_at_the_camera() {
    for (name, mesh) in [("animal", animal()), ("person", person())] {
        for quarter in 0..4 {
            let turn = DQuat::from_rotation_z(f64::from(quarter) * std::f64::consts::FRAC_PI_2);
            let orientation = rotated(&mesh, turn).guess_orientation().unwrap();
            assert_eq!(orientation.up, DVec3::Z, "{name}, {quarter}");
            let front = turn * DVec3::X;
            assert!(orientation.front.distance(front) < 1e-9, "{name}, {quarter}: {orientation:?}");
        }
        let turn = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let orientation = rotated(&mesh, turn).guess_orientation().unwrap();
        assert_eq!((orientation.up, orientation.front), (DVec3::Y, DVec3::X), "{name}");
    }
}

#[test]
fn what_has_no_face_is_seen_from_the_usual_side() {
    // A bed has a high end above two of its four feet, which is no head.
    let bed = of(|mesh| {
        add_box(mesh, [0.0, 0.0, 0.5], [2.0, 1.0, 0.3]);
        add_box(mesh, [-0.95, 0.0, 0.9], [0.1, 1.0, 0.9]);
        for (x, y) in [(-0.95, -0.45), (0.95, -0.45), (-0.95, 0.45), (0.95, 0.45)] {
            add_box(mesh, [x, y, 0.2], [0.1, 0.1, 0.4]);
        }
    });
    let shapes = [
        ("table", table()),
        ("chair", chair()),
        ("bed", bed),
        ("car", car()),
        ("figure", figure()),
        ("bottle", bottle()),
    ];
    for (name, mesh) in shapes {
        assert_eq!(mesh.guess_orientation(), Some(Orientation::SURVEY), "{name}");
    }
}
