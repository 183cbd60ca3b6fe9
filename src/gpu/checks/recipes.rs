//! Every pipeline that the engine can build.

use crate::gpu::{
    passes::{
        bin::Bin, clear::Clear, cull::Cull, cut::Cut, gather::Gather, large::Large, march::March,
        mark::Mark, measure::Measure, occlusion::Occlusion, order::Order, plan::Plan,
        present::Presenter, project::Project, recolor::Recolor, resume::Resume, scan::Scan,
        select::Select, select_bricks::SelectBricks, tiles::Tiles,
    },
    pipeline::recipe::Recipe,
    variant::Variant,
};
use naga::{Expression, Literal, Module, ShaderStage};

/// WebGPU's default limit, which every device is opened with.
const MOST_WORKGROUPS: u32 = 65_535;

/// Returns the pipelines that serve all variants.
pub fn shared() -> Vec<Recipe> {
    let mut all = vec![Clear::recipe(), Mark::recipe(), Recolor::recipe()];
    all.extend(Select::recipes());
    all.extend(SelectBricks::recipes());
    all.extend(Cut::recipes());
    all.extend(Scan::recipes());
    all.extend(Resume::recipes());
    all.extend(Tiles::recipes());
    all.extend(Presenter::recipes());
    all
}

/// Returns the pipelines of one variant.
pub fn of(variant: &Variant) -> Vec<Recipe> {
    let mut all = Vec::new();
    if variant.scatters() {
        all.extend(Measure::recipes(variant).into_array());
        all.extend(Plan::recipes(variant));
        all.extend(Project::recipes(variant).into_array());
        all.extend(Cull::recipes(variant));
        all.extend(Bin::recipes(variant));
        all.extend(Large::recipes(variant));
        all.extend(Order::recipes(variant));
        all.push(March::recipe(variant));
        if variant.occlusion {
            all.extend(Occlusion::recipes(variant));
        }
    }
    if variant.gather {
        all.push(Gather::recipe(variant));
    }
    all
}

/// Returns the joined source of a pipeline, as a device compiles it.
pub fn source_of(recipe: &Recipe) -> String {
    recipe.source(MOST_WORKGROUPS)
}

/// Parses the source of a pipeline.
pub fn parse(recipe: &Recipe) -> Result<Module, String> {
    let source = source_of(recipe);
    naga::front::wgsl::parse_str(&source).map_err(|error| error.emit_to_string(&source))
}

/// Returns the kind of a pipeline's entry point.
pub fn stage_of(recipe: &Recipe, module: &Module) -> ShaderStage {
    let entry_point = module.entry_points.iter().find(|point| point.name == recipe.entry);
    entry_point.map_or(ShaderStage::Compute, |point| point.stage)
}

/// Returns the constants of a module that are unsigned integers.
pub fn integers(module: &Module) -> impl Iterator<Item = (&str, u32)> {
    module.constants.iter().filter_map(|(_, constant)| {
        let Expression::Literal(Literal::U32(value)) = module.global_expressions[constant.init]
        else {
            return None;
        };
        Some((constant.name.as_deref()?, value))
    })
}
