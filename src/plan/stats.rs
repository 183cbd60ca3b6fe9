//! Statistics of a frame.

/// Statistics of a frame.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct FrameStats {
    /// Splats that meet the picture. The samples of a gathered lattice do not count.
    pub splats: u64,
    /// The number of these that were left out because opaque parts lie in front of them.
    pub hidden: u64,
    /// (splat, tile, window) triples that were drawn.
    pub entries: u64,
    /// Depth passes; 0 if nothing is scattered.
    pub passes: u32,
    /// For gathered lattices: (tile, sheet) pairs in which each may be visible, so that rays
    /// evaluate it there.
    pub gathered: u64,
    /// Memory that the scene and the frame hold, in bytes: that of the device, or that of the CPU
    /// engine.
    pub gpu_bytes: u64,
    /// For hierarchies: the cut, in pixels.
    pub cut_pixels: f64,
    /// Pages of hierarchies that the view needed but that did not fit in memory. The nodes above
    /// them were drawn.
    pub missing_pages: u64,
    /// For volumes in bricks: the level of detail, a real number of levels. Higher is coarser; of
    /// several volumes, that of the coarsest.
    pub lambda: f64,
    /// Bricks that the view needed.
    pub bricks: u64,
    /// Bricks that were read for this view.
    pub read_bricks: u64,
    /// GPU memory of the slots that hold bricks, in bytes.
    pub brick_bytes: u64,
    /// GPU engine: milliseconds in which the processor planned the frame, and encoded and submitted
    /// its work, without waiting for the device.
    pub host_ms: f64,
    /// Milliseconds of each step, in order; only from
    /// [`Renderer::profile`](crate::Renderer::profile).
    pub steps: Vec<(&'static str, f64)>,
}

impl FrameStats {
    /// Adds the statistics of another strip of the same picture.
    pub(crate) fn add(&mut self, other: Self) {
        self.splats = self.splats.max(other.splats);
        self.hidden = self.hidden.max(other.hidden);
        self.entries += other.entries;
        self.passes += other.passes;
        self.gathered += other.gathered;
        self.gpu_bytes = self.gpu_bytes.max(other.gpu_bytes);
        self.cut_pixels = self.cut_pixels.max(other.cut_pixels);
        self.missing_pages = self.missing_pages.max(other.missing_pages);
        self.lambda = self.lambda.max(other.lambda);
        self.bricks = self.bricks.max(other.bricks);
        self.read_bricks += other.read_bricks;
        self.brick_bytes = self.brick_bytes.max(other.brick_bytes);
        self.host_ms += other.host_ms;
        for (name, time) in other.steps {
            match self.steps.iter_mut().find(|step| step.0 == name) {
                Some(step) => step.1 += time,
                None => self.steps.push((name, time)),
            }
        }
    }
}
