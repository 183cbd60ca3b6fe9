//! The shader files. `passes/` contains one file per pass, `sources/` one per source of candidates,
//! and `shared/` the declarations that they are joined with.

pub const SELECT: &str = include_str!("../../../shaders/passes/select.wgsl");
pub const SELECT_BRICKS: &str = include_str!("../../../shaders/passes/select_bricks.wgsl");
pub const CUT: &str = include_str!("../../../shaders/passes/cut.wgsl");
pub const TALLY: &str = include_str!("../../../shaders/passes/tally.wgsl");
pub const MEASURE: &str = include_str!("../../../shaders/passes/measure.wgsl");
pub const SURVEY: &str = include_str!("../../../shaders/passes/survey.wgsl");
pub const PLAN: &str = include_str!("../../../shaders/passes/plan.wgsl");
pub const PROJECT: &str = include_str!("../../../shaders/passes/project.wgsl");
pub const SCAN: &str = include_str!("../../../shaders/passes/scan.wgsl");
pub const BIN: &str = include_str!("../../../shaders/passes/bin.wgsl");
pub const CLEAR: &str = include_str!("../../../shaders/passes/clear.wgsl");
pub const CULL: &str = include_str!("../../../shaders/passes/cull.wgsl");
pub const OCCLUSION: &str = include_str!("../../../shaders/passes/occlusion.wgsl");
pub const MARK: &str = include_str!("../../../shaders/passes/mark.wgsl");
pub const RECOLOR: &str = include_str!("../../../shaders/passes/recolor.wgsl");
pub const RESUME: &str = include_str!("../../../shaders/passes/resume.wgsl");
pub const TILES: &str = include_str!("../../../shaders/passes/tiles.wgsl");
pub const LARGE: &str = include_str!("../../../shaders/passes/large.wgsl");
pub const ORDER: &str = include_str!("../../../shaders/passes/order.wgsl");
pub const GATHER: &str = include_str!("../../../shaders/passes/gather.wgsl");
pub const MARCH: &str = include_str!("../../../shaders/passes/march.wgsl");
pub const PRESENT: &str = include_str!("../../../shaders/passes/present.wgsl");

pub const SOURCE_NODES: &str = include_str!("../../../shaders/sources/nodes.wgsl");
pub const SOURCE_SPLATS: &str = include_str!("../../../shaders/sources/splats.wgsl");
pub const SOURCE_LATTICE: &str = include_str!("../../../shaders/sources/lattice.wgsl");
pub const SOURCE_BRICKS: &str = include_str!("../../../shaders/sources/bricks.wgsl");
pub const SOURCE_FACETS: &str = include_str!("../../../shaders/sources/facets.wgsl");
pub const SOURCE_NO_FACETS: &str = include_str!("../../../shaders/sources/no_facets.wgsl");

pub const FRAME: &str = include_str!("../../../shaders/shared/frame.wgsl");
pub const NORMAL: &str = include_str!("../../../shaders/shared/normal.wgsl");
pub const VALUE: &str = include_str!("../../../shaders/shared/value.wgsl");
pub const SAMPLE: &str = include_str!("../../../shaders/shared/sample.wgsl");
pub const FOOTPRINT: &str = include_str!("../../../shaders/shared/footprint.wgsl");
pub const KEY: &str = include_str!("../../../shaders/shared/key.wgsl");
pub const SPLAT: &str = include_str!("../../../shaders/shared/splat.wgsl");
pub const SPLATS: &str = include_str!("../../../shaders/shared/splats.wgsl");
pub const SPANS: &str = include_str!("../../../shaders/shared/spans.wgsl");
pub const CENSUS: &str = include_str!("../../../shaders/shared/census.wgsl");
pub const BINS: &str = include_str!("../../../shaders/shared/bins.wgsl");
pub const NODES: &str = include_str!("../../../shaders/shared/nodes.wgsl");
pub const ACTIVE: &str = include_str!("../../../shaders/shared/active.wgsl");
pub const MAP: &str = include_str!("../../../shaders/shared/map.wgsl");
pub const PROGRESS: &str = include_str!("../../../shaders/shared/progress.wgsl");
pub const SAVED: &str = include_str!("../../../shaders/shared/saved.wgsl");
pub const STAGED: &str = include_str!("../../../shaders/shared/staged.wgsl");
pub const NO_STAGED: &str = include_str!("../../../shaders/shared/no_staged.wgsl");
pub const SLOPES: &str = include_str!("../../../shaders/shared/slopes.wgsl");
pub const NO_SLOPES: &str = include_str!("../../../shaders/shared/no_slopes.wgsl");
pub const STATE: &str = include_str!("../../../shaders/shared/state.wgsl");
pub const TABLES: &str = include_str!("../../../shaders/shared/tables.wgsl");
pub const PIXEL: &str = include_str!("../../../shaders/shared/pixel.wgsl");
pub const KERNELS: &str = include_str!("../../../shaders/shared/kernels.wgsl");
pub const FACETS: &str = include_str!("../../../shaders/shared/facets.wgsl");
pub const NO_FACETS: &str = include_str!("../../../shaders/shared/no_facets.wgsl");
pub const RODS: &str = include_str!("../../../shaders/shared/rods.wgsl");
pub const NO_RODS: &str = include_str!("../../../shaders/shared/no_rods.wgsl");
pub const IMAGES: &str = include_str!("../../../shaders/shared/images.wgsl");
pub const NO_IMAGES: &str = include_str!("../../../shaders/shared/no_images.wgsl");
pub const LAMPS: &str = include_str!("../../../shaders/shared/lamps.wgsl");
pub const NO_LAMPS: &str = include_str!("../../../shaders/shared/no_lamps.wgsl");
pub const SHEET: &str = include_str!("../../../shaders/shared/sheet.wgsl");
pub const FIELD_SUMS: &str = include_str!("../../../shaders/shared/field_sums.wgsl");
pub const LABELS: &str = include_str!("../../../shaders/shared/labels.wgsl");
pub const NO_LABELS: &str = include_str!("../../../shaders/shared/no_labels.wgsl");
pub const FIELD_LATTICE: &str = include_str!("../../../shaders/shared/field_lattice.wgsl");
pub const MARCH_LATTICE: &str = include_str!("../../../shaders/shared/march_lattice.wgsl");
pub const PICTURE: &str = include_str!("../../../shaders/shared/picture.wgsl");

#[cfg(test)]
mod tests {
    use std::{fs, path::Path};

    /// Returns the lines that declare variables inside the blocks of a function without values.
    fn without_values(text: &str) -> Vec<&str> {
        let mut depth = 0usize;
        let mut found = Vec::new();
        for line in text.lines() {
            let code = line.split("//").next().unwrap_or("").trim();
            if depth > 1 && code.starts_with("var ") && code.ends_with(';') && !code.contains('=') {
                found.push(code);
            }
            depth += code.matches('{').count();
            depth = depth.saturating_sub(code.matches('}').count());
        }
        found
    }

    /// In Chromium 148, a variable without a value keeps the one of the last turn of its loop.
    #[test]
    fn variables_in_loops_have_values() {
        let function =
            "fn f() {\n    var a: f32;\n    loop {\n        var b: vec3<f32>; // c\n    }\n}";
        assert_eq!(without_values(function), ["var b: vec3<f32>;"]);
        let shaders = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let mut files = 0;
        for folder in ["passes", "sources", "shared"] {
            for entry in fs::read_dir(shaders.join(folder)).expect("a folder") {
                let path = entry.expect("a file").path();
                let text = fs::read_to_string(&path).expect("a shader");
                assert_eq!(without_values(&text), [""; 0], "{}", path.display());
                files += 1;
            }
        }
        assert!(files > 60, "{files}");
    }
}
