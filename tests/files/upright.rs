//! Scans stand as people know them, however their files are turned.

use glam::{DQuat, DVec3};
use splatkit::{
    formats::{self, ReadOptions},
    input::Limits,
    surface::Mesh,
};
use std::path::{Path, PathBuf};

/// The shared scans and the direction that is up in their files.
const SCANS: [(&str, DVec3); 5] = [
    ("bun_zipper.ply", DVec3::Y),
    ("armadillo.obj", DVec3::Y),
    ("horse.ply", DVec3::Z),
    ("lucy.ply", DVec3::Z),
    ("lion_takanawa.copc.laz", DVec3::Z),
];

fn here() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data")
}

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("SPLATKIT_DATA").map_or_else(here, PathBuf::from);
    folder.is_dir().then_some(folder)
}

#[test]
fn shared_scans_stand() {
    let Some(folder) = data() else {
        eprintln!("skipped: ../shared/data is missing");
        return;
    };
    for (name, up) in SCANS {
        let mesh =
            formats::load_mesh(folder.join(name), &Limits::default(), &ReadOptions::default());
        let mesh = mesh.expect("a scan");
        // The lion's file says how it stands; its points alone must stand too.
        let bare = Mesh { positions: mesh.positions, triangles: mesh.triangles, ..Mesh::default() };
        for turned_up in DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]) {
            let turn = DQuat::from_rotation_arc(up, turned_up);
            let turned = |p: glam::Vec3| (turn * p.as_dvec3()).as_vec3();
            let positions = bare.positions.iter().map(|p| turned(*p)).collect();
            let mesh = Mesh { positions, triangles: bare.triangles.clone(), ..Mesh::default() };
            let guess = mesh.guess_orientation().expect("an orientation").up;
            assert!(guess.distance(turned_up) < 1e-9, "{name} with {turned_up} up: {guess}");
        }
    }
}
