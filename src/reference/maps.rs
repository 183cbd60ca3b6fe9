//! The maps from which the lights of a picture follow: what the scene absorbs along the light.

use super::{
    Frame,
    composite::Composite,
    images::Row,
    lamps::{Lamps, Map, Openness},
};
use crate::{
    Result,
    math::{Bounds, View},
    parallel::prelude::*,
    scene::{KeyLight, Lighting, MapView, Occlusion, OcclusionBox, Scene, Settings, Sky},
};
use glam::{DVec3, DVec4};

/// The largest optical depth of a sheet of a map.
const MOST_DEPTH: f64 = 16.0;

impl Map {
    /// Draws the optical depth of a scene in front of each place of a map.
    fn of_depth(scene: &Scene, view: MapView, settings: &Settings) -> Result<Self> {
        let settings = view.settings(scene, settings);
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
}

impl Frame<'_> {
    /// Returns the optical depth in front of planes at a pixel. Each sheet meets all of the light.
    fn depths(&self, planes: &[f64], column: i64, row: &Row) -> Vec<f64> {
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
}
