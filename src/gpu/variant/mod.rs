//! The variant of a picture, and the constants that precede its shaders. `choice` chooses it.

mod choice;

pub use choice::{Request, variant};

use super::{
    budget::RECORD_WORDS,
    pipeline::{recipe::Binding, shaders},
};
use crate::{
    plan::tables,
    scene::{Classification, Mode, Optics, Order},
};

/// Maximum number of bins in a pass. Groups of sheets are made large enough to need no more.
pub const MOST_BINS: u32 = 1 << 21;

/// A group contains at most 2 to this power sheets (7 bits in an entry).
pub const MOST_GROUP_SHIFT: u32 = 7;

/// The features of the shaders that a picture needs. Each combination is compiled when it first
/// occurs. The compiler leaves out the rest, such as the sums of a payload that the scene lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    pub perspective: bool,
    pub mode: Mode,
    pub classification: Classification,
    pub optics: Optics,
    /// The scene has scalars that are classified after interpolation (`classified`: before).
    pub scalar: bool,
    pub classified: bool,
    /// The number of fields, at least 1. A flag below is set if any field needs it.
    pub fields: u32,
    /// The scalars are scattered samples.
    pub samples: bool,
    /// The scalars lie on a lattice, possibly of one of the two kinds below.
    pub lattice: bool,
    pub body_centred: bool,
    pub rectilinear: bool,
    /// The lattice is gathered; otherwise its samples are scattered as splats are.
    pub gather: bool,
    /// The layout of a gathered lattice's samples (value.wgsl).
    pub sample_kind: u32,
    /// The values of a gathered lattice are labels.
    pub labels: bool,
    /// Two levels of a volume in bricks are drawn together, each with its weight.
    pub two_levels: bool,
    pub radiance: bool,
    /// The scene has trained Gaussians.
    pub trained: bool,
    /// They are drawn alone, each at the depth of its centre.
    pub by_centers: bool,
    /// The scene has facets.
    pub facets: bool,
    /// Facets show images.
    pub images: bool,
    /// Facets are rods.
    pub rods: bool,
    /// Lattice samples are drawn with sections that do not depend on the pixel.
    pub isotropic: bool,
    /// Samples are drawn with sections that depend on the pixel.
    pub general: bool,
    /// The field's kernel has no closed form.
    pub table_kernel: bool,
    /// Samples may have values outside the range of the transfer function's table.
    pub beyond: bool,
    pub volume_shaded: bool,
    pub surface_shaded: bool,
    /// Not all light comes from the eye.
    pub lamps: bool,
    pub gradient_opacity: bool,
    /// The largest number of isosurfaces of a field.
    pub isosurfaces: u32,
    /// Convex parts that the clips keep.
    pub clips: u32,
    /// Boxes that the clips cut out.
    pub holes: u32,
    /// Opaque parts may hide the splats behind them.
    pub occlusion: bool,
    /// Minimum number of entries in a pass before it checks what it hides.
    pub least_share: u32,
    /// Gradients from neighbouring pixels.
    pub central: bool,
    /// Pixels per invocation of march, one below the other: 1, 2, 4 or 8.
    pub rows: u32,
    /// The invocations of a tile load and sort its entries together, in the memory of their
    /// workgroup.
    pub staged: bool,
    /// A pixel of a gathered lattice asks what the samples show before it evaluates a sheet.
    pub asks_first: bool,
    /// Entries after which march stops a tile and continues in another dispatch.
    pub most_entries: u32,
}

/// Parts of a sheet in which the transfer function is integrated. docs/engine.md has measurements.
const PARTS: u32 = 3;

/// Maximum number of loop iterations of an entry.
const ENTRY_ITERATIONS: u32 = 6;

impl Variant {
    /// Returns the width and height of a tile in pixels, without the edge that it shares with its
    /// neighbours.
    pub fn tile_step(&self) -> u32 {
        8 - 2 * u32::from(self.central)
    }

    /// Whether a field's gradient is used.
    pub fn gradients(&self) -> bool {
        self.scalar && (self.volume_shaded || self.gradient_opacity)
    }

    /// Returns the number of sheets that one dispatch of gather draws: as many as a driver's limit
    /// on iterations allows.
    pub fn gathered_sheets(&self) -> u32 {
        // Iterations that close a sheet; six more find it and evaluate its planes.
        let pieces = PARTS * (1 + self.isosurfaces) * (1 + self.holes)
            + (1 + self.holes) * self.holes * self.holes;
        let most = self.most_entries.saturating_mul(ENTRY_ITERATIONS);
        if self.can_stop() { (most / (6 + pieces)).max(1) } else { u32::MAX }
    }

    /// Returns the shader of the lights.
    pub fn lamp_shader(&self) -> &'static str {
        if self.lamps { shaders::LAMPS } else { shaders::NO_LAMPS }
    }

    /// Returns the shader of a gathered lattice's labels.
    pub fn label_shader(&self) -> &'static str {
        if self.labels { shaders::LABELS } else { shaders::NO_LABELS }
    }

    /// Returns the bindings of a gathered lattice's textures.
    pub fn textures(&self) -> &'static [Binding] {
        if self.labels { &[Binding::Texture; 2] } else { &[Binding::Texture] }
    }

    /// Returns the words of the shortest record. Records begin at multiples of it.
    pub fn record_unit(&self) -> u32 {
        if self.isotropic { 1 } else { RECORD_WORDS }
    }

    /// Whether splats are scattered.
    pub fn scatters(&self) -> bool {
        !self.gather || self.radiance || self.facets
    }

    /// Whether march may stop a tile among its entries.
    pub fn can_stop(&self) -> bool {
        self.most_entries < u32::MAX
    }

    /// Whether the field in a sheet counts as a parabola, not as a constant.
    fn parabola(&self) -> bool {
        let post = self.classification == Classification::Post;
        self.scalar && (!post || self.isosurfaces > 0)
    }

    /// Returns the constants, as WGSL.
    pub fn constants(&self) -> String {
        let flags = self.flags().map(|(name, value)| format!("const {name}: bool = {value};\n"));
        let counts = self.counts().map(|(name, value)| format!("const {name}: u32 = {value}u;\n"));
        let (flags, counts) = (flags.concat(), counts.concat());
        let apron = i32::from(self.central);
        let step = self.tile_step();
        format!(
            "{flags}{counts}const APRON: i32 = {apron};\nconst TILE_STEP: i32 = {step};\n{}",
            tables::constants()
        )
    }

    /// The constants that are true or false.
    fn flags(&self) -> [(&'static str, bool); 42] {
        let radiance = self.radiance || self.classified;
        [
            ("PERSPECTIVE", self.perspective),
            ("SCALAR", self.scalar),
            ("GATHER", self.gather),
            ("LABELS", self.labels),
            ("SUMS", self.scalar && !self.gather),
            ("CLASSIFIED", self.classified),
            ("LATTICE", self.lattice),
            ("BODY_CENTRED", self.body_centred),
            ("RECTILINEAR", self.rectilinear),
            ("SAMPLES", self.samples),
            ("SLOPES", self.scalar && (self.samples || self.rectilinear)),
            ("TWO_LEVELS", self.two_levels),
            ("WEIGHTS", self.scalar && (self.samples || self.rectilinear || self.two_levels)),
            ("SAMPLE_NORMALS", self.classified && self.surface_shaded),
            ("RADIANCE_PAYLOAD", radiance),
            ("TRAINED", self.trained),
            ("ISOTROPIC_RECORDS", self.isotropic),
            ("GENERAL_RECORDS", radiance || self.facets || self.general),
            ("HAS_FACETS", self.facets),
            ("HAS_IMAGES", self.images),
            ("HAS_RODS", self.rods),
            ("TABLE_KERNEL", self.table_kernel),
            ("BEYOND", self.beyond),
            ("VOLUME_SHADED", self.volume_shaded),
            ("SURFACE_SHADED", self.surface_shaded),
            ("LAMPS", self.lamps),
            ("GRADIENT_OPACITY", self.gradient_opacity),
            ("GRADIENTS", self.gradients()),
            ("CENTRAL", self.central),
            ("OCCLUSION", self.occlusion),
            ("BY_CENTERS", self.by_centers),
            ("WHOLE", self.mode != Mode::Sheets),
            ("AXIS_SHEETS", self.mode == Mode::AxisSheets),
            ("SINGLE_SPLATS", matches!(self.mode, Mode::Splats(_))),
            ("BACK_TO_FRONT", self.mode == Mode::Splats(Order::BackToFront)),
            ("POST", self.classification == Classification::Post),
            ("PARABOLA", self.parabola()),
            ("MAXIMUM", self.optics == Optics::Maximum),
            ("XRAY", self.optics == Optics::XRay),
            ("CAN_STOP", self.can_stop()),
            ("STAGED", self.staged),
            ("ASKS_FIRST", self.asks_first),
        ]
    }

    /// The constants that are whole numbers.
    fn counts(&self) -> [(&'static str, u32); 15] {
        let parts = if self.parabola() { PARTS } else { 1 };
        // The cost of closing a sheet, in entries, against the driver's limit on iterations (see
        // docs/engine.md).
        let field = parts * (1 + self.isosurfaces) * (1 + self.holes);
        let closing = (2 + self.rows * self.fields * field).div_ceil(ENTRY_ITERATIONS);
        let closing = closing + u32::from(self.gather);
        [
            ("FIELDS", self.fields),
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
            ("RECORD_UNIT", self.record_unit()),
            ("ROWS", self.rows),
            ("LANE_ROWS", 8 / self.rows),
        ]
    }
}
