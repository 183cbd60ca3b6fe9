//! The shader files, and the constants that a picture's variant puts before them.

pub const FRAME: &str = include_str!("../../shaders/frame.wgsl");
pub const NORMAL: &str = include_str!("../../shaders/normal.wgsl");
pub const SAMPLE: &str = include_str!("../../shaders/sample.wgsl");
pub const FOOTPRINT: &str = include_str!("../../shaders/footprint.wgsl");
pub const SOURCE_SPLATS: &str = include_str!("../../shaders/source_splats.wgsl");
pub const SOURCE_LATTICE: &str = include_str!("../../shaders/source_lattice.wgsl");
pub const SPANS: &str = include_str!("../../shaders/spans.wgsl");
pub const CENSUS: &str = include_str!("../../shaders/census.wgsl");
pub const BINS: &str = include_str!("../../shaders/bins.wgsl");
pub const SELECT: &str = include_str!("../../shaders/select.wgsl");
pub const MEASURE: &str = include_str!("../../shaders/measure.wgsl");
pub const SURVEY: &str = include_str!("../../shaders/survey.wgsl");
pub const PLAN: &str = include_str!("../../shaders/plan.wgsl");
pub const PROJECT: &str = include_str!("../../shaders/project.wgsl");
pub const SCAN: &str = include_str!("../../shaders/scan.wgsl");
pub const SCATTER: &str = include_str!("../../shaders/scatter.wgsl");
pub const LARGE: &str = include_str!("../../shaders/large.wgsl");
pub const ORDER: &str = include_str!("../../shaders/order.wgsl");
pub const MARCH: &str = include_str!("../../shaders/march.wgsl");

/// What a picture needs of the shaders. Each combination is compiled when it first occurs; what it does not need (the
/// sums of a payload that the scene lacks, say) the compiler then leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Variant {
    pub perspective: bool,
    /// The scene holds scalars; they come from a lattice.
    pub scalar: bool,
    pub lattice: bool,
    pub radiance: bool,
    /// Lattice samples are drawn with sections that do not depend on the pixel.
    pub isotropic: bool,
    pub volume_shaded: bool,
    pub surface_shaded: bool,
    /// Gradients from neighbouring pixels.
    pub central: bool,
    /// Pixels per invocation of march, one below the other: 1, 2, 4 or 8.
    pub rows: u32,
    /// Entries after which march stops a tile, to go on in another dispatch.
    pub most_entries: u32,
}

impl Variant {
    /// Pixels that a tile is wide and high, without the edge that it shares with its neighbours.
    pub fn tile_step(&self) -> u32 {
        8 - 2 * u32::from(self.central)
    }

    /// Whether a sheet is shaded only when the one behind it is known.
    pub fn waits(&self) -> bool {
        self.scalar && self.volume_shaded
    }

    /// The constants, as WGSL.
    pub fn constants(&self) -> String {
        let Self {
            perspective,
            scalar,
            lattice,
            radiance,
            isotropic,
            volume_shaded,
            surface_shaded,
            central,
            rows,
            most_entries,
        } = *self;
        let general = radiance || !isotropic;
        let waiting = u32::from(self.waits());
        format!(
            "const PERSPECTIVE: bool = {perspective};\nconst SCALAR: bool = {scalar};\n\
             const LATTICE: bool = {lattice};\nconst RADIANCE_PAYLOAD: bool = {radiance};\n\
             const ISOTROPIC_RECORDS: bool = {isotropic};\nconst GENERAL_RECORDS: bool = {general};\n\
             const VOLUME_SHADED: bool = {volume_shaded};\nconst SURFACE_SHADED: bool = {surface_shaded};\n\
             const CENTRAL: bool = {central};\nconst APRON: i32 = {apron};\nconst TILE_STEP: i32 = {step};\n\
             const WAITING: u32 = {waiting}u;\nconst MARGIN: u32 = {waiting}u;\n\
             const MAX_PASSES: u32 = {passes}u;\n\
             const MOST_ENTRIES: u32 = {most_entries}u;\nconst LONGEST_RUN: u32 = {longest_run}u;\n\
             const ROWS: u32 = {rows}u;\nconst LANE_ROWS: u32 = {lanes}u;\n",
            apron = i32::from(central),
            step = self.tile_step(),
            lanes = 8 / rows,
            longest_run = most_entries.saturating_mul(4),
            passes = super::plan::MAX_PASSES,
        )
    }
}
