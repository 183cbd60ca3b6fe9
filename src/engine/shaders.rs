//! The shader files, and the constants that a picture's variant puts before them.

use super::tables;
use crate::scene::{Classification, Mode, Optics, Order};

pub const FRAME: &str = include_str!("../../shaders/frame.wgsl");
pub const NORMAL: &str = include_str!("../../shaders/normal.wgsl");
pub const VALUE: &str = include_str!("../../shaders/value.wgsl");
pub const SAMPLE: &str = include_str!("../../shaders/sample.wgsl");
pub const FOOTPRINT: &str = include_str!("../../shaders/footprint.wgsl");
pub const SPLATS: &str = include_str!("../../shaders/splats.wgsl");
pub const SOURCE_NODES: &str = include_str!("../../shaders/source_nodes.wgsl");
pub const SOURCE_SPLATS: &str = include_str!("../../shaders/source_splats.wgsl");
pub const SOURCE_LATTICE: &str = include_str!("../../shaders/source_lattice.wgsl");
pub const SOURCE_BRICKS: &str = include_str!("../../shaders/source_bricks.wgsl");
pub const SPANS: &str = include_str!("../../shaders/spans.wgsl");
pub const CENSUS: &str = include_str!("../../shaders/census.wgsl");
pub const BINS: &str = include_str!("../../shaders/bins.wgsl");
pub const SELECT: &str = include_str!("../../shaders/select.wgsl");
pub const SELECT_BRICKS: &str = include_str!("../../shaders/select_bricks.wgsl");
pub const NODES: &str = include_str!("../../shaders/nodes.wgsl");
pub const CUT: &str = include_str!("../../shaders/cut.wgsl");
pub const TALLY: &str = include_str!("../../shaders/tally.wgsl");
pub const MEASURE: &str = include_str!("../../shaders/measure.wgsl");
pub const SURVEY: &str = include_str!("../../shaders/survey.wgsl");
pub const PLAN: &str = include_str!("../../shaders/plan.wgsl");
pub const PROJECT: &str = include_str!("../../shaders/project.wgsl");
pub const SCAN: &str = include_str!("../../shaders/scan.wgsl");
pub const ACTIVE: &str = include_str!("../../shaders/active.wgsl");
pub const BIN: &str = include_str!("../../shaders/bin.wgsl");
pub const CLEAR: &str = include_str!("../../shaders/clear.wgsl");
pub const CULL: &str = include_str!("../../shaders/cull.wgsl");
pub const MAP: &str = include_str!("../../shaders/map.wgsl");
pub const OCCLUSION: &str = include_str!("../../shaders/occlusion.wgsl");
pub const RESUME: &str = include_str!("../../shaders/resume.wgsl");
pub const PROGRESS: &str = include_str!("../../shaders/progress.wgsl");
pub const SAVED: &str = include_str!("../../shaders/saved.wgsl");
pub const TILES: &str = include_str!("../../shaders/tiles.wgsl");
pub const STATE: &str = include_str!("../../shaders/state.wgsl");
pub const LARGE: &str = include_str!("../../shaders/large.wgsl");
pub const ORDER: &str = include_str!("../../shaders/order.wgsl");
pub const TABLES: &str = include_str!("../../shaders/tables.wgsl");
pub const PIXEL: &str = include_str!("../../shaders/pixel.wgsl");
pub const KERNELS: &str = include_str!("../../shaders/kernels.wgsl");
pub const SHEET: &str = include_str!("../../shaders/sheet.wgsl");
pub const FIELD_SUMS: &str = include_str!("../../shaders/field_sums.wgsl");
pub const FIELD_LATTICE: &str = include_str!("../../shaders/field_lattice.wgsl");
pub const MARCH_LATTICE: &str = include_str!("../../shaders/march_lattice.wgsl");
pub const GATHER: &str = include_str!("../../shaders/gather.wgsl");
pub const PICTURE: &str = include_str!("../../shaders/picture.wgsl");
pub const MARCH: &str = include_str!("../../shaders/march.wgsl");

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
            ("MOST_BINS", super::frame::MOST_BINS),
            ("MOST_GROUP_SHIFT", super::frame::MOST_GROUP_SHIFT),
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
