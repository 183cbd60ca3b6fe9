//! The flags of a scene.

use crate::{
    edit::EditFlags,
    failure::Failure,
    given::Given,
    load::LoadFlags,
    parse,
    scene_file::{self, Stated},
    show::ShowFlags,
    transform::TransformFlags,
};
use clap::Args;
use splatkit::session::Description;
use std::path::PathBuf;

/// The inputs, and how their values and surfaces are shown.
#[derive(Args, Debug, Clone)]
pub struct SceneFlags {
    /// Meshes, point clouds, hierarchies, and up to eight volumes, sets of cells or sets of
    /// scattered samples; all are drawn in one picture. Addresses are inputs too: https://…,
    /// s3://…, gs://…, az://… (docs/remote.md).
    #[arg(value_name = "SCENE", required = true, value_parser = parse::input())]
    pub inputs: Vec<PathBuf>,
    /// Let a scene file name files outside its folder, and addresses. Give it only for scenes that
    /// you have made, or whose maker you trust.
    #[arg(long)]
    pub trust_scene: bool,
    #[command(flatten)]
    load: LoadFlags,
    #[command(flatten)]
    transform: TransformFlags,
    #[command(flatten)]
    edit: EditFlags,
    #[command(flatten)]
    show: ShowFlags,
}

impl SceneFlags {
    /// Returns the scene of these inputs, or the one that a scene file among them describes, and
    /// where it is stated.
    pub fn open(&self, given: &Given) -> Result<(Description, Option<Stated>), Failure> {
        scene_file::open(&self.inputs, self.trust_scene, given)
    }

    /// Changes how the inputs of a scene are read, moved and shown: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) -> Result<(), Failure> {
        self.load.apply(scene);
        self.transform.apply(scene)?;
        self.edit.apply(scene)?;
        self.show.apply(scene)
    }
}
