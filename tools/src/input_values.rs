//! Values of flags for all inputs, or for one: `VALUE` or `FILE=VALUE`.

use crate::failure::Failure;
use splatkit::{
    input,
    session::{AppearanceEntry, Description},
};
use std::{
    collections::{HashMap, HashSet},
    path::{Path, PathBuf},
};

/// A value for all inputs, or for one.
#[derive(Debug, Clone, PartialEq)]
pub struct InputValue<T> {
    file: Option<PathBuf>,
    value: T,
}

impl<T> InputValue<T> {
    /// Parses `VALUE` or `FILE=VALUE`. The value has no `=`.
    pub fn parse(
        text: &str,
        parse: impl FnOnce(&str) -> Result<T, String>,
    ) -> Result<Self, String> {
        let (file, value) = match text.rsplit_once('=') {
            Some((file, value)) => (Some(input::address(file)), value),
            None => (None, text),
        };
        Ok(Self { file, value: parse(value)? })
    }

    /// Returns what is made of the value, for the same inputs.
    pub fn try_map<U>(
        &self,
        make: impl FnOnce(&T) -> splatkit::Result<U>,
    ) -> splatkit::Result<InputValue<U>> {
        Ok(InputValue { file: self.file.clone(), value: make(&self.value)? })
    }

    /// A value for all inputs.
    pub fn of_all(value: T) -> Self {
        Self { file: None, value }
    }

    /// A value for one input.
    pub fn of_file(file: PathBuf, value: T) -> Self {
        Self { file: Some(file), value }
    }

    /// Returns the value.
    pub fn value(&self) -> &T {
        &self.value
    }

    /// Returns an input's own value, or else that of all inputs.
    pub fn of<'a>(values: &'a [Self], path: &Path) -> Option<&'a T> {
        let mut singles = values.iter().filter_map(Self::single);
        let single = singles.find(|(file, _)| *file == name_of(path));
        single.map(|(_, value)| value).or_else(|| Self::shared(values))
    }

    /// Returns the value of all inputs that have none of their own.
    pub fn shared(values: &[Self]) -> Option<&T> {
        values.iter().find(|entry| entry.file.is_none()).map(|entry| &entry.value)
    }

    /// Returns the name of the input that the value is for ([`name_of`]), and the value; `None` for
    /// a value of all inputs.
    pub fn single(&self) -> Option<(&Path, &T)> {
        self.file.as_deref().map(|file| (name_of(file), &self.value))
    }

    /// Refuses values of files that are no inputs.
    pub fn check_files(values: &[Self], flag: &str, inputs: &[PathBuf]) -> Result<(), Failure> {
        let known: HashSet<&Path> = match values {
            [] => return Ok(()),
            _ => inputs.iter().map(|input| name_of(input)).collect(),
        };
        let files = values.iter().filter_map(|entry| entry.file.as_deref());
        match files.into_iter().find(|file| !known.contains(name_of(file))) {
            None => Ok(()),
            Some(file) => Err(Failure::Usage(format!(
                "--{flag} {}=…: no input has this name; write it as the input is written",
                file.display()
            ))),
        }
    }

    /// Refuses values of files that are no inputs, and two values for the same.
    pub fn check(values: &[Self], flag: &str, inputs: &[PathBuf]) -> Result<(), Failure> {
        Self::check_files(values, flag, inputs)?;
        let mut seen = HashSet::new();
        for entry in values {
            if !seen.insert(entry.file.as_deref().map(name_of)) {
                let whose = entry
                    .file
                    .as_ref()
                    .map_or("all inputs".into(), |file| file.display().to_string());
                return Err(Failure::Usage(format!("--{flag} is given twice for {whose}")));
            }
        }
        Ok(())
    }
}

/// Returns the name by which flags know an input: inputs of a scene file in this folder begin with
/// `./`, and `a.ply` names one as `./a.ply` does.
pub fn name_of(path: &Path) -> &Path {
    path.strip_prefix(".").unwrap_or(path)
}

/// What a flag sets for all inputs of a scene, instead of what each has of its own.
pub struct Shared;

impl Shared {
    /// Sets a field of how inputs are shown, if there is a value.
    pub fn set<T>(
        scene: &mut Description,
        field: impl Fn(&mut AppearanceEntry) -> &mut Option<T>,
        value: Option<T>,
    ) {
        if let Some(value) = value {
            scene.inputs.iter_mut().for_each(|input| *field(&mut input.appearance) = None);
            *field(&mut scene.appearance) = Some(value);
        }
    }

    /// Sets a field to the values of all inputs and of single ones, if there are any. Several
    /// values of one input are joined.
    pub fn set_each<T: Clone>(
        scene: &mut Description,
        field: impl Fn(&mut AppearanceEntry) -> &mut Option<T>,
        values: &[InputValue<T>],
        join: impl Fn(&mut T, T),
    ) {
        if values.is_empty() {
            return;
        }
        let add = |place: &mut Option<T>, value: T| match place {
            Some(before) => join(before, value),
            None => *place = Some(value),
        };
        scene.inputs.iter_mut().for_each(|input| *field(&mut input.appearance) = None);
        *field(&mut scene.appearance) = None;
        // However many inputs have values of their own, each is found at once.
        let mut of_files: HashMap<&Path, Option<T>> = HashMap::new();
        for InputValue { file, value } in values {
            match file {
                Some(file) => add(of_files.entry(name_of(file)).or_default(), value.clone()),
                None => add(field(&mut scene.appearance), value.clone()),
            }
        }
        for input in &mut scene.inputs {
            *field(&mut input.appearance) = of_files.get(name_of(&input.file)).cloned().flatten();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_have_their_own_values() {
        let number = |text: &str| text.parse::<f32>().map_err(|error| error.to_string());
        let values = ["0.5", "a=b.ply=0.25"].map(|text| InputValue::parse(text, number).unwrap());
        let [file, other] = ["a=b.ply", "c.ply"].map(PathBuf::from);
        assert_eq!(InputValue::of(&values, &file), Some(&0.25));
        assert_eq!(InputValue::of(&values, &other), Some(&0.5));
        // Inputs of a scene file in this folder.
        assert_eq!(InputValue::of(&values, Path::new("./a=b.ply")), Some(&0.25));
        let inputs = [PathBuf::from("./a=b.ply"), other.clone()];
        assert!(InputValue::check(&values, "opacity", &inputs).is_ok());
        assert!(InputValue::check(&values, "opacity", &[file, other.clone()]).is_ok());
        let error = InputValue::check(&values, "opacity", &[other]).unwrap_err();
        assert!(error.to_string().contains("a=b.ply"));
        let twice = [InputValue::of_all(1.0), InputValue::of_all(2.0)];
        assert!(InputValue::check(&twice, "opacity", &[]).is_err());
        assert!(InputValue::parse("a=x", number).is_err());
        let many =
            ["1", "a.ply=2", "3", "a.ply=4"].map(|text| InputValue::parse(text, number).unwrap());
        let [file, other] = ["a.ply", "b.ply"].map(PathBuf::from);
        assert!(InputValue::check_files(&many, "iso", std::slice::from_ref(&file)).is_ok());
        assert!(InputValue::check_files(&many, "iso", std::slice::from_ref(&other)).is_err());
        let mut scene = Description::new([file, other]);
        scene.inputs[1].appearance.opacity = Some(0.1);
        Shared::set_each(
            &mut scene,
            |appearance| &mut appearance.opacity,
            &many,
            |before, more| *before += more,
        );
        let opacities: Vec<_> = scene.inputs.iter().map(|input| input.appearance.opacity).collect();
        assert_eq!((opacities, scene.appearance.opacity), (vec![Some(6.0), None], Some(4.0)));
    }

    #[test]
    fn many_inputs_with_values_of_their_own_are_found_at_once() {
        let inputs: Vec<PathBuf> = (0..200_000).map(|i| format!("a/{i}.ply").into()).collect();
        let entry = |(number, path): (usize, &PathBuf)| InputValue {
            file: Some(path.clone()),
            value: number as f32,
        };
        let all: Vec<InputValue<f32>> = inputs.iter().enumerate().map(entry).collect();
        // A search from the first for each input would take hours.
        let begin = std::time::Instant::now();
        assert!(InputValue::check(&all, "opacity", &inputs).is_ok());
        let mut scene = Description::new(inputs);
        Shared::set_each(&mut scene, |appearance| &mut appearance.opacity, &all, |_, _| {});
        let opacities = scene.inputs.iter().map(|input| input.appearance.opacity);
        assert!(opacities.enumerate().all(|(number, opacity)| opacity == Some(number as f32)));
        assert!(begin.elapsed().as_secs() < 60, "{:?}", begin.elapsed());
    }
}
