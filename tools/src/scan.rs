//! Scans of any size, made from a small mesh: its triangles are subdivided into four repeatedly,
//! and its surface is displaced by waves.

use glam::Vec3;
use splatkit::surface::Mesh;
use std::collections::HashMap;

/// Height and lengths of the waves, in mean edge lengths of the original mesh.
const HEIGHT: f32 = 0.06;
const LENGTHS: [f32; 3] = [1.3, 2.1, 3.7];

/// Subdivides each triangle into four while the mesh has at most `most` vertices, and displaces the
/// vertices along their normals by smooth waves. Keeps positions and triangles only.
pub fn scan(mesh: &Mesh, most: usize) -> Mesh {
    let edge = mean_edge(mesh);
    let mut fine = Mesh {
        positions: mesh.positions.clone(),
        triangles: mesh.triangles.clone(),
        ..Mesh::default()
    };
    fine.origin = mesh.origin;
    // An edge of a closed mesh belongs to two triangles.
    while fine.positions.len() + fine.triangles.len() * 3 / 2 <= most {
        cut_in_four(&mut fine);
    }
    let normals = normals(&fine);
    for (place, normal) in fine.positions.iter_mut().zip(normals) {
        let wave = |length: f32| {
            let turn = *place * (std::f32::consts::TAU / (length * edge));
            turn.x.sin() + turn.y.sin() + turn.z.sin()
        };
        let height: f32 = LENGTHS.map(wave).iter().sum::<f32>() * HEIGHT * edge / 9.0;
        *place += normal * height;
    }
    fine
}

fn mean_edge(mesh: &Mesh) -> f32 {
    let first =
        |t: &[u32; 3]| mesh.positions[t[0] as usize].distance(mesh.positions[t[1] as usize]);
    mesh.triangles.iter().map(first).sum::<f32>() / mesh.triangles.len().max(1) as f32
}

fn cut_in_four(mesh: &mut Mesh) {
    let mut middles: HashMap<[u32; 2], u32> = HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
    let mut triangles = Vec::with_capacity(mesh.triangles.len() * 4);
    for &[a, b, c] in &mesh.triangles {
        let mut middle = |p: u32, q: u32| {
            *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                mesh.positions
                    .push((mesh.positions[p as usize] + mesh.positions[q as usize]) * 0.5);
                mesh.positions.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    mesh.triangles = triangles;
}

/// Returns the unit normals of the vertices, weighted by area.
fn normals(mesh: &Mesh) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|vertex| mesh.positions[vertex as usize]);
        let cross = (b - a).cross(c - a);
        t.iter().for_each(|&vertex| normals[vertex as usize] += cross);
    }
    normals.iter().map(|normal| normal.normalize_or_zero()).collect()
}

/// Returns a binary PLY file of a mesh's positions and triangles.
pub fn ply(mesh: &Mesh) -> Vec<u8> {
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
         property float y\nproperty float z\nelement face {faces}\n\
         property list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    bytes.reserve(12 * vertices + 13 * faces);
    for place in &mesh.positions {
        let place = mesh.origin.as_vec3() + *place;
        place.to_array().iter().for_each(|part| bytes.extend(part.to_le_bytes()));
    }
    for triangle in &mesh.triangles {
        bytes.push(3);
        triangle.iter().for_each(|vertex| bytes.extend(vertex.to_le_bytes()));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scan_is_the_same_surface_in_waves() {
        let sphere = Mesh::sphere(2);
        let fine = scan(&sphere, 20 * sphere.positions.len());
        // A closed mesh has two vertices fewer than half its triangles.
        assert_eq!(fine.triangles.len(), 16 * sphere.triangles.len());
        assert_eq!(fine.positions.len(), fine.triangles.len() / 2 + 2);
        let radii = || fine.positions.iter().map(|p| p.length());
        let (low, high) = (radii().fold(f32::MAX, f32::min), radii().fold(0.0, f32::max));
        assert!(low > 0.9 && high < 1.05 && high - low > 0.01, "{low} {high}");
    }

    #[test]
    fn files_hold_the_mesh() {
        let mesh = Mesh::cube(2.0);
        let bytes = ply(&mesh);
        let end = bytes.windows(11).position(|part| part == b"end_header\n").unwrap() + 11;
        assert_eq!(bytes.len() - end, 8 * 12 + 12 * 13);
        assert_eq!(bytes[end..end + 4], mesh.positions[0].x.to_le_bytes());
    }
}
