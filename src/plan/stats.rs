//! What a frame took.

/// What a frame took.
#[derive(Debug, Clone, Default)]
pub struct FrameStats {
    /// Splats that meet the picture. Samples of a lattice that is gathered are none.
    pub splats: u64,
    /// Those of them that were left out because what lies before them is opaque.
    pub hidden: u64,
    /// (splat, tile, window) triples that were drawn.
    pub entries: u64,
    /// Depth passes; none where nothing is scattered.
    pub passes: u32,
    /// A lattice that is gathered: (tile, sheet) pairs in which it may show something, so that rays look for it there.
    pub gathered: u64,
    /// Memory of the device that draws, or of the CPU engine, held by the scene and by the frame.
    pub gpu_bytes: u64,
    /// Hierarchies: the cut, in pixels.
    pub cut_pixels: f64,
    /// Pages of hierarchies that the view needed and that had no room; the nodes above them were drawn.
    pub missing_pages: u64,
    /// Volumes in bricks: how coarse the picture is, a real number of levels.
    pub lambda: f64,
    /// Bricks that the view needed, and those of them that were read for it.
    pub bricks: u64,
    /// Bricks that were read for this view.
    pub read_bricks: u64,
    /// GPU memory of the slots that bricks lie in.
    pub brick_bytes: u64,
    /// Milliseconds of each step, in order; only from
    /// [`Renderer::profile`](crate::Renderer::profile).
    pub steps: Vec<(&'static str, f64)>,
}

impl FrameStats {
    /// Adds what another strip of the same picture took.
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
        for (name, time) in other.steps {
            match self.steps.iter_mut().find(|step| step.0 == name) {
                Some(step) => step.1 += time,
                None => self.steps.push((name, time)),
            }
        }
    }
}
