//! Every pipeline of every variant compiles: naga accepts its WGSL, its bindings are those that the
//! engine binds, and naga writes it as SPIR-V, MSL and HLSL. Like `Stage::new`, it leaves out the
//! checks that untrusted shaders need.

use super::{
    recipes::{self, parse, source_of, stage_of},
    variants,
};
use crate::gpu::{
    pipeline::recipe::{Binding, Recipe, split, words},
    variant::Variant,
};
use naga::{
    AddressSpace, ImageClass, ImageDimension, Module, ResourceBinding, ScalarKind, StorageAccess,
    TypeInner,
    back::{PipelineConstants, hlsl, msl, pipeline_constants::process_overrides, spv},
    valid::{Capabilities, ModuleInfo, ValidationFlags, Validator},
};
use rayon::prelude::*;
use std::{
    collections::{BTreeMap, BTreeSet, HashMap, HashSet},
    error::Error,
    path::Path,
};

type Outcome = Result<(), String>;

/// Returns an error with its causes.
fn with_causes(error: impl Error) -> String {
    let causes = std::iter::successors(error.source(), |&error| error.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// Finds pipelines that compile alike: they differ in constants that their shaders do not mention.
#[derive(Default)]
struct Essences {
    /// The shaders without the constants before them: a number, and the words in them.
    known: HashMap<String, (usize, HashSet<String>)>,
}

impl Essences {
    /// Returns the number of the pipeline's shader, and the constants that it mentions.
    fn of(&mut self, recipe: &Recipe) -> (usize, Vec<String>) {
        let source = source_of(recipe);
        let (constants, body) = split(&source);
        if !self.known.contains_key(body) {
            let words = words(body).map(str::to_owned).collect();
            self.known.insert(body.to_owned(), (self.known.len(), words));
        }
        let (number, used) = &self.known[body];
        let is_used = |line: &&str| words(line).nth(1).is_some_and(|name| used.contains(name));
        (*number, constants.lines().filter(is_used).map(str::to_owned).collect())
    }
}

fn check(recipe: &Recipe) -> Outcome {
    let module = parse(recipe)?;
    // Reading 16-bit floats from words is part of WebGPU.
    let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
    let info = Validator::new(ValidationFlags::all(), capabilities)
        .validate(&module)
        .map_err(|error| error.emit_to_string(&source_of(recipe)))?;
    check_bindings(recipe, &module, &info)?;
    // What wgpu does before it writes a pipeline: only what its entry point reaches is left.
    let entry = (stage_of(recipe, &module), recipe.entry);
    let (module, info) =
        process_overrides(&module, &info, Some(entry), &PipelineConstants::default())
            .map_err(with_causes)?;
    write_spirv(recipe, &module, &info).map_err(|error| format!("SPIR-V: {error}"))?;
    write_msl(recipe, &module, &info).map_err(|error| format!("MSL: {error}"))?;
    write_hlsl(recipe, &module, &info).map_err(|error| format!("HLSL: {error}"))
}

/// The bindings of a recipe, with their numbers.
fn bindings(recipe: &Recipe) -> impl Iterator<Item = (ResourceBinding, Binding)> {
    (0..).zip(&recipe.groups).flat_map(|(group, bindings)| {
        let used = (0..).zip(bindings).filter(|(_, kind)| **kind != Binding::Unused);
        used.map(move |(binding, &kind)| (ResourceBinding { group, binding }, kind))
    })
}

/// Everything that the entry point uses is bound, and as what the shader declares it.
fn check_bindings(recipe: &Recipe, module: &Module, info: &ModuleInfo) -> Outcome {
    let bound: BTreeMap<_, _> = bindings(recipe).collect();
    let entry = module.entry_points.iter().position(|point| point.name == recipe.entry);
    let entry = info.get_entry_point(entry.ok_or(format!("no entry point {}", recipe.entry))?);
    for (handle, global) in module.global_variables.iter() {
        let Some(place) = global.binding.filter(|_| !entry[handle].is_empty()) else { continue };
        let texture = match module.types[global.ty].inner {
            TypeInner::Image {
                dim,
                arrayed: false,
                class: ImageClass::Sampled { kind: ScalarKind::Uint, multi: false },
            } => Some(if dim == ImageDimension::D3 { Binding::Texture } else { Binding::Words }),
            _ => None,
        };
        let both = StorageAccess::LOAD | StorageAccess::STORE;
        let declared = match global.space {
            AddressSpace::Uniform => Some(Binding::Uniform),
            AddressSpace::Storage { access } if access == StorageAccess::LOAD => {
                Some(Binding::Read)
            }
            AddressSpace::Storage { access } if access == both => Some(Binding::Write),
            AddressSpace::Handle => texture,
            _ => None,
        };
        let given = bound.get(&place).copied();
        if declared.is_none() || declared != given {
            return Err(format!("{:?} is {declared:?}, but bound as {given:?}", global.name));
        }
    }
    Ok(())
}

fn write_spirv(recipe: &Recipe, module: &Module, info: &ModuleInfo) -> Outcome {
    let target = |place: ResourceBinding| spv::BindingInfo {
        descriptor_set: place.group,
        binding: place.binding,
        binding_array_size: None,
    };
    let options = spv::Options {
        fake_missing_bindings: false,
        binding_map: bindings(recipe).map(|(place, _)| (place, target(place))).collect(),
        zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
        force_loop_bounding: false,
        ..spv::Options::default()
    };
    let pipeline = spv::PipelineOptions {
        shader_stage: stage_of(recipe, module),
        entry_point: recipe.entry.to_owned(),
    };
    spv::write_vec(module, info, &options, Some(&pipeline)).map(drop).map_err(with_causes)
}

fn write_msl(recipe: &Recipe, module: &Module, info: &ModuleInfo) -> Outcome {
    let target = |slot: u8, kind| {
        let is_texture = matches!(kind, Binding::Texture | Binding::Words);
        msl::BindTarget {
            buffer: (!is_texture).then_some(slot),
            texture: is_texture.then_some(slot),
            mutable: kind == Binding::Write,
            ..msl::BindTarget::default()
        }
    };
    let resources: BTreeMap<_, _> = (0..)
        .zip(bindings(recipe))
        .map(|(slot, (place, kind))| (place, target(slot, kind)))
        .collect();
    let entry_point = msl::EntryPointResources {
        sizes_buffer: Some(resources.len() as u8),
        resources,
        immediates_buffer: None,
    };
    let options = msl::Options {
        // The oldest that wgpu's Metal backend has atomics and 32-bit textures in.
        lang_version: (2, 0),
        per_entry_point_map: [(recipe.entry.to_owned(), entry_point)].into(),
        fake_missing_bindings: false,
        zero_initialize_workgroup_memory: false,
        force_loop_bounding: false,
        ..msl::Options::default()
    };
    let pipeline = msl::PipelineOptions {
        entry_point: Some((stage_of(recipe, module), recipe.entry.to_owned())),
        ..msl::PipelineOptions::default()
    };
    let (_, written) = msl::write_string(module, info, &options, &pipeline).map_err(with_causes)?;
    written.entry_point_names.into_iter().try_for_each(|name| name.map(drop).map_err(with_causes))
}

fn write_hlsl(recipe: &Recipe, module: &Module, info: &ModuleInfo) -> Outcome {
    let target = |place: ResourceBinding| hlsl::BindTarget {
        space: place.group as u8,
        register: place.binding,
        ..hlsl::BindTarget::default()
    };
    let options = hlsl::Options {
        // Numbers of workgroups come from the host.
        special_constants_binding: Some(hlsl::BindTarget { space: 9, ..Default::default() }),
        binding_map: bindings(recipe).map(|(place, _)| (place, target(place))).collect(),
        fake_missing_bindings: false,
        zero_initialize_workgroup_memory: false,
        restrict_indexing: false,
        force_loop_bounding: false,
        ..hlsl::Options::default()
    };
    let pipeline = hlsl::PipelineOptions {
        entry_point: Some((stage_of(recipe, module), recipe.entry.to_owned())),
    };
    let mut text = String::new();
    let written = hlsl::Writer::new(&mut text, &options, &pipeline)
        .write(module, info, None)
        .map_err(with_causes)?;
    written.entry_point_names.into_iter().try_for_each(|name| name.map(drop).map_err(with_causes))
}

/// Writes the shaders of pipelines for another compiler: tools/web/tests.mjs gives them to a
/// browser's. Each begins with a comment that names its entry point.
fn write_shaders<'a>(recipes: impl Iterator<Item = &'a Recipe>, folder: &Path) {
    std::fs::create_dir_all(folder).expect("a folder");
    for (number, recipe) in recipes.enumerate() {
        let label = recipe.label.replace(' ', "-");
        let text = format!("// {}\n{}", recipe.entry, source_of(recipe));
        std::fs::write(folder.join(format!("{number}-{label}.wgsl")), text).expect("a shader");
    }
}

/// Pipelines that compile alike are checked once. `SPLATKIT_SHADERS` names a folder for their
/// shaders.
#[test]
fn every_pipeline_of_every_variant_compiles_for_every_backend() {
    let variants = &*variants::ALL;
    let shared = recipes::shared().into_iter().map(|recipe| (recipe, None));
    let specific = variants.iter().flat_map(|named| {
        recipes::of(&named.1).into_iter().map(move |recipe| (recipe, Some(named)))
    });
    let mut essences = Essences::default();
    let mut distinct: HashMap<_, (Recipe, Option<&(&str, Variant)>)> = HashMap::new();
    let mut pipelines = 0;
    for (recipe, named) in shared.chain(specific) {
        pipelines += 1;
        let key = (essences.of(&recipe), recipe.entry, recipe.groups.clone());
        distinct.entry(key).or_insert((recipe, named));
    }
    println!("{} variants, {pipelines} pipelines, {} distinct", variants.len(), distinct.len());
    if let Some(folder) = std::env::var_os("SPLATKIT_SHADERS") {
        write_shaders(distinct.values().map(|(recipe, _)| recipe), Path::new(&folder));
    }
    let failure = |(recipe, named): &(Recipe, Option<&(&str, Variant)>)| {
        let error = check(recipe).err()?;
        let variant = named.map_or("any variant".into(), |(scene, variant)| {
            format!("a variant of the scene {scene}, {variant:?}")
        });
        Some(format!("{} of {variant}:\n{error}\n", recipe.label))
    };
    let failures: Vec<String> =
        distinct.into_values().par_bridge().filter_map(|pipeline| failure(&pipeline)).collect();
    let first = failures.iter().take(3).map(String::as_str).collect::<String>();
    assert!(failures.is_empty(), "{} pipelines fail, among them\n{first}", failures.len());
}

/// Each flag of a variant is on in one and off in another, and each number has several values.
#[test]
fn the_variants_cover_every_constant() {
    let fixed = BTreeSet::from([
        "MOST_BINS",
        "MOST_GROUP_SHIFT",
        "GRADIENT_ENTRIES",
        "RADIAL_ENTRIES",
        "SECTION_CELLS",
    ]);
    let mut values: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (_, variant) in variants::ALL.iter() {
        for line in variant.constants().lines() {
            let (name, value) = line.split_once(": ").expect("a constant");
            let name = name.trim_start_matches("const ").to_owned();
            values.entry(name).or_default().insert(value.to_owned());
        }
    }
    let alike = values.iter().filter(|(_, values)| values.len() < 2).map(|(name, _)| name.as_str());
    assert_eq!(alike.collect::<BTreeSet<_>>(), fixed, "constants with one value in all variants");
}

/// No entry point of a shader file is left out.
#[test]
fn every_entry_point_has_a_pipeline() {
    let mut recipes = recipes::shared();
    recipes.extend(variants::usual().iter().flat_map(recipes::of));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders/passes");
    for file in folder.read_dir().expect("the folder of the passes") {
        let path = file.expect("a file").path();
        let text = std::fs::read_to_string(&path).expect("a shader");
        let entries: Vec<&str> = ["@compute", "@vertex\n", "@fragment\n"]
            .iter()
            .flat_map(|stage| text.split(stage).skip(1))
            .filter_map(|part| part.split_once("fn ")?.1.split('(').next())
            .collect();
        assert!(!entries.is_empty(), "{} has no entry point", path.display());
        for entry in entries {
            let fits = |recipe: &Recipe| recipe.entry == entry && source_of(recipe).contains(&text);
            assert!(recipes.iter().any(fits), "{}: no pipeline of {entry}", path.display());
        }
    }
}
