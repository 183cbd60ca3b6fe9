//! Light that is not from the eye, and what keeps light away.

use super::{
    ray::Ray,
    shade::{self, Reaching},
};
use crate::{
    math::View,
    scene::{Aside, Lighting, MapView, OcclusionBox},
    volume::Shade,
};
use glam::{DVec3, DVec4};

/// The lights of a picture.
pub(super) struct Lamps {
    pub lighting: Lighting,
    pub view: View,
    pub open: Option<Openness>,
    /// The map of the key lamp's light, if it casts shadows.
    pub key: Option<Map>,
}

/// Numbers at the pixels and planes of a map.
pub(super) struct Map {
    pub view: MapView,
    /// For each pixel, row by row, a number for each plane.
    pub numbers: Vec<f64>,
}

/// The mean direction of the light from all sides in the world, and its amount, at the nodes of a
/// lattice; without nodes, everywhere as in the open.
pub(super) struct Openness {
    pub place: OcclusionBox,
    pub nodes: Vec<DVec4>,
    pub open: DVec4,
}

/// Returns the mean of numbers at the corners of a lattice's cells around a place. Beyond the
/// lattice, a place counts as that at its rim.
fn between(size: [usize; 3], place: DVec3, number: impl Fn([usize; 3]) -> DVec4) -> DVec4 {
    let most = DVec3::from_array(size.map(|side| (side - 1) as f64));
    let place = place.clamp(DVec3::ZERO, most);
    let first = place.floor().min(most - 1.0);
    let part = place - first;
    let first = first.to_array().map(|at| at as usize);
    let mut sum = DVec4::ZERO;
    for corner in 0..8 {
        let far = [0, 1, 2].map(|axis| corner >> axis & 1);
        let shares = [0, 1, 2].map(|axis| match far[axis] {
            0 => 1.0 - part[axis],
            _ => part[axis],
        });
        let at = [0, 1, 2].map(|axis| first[axis] + far[axis]);
        sum += shares.iter().product::<f64>() * number(at);
    }
    sum
}

impl Map {
    /// Returns the number at a place: columns, rows and planes.
    pub fn at(&self, place: DVec3) -> f64 {
        let size = self.view.size as usize;
        let number =
            |[i, j, k]: [usize; 3]| DVec4::splat(self.numbers[(j * size + i) * (size + 1) + k]);
        between([size, size, size + 1], place, number).x
    }
}

impl Openness {
    /// Returns the mean direction and the amount of light at a place in the world.
    fn at(&self, world: DVec3) -> DVec4 {
        if self.nodes.is_empty() {
            return self.open;
        }
        let [width, height, _] = self.place.size;
        let place = (world - self.place.origin) / self.place.step;
        between(self.place.size, place, |[i, j, k]| self.nodes[(k * height + j) * width + i])
    }
}

impl Lamps {
    /// Returns the colour of a surface at a distance along a ray.
    pub fn lit(
        &self,
        color: DVec3,
        normal: DVec3,
        (ray, distance): (&Ray, f64),
        (shade, aside): (&Shade, Option<&Aside>),
    ) -> DVec3 {
        let reaching = self.reaching((normal, 1.0), (ray, distance), shade);
        let lit = Some((self.lighting, reaching));
        let from = (ray.direction, aside);
        shade::with_light(color, shade::light((normal, 1.0), from, shade, &lit))
    }

    /// Returns the light at a distance along a ray, before a surface with a normal of any length.
    /// With the normal comes how far it counts.
    pub fn reaching(
        &self,
        (normal, share): (DVec3, f64),
        (ray, distance): (&Ray, f64),
        shade: &Shade,
    ) -> Reaching {
        let normal = share * shade::certain_normal(normal, ray.direction, shade);
        let out = normal - (1.0 - normal.length()) * ray.direction;
        let to_world = self.view.rotation.transpose();
        let world = |step: f64| {
            let place = ray.point(distance) + Lighting::AHEAD * step * out;
            self.view.position + to_world * place
        };
        let none = DVec3::ZERO;
        let mut reaching = Reaching { side: none, clear_side: none, open: 1.0, key: 1.0 };
        if let Some(open) = &self.open {
            let light = open.at(world(open.place.step));
            reaching.side = self.view.rotation * light.truncate();
            reaching.clear_side = self.view.rotation * open.open.truncate();
            reaching.open = light.w;
        }
        if let Some(map) = &self.key {
            reaching.key = map.at(map.view.place(world(map.view.step)));
        }
        reaching
    }
}
