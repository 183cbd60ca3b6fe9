//! Values of flags for all inputs, or for one: `VALUE` or `FILE=VALUE`.

use crate::failure::Failure;
use splatkit::input;
use std::path::{Path, PathBuf};

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

    /// Returns all of an input's own values, or else all of those of all inputs.
    pub fn all_of<'a>(values: &'a [Self], path: &Path) -> Vec<&'a T> {
        let of = |file: Option<&Path>| -> Vec<&'a T> {
            let own = values.iter().filter(|own| own.file.as_deref() == file);
            own.map(|own| &own.value).collect()
        };
        let own = of(Some(path));
        if own.is_empty() { of(None) } else { own }
    }

    /// Returns the value of all inputs that have none of their own.
    pub fn shared(values: &[Self]) -> Option<&T> {
        values.iter().find(|own| own.file.is_none()).map(|own| &own.value)
    }

    /// Refuses values of files that are no inputs.
    pub fn check_files(values: &[Self], flag: &str, inputs: &[PathBuf]) -> Result<(), Failure> {
        match Self::files(values).find(|file| !inputs.iter().any(|input| input == file)) {
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
        for (number, own) in values.iter().enumerate() {
            if values[..number].iter().any(|other| other.file == own.file) {
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
        assert_eq!(Own::all_of(&many, &own), [&2.0, &4.0]);
        assert_eq!(Own::all_of(&many, &other), [&1.0, &3.0]);
        assert!(Own::check_files(&many, "iso", std::slice::from_ref(&own)).is_ok());
        assert!(Own::check_files(&many, "iso", &[other]).is_err());
    }
}
