//! Light that is not from the eye, and what keeps light away: maps of the scene's optical depth
//! along the light, and what follows from them at each place. `src/reference/lamps.rs` defines the
//! same in double precision.

use crate::{
    Result,
    math::{Bounds, View},
    parallel::prelude::*,
    scene::{Lighting, MapView, Occlusion, OcclusionBox, Settings, Sky},
};
use glam::{DVec3, Vec3, Vec4};
use std::sync::Arc;

/// The optical depth in front of places, along parallel light. For each pixel, row by row, there is
/// a number for each plane.
#[derive(Debug)]
pub struct OpacityMap {
    pub view: MapView,
    pub depths: Vec<f32>,
}

/// A change of coordinates: each row gives a coordinate, as factors on x, y and z and a constant.
pub type Affine = [[f32; 4]; 3];

/// How much light comes in from all sides, at the nodes of a lattice.
#[derive(Debug)]
pub struct Openness {
    pub place: OcclusionBox,
    /// The mean direction of the light in the world, and its amount: 1 in the open.
    pub nodes: Vec<[f32; 4]>,
}

/// The light of the key lamp that reaches the planes of a map, in 255ths.
#[derive(Debug)]
pub struct ShadowMap {
    pub view: MapView,
    /// As in [`OpacityMap`].
    pub light: Vec<u8>,
}

/// What keeps light away in a scene, as long as neither the scene nor the lights change.
#[derive(Debug, Clone, Default)]
pub struct Shadows {
    pub open: Option<Arc<Openness>>,
    pub key: Option<Arc<ShadowMap>>,
}

/// The lights of a frame, in view space.
#[derive(Debug, Clone)]
pub struct Lamps {
    /// The shares of the diffuse light and of the highlight that come from the eye, from the key
    /// lamp and from the sky.
    pub head: f32,
    pub key: f32,
    pub sky: f32,
    /// The direction towards the key lamp.
    pub key_direction: [f32; 3],
    /// The mean direction of the sky's light in the open. 0 without a sky.
    pub sky_side: [f32; 3],
    pub shadows: Shadows,
    /// How far before a surface its light is taken.
    pub open_step: f32,
    pub key_step: f32,
    /// Places in view space, as nodes of the lattice of openness.
    pub to_open: Affine,
    /// Places in view space, as pixels and planes of the map of shadows.
    pub to_key: Affine,
    /// The rotation of the world's directions to view space.
    pub rotation: [[f32; 3]; 3],
}

impl OpacityMap {
    /// Returns the optical depth at a place, linear between pixels and planes. Beyond the map, the
    /// place counts as that at its rim.
    fn at(&self, place: Vec3) -> f32 {
        let size = self.view.size as usize;
        let most = Vec3::new((size - 1) as f32, (size - 1) as f32, size as f32);
        let place = place.clamp(Vec3::ZERO, most);
        let whole = place.floor().min(most - 1.0);
        let [u, v, w] = (place - whole).to_array();
        let [i, j, k] = whole.to_array().map(|at| at as usize);
        let along = |i: usize, j: usize| {
            let at = (j * size + i) * (size + 1) + k;
            let [near, far] = [self.depths[at], self.depths[at + 1]];
            near + (far - near) * w
        };
        let row = |j: usize| {
            let [left, right] = [along(i, j), along(i + 1, j)];
            left + (right - left) * u
        };
        let [above, below] = [row(j), row(j + 1)];
        above + (below - above) * v
    }
}

impl Openness {
    /// Draws the maps of the light from all sides, if there is any. `map` draws a map.
    ///
    /// # Errors
    /// Those of `map`.
    pub fn of(
        bounds: &Bounds,
        lighting: &Lighting,
        map: impl FnMut(MapView) -> Result<OpacityMap>,
    ) -> Result<Option<Self>> {
        match (&lighting.occlusion, lighting.sky) {
            (Some(occlusion), sky) => Self::gather(bounds, occlusion, sky, map).map(Some),
            (None, Some(sky)) => Ok(Some(Self::clear(bounds, sky))),
            (None, None) => Ok(None),
        }
    }

    /// Returns what a sky gives in the open: the mean direction of its light, and its amount.
    fn open(sky: Option<Sky>) -> Vec4 {
        let up = sky.map_or(DVec3::ZERO, |sky| sky.up.normalize_or_zero());
        (up / 3.0).as_vec3().extend(1.0)
    }

    /// Returns the light under a sky that nothing keeps away.
    fn clear(bounds: &Bounds, sky: Sky) -> Self {
        let place = OcclusionBox { size: [2; 3], ..OcclusionBox::around(bounds, 8) };
        Self { place, nodes: vec![Self::open(Some(sky)).to_array(); 8] }
    }

    /// Gathers the light from all sides. `map` draws a map.
    fn gather(
        bounds: &Bounds,
        occlusion: &Occlusion,
        sky: Option<Sky>,
        mut map: impl FnMut(MapView) -> Result<OpacityMap>,
    ) -> Result<Self> {
        let place = OcclusionBox::around(bounds, occlusion.resolution);
        let [width, height, depth] = place.size;
        let mut sums = vec![Vec4::ZERO; width * height * depth];
        for direction in occlusion.directions() {
            let map = map(MapView::along(direction, bounds, occlusion.resolution))?;
            let ends = Ends::new(&map, direction, bounds, occlusion, sky);
            let slices = sums.par_chunks_mut(width * height).enumerate();
            slices.for_each(|(k, slice)| {
                for (number, node) in slice.iter_mut().enumerate() {
                    ends.add(place.node([number % width, number / width, k]), node);
                }
            });
        }
        let per_direction = 0.5 / occlusion.axes as f32;
        let open = Self::open(sky);
        let strength = occlusion.strength as f32;
        let light = |sum: &Vec4| open.lerp(*sum * per_direction, strength).to_array();
        let nodes: Vec<[f32; 4]> = sums.iter().map(light).collect();
        Ok(Self { place, nodes })
    }
}

/// A map, and the light that comes in from both ends of its axis.
struct Ends<'a> {
    map: &'a OpacityMap,
    /// How far away things count, in planes.
    reach: f32,
    /// The directions towards the light, and its brightness, in front and behind.
    light: [Vec4; 2],
}

impl<'a> Ends<'a> {
    fn new(
        map: &'a OpacityMap,
        direction: DVec3,
        bounds: &Bounds,
        occlusion: &Occlusion,
        sky: Option<Sky>,
    ) -> Self {
        let light = |towards: DVec3| {
            let brightness = sky.map_or(1.0, |sky| sky.brightness(towards));
            (brightness * towards.extend(1.0)).as_vec4()
        };
        Self {
            map,
            reach: (occlusion.radius * bounds.diagonal() / map.view.step) as f32,
            light: [light(-direction), light(direction)],
        }
    }

    /// Adds the light that reaches a place in the world.
    fn add(&self, world: DVec3, sum: &mut Vec4) {
        let place = self.map.view.place(world).as_vec3();
        let reach = Vec3::new(0.0, 0.0, self.reach);
        let [before, here, behind] =
            [place - reach, place, place + reach].map(|place| self.map.at(place));
        let [front, back] = [here - before, behind - here].map(|depth| (-depth).exp());
        *sum += front * self.light[0] + back * self.light[1];
    }
}

impl ShadowMap {
    /// Draws the map of the key lamp's light, if it casts shadows. `map` draws a map.
    ///
    /// # Errors
    /// Those of `map`.
    pub fn of(
        bounds: &Bounds,
        (view, lighting): (&View, &Lighting),
        map: impl FnOnce(MapView) -> Result<OpacityMap>,
    ) -> Result<Option<Self>> {
        let Some(key) = lighting.key.filter(|key| key.shadows > 0) else { return Ok(None) };
        let travels = -(view.rotation.transpose() * key.direction);
        let map = map(MapView::along(travels, bounds, key.shadows))?;
        let light = map.depths.par_iter().map(|depth| (255.0 * (-depth).exp()).round() as u8);
        Ok(Some(Self { light: light.collect(), view: map.view }))
    }
}

impl Lamps {
    /// Returns the lights of a picture, unless all light comes from the eye.
    pub fn new(view: &View, settings: &Settings, shadows: &Shadows) -> Option<Self> {
        let Lighting { head, key, sky, .. } = settings.lighting;
        if settings.lighting.is_plain() {
            return None;
        }
        let key_direction = key.map_or(DVec3::NEG_Z, |key| key.direction.normalize());
        let of_node = |open: &Openness, world: DVec3| (world - open.place.origin) / open.place.step;
        let Shadows { open, key: map } = shadows;
        let step = |length: Option<f64>| length.map_or(0.0, |step| Lighting::AHEAD * step) as f32;
        Some(Self {
            head: head as f32,
            key: key.map_or(0.0, |key| key.share) as f32,
            sky: sky.map_or(0.0, |sky| sky.share) as f32,
            key_direction: key_direction.as_vec3().to_array(),
            sky_side: (view.rotation * Openness::open(sky).truncate().as_dvec3())
                .as_vec3()
                .to_array(),
            shadows: shadows.clone(),
            open_step: step(open.as_ref().map(|open| open.place.step)),
            key_step: step(map.as_ref().map(|map| map.view.step)),
            to_open: affine(view, |world| {
                open.as_ref().map_or(DVec3::ZERO, |open| of_node(open, world))
            }),
            to_key: affine(view, |world| {
                map.as_ref().map_or(DVec3::ZERO, |map| map.view.place(world))
            }),
            rotation: view.rotation.transpose().as_mat3().to_cols_array_2d(),
        })
    }
}

/// Returns an affine function of places in the world as one of places in view space.
fn affine(view: &View, place: impl Fn(DVec3) -> DVec3) -> Affine {
    let back = view.rotation.transpose();
    let start = place(view.position);
    let columns = [back.x_axis, back.y_axis, back.z_axis]
        .map(|axis| place(view.position + axis) - start)
        .map(|column| column.as_vec3().to_array());
    let start = start.as_vec3().to_array();
    std::array::from_fn(|row| [columns[0][row], columns[1][row], columns[2][row], start[row]])
}
