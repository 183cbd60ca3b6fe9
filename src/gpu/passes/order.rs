//! Order: sorts the entries of each bin, so that they are added in the same order every time
//! (shaders/passes/order.wgsl).

use crate::gpu::{
    device::Gpu,
    pipeline::{
        commands::Commands,
        recipe::{Binding, Recipe},
        shaders,
        stage::Stage,
        state::ORDER_ARGUMENTS,
    },
    targets::Targets,
    variant::Variant,
};

/// The pass. One invocation sorts a short bin, one workgroup a long bin.
#[derive(Debug)]
pub struct Order {
    short: Stage,
    count_long: Stage,
    long: Stage,
}

impl Order {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        let [short, count_long, long] = Stage::all(gpu, Self::recipes(variant));
        Self { short, count_long, long }
    }

    pub fn recipes(variant: &Variant) -> [Recipe; 3] {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let bindings = [Uniform, Uniform, Read, Write, Write, Write, Read, Read];
        let recipe = |label, entry, arguments: &[&[Binding]]| {
            let groups = [&[bindings.as_slice()], arguments].concat();
            let sources =
                [&constants, shaders::FRAME, shaders::KEY, shaders::PROGRESS, shaders::ORDER];
            Recipe::new(label, &sources, entry, &groups)
        };
        [
            recipe("order", "order", &[]),
            recipe("order: count long", "count_long", &[&[Write]]),
            recipe("order: long", "order_long", &[]),
        ]
    }

    pub fn encode(&self, gpu: &Gpu, commands: &mut Commands<'_>, targets: &Targets) {
        commands.clear(&targets.long_count);
        let buffers = [
            targets.frame.as_entire_buffer_binding(),
            targets.pass.as_entire_buffer_binding(),
            targets.bins.as_entire_buffer_binding(),
            targets.entries.as_entire_buffer_binding(),
            targets.long_bins.as_entire_buffer_binding(),
            targets.long_count.as_entire_buffer_binding(),
            targets.records.as_entire_buffer_binding(),
            targets.progress.as_entire_buffer_binding(),
        ];
        let group = self.short.bind(gpu, 0, &buffers);
        self.short.dispatch_indirect(commands, &[&group], (&targets.arguments, ORDER_ARGUMENTS));
        let arguments =
            self.count_long.bind(gpu, 1, &[targets.long_arguments.as_entire_buffer_binding()]);
        self.count_long.dispatch(
            commands,
            &[&self.count_long.bind(gpu, 0, &buffers), &arguments],
            1,
        );
        self.long.dispatch_indirect(
            commands,
            &[&self.long.bind(gpu, 0, &buffers)],
            (&targets.long_arguments, 0),
        );
    }
}
