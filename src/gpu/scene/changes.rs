//! Changes of a scene that is prepared: items are added, taken out and moved. The data of the other
//! items stay on the GPU, except the images of facets, which share a texture.

use super::{
    bricks::BrickCache,
    chunk::{Chunk, Origin},
    field::Field,
    images::Images,
    nodes::PageCache,
    prepared::{ClippedSolid, LevelledSet, PreparedScene, SeenSet, check_drawable},
};
use crate::{Result, gpu::device::Gpu, math::Pose, scene::Item};

/// The data of an item that is not drawn.
#[derive(Debug, Default)]
pub struct Parked {
    /// The upload of the scene that the data are from.
    upload: u64,
    chunks: Vec<Chunk>,
    levels: Option<LevelledSet>,
    solid: Option<ClippedSolid>,
    seen: Option<SeenSet>,
    page_cache: Option<PageCache>,
    brick_cache: Option<BrickCache>,
    field: Option<Field>,
}

impl Parked {
    /// Returns the bytes of GPU memory.
    fn bytes(&self) -> u64 {
        let of_chunk = |chunk: &Chunk| match &chunk.origin {
            Origin::Nodes { slots, .. } => chunk.bytes() + slots.bytes(),
            Origin::Lattice { selection, .. } => chunk.bytes() + selection.bytes(),
            // Their samples are those of the cache.
            Origin::Bricks { slab, .. } => chunk.spans.size() + slab.bytes(),
            Origin::Splats { .. } | Origin::Facets { .. } => chunk.bytes(),
        };
        self.chunks.iter().map(of_chunk).sum::<u64>()
            + self.brick_cache.as_ref().map_or(0, BrickCache::bytes)
            + self.field.as_ref().map_or(0, Field::bytes)
    }
}

impl PreparedScene {
    /// Adds an item before the one with this number, with its data if they are still there.
    ///
    /// # Errors
    /// Those of [`Renderer::prepare`](crate::gpu::Renderer::prepare). The data on the device are
    /// then not trusted.
    pub(crate) fn insert(
        &mut self,
        number: usize,
        (item, pose): (Item, Option<Pose>),
        parked: Option<Parked>,
    ) -> Result<()> {
        let gpu = self.gpu.clone();
        let mut scene = self.scene.clone();
        scene.insert(number, item, pose);
        check_drawable(&gpu, &scene)?;
        self.scene = scene;
        self.renumber(|old| old + usize::from(old >= number));
        let shows_images = shows_images(&self.scene.items[number]);
        let parked = match parked {
            // The numbers of images may have changed.
            Some(parked) if parked.upload != self.upload || shows_images => {
                self.forget(parked);
                None
            }
            parked => parked,
        };
        let done = gpu.watch(|| {
            if shows_images {
                self.pack_images(&gpu)?;
            }
            match parked {
                Some(parked) => self.put_back(parked, number),
                None => self.prepare_item(&gpu, number)?,
            }
            self.share_volume(number);
            self.number_runs();
            Ok(())
        });
        self.bounds = self.scene.bounds();
        self.broken |= !matches!(done, Ok(Ok(())));
        done?
    }

    /// Takes an item out. Its data stay on the GPU.
    pub(crate) fn take(&mut self, number: usize) -> Result<Parked> {
        let is_taken = |chunk: &mut Chunk| chunk.item == number;
        let mut parked = Parked {
            chunks: self.chunks.extract_if(.., is_taken).collect(),
            upload: self.upload,
            levels: taken(&mut self.levels, |set| set.item == number),
            solid: taken(&mut self.solids, |solid| solid.item == number),
            seen: taken(&mut self.seen, |seen| seen.item == number),
            brick_cache: self.brick_cache.take_if(|cache| cache.item == number),
            field: None,
            page_cache: None,
        };
        if self.field_item == number {
            parked.field = self.field.take();
        }
        if let Some(index) = self.page_caches.iter().position(|cache| cache.item == number) {
            parked.page_cache = Some(self.page_caches.remove(index));
            self.renumber_caches(|old| old - usize::from(old > index));
        }
        let item = self.scene.remove(number);
        self.renumber(|old| old - usize::from(old > number));
        let gpu = self.gpu.clone();
        let done = match shows_images(&item) {
            true => gpu.watch(|| self.pack_images(&gpu))?,
            false => Ok(()),
        };
        self.broken |= done.is_err();
        self.number_runs();
        self.bounds = self.scene.bounds();
        done.map(|()| parked)
    }

    /// Frees the memory of an item that was taken out.
    pub(crate) fn forget(&mut self, parked: Parked) {
        if parked.upload == self.upload {
            self.bytes = self.bytes.saturating_sub(parked.bytes());
        }
    }

    /// Moves an item.
    ///
    /// # Errors
    /// Those of [`Scene::set_pose`](crate::scene::Scene::set_pose).
    pub(crate) fn set_pose(&mut self, number: usize, pose: Pose) -> Result<()> {
        self.scene.set_pose(number, pose)?;
        self.share_volume(number);
        (self.bounds, self.picture) = (self.scene.bounds(), 0);
        Ok(())
    }

    /// Gives the chunks of a volume the lattice of the scene's.
    fn share_volume(&mut self, number: usize) {
        let Item::Volume(moved, ..) = &self.scene.items[number] else { return };
        for chunk in self.chunks.iter_mut().filter(|chunk| chunk.item == number) {
            if let Origin::Lattice { volume, .. } = &mut chunk.origin {
                *volume = moved.clone();
            }
        }
    }

    /// Puts the data of an item back.
    fn put_back(&mut self, parked: Parked, number: usize) {
        let Parked { mut chunks, upload: _, levels, solid, seen, page_cache, brick_cache, field } =
            parked;
        if let Some(mut cache) = page_cache {
            cache.item = number;
            let index = self.page_caches.iter().filter(|other| other.item < number).count();
            self.renumber_caches(|old| old + usize::from(old >= index));
            self.page_caches.insert(index, cache);
            for chunk in &mut chunks {
                if let Origin::Nodes { page_cache, .. } = &mut chunk.origin {
                    *page_cache = index;
                }
            }
        }
        chunks.iter_mut().for_each(|chunk| chunk.item = number);
        self.chunks.extend(chunks);
        if let Some(mut levels) = levels {
            levels.item = number;
            self.levels.push(levels);
        }
        if let Some(mut solid) = solid {
            solid.item = number;
            self.solids.push(solid);
        }
        self.seen.extend(seen.map(|seen| SeenSet { item: number, ..seen }));
        if let Some(mut cache) = brick_cache {
            cache.item = number;
            self.brick_cache = Some(cache);
        }
        match field {
            Some(field) if self.field.is_none() => {
                (self.field, self.field_item) = (Some(field), number);
            }
            Some(field) => self.bytes = self.bytes.saturating_sub(field.bytes()),
            None => {}
        }
    }

    /// Makes the texture of all images anew, and numbers the facets that show them.
    fn pack_images(&mut self, gpu: &Gpu) -> Result<()> {
        let before = self.images.take().map_or(0, |images| images.bytes);
        gpu.check_memory(self.bytes.saturating_sub(before) + Images::bytes_of(&self.scene))?;
        self.images = Images::of(gpu, &self.scene);
        self.bytes = self.bytes.saturating_sub(before)
            + self.images.as_ref().map_or(0, |images| images.bytes);
        let mut last = (usize::MAX, 0);
        for chunk in &mut self.chunks {
            let Origin::Facets { first_textured, .. } = &mut chunk.origin else { continue };
            let Some(first) = self.images.as_ref().and_then(|images| images.first(chunk.item))
            else {
                continue;
            };
            if last.0 != chunk.item {
                last = (chunk.item, 0);
            }
            *first_textured = first + 1 + last.1;
            last.1 += chunk.count;
        }
        // Without room for the images, the facets of all items are cut to texels.
        self.broken |= self.images.is_none() && self.scene.items.iter().any(shows_images);
        Ok(())
    }

    fn renumber(&mut self, number: impl Fn(usize) -> usize) {
        let chunks = self.chunks.iter_mut().map(|chunk| &mut chunk.item);
        let levels = self.levels.iter_mut().map(|set| &mut set.item);
        let solids = self.solids.iter_mut().map(|solid| &mut solid.item);
        let seen = self.seen.iter_mut().map(|seen| &mut seen.item);
        let page_caches = self.page_caches.iter_mut().map(|cache| &mut cache.item);
        let brick_cache = self.brick_cache.iter_mut().map(|cache| &mut cache.item);
        let all = chunks.chain(levels).chain(solids).chain(seen).chain(page_caches);
        for item in all.chain(brick_cache).chain([&mut self.field_item]) {
            *item = number(*item);
        }
        // A picture that was begun holds the data of the scene before.
        (self.tables, self.picture) = (None, 0);
    }

    pub(super) fn renumber_caches(&mut self, number: impl Fn(usize) -> usize) {
        for chunk in &mut self.chunks {
            if let Origin::Nodes { page_cache, .. } = &mut chunk.origin {
                *page_cache = number(*page_cache);
            }
        }
    }
}

/// Whether an item is facets that show images.
fn shows_images(item: &Item) -> bool {
    matches!(item, Item::Facets(set) if !set.texture_coordinates.is_empty())
}

/// Takes the element of a list that is sought.
fn taken<T>(list: &mut Vec<T>, is_sought: impl Fn(&T) -> bool) -> Option<T> {
    list.iter().position(is_sought).map(|index| list.remove(index))
}
