//! Values of flags for all inputs, or for one: `VALUE` or `FILE=VALUE`.

use crate::failure::Failure;
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
            Some((file, value)) => (Some(PathBuf::from(file)), value),
            None => (None, text),
        };
        Ok(Self { file, value: parse(value)? })
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

    /// Refuses values of files that are no inputs, and two values for the same.
    pub fn check(values: &[Self], flag: &str, inputs: &[PathBuf]) -> Result<(), Failure> {
        for (number, own) in values.iter().enumerate() {
            if let Some(file) = &own.file
                && !inputs.contains(file)
            {
                return Err(Failure::Usage(format!(
                    "--{flag} {}=…: no input has this name; write it as the input is written",
                    file.display()
                )));
            }
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
    }
}
