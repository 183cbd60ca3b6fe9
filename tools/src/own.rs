//! Values of flags for all inputs, or for one: `VALUE` or `FILE=VALUE`.

use crate::failure::Failure;
use splatkit::input;
use std::{
    collections::{HashMap, HashSet},
    path::{Path, PathBuf},
};

/// Values by input. However many inputs have values of their own, each is found at once.
#[derive(Debug)]
pub struct Values<T> {
    own: HashMap<PathBuf, Vec<T>>,
    shared: Vec<T>,
}

impl<T> Values<T> {
    pub fn new(values: impl IntoIterator<Item = Own<T>>) -> Self {
        let mut all = Self { own: HashMap::new(), shared: Vec::new() };
        for Own { file, value } in values {
            match file {
                Some(file) => all.own.entry(file).or_default().push(value),
                None => all.shared.push(value),
            }
        }
        all
    }

    /// Returns an input's own value, or else that of all inputs.
    pub fn of(&self, path: &Path) -> Option<&T> {
        self.all_of(path).first()
    }

    /// Returns all of an input's own values, or else all of those of all inputs.
    pub fn all_of(&self, path: &Path) -> &[T] {
        self.own.get(path).unwrap_or(&self.shared)
    }

    /// Returns the inputs that have values of their own.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        self.own.keys().map(PathBuf::as_path)
    }
}

/// A value for all inputs, or for one.
#[derive(Debug, Clone, PartialEq)]
pub struct Own<T> {
    file: Option<PathBuf>,
    value: T,
}

impl<T> Own<T> {
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
    pub fn try_map<'a, U>(
        &'a self,
        make: impl FnOnce(&'a T) -> Result<U, Failure>,
    ) -> Result<Own<U>, Failure> {
        Ok(Own { file: self.file.clone(), value: make(&self.value)? })
    }

    /// Returns the inputs that have values of their own.
    pub fn files(values: &[Self]) -> impl Iterator<Item = &Path> {
        values.iter().filter_map(|own| own.file.as_deref())
    }

    /// Returns all values.
    pub fn values(values: &[Self]) -> impl Iterator<Item = &T> {
        values.iter().map(|own| &own.value)
    }

    /// A value for all inputs.
    pub fn of_all(value: T) -> Self {
        Self { file: None, value }
    }

    /// Returns an input's own value, or else that of all inputs.
    pub fn of<'a>(values: &'a [Self], path: &Path) -> Option<&'a T> {
        let own = values.iter().find(|own| own.file.as_deref() == Some(path));
        own.map(|own| &own.value).or_else(|| Self::shared(values))
    }

    /// Returns the value of all inputs that have none of their own.
    pub fn shared(values: &[Self]) -> Option<&T> {
        values.iter().find(|own| own.file.is_none()).map(|own| &own.value)
    }

    /// Refuses values of files that are no inputs.
    pub fn check_files(values: &[Self], flag: &str, inputs: &[PathBuf]) -> Result<(), Failure> {
        let known: HashSet<&Path> = match values {
            [] => return Ok(()),
            _ => inputs.iter().map(PathBuf::as_path).collect(),
        };
        match Self::files(values).find(|file| !known.contains(file)) {
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
        for own in values {
            if !seen.insert(own.file.as_deref()) {
                let whose = own
                    .file
                    .as_ref()
                    .map_or("all inputs".into(), |file| file.display().to_string());
                return Err(Failure::Usage(format!("--{flag} is given twice for {whose}")));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_have_their_own_values() {
        let number = |text: &str| text.parse::<f32>().map_err(|error| error.to_string());
        let values = ["0.5", "a=b.ply=0.25"].map(|text| Own::parse(text, number).unwrap());
        let [own, other] = ["a=b.ply", "c.ply"].map(PathBuf::from);
        assert_eq!(Own::of(&values, &own), Some(&0.25));
        assert_eq!(Own::of(&values, &other), Some(&0.5));
        assert!(Own::check(&values, "opacity", &[own, other.clone()]).is_ok());
        let error = Own::check(&values, "opacity", &[other]).unwrap_err();
        assert!(error.to_string().contains("a=b.ply"));
        let twice = [Own::of_all(1.0), Own::of_all(2.0)];
        assert!(Own::check(&twice, "opacity", &[]).is_err());
        assert!(Own::parse("a=x", number).is_err());
        let many = ["1", "a.ply=2", "3", "a.ply=4"].map(|text| Own::parse(text, number).unwrap());
        let [own, other] = ["a.ply", "b.ply"].map(PathBuf::from);
        let found = Values::new(many.clone());
        assert_eq!((found.all_of(&own), found.of(&own)), (&[2.0, 4.0][..], Some(&2.0)));
        assert_eq!((found.all_of(&other), found.of(&other)), (&[1.0, 3.0][..], Some(&1.0)));
        assert_eq!(found.files().collect::<Vec<_>>(), [own.as_path()]);
        assert!(Own::check_files(&many, "iso", std::slice::from_ref(&own)).is_ok());
        assert!(Own::check_files(&many, "iso", &[other]).is_err());
    }

    #[test]
    fn many_inputs_with_values_of_their_own_are_found_at_once() {
        let inputs: Vec<PathBuf> = (0..200_000).map(|i| format!("a/{i}.ply").into()).collect();
        let own = |path: &PathBuf| Own { file: Some(path.clone()), value: path.clone() };
        let all: Vec<Own<PathBuf>> = inputs.iter().map(own).collect();
        // A search from the first for each input would take hours.
        let begin = std::time::Instant::now();
        assert!(Own::check(&all, "color", &inputs).is_ok());
        let found = Values::new(all);
        assert!(inputs.iter().all(|path| found.of(path) == Some(path)));
        assert!(begin.elapsed().as_secs() < 60, "{:?}", begin.elapsed());
    }
}
