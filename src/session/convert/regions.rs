//! Scans larger than memory, converted region by region or in parts.

use super::{Converted, Expected, Watch, Work, memory::Need, splats::Frame, wrong};
use crate::{
    Deadline, Result,
    formats::Stream,
    hierarchy::{
        BuildOptions,
        external::{BLOCKS, ExternalOptions, Stage, check, convert},
        file::WriteOptions,
    },
    surface::Paint,
};

impl<W: Watch> Work<'_, W> {
    /// Converts inputs that need more memory than may be used.
    pub fn in_regions(&self, need: Need) -> Result<Converted, W::Error> {
        let source = self.conversion.write_options(self.files, &Frame::default()).source;
        self.in_regions_named(need, source)
    }

    /// As [`in_regions`](Self::in_regions). The hierarchy names these as its source.
    pub fn in_regions_named(&self, need: Need, source: String) -> Result<Converted, W::Error> {
        let (options, write) = self.region_options(need, self.conversion.in_regions)?;
        let write = WriteOptions { source, ..write };
        let watch = |stage, done, all| self.region_stage(stage, done, all);
        let limits = self.conversion.reading.limits();
        let done = convert(self.files, limits, self.output, &options, &write, Some(&watch))?;
        Ok(Converted::Regions(done))
    }

    /// Finds the memory that converting region by region takes.
    pub fn expect_regions(&self, need: Need) -> Result<Expected, W::Error> {
        let as_a_whole = need.bytes;
        let (options, _) = self.region_options(need, self.conversion.in_regions)?;
        let watch = |stage, done, all| self.region_stage(stage, done, all);
        check(self.files, self.conversion.reading.limits(), &options, Some(&watch))?;
        // The blocks being built take this much in any case.
        Ok(Expected::Regions { as_a_whole, memory: self.conversion.most_memory().max(BLOCKS) })
    }

    pub fn region_stage(&self, stage: Stage, done: u64, all: u64) {
        self.watch.progress(stage.name(), done, all);
    }

    /// Returns how regions are converted and written, if all inputs can be read in pieces.
    /// `is_asked` says whether the caller wants regions, however much memory there is.
    pub fn region_options(
        &self,
        need: Need,
        is_asked: bool,
    ) -> Result<(ExternalOptions, WriteOptions), W::Error> {
        let most = self.conversion.most_memory();
        if let Some(file) = need.whole? {
            let file = file.display();
            let [wanted, most] = [need.bytes, most].map(|bytes| bytes >> 20);
            return Err(wrong(if is_asked {
                format!(
                    "{file}: only binary PLY of points or triangles, LAS and LAZ are converted in \
                     parts"
                )
            } else {
                format!(
                    "converting this takes about {wanted} MiB, but only {most} MiB may be used; \
                     only binary PLY of points or triangles, LAS and LAZ become hierarchies in \
                     less, not {file}; --memory allows more"
                )
            })
            .into());
        }
        let limits = self.conversion.reading.limits();
        let first = self.files.first().map(|file| Stream::open(file, limits));
        let first = first.transpose()?.flatten();
        let frame = match &first {
            Some(first) => Frame::of(first.orientation(), || first.guess_orientation())?,
            None => Frame::default(),
        };
        let is_cloud = first.is_some_and(|file| file.counts().triangles == 0);
        let options = ExternalOptions {
            memory: most,
            preset: self.conversion.preset,
            block_splats: BuildOptions::default().block_splats,
            // Each region has its own deadline.
            surfels: self.conversion.surfel_options(Deadline::NEVER),
            paint: self.paint_in_regions(&frame, is_cloud)?,
            scalar: self.conversion.attribute().map(str::to_owned),
            parts: self.conversion.parts,
        };
        Ok((options, self.conversion.write_options(self.files, &frame)))
    }

    /// Returns what colours the points, which the first file decides.
    fn paint_in_regions(&self, frame: &Frame, is_cloud: bool) -> Result<Option<Paint>, W::Error> {
        let (coloring, attribute) = (&self.conversion.coloring, self.conversion.attribute());
        let up = frame.up(self.conversion.up);
        let paint = coloring.surface_paint(up, [attribute.is_some(), false, is_cloud]);
        let paint = paint.map(|paint| coloring.with_classes(paint, attribute.unwrap_or_default()));
        let has_values = matches!(paint, Some(Paint::Values { .. }));
        self.watch.has_colored(true, has_values)?;
        Ok(paint)
    }
}
