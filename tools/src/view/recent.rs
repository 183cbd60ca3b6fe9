//! The files that were opened last, kept in the platform's folder for configuration.

use etcetera::BaseStrategy;
use std::path::{Path, PathBuf};

/// Most files that are kept.
const MOST: usize = 10;

/// The files that were opened last, the newest first.
#[derive(Debug, Default)]
pub struct Recent {
    /// Where the list is kept; `None` if the platform has no folder for it.
    store: Option<PathBuf>,
    files: Vec<PathBuf>,
}

impl Recent {
    /// Returns the user's list.
    pub fn of_user() -> Self {
        let folder = etcetera::base_strategy::choose_native_strategy().ok();
        let store = folder.map(|folder| folder.config_dir().join("splatkit").join("recent.json"));
        store.map_or_else(Self::default, Self::at)
    }

    /// Returns the list that is kept in a file.
    pub fn at(store: PathBuf) -> Self {
        let files = read(&store);
        Self { store: Some(store), files }
    }

    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Puts files at the top of the list.
    ///
    /// # Errors
    /// Those of writing the list.
    pub fn add(&mut self, files: &[PathBuf]) -> Result<(), String> {
        let files: Vec<PathBuf> = files.iter().map(|file| whole(file)).collect();
        if self.files.starts_with(&files) {
            return Ok(());
        }
        // Another window may have changed the list.
        if let Some(store) = &self.store {
            self.files = read(store);
        }
        self.files.retain(|other| !files.contains(other));
        self.files.splice(0..0, files);
        self.files.truncate(MOST);
        self.write()
    }

    /// Forgets all files.
    ///
    /// # Errors
    /// Those of writing the list.
    pub fn forget(&mut self) -> Result<(), String> {
        self.files.clear();
        self.write()
    }

    fn write(&self) -> Result<(), String> {
        let Some(store) = &self.store else { return Ok(()) };
        // Names that are no text cannot be kept in JSON.
        let names: Vec<&str> = self.files.iter().filter_map(|file| file.to_str()).collect();
        let text = serde_json::to_string_pretty(&names).map_err(|error| error.to_string())?;
        let folder = store.parent().unwrap_or(Path::new("."));
        std::fs::create_dir_all(folder)
            .map_err(|error| error.to_string())
            .and_then(|()| splatkit::disk::write(store, text.as_bytes()).map_err(|e| e.to_string()))
            .map_err(|error| format!("the list of recent files cannot be kept: {error}"))
    }
}

/// Returns the whole path of a file; addresses stay.
fn whole(file: &Path) -> PathBuf {
    let is_address = splatkit::input::is_remote(file);
    let whole = if is_address { None } else { std::path::absolute(file).ok() };
    whole.unwrap_or_else(|| file.to_owned())
}

/// Reads a list. A file that is missing or damaged is an empty one.
fn read(store: &Path) -> Vec<PathBuf> {
    let text = std::fs::read_to_string(store).unwrap_or_default();
    let names: Vec<String> = serde_json::from_str(&text).unwrap_or_default();
    names.into_iter().take(MOST).map(PathBuf::from).collect()
}

/// Returns whether a file is not where it was. Addresses are not asked.
pub fn is_missing(file: &Path) -> bool {
    !splatkit::input::is_remote(file) && !file.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_most_ten_files_are_kept_without_doubles() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("splatkit").join("recent.json");
        let mut recent = Recent::at(store.clone());
        let file = |number: usize| folder.path().join(format!("{number}.ply"));
        for number in 0..12 {
            recent.add(&[file(number)]).expect("kept");
        }
        assert_eq!(recent.files().len(), 10);
        recent.add(&[file(7)]).expect("kept");
        let numbers = [7, 11, 10, 9, 8, 6, 5, 4, 3, 2].map(file);
        assert_eq!(recent.files(), numbers);
        assert_eq!(Recent::at(store.clone()).files(), numbers);
        assert!(is_missing(&file(7)) && !is_missing(folder.path()));
        recent.forget().expect("kept");
        assert!(Recent::at(store).files().is_empty());
    }

    #[test]
    fn damaged_lists_are_empty() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("recent.json");
        std::fs::write(&store, "[1, {").expect("written");
        assert!(Recent::at(store).files().is_empty());
    }

    #[test]
    fn two_windows_keep_one_list() {
        let folder = tempfile::tempdir().expect("a folder");
        let store = folder.path().join("recent.json");
        let (mut one, mut other) = (Recent::at(store.clone()), Recent::at(store.clone()));
        one.add(&[folder.path().join("a")]).expect("kept");
        other.add(&[folder.path().join("b")]).expect("kept");
        assert_eq!(Recent::at(store).files().len(), 2);
    }
}
