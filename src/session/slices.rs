//! Slices and pictures: volumes of one sample along an axis, which are seen head-on.

use crate::{
    about::{Frame, Orientation},
    facet::Texture,
    surface::{Material, Mesh},
    volume::{Arrangement, Volume},
};
use glam::{DVec3, Vec2};

/// Returns the axes of a slice, in their order; `None` for other volumes.
fn axes(volume: &Volume) -> Option<[usize; 2]> {
    let dims = volume.lattice.dims;
    let is_cartesian = !matches!(volume.lattice.arrangement, Arrangement::BodyCentred);
    let wide: Vec<usize> = (0..3).filter(|axis| dims[*axis] > 1).collect();
    <[usize; 2]>::try_from(wide).ok().filter(|_| is_cartesian)
}

/// Returns how a slice is looked at: its front is against the viewer, and up is up in the picture.
/// `None` for volumes of several slices.
///
/// The first axis of a slice runs to the right, and the second one upwards, unless the file says
/// otherwise. Slices of patients are seen as radiologists see them: from the feet, from the front
/// or from the left.
pub(super) fn facing(volume: &Volume) -> Option<Orientation> {
    let [right, up] = axes(volume)?.map(|axis| volume.lattice.axes.col(axis));
    let normal = right.cross(up).try_normalize()?;
    let about = &volume.about;
    if about.frame == Frame::Patient {
        let wanted = match normal.abs().to_array() {
            [x, y, z] if z >= x && z >= y => Orientation { up: DVec3::Y, front: DVec3::NEG_Z },
            [x, y, _] if y >= x => Orientation::RAS,
            _ => Orientation { up: DVec3::Z, front: DVec3::NEG_X },
        };
        let front = normal * wanted.front.dot(normal).signum();
        let up = (wanted.up - front * wanted.up.dot(front)).try_normalize()?;
        return Some(Orientation { up, front });
    }
    let stated = about.orientation.filter(|stated| stated.front.dot(normal).abs() > 0.99);
    let up = (up - right * up.dot(right) / right.length_squared()).try_normalize()?;
    Some(stated.unwrap_or(Orientation { up, front: normal }))
}

/// Returns a slice as a sheet that shows these colours of its samples, without light.
pub(super) fn sheet(volume: &Volume, colors: &[[u8; 4]]) -> Option<Mesh> {
    let (lattice, [first, second]) = (&volume.lattice, axes(volume)?);
    let [width, height] = [first, second].map(|axis| lattice.dims[axis]);
    let origin = volume.bounds().center();
    // Samples are in the middle of their texels.
    let corner = |[u, v]: [f64; 2]| {
        let mut steps = DVec3::ZERO;
        steps[first] = u * width as f64 - 0.5;
        steps[second] = v * height as f64 - 0.5;
        (lattice.position(steps) - origin).as_vec3()
    };
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let [width, height] = [width, height].map(|count| u32::try_from(count).ok());
    let texture = Texture { width: width?, height: height?, texels: colors.to_vec() };
    let material = Material {
        color: [1.0; 4],
        texture: Some(texture.into()),
        unlit: true,
        ..Material::default()
    };
    Some(Mesh {
        origin,
        positions: corners.map(corner).to_vec(),
        uvs: corners.map(|[u, v]| Vec2::new(u as f32, v as f32)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0; 2],
        materials: vec![material],
        about: volume.about.clone(),
        ..Mesh::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};

    fn slice(dims: [usize; 3]) -> Volume {
        let count = dims.iter().product::<usize>();
        let lattice = Lattice::with_spacing(dims, DVec3::ONE);
        Volume::new(lattice, Samples::U8((0..count as u8).collect())).unwrap()
    }

    #[test]
    fn slices_are_seen_head_on() {
        assert_eq!(facing(&slice([4, 3, 1])), Some(Orientation::Y_UP));
        assert_eq!(facing(&slice([4, 1, 3])), Some(Orientation::SURVEY));
        let from_the_side = facing(&slice([1, 4, 3])).unwrap();
        assert_eq!([from_the_side.up, from_the_side.front], [DVec3::Z, DVec3::X]);
        assert_eq!([[4, 3, 2], [4, 1, 1]].map(|dims| facing(&slice(dims))), [None; 2]);
        let mut picture = slice([4, 3, 1]);
        picture.about.orientation = Some(Orientation::Y_DOWN);
        assert_eq!(facing(&picture), Some(Orientation::Y_DOWN));
        let mut axial = slice([4, 3, 1]);
        axial.about.frame = Frame::Patient;
        let axial = facing(&axial).unwrap();
        assert_eq!([axial.up, axial.front], [DVec3::Y, DVec3::NEG_Z]);
    }

    #[test]
    fn sheets_reach_half_a_step_beyond_the_samples() {
        let volume = slice([4, 1, 3]);
        let mesh = sheet(&volume, &[[9; 4]; 12]).unwrap();
        let places = mesh.positions.iter().map(|place| mesh.origin + place.as_dvec3());
        let places: Vec<DVec3> = places.collect();
        assert_eq!(places[0], DVec3::new(-0.5, 0.0, -0.5));
        assert_eq!(places[2], DVec3::new(3.5, 0.0, 2.5));
    }
}
