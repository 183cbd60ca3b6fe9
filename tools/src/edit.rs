//! The flag that edits inputs before they are drawn.

use crate::{
    failure::Failure,
    input_values::{InputValue, name_of},
};
use clap::Args;
use splatkit::{
    input,
    session::{Description, EditEntry},
};

/// The names of edits, which end the name of a file before them.
const NAMES: [&str; 11] = [
    "crop",
    "where",
    "translate",
    "rotate",
    "scale",
    "matrix",
    "reproject",
    "thin",
    "remove-floaters",
    "keep-cluster",
    "normals",
];

/// What is changed of inputs before they are drawn.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Input")]
pub struct EditFlags {
    /// Edit inputs before they are drawn, as `splatkit convert` does with the flags of these names:
    /// crop:REGION, where:CONDITION, thin:DISTANCE, remove-floaters, … They are edited once they
    /// are moved, in the order of the flags. FILE=NAME:VALUE is for one input, and the flag can be
    /// given several times. For meshes, point clouds and trained Gaussians.
    #[arg(
        long,
        value_name = "[FILE=]NAME:VALUE",
        value_parser = edit,
        allow_hyphen_values = true
    )]
    edit: Vec<InputValue<EditEntry>>,
}

impl EditFlags {
    /// Changes how the inputs of a scene are edited: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) -> Result<(), Failure> {
        if self.edit.is_empty() {
            return Ok(());
        }
        let inputs: Vec<_> = scene.visible().map(|input| input.file.clone()).collect();
        InputValue::check_files(&self.edit, "edit", &inputs)?;
        for input in &mut scene.inputs {
            let name = name_of(&input.file);
            let is_of = |value: &&InputValue<EditEntry>| {
                value.single().is_none_or(|(file, _)| file == name)
            };
            let edits = self.edit.iter().filter(is_of).map(|value| value.value().clone());
            input.edits = edits.collect();
        }
        Ok(())
    }
}

/// Parses `NAME:VALUE` or `FILE=NAME:VALUE`. A value may have any characters.
fn edit(text: &str) -> Result<InputValue<EditEntry>, String> {
    let ends = |rest: &str| rest.is_empty() || rest.starts_with(':');
    let is_edit = |text: &str| NAMES.iter().any(|name| text.strip_prefix(name).is_some_and(ends));
    let signs = text.match_indices('=').map(|(at, _)| at);
    let split = signs.into_iter().find(|at| is_edit(&text[at + 1..]));
    match split.filter(|_| !is_edit(text)) {
        Some(at) => {
            let entry = EditEntry::parse(&text[at + 1..])?;
            Ok(InputValue::of_file(input::address(&text[..at]), entry))
        }
        None => EditEntry::parse(text).map(InputValue::of_all),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A condition and a file's name may have the signs that separate them.
    #[test]
    fn edits_are_of_all_inputs_or_of_one() {
        let all = edit("where:a == 2 && b != 3").unwrap();
        assert!(all.single().is_none() && all.value().text() == "where:a == 2 && b != 3");
        let one = edit("a=b.ply=where:a == 2").unwrap();
        let (file, entry) = one.single().unwrap();
        assert_eq!((file, entry.text()), (Path::new("a=b.ply"), "where:a == 2"));
        for (bad, word) in [
            ("grow:2", "there is no edit “grow”"),
            ("a.ply=grow:2", "there is no edit “a.ply=grow”"),
            ("where:x >", "column 4"),
            ("a.ply=thin:0", "100000pts"),
            ("remove-floaters:3", "takes no value"),
        ] {
            let message = edit(bad).unwrap_err();
            assert!(message.contains(word), "{bad}: {message}");
        }
    }

    #[test]
    fn flags_replace_the_edits_of_the_inputs_that_they_are_for() {
        let mut scene = Description::new(["a.ply", "b.ply"].map(Into::into));
        scene.inputs[1].edits = vec![EditEntry::parse("thin:5%").unwrap()];
        let edit = ["a.ply=where:x > 1", "crop:0,0,0,1,1,1"].map(|text| edit(text).unwrap());
        EditFlags { edit: edit.to_vec() }.apply(&mut scene).unwrap();
        let texts =
            |at: usize| scene.inputs[at].edits.iter().map(EditEntry::text).collect::<Vec<_>>();
        assert_eq!(texts(0), ["where:x > 1", "crop:0,0,0,1,1,1"]);
        assert_eq!(texts(1), ["crop:0,0,0,1,1,1"]);
        let unknown = EditFlags { edit: vec![super::edit("c.ply=thin:5%").unwrap()] };
        let message = unknown.apply(&mut scene).unwrap_err().to_string();
        assert!(message.contains("--edit c.ply=…"), "{message}");
    }
}
