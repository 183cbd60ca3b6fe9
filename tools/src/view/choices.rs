//! What can be chosen of inputs: their arrays and series, read in the background so that lists can
//! offer them, and their times.

use splatkit::{
    formats::{Array, FORMATS, Format, Series},
    session::{Description, InputEntry, Opened, ReadingEntry},
};
use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, channel},
};

/// What the lists of an input depend on.
type Key = (PathBuf, ReadingEntry);

/// The lists of an input.
#[derive(Default)]
struct Lists {
    arrays: Vec<Array>,
    series: Vec<Series>,
}

/// The lists of the inputs that were shown so far.
#[derive(Default)]
pub struct Choices {
    lists: Vec<(Key, Lists)>,
    asked: Vec<Key>,
    answers: Vec<Receiver<(Key, Lists)>>,
}

/// Returns what the lists of an input depend on: not on what is chosen from them.
fn key_of(scene: &Description, input: &InputEntry) -> Key {
    let reading = scene.reading_of(input);
    let reading = ReadingEntry { scalar: None, dataset: None, series: None, time: None, ..reading };
    (input.file.clone(), reading)
}

/// Returns whether the arrays of a file are data sets, which [`ReadingEntry::dataset`] chooses.
fn has_datasets(file: &Path) -> bool {
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let holds_sets = |name: &str| name.starts_with("HDF5") || matches!(name, "NPZ" | "OME-Zarr");
    let ending = ending.unwrap_or_default();
    FORMATS.iter().any(|row| holds_sets(row.name) && row.extensions.contains(&&*ending))
}

/// Returns whether an input may have lists. An object on a server is asked only if its format has
/// them. It was fetched to be drawn, and comes from the cache.
fn may_have_lists(file: &Path) -> bool {
    let is_listed = || Format::of_path(file).is_some_and(Format::has_choices);
    !splatkit::input::is_remote(file) || is_listed()
}

/// Reads the lists of an opened input.
fn lists_of(opened: &Opened<'_>) -> splatkit::Result<Lists> {
    Ok(Lists { arrays: opened.arrays()?, series: opened.series()? })
}

impl Choices {
    /// Reads the lists of a scene's inputs, unless they are known. `tell` is called when there is
    /// something new.
    pub fn read(&mut self, scene: &Description, tell: impl Fn() + Send + 'static) {
        let is_new = |key: &Key| !self.asked.contains(key) && may_have_lists(&key.0);
        let keys = scene.visible().map(|input| key_of(scene, input)).filter(is_new);
        let keys: Vec<Key> = keys.collect();
        if keys.is_empty() {
            return;
        }
        self.asked.extend(keys.clone());
        let (send, receive) = channel();
        let read = move || {
            for key in keys {
                let reading = key.1.reading();
                let lists = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                    reading.open(&key.0).and_then(|opened| lists_of(&opened))
                }));
                // What cannot be read was an error of loading already.
                let lists = lists.ok().and_then(Result::ok).unwrap_or_default();
                send.send((key, lists)).ok();
                tell();
            }
        };
        // Without a thread there are no lists.
        if std::thread::Builder::new().name("choices".into()).spawn(read).is_ok() {
            self.answers.push(receive);
        }
    }

    /// Takes what was read since the last call.
    pub fn take(&mut self) {
        for answer in &self.answers {
            self.lists.extend(answer.try_iter());
        }
    }

    fn of(&self, scene: &Description, input: &InputEntry) -> Option<&Lists> {
        let key = key_of(scene, input);
        self.lists.iter().find(|(other, _)| *other == key).map(|(_, lists)| lists)
    }

    /// Returns the names of the arrays of numbers that can be chosen for an input.
    pub fn arrays(&self, scene: &Description, input: &InputEntry) -> Vec<String> {
        let arrays = self.of(scene, input).map_or(&[][..], |lists| &lists.arrays);
        // Places are no values that anybody looks for.
        let is_place = |array: &Array| ["x", "y", "z"].contains(&&*array.name);
        let named = arrays.iter().filter(|array| array.range.is_some() && !is_place(array));
        named.map(|array| array.name.clone()).collect()
    }

    /// Returns the series of an input that can be drawn.
    pub fn series<'a>(
        &'a self,
        scene: &Description,
        input: &InputEntry,
    ) -> impl Iterator<Item = &'a Series> {
        let series = self.of(scene, input).map_or(&[][..], |lists| &lists.series);
        series.iter().filter(|series| series.obstacle.is_none())
    }
}

/// Returns the array that was chosen for an input.
pub fn array_of(scene: &Description, input: &InputEntry) -> Option<String> {
    let reading = scene.reading_of(input);
    if has_datasets(&input.file) { reading.dataset } else { reading.scalar }
}

/// Chooses an array of an input, or none.
pub fn choose_array(scene: &mut Description, number: usize, array: Option<String>) {
    let Some(input) = scene.inputs.get(number) else { return };
    match has_datasets(&input.file) {
        true => set(scene, number, |reading| &mut reading.dataset, array),
        false => set(scene, number, |reading| &mut reading.scalar, array),
    }
    forget_values(scene, number);
}

/// Chooses a series of an input by its identifier, or none. It has times of its own.
pub fn choose_series(scene: &mut Description, number: usize, series: Option<String>) {
    set(scene, number, |reading| &mut reading.series, series);
    set(scene, number, |reading| &mut reading.time, None);
    forget_values(scene, number);
}

/// Chooses a time of an input. The transfer function stays, so that times can be compared.
pub fn choose_time(scene: &mut Description, number: usize, time: usize) {
    set(scene, number, |reading| &mut reading.time, Some(time));
}

/// Sets a part of how an input is read. That of the only input becomes one that a flag can name.
fn set<T>(
    scene: &mut Description,
    number: usize,
    part: impl Fn(&mut ReadingEntry) -> &mut Option<T>,
    value: Option<T>,
) {
    let is_only = scene.inputs.len() == 1;
    let Some(input) = scene.inputs.get_mut(number) else { return };
    if is_only {
        *part(&mut input.reading) = None;
        *part(&mut scene.reading) = value;
    } else {
        *part(&mut input.reading) = value;
    }
}

/// Forgets the transfer function, range and isosurfaces of an input, which were for other values.
fn forget_values(scene: &mut Description, number: usize) {
    let is_only = scene.inputs.len() == 1;
    let Description { inputs, appearance, .. } = scene;
    let of_input = inputs.get_mut(number).map(|input| &mut input.appearance);
    for appearance in of_input.into_iter().chain(is_only.then_some(appearance)) {
        (appearance.transfer, appearance.range) = (None, None);
        (appearance.isosurfaces, appearance.gradient_opacity) = (None, None);
        appearance.channels = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splatkit::session::TransferEntry;

    #[test]
    fn the_array_of_the_only_input_is_one_that_a_flag_can_name() {
        let mut scene = Description::new(["a.vtu".into()]);
        scene.appearance.transfer = Some(TransferEntry::Name("mri".into()));
        choose_array(&mut scene, 0, Some("heat".into()));
        assert_eq!(scene.reading.scalar.as_deref(), Some("heat"));
        assert_eq!(scene.appearance.transfer, None);
        assert_eq!(array_of(&scene, &scene.inputs[0]).as_deref(), Some("heat"));
        choose_array(&mut scene, 0, None);
        assert_eq!((scene.reading.scalar.as_deref(), scene.inputs.len()), (None, 1));
    }

    #[test]
    fn one_of_several_inputs_has_an_array_of_its_own() {
        let mut scene = Description::new(["a.vtu".into(), "b.h5".into()]);
        scene.reading.scalar = Some("heat".into());
        choose_array(&mut scene, 1, Some("group/set".into()));
        assert_eq!(scene.inputs[1].reading.dataset.as_deref(), Some("group/set"));
        assert_eq!(array_of(&scene, &scene.inputs[0]).as_deref(), Some("heat"));
        assert_eq!(array_of(&scene, &scene.inputs[1]).as_deref(), Some("group/set"));
    }

    #[test]
    fn another_series_forgets_the_time_and_another_time_nothing() {
        let mut scene = Description::new(["study".into()]);
        scene.appearance.transfer = Some(TransferEntry::Name("mri".into()));
        choose_time(&mut scene, 0, 3);
        assert_eq!(scene.reading.time, Some(3));
        assert!(scene.appearance.transfer.is_some());
        choose_series(&mut scene, 0, Some("1.2".into()));
        assert_eq!((scene.reading.series.as_deref(), scene.reading.time), (Some("1.2"), None));
        assert!(scene.appearance.transfer.is_none());
    }
}
