//! The scene that is shown: what was loaded, its camera, and the transfer functions of its fields.

use super::{
    document::{Document, Field, LoadedBy},
    painter::Stage,
};
use crate::{failure::Failure, given::Kinds, job::Finish};
use glam::DVec3;
use splatkit::{
    interaction::Orbit,
    math::Kernel,
    scene::{Item, Settings},
    volume::{TransferFunction, Volume},
};
use std::{path::PathBuf, sync::Arc};

/// The scene that is shown, and how.
pub struct SceneView {
    pub stage: Arc<Stage>,
    pub orbit: Orbit,
    pub settings: Settings,
    pub finish: Arc<Finish>,
    /// The scene's way up.
    pub up: DVec3,
    /// What the scene was loaded by.
    pub loaded_by: LoadedBy,
    /// The inputs that were loaded: those of the items.
    inputs: Vec<PathBuf>,
    /// The transfer functions that the scene was loaded with, with the numbers of their items.
    loaded_transfers: Vec<(usize, TransferFunction)>,
    /// The item whose field is edited.
    pub field: usize,
}

impl SceneView {
    /// Shows a scene that was loaded by the document's description.
    pub fn new(document: &Document, stage: Stage, size: [u32; 2]) -> Result<Self, Failure> {
        let job = document.job(size)?;
        let finish = job.finish(&stage.loaded)?;
        let settings = finish.drawing.settings.clone();
        let camera = job.camera(&stage.loaded, &finish)?;
        let up = job.up(&stage.loaded)?;
        let orbit = Orbit::new(camera, up, stage.loaded.subject.bounds.diagonal());
        let loaded_transfers = stage.transfers();
        // An input may have become several items.
        let names = stage.loaded.items.contents.iter().map(|content| &content.name.text);
        let inputs = names.map(PathBuf::from).collect();
        let field = loaded_transfers.first().map_or(0, |(item, _)| *item);
        let (stage, finish) = (Arc::new(stage), Arc::new(finish));
        let loaded_by = document.loaded_by();
        Ok(Self { stage, orbit, settings, finish, up, loaded_by, inputs, loaded_transfers, field })
    }

    /// Returns the items that have a field, with their names.
    pub fn fields(&self) -> Vec<(usize, String)> {
        let name = |item: usize| {
            let name = self.inputs.get(item).and_then(|file| file.file_name());
            let name = name.map_or(String::new(), |name| name.to_string_lossy().into_owned());
            match self.channel_of(item) {
                Some((_, channel)) => format!("{name}, {channel}"),
                None => name,
            }
        };
        self.loaded_transfers.iter().map(|(item, _)| (*item, name(*item))).collect()
    }

    /// Returns what each visible input is.
    pub fn kinds(&self) -> Vec<Kinds> {
        self.stage.loaded.kinds()
    }

    /// Returns the values that colour a surface, from the first to the last colour.
    pub fn surface_range(&self) -> Option<[f64; 2]> {
        let loaded = &self.stage.loaded;
        let is_surface = |item: usize| {
            loaded.scene.items.get(item).is_some_and(|item| item.transfer().is_none())
        };
        let mut legends = loaded.captions.legends.iter();
        legends.find(|(item, _)| is_surface(*item)).map(|(_, legend)| legend.scale.range)
    }

    /// Returns the transfer functions that show the fields, with the numbers of their items.
    pub fn transfers(&self, document: &Document) -> Vec<(usize, TransferFunction)> {
        let mut all = self.loaded_transfers.clone();
        for (item, transfer) in self.edited_transfers(document) {
            all.iter_mut()
                .filter(|entry| entry.0 == item)
                .for_each(|entry| entry.1.clone_from(&transfer));
        }
        all
    }

    /// Returns the transfer function that shows an item's field.
    pub fn transfer_of(&self, document: &Document, item: usize) -> Option<TransferFunction> {
        let mut transfers = self.transfers(document).into_iter();
        transfers.find(|(number, _)| *number == item).map(|(_, transfer)| transfer)
    }

    /// Returns the transfer functions that may be others than those that the scene was loaded with.
    pub fn edited_transfers(&self, document: &Document) -> Vec<(usize, TransferFunction)> {
        let edited = |(item, _): &(usize, TransferFunction)| {
            Some((*item, document.transfer_of(&self.field_of(document, *item)?)?))
        };
        self.loaded_transfers.iter().filter_map(edited).collect()
    }

    /// Returns the number and the name of the channel that an item's field is, if its file has
    /// several.
    fn channel_of(&self, item: usize) -> Option<(usize, &str)> {
        match self.stage.loaded.scene.items.get(item)? {
            Item::Volume(volume, ..) if !volume.about.channels.is_empty() => {
                Some((volume.about.channel, &volume.about.name))
            }
            _ => None,
        }
    }

    /// Returns the field of an item, as the document knows it.
    fn field_of(&self, document: &Document, item: usize) -> Option<Field<'_>> {
        let file = self.inputs.get(item)?.as_path();
        let channel = self.channel_of(item).filter(|_| document.shows_channels(file));
        Some(Field { file, channel })
    }

    /// Sets the transfer function that is edited, without a step that can be undone.
    pub fn set_transfer(&self, document: &mut Document, transfer: &TransferFunction) {
        let mut transfers = self.transfers(document);
        let edited = transfers.iter_mut().filter(|entry| entry.0 == self.field);
        edited.for_each(|entry| entry.1.clone_from(transfer));
        let of_file = |(item, transfer): (usize, TransferFunction)| {
            Some((self.field_of(document, item)?, transfer))
        };
        let transfers: Vec<_> = transfers.into_iter().filter_map(of_file).collect();
        let has_surfaces =
            self.stage.loaded.scene.items.iter().any(|item| item.transfer().is_none());
        document.set_transfers(&transfers, has_surfaces);
    }

    /// Returns the volume that slices show, with its kernel and its item: that of the field that is
    /// edited, or else the first one on a lattice in memory.
    pub fn sliced(&self) -> Option<(&Arc<Volume>, &Kernel, usize)> {
        let items = &self.stage.loaded.scene.items;
        let volume = |number: usize| match items.get(number)? {
            Item::Volume(volume, kernel, _) => Some((volume, kernel, number)),
            _ => None,
        };
        [self.field].into_iter().chain(0..items.len()).find_map(volume)
    }
}
