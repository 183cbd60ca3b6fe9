//! Edits of inputs, as a description says them.

use crate::edit::Edit;
use serde::{Deserialize, Serialize};
use std::fmt;

/// An edit of an input, as the text `NAME:VALUE`: the name of a flag of `splatkit convert` and its
/// value, such as `where:z > 0`, `crop:0,0,0,1,1,1`, `thin:10%` or `remove-floaters`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[cfg_attr(test, schemars(with = "String"))]
pub struct EditEntry {
    text: String,
    edit: Edit,
}

impl EditEntry {
    /// Reads `NAME:VALUE`.
    ///
    /// # Errors
    /// What is wrong with the value, or which names there are.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once(':').unwrap_or((text, ""));
        let (name, value) = (name.trim(), value.trim());
        let edit = Edit::parse(name, value).map_err(|wrong| match value {
            "" => wrong,
            _ => format!("{name}: {wrong}"),
        })?;
        Ok(Self { text: text.trim().to_owned(), edit })
    }

    /// Returns the edit.
    pub fn edit(&self) -> &Edit {
        &self.edit
    }

    /// Returns the text that [`parse`](Self::parse) reads.
    pub fn text(&self) -> &str {
        &self.text
    }
}

impl fmt::Display for EditEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl TryFrom<String> for EditEntry {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        Self::parse(&text)
    }
}

impl From<EditEntry> for String {
    fn from(entry: EditEntry) -> Self {
        entry.text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edits_are_texts() {
        for text in ["where:a > 1 && b == 2", "crop:sphere:0,0,0,1", "remove-floaters", "thin:5%"] {
            let entry = EditEntry::parse(text).unwrap();
            assert_eq!(entry.text(), text);
            let json = serde_json::to_string(&entry).unwrap();
            assert_eq!(serde_json::from_str::<EditEntry>(&json).unwrap(), entry, "{json}");
        }
        for (text, word) in
            [("grow:2", "there is no edit “grow”"), ("thin:0", "thin: the form"), ("crop", "form")]
        {
            let message = EditEntry::parse(text).unwrap_err();
            assert!(message.contains(word), "{text}: {message}");
        }
    }
}
