//! The order of the passes of a frame.

use crate::gpu::{
    device::Gpu,
    passes::{
        bin::Bin, clear::Clear, cull::Cull, cut::Cut, gather::Gather, large::Large, march::March,
        mark::Mark, measure::Measure, occlusion::Occlusion, order::Order, plan::Plan,
        project::Project, recolor::Recolor, resume::Resume, scan::Scan, select::Select,
        select_bricks::SelectBricks, tiles::Tiles,
    },
    pipeline::{
        commands::Commands,
        state::{AGAIN_ARGUMENTS, MARCH_ARGUMENTS, SCAN_ARGUMENTS},
    },
    scene::{PreparedScene, chunk::Origin},
    targets::Targets,
    variant::Variant,
};

/// The pipelines of a variant: those that scatter splats, and the one that gathers a lattice.
#[derive(Debug)]
pub struct Pipelines {
    scatter: Option<Scatter>,
    gather: Option<Gather>,
}

#[derive(Debug)]
struct Scatter {
    measure: Measure,
    plan: Plan,
    project: Project,
    cull: Cull,
    bin: Bin,
    large: Large,
    order: Order,
    march: March,
    occlusion: Option<Occlusion>,
}

impl Pipelines {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self {
            scatter: variant.scatters().then(|| Scatter::new(gpu, variant)),
            gather: variant.gather.then(|| Gather::new(gpu, variant)),
        }
    }
}

impl Scatter {
    fn new(gpu: &Gpu, variant: &Variant) -> Self {
        Self {
            measure: Measure::new(gpu, variant),
            plan: Plan::new(gpu, variant),
            project: Project::new(gpu, variant),
            cull: Cull::new(gpu, variant),
            bin: Bin::new(gpu, variant),
            large: Large::new(gpu, variant),
            order: Order::new(gpu, variant),
            march: March::new(gpu, variant),
            occlusion: variant.occlusion.then(|| Occlusion::new(gpu, variant)),
        }
    }
}

/// The passes that all variants share.
#[derive(Debug)]
pub struct Passes {
    pub select: Select,
    pub select_bricks: SelectBricks,
    pub cut: Cut,
    pub recolor: Recolor,
    scan: Scan,
    clear: Clear,
    mark: Mark,
    resume: Resume,
    tiles: Tiles,
}

impl Passes {
    pub fn new(gpu: &Gpu) -> Self {
        let scan = Scan::new(gpu);
        Self {
            select: Select::new(gpu, &scan),
            select_bricks: SelectBricks::new(gpu, &scan),
            cut: Cut::new(gpu),
            recolor: Recolor::new(gpu),
            scan,
            clear: Clear::new(gpu),
            mark: Mark::new(gpu),
            resume: Resume::new(gpu),
            tiles: Tiles::new(gpu),
        }
    }
}

/// A step of a frame, with its name for profiles.
pub type Step<'a> = (&'static str, Box<dyn Fn(&mut Commands<'_>) + 'a>);

/// Encodes all steps.
pub fn encode_all(steps: &[Step<'_>], encoder: &mut wgpu::CommandEncoder) {
    let mut commands = Commands::new(encoder);
    steps.iter().for_each(|(_, encode)| encode(&mut commands));
}

/// The resources that the steps of a frame use.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    pub gpu: &'a Gpu,
    pub passes: &'a Passes,
    pub pipelines: &'a Pipelines,
    pub targets: &'a Targets,
    pub prepared: &'a PreparedScene,
}

impl<'a> Work<'a> {
    /// Returns the steps before the first depth pass: the cuts of hierarchies, then measure and
    /// plan. If a lattice is gathered, the picture is cleared first.
    pub fn opening(self) -> Vec<Step<'a>> {
        let Self { gpu, passes, pipelines, targets, prepared } = self;
        let mut steps: Vec<Step<'a>> = Vec::new();
        if targets.gathered.is_some() {
            let clear = |commands: &mut Commands<'_>| {
                for buffer in [&targets.colors, &targets.depths, &targets.progress] {
                    commands.clear(buffer);
                }
            };
            steps.push(("clear", Box::new(clear)));
            steps.push((
                "mark",
                Box::new(move |commands| passes.mark.encode(gpu, commands, targets)),
            ));
        }
        let Some(scatter) = &pipelines.scatter else { return steps };
        for chunk in &prepared.chunks {
            if let Origin::Nodes { slots, .. } = &chunk.origin {
                let nodes = slots.chunk(&chunk.uniform, &chunk.data);
                steps.push((
                    "cut",
                    Box::new(move |commands| {
                        passes.cut.encode(gpu, commands, &passes.scan, &nodes);
                    }),
                ));
            }
        }
        steps.push((
            "measure",
            Box::new(move |commands| {
                for buffer in [&targets.needs, &targets.colors, &targets.depths, &targets.map] {
                    commands.clear(buffer);
                }
                for chunk in &prepared.chunks {
                    scatter.measure.encode(gpu, commands, targets, chunk);
                }
            }),
        ));
        steps.push(("plan", Box::new(move |commands| scatter.plan.encode(gpu, commands, targets))));
        steps
    }

    /// Returns the steps of the next depth pass. They do nothing if the frame is done.
    pub fn depth_pass(self) -> Vec<Step<'a>> {
        let Self { gpu, passes, pipelines, targets, prepared } = self;
        let Passes { scan, clear, resume, tiles, .. } = passes;
        let Some(scatter) = &pipelines.scatter else { return Vec::new() };
        let chunks = prepared.chunks.as_slice();
        let mut steps: Vec<Step<'a>> = vec![
            (
                "cull",
                Box::new(move |commands| {
                    scatter.plan.encode_advance(gpu, commands, targets);
                    scatter.cull.encode(gpu, commands, targets, chunks);
                    let size = (&targets.run_size, targets.run_total + 1);
                    scan.encode_sized(gpu, commands, &targets.runs, size);
                    targets.copy_record_starts(commands);
                }),
            ),
            (
                "project",
                Box::new(move |commands| scatter.project.encode(gpu, commands, targets, chunks)),
            ),
            (
                "bin",
                Box::new(move |commands| {
                    clear.encode(gpu, commands, targets);
                    scatter.bin.encode_count(gpu, commands, targets);
                    scatter.large.encode_count(gpu, commands, targets);
                    let arguments = (&targets.arguments, SCAN_ARGUMENTS);
                    scan.encode_indirect(
                        gpu,
                        commands,
                        &targets.bins,
                        &targets.bin_size,
                        arguments,
                    );
                    scatter.bin.encode_fill(gpu, commands, targets);
                    scatter.large.encode_fill(gpu, commands, targets);
                    tiles.encode(gpu, commands, targets);
                }),
            ),
            ("order", Box::new(move |commands| scatter.order.encode(gpu, commands, targets))),
            (
                "march",
                Box::new(move |commands| {
                    scatter.march.encode(gpu, commands, targets, MARCH_ARGUMENTS);
                    resume.encode_again(gpu, commands, targets);
                    scatter.march.encode(gpu, commands, targets, AGAIN_ARGUMENTS);
                    resume.encode_hold(gpu, commands, targets);
                }),
            ),
        ];
        steps.extend(self.occlusion());
        steps
    }

    /// Returns the steps that continue a pass at which the frame stopped.
    pub fn resumed(self) -> Vec<Step<'a>> {
        // A march that finds nothing left does nothing.
        const MARCHES: usize = 8;
        let Self { gpu, passes: Passes { resume, .. }, pipelines, targets, .. } = self;
        let Some(scatter) = &pipelines.scatter else { return Vec::new() };
        let march: Step<'a> = (
            "march",
            Box::new(move |commands| {
                resume.encode_resume(gpu, commands, targets);
                scatter.march.encode(gpu, commands, targets, MARCH_ARGUMENTS);
                for _ in 1..MARCHES {
                    resume.encode_again(gpu, commands, targets);
                    scatter.march.encode(gpu, commands, targets, AGAIN_ARGUMENTS);
                }
                resume.encode_hold(gpu, commands, targets);
            }),
        );
        [march].into_iter().chain(self.occlusion()).collect()
    }

    /// Returns the step that gathers the rest of a lattice's field.
    pub fn gathered(self) -> Vec<Step<'a>> {
        let Self { gpu, pipelines, targets, .. } = self;
        let Some(gather) = &pipelines.gather else { return Vec::new() };
        vec![("gather", Box::new(move |commands| gather.encode(gpu, commands, targets)))]
    }

    fn occlusion(self) -> Option<Step<'a>> {
        let Self { gpu, pipelines, targets, .. } = self;
        let occlusion = pipelines.scatter.as_ref()?.occlusion.as_ref()?;
        Some(("occlusion", Box::new(move |commands| occlusion.encode(gpu, commands, targets))))
    }
}
