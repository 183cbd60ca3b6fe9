//! What is selected: a condition, as `--where` has it, and what meets it.
//!
//! Outlines on the picture, boxes and values all become parts of one condition, so that deleting is
//! an edit of the scene that flags and scene files have too.

use super::document::LoadedBy;
use glam::DVec3;
use splatkit::{
    edit::Expression,
    session::{Description, EditedInput},
};
use std::{
    path::PathBuf,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, TryRecvError, channel},
    },
};

/// The most marks that are drawn over a picture.
const MOST_MARKS: usize = 60_000;

/// What an outline on the picture is drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tool {
    Box,
    Lasso,
}

/// What becomes of the selection before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mode {
    Replace,
    Add,
    Remove,
}

impl Mode {
    /// Returns the condition of a selection that is changed by another one.
    pub fn join(self, before: Option<&str>, new: &str) -> String {
        match (self, before) {
            (Self::Replace, _) | (Self::Add, None) => new.to_owned(),
            (Self::Add, Some(before)) => format!("({before}) || ({new})"),
            (Self::Remove, Some(before)) => format!("({before}) && !({new})"),
            (Self::Remove, None) => format!("!({new})"),
        }
    }
}

/// Returns the condition that everything else meets.
pub fn inverted(condition: Option<&str>) -> String {
    match condition {
        // Nothing was selected.
        None => "0 < 1".into(),
        Some(condition) => match condition.strip_prefix("!(").and_then(|c| c.strip_suffix(')')) {
            Some(inner) if is_whole(inner) => inner.to_owned(),
            _ => format!("!({condition})"),
        },
    }
}

/// Whether the brackets of a text close in it, so that those around it belong together. Quotes hold
/// regions, whose texts have no brackets.
fn is_whole(text: &str) -> bool {
    let mut depth = 0i32;
    text.chars().all(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        depth >= 0
    })
}

/// What the panel's fields hold, beside the scene.
#[derive(Default)]
pub struct Form {
    /// A condition that is being written.
    pub condition: String,
    /// The corners of a box in the world; those of the scene at first.
    pub corners: Option<[[f64; 3]; 2]>,
}

/// The selection of a window.
pub struct Selection {
    pub tool: Option<Tool>,
    pub mode: Mode,
    /// Whether outlines select no deeper than what is seen in them.
    pub is_near: bool,
    pub condition: Option<String>,
    pub form: Form,
    /// What meets the condition, as soon as it is known.
    pub selected: Option<Selected>,
    pub finding: Option<Finding>,
    cache: Cache,
}

impl Default for Selection {
    fn default() -> Self {
        Self {
            tool: None,
            mode: Mode::Replace,
            is_near: false,
            condition: None,
            form: Form::default(),
            selected: None,
            finding: None,
            cache: Cache::default(),
        }
    }
}

/// What meets a condition.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Selected {
    /// The inputs that can be selected of, with the number of the points, vertices or Gaussians
    /// that meet the condition, and of all.
    pub inputs: Vec<(PathBuf, u64, u64)>,
    /// Where selected points and Gaussians are, or some of them.
    pub places: Vec<DVec3>,
    /// Triangles with a selected corner, or some of them.
    pub triangles: Vec<[DVec3; 3]>,
}

impl Selected {
    /// Returns how many are selected, and how many there are.
    pub fn counts(&self) -> [u64; 2] {
        self.inputs.iter().fold([0, 0], |[some, all], input| [some + input.1, all + input.2])
    }
}

/// The inputs that were read for selections, by what they were loaded by, with the names of the
/// values that they have.
type Cache = Arc<Mutex<Option<(LoadedBy, Vec<String>, Vec<EditedInput>)>>>;

/// A selection that is being found. Dropping it forgets it.
pub struct Finding(Receiver<Result<Selected, String>>);

impl Selection {
    /// Starts to find what meets the condition. `scene` has the inputs that can be selected of.
    pub fn find(
        &mut self,
        (scene, loaded_by): (Description, LoadedBy),
        tell: impl Fn() + Send + 'static,
    ) -> Result<(), String> {
        let condition = self.condition.as_deref().map(str::parse::<Expression>).transpose()?;
        (self.selected, self.finding) = (None, None);
        let Some(condition) = condition else { return Ok(()) };
        let cache = Arc::clone(&self.cache);
        let (send, found) = channel();
        let thread = std::thread::Builder::new().name("selection".into());
        let started = thread.spawn(move || {
            let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
            let found = read(&mut cache, &scene, loaded_by, &condition);
            let found = found.and_then(|inputs| selected(inputs, &scene, &condition));
            send.send(found.map_err(|error| error.to_string())).ok();
            tell();
        });
        started.map_err(|error| error.to_string())?;
        self.finding = Some(Finding(found));
        Ok(())
    }

    /// Takes what was found, once there is an answer.
    pub fn take(&mut self) -> Option<Result<(), String>> {
        let answer = match self.finding.as_ref()?.0.try_recv() {
            Ok(answer) => answer,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the selection could not be made".into()),
        };
        self.finding = None;
        Some(answer.map(|selected| self.selected = Some(selected)))
    }

    /// Selects nothing.
    pub fn clear(&mut self) {
        (self.condition, self.selected, self.finding) = (None, None, None);
    }
}

/// Returns the inputs as they are edited, with the values that a condition compares.
fn read<'a>(
    cache: &'a mut Option<(LoadedBy, Vec<String>, Vec<EditedInput>)>,
    scene: &Description,
    loaded_by: LoadedBy,
    condition: &Expression,
) -> splatkit::Result<&'a [EditedInput]> {
    let is_current = cache.as_ref().is_some_and(|(by, names, _)| {
        *by == loaded_by && condition.names().all(|name| names.iter().any(|known| known == name))
    });
    if !is_current {
        *cache = None;
        let names: Vec<&str> = condition.names().collect();
        let inputs = scene.visible().map(|input| scene.read_editable(input, &names));
        let inputs = inputs.collect::<splatkit::Result<_>>()?;
        *cache = Some((loaded_by, names.into_iter().map(str::to_owned).collect(), inputs));
    }
    Ok(cache.as_ref().map_or(&[], |(.., inputs)| inputs))
}

/// Returns what meets a condition.
fn selected(
    inputs: &[EditedInput],
    scene: &Description,
    condition: &Expression,
) -> splatkit::Result<Selected> {
    let mut all = Selected::default();
    for (input, entry) in inputs.iter().zip(scene.visible()) {
        let kept = input.select(condition)?;
        let count = kept.iter().filter(|kept| **kept).count();
        all.inputs.push((entry.file.clone(), count as u64, kept.len() as u64));
        let place = |vertex: usize| input.scene().place(vertex);
        let is_in = |triangle: &&[u32; 3]| triangle.iter().any(|&vertex| kept[vertex as usize]);
        let triangles = input.triangles().iter().filter(is_in);
        let step = triangles.clone().count().div_ceil(MOST_MARKS).max(1);
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| place(vertex as usize));
        all.triangles.extend(triangles.step_by(step).map(corners));
        if input.triangles().is_empty() {
            let step = count.div_ceil(MOST_MARKS).max(1);
            let marked = (0..kept.len()).filter(|vertex| kept[*vertex]).step_by(step);
            all.places.extend(marked.map(place));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_joined_and_inverted() {
        let join = |mode: Mode, before| mode.join(before, "x > 1");
        assert_eq!(join(Mode::Replace, Some("y > 2")), "x > 1");
        assert_eq!(join(Mode::Add, None), "x > 1");
        assert_eq!(join(Mode::Add, Some("y > 2")), "(y > 2) || (x > 1)");
        assert_eq!(join(Mode::Remove, Some("y > 2")), "(y > 2) && !(x > 1)");
        assert_eq!(inverted(Some("x > 1")), "!(x > 1)");
        assert_eq!(inverted(Some("!(x > 1)")), "x > 1");
        // The first bracket of this one does not belong to the last.
        let two = "!(x > 1) && (y > 2)";
        assert_eq!(inverted(Some(two)), format!("!({two})"));
        for text in [inverted(None), join(Mode::Remove, None), inverted(Some(two))] {
            assert!(text.parse::<Expression>().is_ok(), "{text}");
        }
    }
}
