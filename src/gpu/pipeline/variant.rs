//! The variant of a picture, and the constants that it puts before the shaders.

use crate::{
    plan::tables,
    scene::{Classification, Mode, Optics, Order},
};

/// Bins of a pass at most; groups of sheets are made so large that they suffice.
pub const MOST_BINS: u32 = 1 << 21;

/// Groups hold at most 2 to this power sheets (7 bits in an entry).
pub const MOST_GROUP_SHIFT: u32 = 7;

/// What a picture needs of the shaders. Each combination is compiled when it first occurs; what it does not need (the
/// sums of a payload that the scene lacks, say) the compiler then leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    pub perspective: bool,
    pub mode: Mode,
    pub classification: Classification,
    pub optics: Optics,
    /// The scene holds scalars, classified after interpolation (or before).
    pub scalar: bool,
    pub classified: bool,
    /// Where the scalars come from: a lattice, of one of these kinds, or scattered samples.
    pub lattice: bool,
    pub body_centred: bool,
    pub rectilinear: bool,
    /// The lattice is gathered; else its samples are scattered as splats are.
    pub gather: bool,
    /// The type of a gathered lattice's samples (sample.wgsl).
    pub sample_kind: u32,
    /// Two levels of a volume in bricks are drawn together, each with its share.
    pub two_levels: bool,
    pub radiance: bool,
    /// Lattice samples are drawn with sections that do not depend on the pixel.
    pub isotropic: bool,
    /// The field's kernel has no closed form.
    pub table_kernel: bool,
    /// Samples may have values before or behind those that the transfer function's table holds.
    pub beyond: bool,
    pub volume_shaded: bool,
    pub surface_shaded: bool,
    pub gradient_opacity: bool,
    pub isosurfaces: u32,
    /// Convex parts that the scene is cut to, and boxes that are cut out.
    pub clips: u32,
    pub holes: u32,
    /// What lies before a splat may hide it.
    pub occlusion: bool,
    /// Entries that a pass takes at least before it looks what it hides.
    pub least_share: u32,
    /// Gradients from neighbouring pixels.
    pub central: bool,
    /// Pixels per invocation of march, one below the other: 1, 2, 4 or 8.
    pub rows: u32,
    /// Entries after which march stops a tile, to go on in another dispatch.
    pub most_entries: u32,
}

/// Parts of a sheet in which the transfer function is integrated. Figures are in docs/engine.md.
const PARTS: u32 = 3;

/// Iterations that an entry takes at most.
const ENTRY_ITERATIONS: u32 = 6;

impl Variant {
    /// Pixels that a tile is wide and high, without the edge that it shares with its neighbours.
    pub fn tile_step(&self) -> u32 {
        8 - 2 * u32::from(self.central)
    }

    /// Whether a field's gradient is looked at.
    pub fn gradients(&self) -> bool {
        self.scalar && (self.volume_shaded || self.gradient_opacity)
    }

    /// Sheets that one dispatch of gather draws: as many as a driver's bound on iterations allows.
    pub fn gathered_sheets(&self) -> u32 {
        // Those that find the sheet and look at its planes, and those that close it.
        let pieces = PARTS * (1 + self.isosurfaces) * (1 + self.holes)
            + (1 + self.holes) * self.holes * self.holes;
        let most = self.most_entries.saturating_mul(ENTRY_ITERATIONS);
        if self.can_stop() { (most / (6 + pieces)).max(1) } else { u32::MAX }
    }

    /// Whether splats are scattered.
    pub fn scatters(&self) -> bool {
        !self.gather || self.radiance
    }

    /// Whether march may stop a tile among its entries.
    pub fn can_stop(&self) -> bool {
        self.most_entries < u32::MAX
    }

    /// The constants, as WGSL.
    pub fn constants(&self) -> String {
        let whole = self.mode != Mode::Sheets;
        let single = matches!(self.mode, Mode::Splats(_));
        let post = self.classification == Classification::Post;
        let maximum = self.optics == Optics::Maximum;
        let parabola = self.scalar && (!post || self.isosurfaces > 0);
        let parts = if parabola { PARTS } else { 1 };
        let radiance = self.radiance || self.classified;
        let samples = (self.scalar || self.classified) && !self.lattice;
        let flags = [
            ("PERSPECTIVE", self.perspective),
            ("SCALAR", self.scalar),
            ("GATHER", self.gather),
            ("SUMS", self.scalar && !self.gather),
            ("CLASSIFIED", self.classified),
            ("LATTICE", self.lattice),
            ("BODY_CENTRED", self.body_centred),
            ("RECTILINEAR", self.rectilinear),
            ("SAMPLES", samples),
            ("SLOPES", self.scalar && (samples || self.rectilinear)),
            ("TWO_LEVELS", self.two_levels),
            ("WEIGHTS", self.scalar && (samples || self.rectilinear || self.two_levels)),
            ("SAMPLE_NORMALS", self.classified && self.surface_shaded),
            ("RADIANCE_PAYLOAD", radiance),
            ("ISOTROPIC_RECORDS", self.isotropic),
            ("GENERAL_RECORDS", radiance || !self.isotropic),
            ("TABLE_KERNEL", self.table_kernel),
            ("BEYOND", self.beyond),
            ("VOLUME_SHADED", self.volume_shaded),
            ("SURFACE_SHADED", self.surface_shaded),
            ("GRADIENT_OPACITY", self.gradient_opacity),
            ("GRADIENTS", self.gradients()),
            ("CENTRAL", self.central),
            ("OCCLUSION", self.occlusion),
            ("WHOLE", whole),
            ("AXIS_SHEETS", self.mode == Mode::AxisSheets),
            ("SINGLE_SPLATS", single),
            ("BACK_TO_FRONT", self.mode == Mode::Splats(Order::BackToFront)),
            ("POST", post),
            ("PARABOLA", parabola),
            ("MAXIMUM", maximum),
            ("XRAY", self.optics == Optics::XRay),
            ("CAN_STOP", self.can_stop()),
        ];
        // What closing a sheet takes of the iterations that a driver allows, in entries (see docs/engine.md).
        let closing = (2 + self.rows * parts * (1 + self.isosurfaces) * (1 + self.holes))
            .div_ceil(ENTRY_ITERATIONS);
        let closing = closing + u32::from(self.gather);
        let counts = [
            ("ISOSURFACES", self.isosurfaces),
            ("PARTS", parts),
            ("CLIPS", self.clips),
            ("HOLES", self.holes),
            ("HOLES_OR_ONE", self.holes.max(1)),
            ("LEAST_SHARE", self.least_share),
            ("MOST_BINS", MOST_BINS),
            ("MOST_GROUP_SHIFT", MOST_GROUP_SHIFT),
            ("MOST_ENTRIES", self.most_entries),
            ("CLOSING_ENTRIES", closing),
            ("SAMPLE_KIND", self.sample_kind),
            ("ROWS", self.rows),
            ("LANE_ROWS", 8 / self.rows),
        ];
        let flags = flags.map(|(name, value)| format!("const {name}: bool = {value};\n")).concat();
        let counts =
            counts.map(|(name, value)| format!("const {name}: u32 = {value}u;\n")).concat();
        let apron = i32::from(self.central);
        let step = self.tile_step();
        format!(
            "{flags}{counts}const APRON: i32 = {apron};\nconst TILE_STEP: i32 = {step};\n{}",
            tables::constants()
        )
    }
}
