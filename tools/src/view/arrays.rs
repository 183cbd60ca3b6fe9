//! The arrays that inputs hold, read in the background so that lists can offer them.

use splatkit::{
    formats::{Array, FORMATS},
    session::{Description, InputEntry, ReadingEntry},
};
use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, channel},
};

/// What an input's arrays depend on.
type Key = (PathBuf, ReadingEntry);

/// The arrays of the inputs that were shown so far.
#[derive(Default)]
pub struct Arrays {
    lists: Vec<(Key, Vec<Array>)>,
    asked: Vec<Key>,
    answers: Vec<Receiver<(Key, Vec<Array>)>>,
}

/// Returns what an input's arrays depend on: not on the array that is chosen.
fn key_of(scene: &Description, input: &InputEntry) -> Key {
    let reading = ReadingEntry { scalar: None, dataset: None, ..scene.reading_of(input) };
    (input.file.clone(), reading)
}

/// Returns whether the arrays of a file are data sets, which [`ReadingEntry::dataset`] chooses.
fn has_datasets(file: &Path) -> bool {
    let ending = file.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let holds_sets = |name: &str| name.starts_with("HDF5") || name == "NPZ";
    let ending = ending.unwrap_or_default();
    FORMATS.iter().any(|row| holds_sets(row.name) && row.extensions.contains(&&*ending))
}

impl Arrays {
    /// Reads the arrays of a scene's inputs, unless they are known. Objects on servers are left
    /// out: their arrays may be far away. `tell` is called when there is something new.
    pub fn read(&mut self, scene: &Description, tell: impl Fn() + Send + 'static) {
        let is_new = |key: &Key| !self.asked.contains(key) && !splatkit::input::is_remote(&key.0);
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
                let arrays = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                    reading.open(&key.0).and_then(|opened| opened.arrays())
                }));
                // What cannot be read was an error of loading already.
                let arrays = arrays.ok().and_then(Result::ok).unwrap_or_default();
                send.send((key, arrays)).ok();
                tell();
            }
        };
        // Without a thread there are no lists.
        if std::thread::Builder::new().name("arrays".into()).spawn(read).is_ok() {
            self.answers.push(receive);
        }
    }

    /// Takes what was read since the last call.
    pub fn take(&mut self) {
        for answer in &self.answers {
            self.lists.extend(answer.try_iter());
        }
    }

    /// Returns the names of the arrays of numbers that can be chosen for an input.
    pub fn names(&self, scene: &Description, input: &InputEntry) -> Vec<String> {
        let key = key_of(scene, input);
        let list = self.lists.iter().find(|(other, _)| *other == key);
        let arrays = list.map_or(&[][..], |(_, arrays)| arrays);
        // Places are no values that anybody looks for.
        let is_place = |array: &Array| ["x", "y", "z"].contains(&&*array.name);
        let named = arrays.iter().filter(|array| array.range.is_some() && !is_place(array));
        named.map(|array| array.name.clone()).collect()
    }
}

/// Returns the array that was chosen for an input.
pub fn chosen(scene: &Description, input: &InputEntry) -> Option<String> {
    let reading = scene.reading_of(input);
    if has_datasets(&input.file) { reading.dataset } else { reading.scalar }
}

/// Chooses an array of an input, or none. Its transfer function, range and isosurfaces were for the
/// values of another array, so that they are forgotten.
pub fn choose(scene: &mut Description, number: usize, array: Option<String>) {
    let is_only = scene.inputs.len() == 1;
    let Description { inputs, reading: shared, appearance, .. } = scene;
    let Some(input) = inputs.get_mut(number) else { return };
    let is_set = has_datasets(&input.file);
    // A flag can name the array of the only input.
    let readings =
        if is_only { [shared, &mut input.reading] } else { [&mut input.reading, shared] };
    for (place, reading) in readings.into_iter().enumerate() {
        let value = if is_set { &mut reading.dataset } else { &mut reading.scalar };
        match place {
            0 => value.clone_from(&array),
            _ if is_only => *value = None,
            _ => {}
        }
    }
    let mut appearances = vec![&mut input.appearance];
    appearances.extend(is_only.then_some(appearance));
    for appearance in appearances {
        (appearance.transfer, appearance.range) = (None, None);
        (appearance.isosurfaces, appearance.gradient_opacity) = (None, None);
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
        choose(&mut scene, 0, Some("heat".into()));
        assert_eq!(scene.reading.scalar.as_deref(), Some("heat"));
        assert_eq!(scene.appearance.transfer, None);
        assert_eq!(chosen(&scene, &scene.inputs[0]).as_deref(), Some("heat"));
        choose(&mut scene, 0, None);
        assert_eq!((scene.reading.scalar.as_deref(), scene.inputs.len()), (None, 1));
    }

    #[test]
    fn one_of_several_inputs_has_an_array_of_its_own() {
        let mut scene = Description::new(["a.vtu".into(), "b.h5".into()]);
        scene.reading.scalar = Some("heat".into());
        choose(&mut scene, 1, Some("group/set".into()));
        assert_eq!(scene.inputs[1].reading.dataset.as_deref(), Some("group/set"));
        assert_eq!(chosen(&scene, &scene.inputs[0]).as_deref(), Some("heat"));
        assert_eq!(chosen(&scene, &scene.inputs[1]).as_deref(), Some("group/set"));
    }
}
