//! Conversion of files larger than memory, region by region.

use super::{Convert, memory::Need, surface::Frame};
use crate::{failure::Failure, output, progress::Progress, timing::milliseconds};
use serde_json::json;
use splatkit::{
    Deadline, Error,
    formats::Stream,
    hierarchy::{
        BuildOptions,
        external::{BLOCKS, Converted, ExternalOptions, Plan, Stage, check, convert},
    },
    surface::{Paint, SurfelOptions},
};
use std::time::Instant;

/// Returns what a progress bar calls a stage.
pub fn name_of(stage: Stage) -> &'static str {
    match stage {
        Stage::Reading => "Scanning the input",
        Stage::Distributing => "Distributing to regions",
        Stage::Building => "Building the hierarchy",
        Stage::Writing => "Writing the file",
    }
}

impl Convert {
    /// Converts inputs that need more than the `most` bytes of memory that may be used.
    pub(super) fn in_regions(
        &self,
        need: Need,
        most: u64,
        progress: &Progress,
    ) -> Result<(), Failure> {
        let [wanted, most_mib] = [need.bytes, most].map(|bytes| bytes >> 20);
        if let Some(file) = need.whole? {
            let file = file.display();
            return Err(Failure::Usage(if self.parts.divide() {
                format!(
                    "{file}: only binary PLY of points or triangles, LAS and LAZ are converted in \
                     parts"
                )
            } else {
                format!(
                    "converting this takes about {wanted} MiB, but only {most_mib} MiB may be \
                     used; only binary PLY of points or triangles, LAS and LAZ become hierarchies \
                     in less, not {file}; --memory allows more"
                )
            }));
        }
        let start = Instant::now();
        let limits = self.load.limits();
        let first =
            self.files.first().map(|file| Stream::open(file, &limits)).transpose()?.flatten();
        let frame = match &first {
            Some(first) => Frame::of(first.stance(), || first.guess_stance())?,
            None => Frame::default(),
        };
        let options = ExternalOptions {
            memory: most,
            preset: self.surface.preset(),
            block_splats: BuildOptions::default().block_splats,
            // Each region has its own deadline.
            surfels: SurfelOptions {
                color_by_normal: self.color.coloring(None).by_normal(),
                ..self.surface.surfel_options(Deadline::NEVER)
            },
            paint: self.paint_in_regions(&frame)?,
            scalar: self.attribute().map(str::to_owned),
            parts: self.parts.parts,
        };
        let stages = progress.stages();
        let watch = |stage, done, total| stages.set(name_of(stage), done, total);
        if self.dry_run {
            check(&self.files, &limits, &options, Some(&watch))?;
            drop(stages);
            progress.clear();
            return self.print_need(need.bytes, most);
        }
        let write = self.surface.write_options(&self.files, &frame);
        if let Some(folder) = &self.parts.plan {
            self.check_plan(folder)?;
            let plan = Plan::make(&self.files, folder, &limits, &options, &write, Some(&watch))?;
            drop(stages);
            progress.clear();
            return self.print_plan(&plan);
        }
        let done = convert(&self.files, &limits, self.output(), &options, &write, Some(&watch))?;
        drop(stages);
        progress.clear();
        self.print_converted(&done, milliseconds(start))
    }

    /// Returns what colours the points, which the first file decides.
    fn paint_in_regions(&self, frame: &Frame) -> Result<Option<Paint>, Failure> {
        let limits = self.load.limits();
        let first =
            self.files.first().map(|file| Stream::open(file, &limits)).transpose()?.flatten();
        let is_cloud = first.is_some_and(|file| file.counts().triangles == 0);
        let up = self.surface.up_of(frame);
        let named = self.attribute().is_some();
        let coloring = self.color.coloring(self.range);
        let paint = coloring.surface_paint(up, [named, false, is_cloud]);
        let name = self.attribute().unwrap_or_default();
        let paint = paint.map(|paint| coloring.with_classes(paint, name));
        let has_values = matches!(paint, Some(Paint::Values { .. }));
        self.color.check_effect(true, has_values)?;
        Ok(paint)
    }

    /// Prints the memory that converting region by region takes.
    fn print_need(&self, as_a_whole: u64, most: u64) -> Result<(), Failure> {
        // The blocks being built take this much in any case.
        let taken = most.max(BLOCKS);
        if self.json {
            return output::line(
                json!({"expected_memory": as_a_whole, "memory": taken, "in_regions": true}),
            );
        }
        output::line(format_args!(
            "memory          about {} MiB as a whole; region by region in {} MiB",
            as_a_whole >> 20,
            taken >> 20
        ))
    }

    /// Prints the counts and the size of the file.
    pub(super) fn print_converted(&self, done: &Converted, total_ms: f64) -> Result<(), Failure> {
        let bytes =
            self.output().metadata().map_err(|e| Error::file(self.output(), "read", e))?.len();
        let per_point = bytes as f64 / done.points as f64;
        if self.json {
            return output::line(json!({
                "file": self.output().to_string_lossy(),
                "points": done.points,
                "splats": done.splats,
                "closed": done.closed,
                "regions": done.regions,
                "bytes": bytes,
                "bytes_per_point": per_point,
                "total_ms": total_ms,
            }));
        }
        output::line(format_args!("points          {}", done.points))?;
        output::line(format_args!("splats          {} in {} regions", done.splats, done.regions))?;
        output::line(format_args!("bytes           {bytes} ({per_point:.2} a point)"))?;
        output::line(format_args!("time            {:.2} s", total_ms / 1e3))
    }
}
