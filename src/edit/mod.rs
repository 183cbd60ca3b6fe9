//! Edits of scenes: what is cut out, moved, thinned or cleaned before a scene is drawn or written.
//!
//! An [`Edit`] changes anything that is [`Editable`]: points with attributes
//! ([`Records`](crate::formats::Records)), meshes and clouds ([`Surface`]), trained Gaussians, and
//! the splats of a hierarchy. [`apply`] makes edits in their order. [`Pass`] does the same with
//! points that are read in pieces, and of which only some fit in memory.
//!
//! | module | purpose |
//! |---|---|
//! | `expression` | what `where` compares |
//! | `region` | the shapes of `crop` |
//! | `motion` | moves, turns, scales and matrices |
//! | `reproject` | other coordinate reference systems |
//! | `thin`, `coarser` | fewer points and vertices |
//! | `merge`, `reduce` | fewer splats and Gaussians that look the same |
//! | `clusters` | floaters, and the largest parts |
//! | `surface`, `records`, `gaussians`, `splats` | the scenes that are edited |
//! | `stream` | points larger than memory |
//! | `statistics` | what is known of the values of a scene |
//!
//! ```
//! use splatkit::{
//!     edit::{self, Context, Edit, Surface},
//!     surface::Mesh,
//! };
//!
//! let mut ball = Surface::from(Mesh::sphere(3));
//! let edits = [Edit::Where("z > 0 || x > 0.9".parse()?), Edit::Crop("-1,-1,-1,1,1,1".parse()?)];
//! let changes = edit::apply(&mut ball, &edits, &Context::default())?;
//! assert!(changes[0].after < changes[0].before);
//! assert!(ball.mesh.positions.iter().all(|place| place.z > 0.0 || place.x > 0.8));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod clusters;
mod coarser;
mod expression;
mod gaussians;
mod merge;
mod motion;
mod records;
mod reduce;
mod region;
mod reproject;
mod splats;
mod statistics;
mod stream;
mod surface;
#[cfg(test)]
mod tests;
mod thin;

pub use expression::Expression;
pub use motion::Motion;
pub use reduce::levels;
pub use region::{Region, Sight};
pub use reproject::{Crs, Mapping, Reprojection};
pub use statistics::{BINS, Statistics, statistics};
pub use stream::Pass;
pub(crate) use stream::grid_of_degrees;
pub use surface::Surface;
pub use thin::Thin;

use crate::{Error, Result, math::keep, memory, parallel::prelude::*};
use glam::{DVec3, Vec3};
use std::{collections::HashSet, path::PathBuf};

/// A change of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Keep what lies in a region. Of a mesh, triangles with all corners inside are kept.
    Crop(Region),
    /// Keep what meets a condition.
    Where(Expression),
    /// Move, turn or scale everything. Which axis is up stays as the scene says.
    Move(Motion),
    /// Give points the coordinates of another reference system. Heights stay.
    Reproject(Reprojection),
    /// Keep fewer points, evenly spread; or merge splats.
    Thin(Thin),
    /// Remove small clusters far from others.
    RemoveFloaters,
    /// Keep the largest clusters, this many.
    KeepCluster(usize),
    /// Estimate the normals of points, in place of those that they have.
    Normals,
}

impl Edit {
    /// Reads an edit from its name and its value, as the command's flags have them. `translate`,
    /// `rotate`, `scale` and `matrix` are moves. Edits without a value have an empty one.
    ///
    /// # Errors
    /// A message that says what is wrong with the value, or which names there are.
    pub fn parse(name: &str, value: &str) -> std::result::Result<Self, String> {
        let numbers = || -> std::result::Result<Vec<f64>, String> {
            let number = |part: &str| {
                let number = part.trim().parse().ok().filter(|number: &f64| number.is_finite());
                number.ok_or_else(|| format!("“{}” is not a number", part.trim()))
            };
            value.split(',').map(number).collect()
        };
        let empty = |edit: Self| match value.trim() {
            "" => Ok(edit),
            value => Err(format!("it takes no value such as “{value}”")),
        };
        match name.replace('_', "-").as_str() {
            "crop" => value.parse().map(Self::Crop),
            "where" => value.parse().map(Self::Where),
            "translate" => {
                let by = numbers()?.try_into().map_err(|_| "the form is X,Y,Z")?;
                Ok(Self::Move(Motion::translation(DVec3::from_array(by))))
            }
            "rotate" => value.parse().map(Self::Move),
            "scale" => match numbers()?[..] {
                [factor] if factor > 0.0 => Ok(Self::Move(Motion::scale(factor))),
                _ => Err("a number above 0 is needed".into()),
            },
            "matrix" => {
                let rows = numbers()?.try_into().map_err(|_| "a matrix has 16 numbers")?;
                Motion::matrix(rows).map(Self::Move)
            }
            "reproject" => value.parse().map(Self::Reproject),
            "thin" => value.parse().map(Self::Thin),
            "keep-cluster" => {
                let count = value.trim().parse().ok().filter(|count: &usize| *count > 0);
                count.map(Self::KeepCluster).ok_or("a count above 0 is needed".into())
            }
            "remove-floaters" => empty(Self::RemoveFloaters),
            "normals" => empty(Self::Normals),
            _ => Err(format!(
                "there is no edit “{name}”, only crop, where, translate, rotate, scale, matrix, \
                 reproject, thin, remove-floaters, keep-cluster and normals"
            )),
        }
    }

    /// Returns the name of the edit, as the command's flag has it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Crop(_) => "crop",
            Self::Where(_) => "where",
            Self::Move(_) => "move",
            Self::Reproject(_) => "reproject",
            Self::Thin(_) => "thin",
            Self::RemoveFloaters => "remove-floaters",
            Self::KeepCluster(_) => "keep-cluster",
            Self::Normals => "normals",
        }
    }

    /// Returns the names of the values that the edit compares, if it compares any.
    pub fn names(&self) -> Option<impl Iterator<Item = &str>> {
        match self {
            Self::Where(expression) => Some(expression.names()),
            _ => None,
        }
    }

    /// Returns whether what becomes of one point depends on no other point.
    pub fn is_local(&self) -> bool {
        matches!(self, Self::Crop(_) | Self::Where(_) | Self::Move(_) | Self::Reproject(_))
    }
}

/// What an edit did: the points, vertices or Gaussians before and after it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The name of the edit ([`Edit::name`]).
    pub edit: &'static str,
    /// How many there were.
    pub before: u64,
    /// How many are left.
    pub after: u64,
}

/// What edits need to know of a scene.
#[derive(Debug, Clone)]
pub struct Context {
    /// The file that errors name.
    pub file: PathBuf,
    /// The direction in which `height` is measured, of unit length.
    pub up: DVec3,
    /// Bytes of memory that edits may use beside the scene.
    pub memory: u64,
    /// The coordinate reference system, as the file says it; empty if it does not.
    pub crs: String,
}

impl Context {
    /// Returns what is known of a scene after these edits.
    fn after(&self, edits: &[Edit]) -> Self {
        let system = edits.iter().rev().find_map(|edit| match edit {
            Edit::Reproject(reprojection) => Some(reprojection.to.to_string()),
            _ => None,
        });
        Self { crs: system.unwrap_or_else(|| self.crs.clone()), ..self.clone() }
    }
}

impl Default for Context {
    fn default() -> Self {
        let memory = memory::most().unwrap_or(u64::MAX);
        Self { file: "scene".into(), up: DVec3::Z, memory, crs: String::new() }
    }
}

/// A scene that edits change.
pub trait Editable: Sync {
    /// Returns the number of points, vertices or Gaussians.
    fn count(&self) -> usize;

    /// Returns where one of them is in the world.
    fn place(&self, index: usize) -> DVec3;

    /// Returns the names of the values that [`column`](Self::column) has.
    fn names(&self) -> Vec<String>;

    /// Returns the values of this name, one for each.
    fn column(&self, name: &str) -> Option<Vec<f64>>;

    /// Keeps those that are marked.
    fn keep(&mut self, kept: &[bool]);

    /// Moves all.
    fn move_by(&mut self, motion: &Motion);

    /// Gives all of them coordinates of another reference system.
    ///
    /// # Errors
    /// [`Error::Input`] for places that have none there; [`Error::Argument`] for scenes with shapes
    /// that change with the coordinates.
    fn reproject(&mut self, _: &Mapping) -> Result<()> {
        Err(Error::Argument(
            "--reproject is for points and meshes: splats and trained Gaussians have shapes that \
             no map keeps; --matrix moves them"
                .into(),
        ))
    }

    /// Returns how far one of them reaches around its place, in world units.
    fn reach(&self, _: usize) -> f32 {
        0.0
    }

    /// Keeps fewer of them. Returns whether that is possible; the message says why not.
    ///
    /// # Errors
    /// [`Error::Argument`] if the scene cannot be thinned; [`Error::Memory`].
    fn thin(&mut self, thin: &Thin) -> Result<()> {
        let (_, places) = local_places(self);
        let kept = thin.kept(&places)?;
        self.keep(&kept);
        Ok(())
    }

    /// Gives all of them estimated normals.
    ///
    /// # Errors
    /// [`Error::Argument`] for scenes that have none.
    fn estimate_normals(&mut self) -> Result<()> {
        Err(Error::Argument(
            "normals are estimated for meshes and point clouds; splats have a shape of their own"
                .into(),
        ))
    }

    /// Returns pairs that belong together, such as the ends of edges.
    fn pairs(&self) -> Vec<[u32; 2]> {
        Vec::new()
    }
}

/// Makes edits in their order, and says what each did.
///
/// # Errors
/// [`Error::Input`] if nothing is left, and for a name of no attribute;
/// [`Error::Argument`] for edits that do not suit the scene, or that need more memory than they may
/// use.
pub fn apply<S: Editable>(scene: &mut S, edits: &[Edit], context: &Context) -> Result<Vec<Change>> {
    let mut changes = Vec::new();
    for (at, edit) in edits.iter().enumerate() {
        let before = scene.count() as u64;
        if let Edit::Move(motion) = edit {
            let places = (0..scene.count()).map(|index| scene.place(index));
            motion.check(keep::around(places))?;
        }
        one(scene, edit, &context.after(&edits[..at]))?;
        changes.push(Change { edit: edit.name(), before, after: scene.count() as u64 });
        check_left(&changes, context)?;
    }
    Ok(changes)
}

/// Refuses edits that leave nothing.
fn check_left(changes: &[Change], context: &Context) -> Result<()> {
    let Some(Change { edit, before, .. }) = changes.iter().find(|change| change.after == 0) else {
        return Ok(());
    };
    let message = match before {
        0 => "gets nothing to edit".to_owned(),
        before => format!("keeps none of {before}"),
    };
    Err(Error::input(&context.file, format!("--{edit}"), message)
        .hint("`splatkit info --stats` prints the range of every value"))
}

/// Makes one edit.
fn one<S: Editable>(scene: &mut S, edit: &Edit, context: &Context) -> Result<()> {
    match edit {
        Edit::Crop(region) => {
            let is_in = |index: usize| region.contains(scene.place(index));
            let kept: Vec<bool> = (0..scene.count()).into_par_iter().map(is_in).collect();
            scene.keep(&kept);
        }
        Edit::Where(expression) => {
            let kept = select(scene, expression, context)?;
            scene.keep(&kept);
        }
        Edit::Move(motion) => scene.move_by(motion),
        Edit::Reproject(reprojection) => scene.reproject(&reprojection.mapping(context)?)?,
        Edit::Thin(thin) => scene.thin(thin)?,
        Edit::RemoveFloaters | Edit::KeepCluster(_) => {
            clusters::check_memory(edit.name(), scene.count(), context)?;
            let (_, places) = local_places(scene);
            let reaches: Vec<f32> = (0..scene.count()).map(|index| scene.reach(index)).collect();
            let clusters = clusters::Clusters::new(&places, &reaches, &scene.pairs());
            let kept = match edit {
                Edit::KeepCluster(count) => clusters.largest(*count),
                _ => clusters.without_floaters(),
            };
            scene.keep(&kept);
        }
        Edit::Normals => scene.estimate_normals()?,
    }
    Ok(())
}

/// Returns which points, vertices or Gaussians of a scene meet a condition.
///
/// # Errors
/// [`Error::Input`] for a name of no attribute.
pub fn select<S: Editable + ?Sized>(
    scene: &S,
    expression: &Expression,
    context: &Context,
) -> Result<Vec<bool>> {
    let columns = expression.names().map(|name| match name {
        "x" | "y" | "z" | "height" => Ok(None),
        name => match scene.column(name) {
            Some(column) => Ok(Some(column)),
            None => Err(unknown(expression, name, &scene.names(), context)),
        },
    });
    let columns: Vec<Option<Vec<f64>>> = columns.collect::<Result<_>>()?;
    let names: Vec<&str> = expression.names().collect();
    let is_met = |index: usize| {
        expression.is_met(&|name: usize| match &columns[name] {
            Some(column) => column[index],
            None => {
                let place = scene.place(index);
                match names[name] {
                    "x" => place.x,
                    "y" => place.y,
                    "z" => place.z,
                    _ => place.dot(context.up),
                }
            }
        })
    };
    Ok((0..scene.count()).into_par_iter().map(is_met).collect())
}

/// Returns the error for a name that a scene has no values of.
fn unknown(expression: &Expression, name: &str, names: &[String], context: &Context) -> Error {
    let place = format!("--where, column {}", expression.column_of(name));
    let known = ["x", "y", "z", "height"].into_iter().chain(names.iter().map(String::as_str));
    let mut known: Vec<&str> = known.collect();
    let mut seen = HashSet::new();
    known.retain(|name| seen.insert(*name));
    Error::input(&context.file, place, format!("there is no attribute “{name}”"))
        .hint(format!("name one of them: {}", known.join(", ")))
}

/// Finds a name among others: exactly, or else by other letters' case, or without `scalar_`.
fn find<'a>(names: impl Iterator<Item = &'a str> + Clone, name: &str) -> Option<usize> {
    let alike = |known: &str| {
        known.eq_ignore_ascii_case(name)
            || known.strip_prefix("scalar_").is_some_and(|rest| rest.eq_ignore_ascii_case(name))
    };
    names.clone().position(|known| known == name).or_else(|| names.clone().position(alike))
}

/// Returns the places relative to an origin, which keeps their precision in 32 bits.
fn local_places<S: Editable + ?Sized>(scene: &S) -> (DVec3, Vec<Vec3>) {
    let count = scene.count();
    let origin = if count > 0 { scene.place(count / 2).round() } else { DVec3::ZERO };
    let place = |index: usize| (scene.place(index) - origin).as_vec3();
    (origin, (0..count).into_par_iter().map(place).collect())
}

/// Keeps the marked parts of a list in which each has `each` entries. An empty list stays empty.
fn retain<T>(list: &mut Vec<T>, kept: &[bool], each: usize) {
    let mut index = 0;
    list.retain(|_| {
        index += 1;
        kept[(index - 1) / each]
    });
}
