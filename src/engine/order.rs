//! Order: sorts the entries of each bin, so that every run adds them up alike (shaders/order.wgsl).

use super::{
    Gpu,
    frame::Targets,
    shaders::{self, Variant},
    stage::{Binding, Stage},
};

/// The pass: short bins by one invocation each, long ones by a workgroup each.
#[derive(Debug)]
pub struct Order {
    short: Stage,
    count_long: Stage,
    long: Stage,
}

impl Order {
    pub fn new(gpu: &Gpu, variant: &Variant) -> Self {
        use Binding::{Read, Uniform, Write};
        let constants = variant.constants();
        let bindings = [Uniform, Uniform, Read, Write, Write, Write, Read];
        let stage = |label, entry, arguments: &[&[Binding]]| {
            let groups = [&[bindings.as_slice()], arguments].concat();
            Stage::new(gpu, label, &[&constants, shaders::FRAME, shaders::ORDER], entry, &groups)
        };
        Self {
            short: stage("order", "order", &[]),
            count_long: stage("order: count long", "count_long", &[&[Write]]),
            long: stage("order: long", "order_long", &[]),
        }
    }

    pub fn encode(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, targets: &Targets, pass: u32) {
        encoder.clear_buffer(&targets.long_count, 0, None);
        let buffers = [
            targets.frame.as_entire_buffer_binding(),
            targets.pass(pass),
            targets.bins.as_entire_buffer_binding(),
            targets.entries.as_entire_buffer_binding(),
            targets.long_bins.as_entire_buffer_binding(),
            targets.long_count.as_entire_buffer_binding(),
            targets.records.as_entire_buffer_binding(),
        ];
        self.short.dispatch(encoder, &[&self.short.bind(gpu, 0, &buffers)], targets.bin_count.div_ceil(64));
        let arguments = self.count_long.bind(gpu, 1, &[targets.long_arguments.as_entire_buffer_binding()]);
        self.count_long.dispatch(encoder, &[&self.count_long.bind(gpu, 0, &buffers), &arguments], 1);
        self.long.dispatch_indirect(encoder, &[&self.long.bind(gpu, 0, &buffers)], (&targets.long_arguments, 0));
    }
}
