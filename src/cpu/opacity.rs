//! Maps of what the scene absorbs along parallel light. They are drawn as pictures are, sheet by
//! sheet, but each sheet meets all of the light, and its optical depth is written down.

use super::{BLOCK, Clock, CpuRenderer, TileLists, march::March, tile_map::TileMap};
use crate::{
    Error, Result,
    math::View,
    plan::{
        TILE,
        lamps::{OpacityMap, Openness, ShadowMap, Shadows},
    },
    scene::{Clip, KeyLight, MapView, Occlusion, Settings, Sky},
};
use fearless_simd::Level;
use glam::DMat3;
use std::sync::Arc;
use web_time::Instant;

/// What keeps light away in the last picture, and what it depends on besides the scene.
#[derive(Debug, Default)]
pub struct ShadowCache {
    open: Option<(OpenCause, Option<Arc<Openness>>)>,
    key: Option<(KeyCause, Option<Arc<ShadowMap>>)>,
}

/// What the light from all sides depends on.
type OpenCause = (Option<Occlusion>, Option<Sky>, Vec<Clip>);

/// What the light of the key lamp depends on: the lamp, the turn of the view, and the clips.
type KeyCause = (Option<KeyLight>, DMat3, Vec<Clip>);

/// Returns what was made for the same cause, or makes it anew.
fn kept<C: PartialEq, T>(
    slot: Option<(C, Option<Arc<T>>)>,
    cause: C,
    make: impl FnOnce() -> Result<Option<T>>,
) -> Result<(C, Option<Arc<T>>)> {
    match slot {
        Some((last, value)) if last == cause => Ok((cause, value)),
        _ => Ok((cause, make()?.map(Arc::new))),
    }
}

impl ShadowCache {
    /// Forgets the shadows, because the scene changes.
    pub fn forget(&mut self) {
        *self = Self::default();
    }
}

impl CpuRenderer {
    /// Returns what keeps light away in a picture.
    pub(crate) fn shadows(&mut self, view: &View, settings: &Settings) -> Result<Shadows> {
        let lighting = &settings.lighting;
        if lighting.is_plain() || !self.scene.is_lit(settings) {
            return Ok(Shadows::default());
        }
        let (bounds, clips) = (self.scene.bounds(), &settings.clips);
        let cause = (lighting.occlusion, lighting.sky, clips.clone());
        let open = kept(self.shadows.open.take(), cause, || {
            Openness::of(&bounds, lighting, |map| self.map(map, settings))
        })?;
        let cause = (lighting.key, view.rotation, clips.clone());
        let key = kept(self.shadows.key.take(), cause, || {
            ShadowMap::of(&bounds, (view, lighting), |map| self.map(map, settings))
        })?;
        let shadows = Shadows { open: open.1.clone(), key: key.1.clone() };
        self.shadows = ShadowCache { open: Some(open), key: Some(key) };
        Ok(shadows)
    }

    /// Draws a map.
    fn map(&mut self, map: MapView, settings: &Settings) -> Result<OpacityMap> {
        let settings = &map.settings(&self.scene, settings);
        let outline = self.outline(&map.view, settings)?;
        let plans = self.plans(&map.view, settings, &outline);
        let records = self.records(&plans, settings, &outline)?;
        let planes: Vec<f32> = map.planes().iter().map(|plane| *plane as f32).collect();
        let width = map.size as usize;
        let mut depths = vec![0.0; width * width * planes.len()];
        let bands = depths.chunks_mut(width * BLOCK * TILE * planes.len()).collect();
        let (level, planes) = (self.level, &planes);
        let mut clock = Clock { last: Instant::now(), steps: Vec::new() };
        let job = (&plans[..], &outline, &records[..]);
        self.march(job, &mut clock, bands, |march, row, band: &mut [f32]| {
            let blocks: Vec<Vec<Vec<f32>>> =
                row.map(|(at, entries)| map_block(level, march, at, &entries, planes));
            write_band(&blocks, band, width, planes.len());
        });
        self.spare = records;
        if settings.controls.stop.is_requested() {
            return Err(Error::Stopped);
        }
        Ok(OpacityMap { view: map, depths })
    }
}

/// Returns the optical depths of the tiles of a block, row by row. A tile that absorbs nothing has
/// no numbers.
fn map_block(
    level: Level,
    march: &March,
    [column, row]: [usize; 2],
    entries: &TileLists,
    planes: &[f32],
) -> Vec<Vec<f32>> {
    let tiles = march.plans[0].tiles();
    let tile = |number: usize| {
        let at = [column * BLOCK + number % BLOCK, row * BLOCK + number / BLOCK];
        if at[0] >= tiles[0] || at[1] >= tiles[1] {
            return Vec::new();
        }
        let entries = entries.of(number);
        let mut map = TileMap::new(planes);
        let mut count = 0;
        let _ = march.draw(level, at, entries, &mut count, Some(&mut map));
        map.into_depths()
    };
    (0..BLOCK * BLOCK).map(tile).collect()
}

/// Writes the pixels of a row of blocks, and adds up the optical depths of each.
fn write_band(blocks: &[Vec<Vec<f32>>], band: &mut [f32], width: usize, count: usize) {
    for (number, depths) in band.chunks_mut(count).enumerate() {
        let [x, y] = [number % width, number / width];
        let tiles = &blocks[x / (BLOCK * TILE)];
        let tile = tiles.get(y / TILE * BLOCK + x / TILE % BLOCK).map_or(&[][..], Vec::as_slice);
        let pixel = y % TILE * TILE + x % TILE;
        let Some(steps) = tile.get(pixel * count..(pixel + 1) * count) else { continue };
        let mut sum = 0.0;
        for (depth, step) in depths.iter_mut().zip(steps) {
            sum += step;
            *depth = sum;
        }
    }
}
