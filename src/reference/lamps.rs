//! Light that is not from the eye, and what keeps light away.

use super::{Frame, composite::Composite, ray::Ray, shade::Reaching};
use crate::{
    Result,
    math::{Bounds, View},
    parallel::prelude::*,
    scene::{KeyLight, Lighting, MapView, Occlusion, OcclusionBox, Scene, Settings, Sky},
};
use glam::{DVec3, DVec4};

/// The lights of a picture.
pub(super) struct Lamps {
    pub lighting: Lighting,
    view: View,
    open: Option<Openness>,
    /// The map of the key lamp's light, if it casts shadows.
    key: Option<Map>,
}

/// Numbers at the pixels and planes of a map.
struct Map {
    view: MapView,
    /// For each pixel, row by row, a number for each plane.
    numbers: Vec<f64>,
}

/// The mean direction of the light from all sides in the world, and its amount, at the nodes of a
/// lattice; without nodes, everywhere as in the open.
struct Openness {
    place: OcclusionBox,
    nodes: Vec<DVec4>,
    open: DVec4,
}

/// The largest optical depth of a sheet of a map.
const MOST_DEPTH: f64 = 16.0;

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
    /// Draws the optical depth of a scene in front of each place of a map.
    fn of_depth(scene: &Scene, view: MapView, settings: &Settings) -> Result<Self> {
        let settings = view.settings(settings);
        let (flat, trained) = super::with_cuts(scene, &view.view, &settings)?;
        let frame = Frame::new(scene, &flat, &trained, view.view.clone(), &settings);
        let planes = view.planes();
        let rows: Vec<Vec<f64>> = (0..view.size)
            .into_par_iter()
            .map(|number| {
                let row = frame.met_by_row(number.into());
                let pixel = |column: i64| frame.depths(&planes, column, &row);
                (0..i64::from(view.size)).flat_map(pixel).collect()
            })
            .collect();
        Ok(Self { view, numbers: rows.concat() })
    }

    /// Returns the number at a place: columns, rows and planes.
    fn at(&self, place: DVec3) -> f64 {
        let size = self.view.size as usize;
        let number =
            |[i, j, k]: [usize; 3]| DVec4::splat(self.numbers[(j * size + i) * (size + 1) + k]);
        between([size, size, size + 1], place, number).x
    }
}

impl Frame<'_> {
    /// Returns the optical depth in front of planes at a pixel. Each sheet meets all of the light.
    fn depths(&self, planes: &[f64], column: i64, row: &super::images::Row) -> Vec<f64> {
        let sheets = self.sheets_of_pixel(column, row);
        let mut depths = vec![0.0; planes.len()];
        for (k, sheet) in sheets.iter().enumerate() {
            let mut composite = Composite::EMPTY;
            sheet.add(&mut composite, self.span(k));
            let depth = (-(-composite.opacity).ln_1p()).min(MOST_DEPTH);
            let [from, to] = self.span(k);
            for (sum, plane) in depths.iter_mut().zip(planes) {
                *sum += depth * ((plane - from) / (to - from)).clamp(0.0, 1.0);
            }
        }
        depths
    }
}

impl Openness {
    fn new(
        scene: &Scene,
        occlusion: Option<&Occlusion>,
        sky: Option<Sky>,
        settings: &Settings,
    ) -> Result<Self> {
        let bounds = scene.bounds();
        let up = sky.map_or(DVec3::ZERO, |sky| sky.up.normalize());
        let open = (up / 3.0).extend(1.0);
        let place = OcclusionBox::around(&bounds, occlusion.map_or(8, |all| all.resolution));
        let Some(occlusion) = occlusion else { return Ok(Self { place, nodes: Vec::new(), open }) };
        let [width, height, depth] = place.size;
        let mut nodes = vec![DVec4::ZERO; width * height * depth];
        for axis in occlusion.directions() {
            let view = MapView::along(axis, &bounds, occlusion.resolution);
            let reach = DVec3::Z * (occlusion.radius * bounds.diagonal() / view.step);
            let map = Map::of_depth(scene, view, settings)?;
            nodes.par_iter_mut().enumerate().for_each(|(number, node)| {
                let at = [number % width, number / width % height, number / (width * height)];
                let here = map.view.place(place.node(at));
                for towards in [-axis, axis] {
                    let far = if towards == axis { here + reach } else { here - reach };
                    let depth = (map.at(far) - map.at(here)).abs();
                    let light = sky.map_or(1.0, |sky| sky.brightness(towards)) * (-depth).exp();
                    *node += 0.5 / f64::from(occlusion.axes) * light * towards.extend(1.0);
                }
            });
        }
        for node in &mut nodes {
            *node = open + occlusion.strength * (*node - open);
        }
        Ok(Self { place, nodes, open })
    }

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

/// Returns the map of the key lamp's light.
fn key_map(
    scene: &Scene,
    bounds: &Bounds,
    (view, key): (&View, &KeyLight),
    settings: &Settings,
) -> Result<Map> {
    let travels = -(view.rotation.transpose() * key.direction);
    let mut map = Map::of_depth(scene, MapView::along(travels, bounds, key.shadows), settings)?;
    map.numbers.iter_mut().for_each(|depth| *depth = (-*depth).exp());
    Ok(map)
}

impl Lamps {
    /// Returns the lights of a picture; `None` if all light comes from the eye.
    pub fn new(scene: &Scene, view: &View, settings: &Settings) -> Result<Option<Self>> {
        let lighting = settings.lighting;
        if lighting.is_plain() {
            return Ok(None);
        }
        let Lighting { key, sky, occlusion, .. } = lighting;
        let has_open = sky.is_some() || occlusion.is_some();
        let open = has_open.then(|| Openness::new(scene, occlusion.as_ref(), sky, settings));
        let key = key.filter(|key| key.shadows > 0);
        let key = key.map(|key| key_map(scene, &scene.bounds(), (view, &key), settings));
        let (open, key) = (open.transpose()?, key.transpose()?);
        Ok(Some(Self { lighting, view: view.clone(), open, key }))
    }

    /// Returns the light at a distance along a ray, before a surface whose normal is as long as it
    /// is certain, and points towards the eye.
    pub fn reaching(&self, ray: &Ray, distance: f64, normal: DVec3) -> Reaching {
        let out = normal - (1.0 - normal.length()) * ray.direction;
        let to_world = self.view.rotation.transpose();
        let world = |step: f64| {
            let place = ray.point(distance) + Lighting::AHEAD * step * out;
            self.view.position + to_world * place
        };
        let mut reaching = Reaching { side: DVec3::ZERO, open: 1.0, key: 1.0 };
        if let Some(open) = &self.open {
            let light = open.at(world(open.place.step));
            reaching.side = self.view.rotation * light.truncate();
            reaching.open = light.w;
        }
        if let Some(map) = &self.key {
            reaching.key = map.at(map.view.place(world(map.view.step)));
        }
        reaching
    }
}
