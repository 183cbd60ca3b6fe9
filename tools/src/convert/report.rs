//! What the command prints of conversions.

use super::Convert;
use crate::{failure::Failure, output};
use serde_json::{Value, json};
use splatkit::{
    Error,
    edit::Change,
    hierarchy::external,
    session::convert::{Built, Converted, Expected},
    volume::{Lattice, Scalar},
};
use std::{
    path::Path,
    sync::{MutexGuard, PoisonError},
};

/// Returns the bytes of an output, with the files that a `meta.json` or `lod-meta.json` names.
fn bytes_of(path: &Path) -> Result<u64, Error> {
    let unread = |error| Error::file(path, "read", error);
    let mut all = path.metadata().map_err(unread)?.len();
    if path.extension().is_some_and(|extension| extension == "json") {
        let text = std::fs::read(path).map_err(unread)?;
        let meta: Value = serde_json::from_slice(&text).unwrap_or_default();
        let parts = meta.as_object().into_iter().flat_map(|meta| meta.values());
        let planes = parts.map(|part| &part["files"]).chain([&meta["filenames"]]);
        for name in planes.filter_map(Value::as_array).flatten().filter_map(Value::as_str) {
            all += bytes_of(&path.with_file_name(name))?;
        }
    }
    Ok(all)
}

impl Convert {
    /// Returns what edits have done.
    fn changes(&self) -> MutexGuard<'_, Vec<Change>> {
        self.changes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Prints JSON, with what edits did if there are any.
    fn report(&self, mut value: Value) -> Result<(), Failure> {
        let changes = self.changes();
        if !changes.is_empty() {
            let change = |change: &Change| {
                let Change { edit, before, after } = change;
                json!({ "edit": edit, "before": before, "after": after })
            };
            value["edits"] = changes.iter().map(change).collect();
        }
        output::json(&value)
    }

    /// Prints what was written in this many milliseconds.
    pub(super) fn print(&self, converted: &Converted, total_ms: f64) -> Result<(), Failure> {
        for Change { edit, before, after } in self.changes().iter().filter(|_| !self.json) {
            let removed = before - after;
            output::line(format_args!("{edit:<15} {after} of {before} left, {removed} removed"))?;
        }
        match converted {
            Converted::Points { points, written, attributes } => {
                self.print_points(*points, *written, attributes, total_ms)
            }
            Converted::Hierarchy(built) => self.print_built(built),
            Converted::Regions(done) => self.print_regions(done, total_ms),
            Converted::Gaussians { .. } => self.print_gaussians(converted),
            Converted::Volume { lattice, sample_type, samples_read } => {
                self.print_volume(lattice, sample_type, *samples_read)
            }
            Converted::Bricks { lattice, scalar, slice_by_slice } => {
                self.print_bricks((lattice, *scalar), *slice_by_slice, total_ms)
            }
        }
    }

    fn print_points(
        &self,
        points: u64,
        written: u64,
        attributes: &[String],
        total_ms: f64,
    ) -> Result<(), Failure> {
        let bytes = bytes_of(self.output())?;
        let per_point = bytes as f64 / written.max(1) as f64;
        if self.json {
            return self.report(json!({
                "file": self.output().to_string_lossy(),
                "points_read": points,
                "points": written,
                "attributes": attributes,
                "bytes": bytes,
                "bytes_per_point": per_point,
                "total_ms": total_ms,
            }));
        }
        output::line(format_args!("points          {written} of {points}"))?;
        if !attributes.is_empty() {
            output::line(format_args!("attributes      {}", attributes.join(", ")))?;
        }
        output::line(format_args!("bytes           {bytes} ({per_point:.2} a point)"))?;
        output::line(format_args!("time            {:.2} s", total_ms / 1e3))
    }

    fn print_built(&self, built: &Built) -> Result<(), Failure> {
        let &Built { points, splats, closed, read_ms, splats_ms, build_ms } = built;
        let bytes = bytes_of(self.output())?;
        let per_point = bytes as f64 / points as f64;
        if self.json {
            return self.report(json!({
                "file": self.output().to_string_lossy(),
                "points": points,
                "splats": splats,
                "closed": closed,
                "bytes": bytes,
                "bytes_per_point": per_point,
                "read_ms": read_ms,
                "splats_ms": splats_ms,
                "build_ms": build_ms,
            }));
        }
        output::line(format_args!("points          {points}"))?;
        output::line(format_args!("splats          {splats}"))?;
        output::line(format_args!("bytes           {bytes} ({per_point:.2} a point)"))?;
        let [read, made, build] = [read_ms, splats_ms, build_ms].map(|ms| ms / 1e3);
        output::line(format_args!(
            "time            {read:.2} s reading, {made:.2} s splats, {build:.2} s tree and file"
        ))
    }

    pub(super) fn print_regions(
        &self,
        done: &external::Converted,
        total_ms: f64,
    ) -> Result<(), Failure> {
        let bytes = bytes_of(self.output())?;
        let per_point = bytes as f64 / done.points as f64;
        if self.json {
            return self.report(json!({
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

    fn print_gaussians(&self, converted: &Converted) -> Result<(), Failure> {
        let &Converted::Gaussians { points, splats, degree, read_ms, write_ms } = converted else {
            return Ok(());
        };
        let bytes = bytes_of(self.output())?;
        let per_splat = bytes as f64 / splats.max(1) as f64;
        if self.json {
            return self.report(json!({
                "file": self.output().to_string_lossy(),
                "points": points,
                "splats": splats,
                "degree": degree,
                "bytes": bytes,
                "bytes_per_splat": per_splat,
                "read_ms": read_ms,
                "write_ms": write_ms,
            }));
        }
        output::line(format_args!("points          {points}"))?;
        output::line(format_args!("splats          {splats}"))?;
        output::line(format_args!("degree          {degree}"))?;
        output::line(format_args!("bytes           {bytes} ({per_splat:.2} a splat)"))?;
        let [read, write] = [read_ms, write_ms].map(|ms| ms / 1e3);
        output::line(format_args!("time            {read:.2} s reading, {write:.2} s writing"))
    }

    fn print_volume(
        &self,
        lattice: &Lattice,
        sample_type: &str,
        samples_read: usize,
    ) -> Result<(), Failure> {
        let (name, count) = (lattice.arrangement.name(), lattice.len());
        let [nx, ny, nz] = lattice.dims;
        if self.json {
            return self.report(json!({
                "file": self.output().to_string_lossy(),
                "lattice": name,
                "dims": lattice.dims,
                "type": sample_type,
                "samples_read": samples_read,
                "samples_written": count,
            }));
        }
        output::line(format_args!("samples read      {samples_read}"))?;
        output::line(format_args!("samples written   {count} ({nx} × {ny} × {nz}, {name})"))
    }

    fn print_bricks(
        &self,
        volume: (&Lattice, Scalar),
        slice_by_slice: bool,
        total_ms: f64,
    ) -> Result<(), Failure> {
        let (lattice, scalar) = volume;
        let bytes = bytes_of(self.output())?;
        let per_sample = bytes as f64 / lattice.len() as f64;
        if self.json {
            return self.report(json!({
                "file": self.output().to_string_lossy(),
                "dims": lattice.dims,
                "type": scalar.name(),
                "slice_by_slice": slice_by_slice,
                "bytes": bytes,
                "bytes_per_point": per_sample,
                "total_ms": total_ms,
            }));
        }
        print_samples(volume)?;
        output::line(format_args!("bytes           {bytes} ({per_sample:.3} a sample)"))?;
        output::line(format_args!("time            {:.2} s", total_ms / 1e3))
    }

    /// Prints what a conversion would take.
    pub(super) fn print_expected(&self, expected: &Expected) -> Result<(), Failure> {
        match expected {
            Expected::Hierarchy { built, bytes, memory } => {
                self.print_expected_tree(built, *bytes, *memory)
            }
            &Expected::Regions { as_a_whole, memory } => {
                if self.json {
                    return self.report(json!({
                        "expected_memory": as_a_whole,
                        "memory": memory,
                        "in_regions": true,
                    }));
                }
                output::line(format_args!(
                    "memory          about {} MiB as a whole; region by region in {} MiB",
                    as_a_whole >> 20,
                    memory >> 20
                ))
            }
            &Expected::Gaussians { points, splats, bytes, is_most, read_ms } => {
                if self.json {
                    return self.report(json!({
                        "points": points,
                        "splats": splats,
                        "expected_bytes": bytes,
                        "read_ms": read_ms,
                    }));
                }
                let how = if is_most { "at most" } else { "about" };
                output::line(format_args!("points          {points}"))?;
                output::line(format_args!("splats          {splats}"))?;
                output::line(format_args!("bytes           {how} {bytes}"))
            }
            Expected::Bricks { .. } => self.print_expected_bricks(expected),
        }
    }

    fn print_expected_tree(&self, built: &Built, bytes: u64, memory: u64) -> Result<(), Failure> {
        let &Built { points, splats, read_ms, splats_ms, build_ms, .. } = built;
        if self.json {
            return self.report(json!({
                "points": points,
                "splats": splats,
                "expected_bytes": bytes,
                "expected_memory": memory,
                "expected_build_ms": build_ms,
                "read_ms": read_ms,
                "splats_ms": splats_ms,
            }));
        }
        output::line(format_args!("points          {points}"))?;
        output::line(format_args!("splats          {splats}"))?;
        output::line(format_args!("bytes           about {bytes}"))?;
        output::line(format_args!("memory          about {} MiB", memory >> 20))?;
        let [read, made, build] = [read_ms, splats_ms, build_ms].map(|ms| ms / 1e3);
        output::line(format_args!(
            "time            {read:.2} s reading, {made:.2} s splats, about {build:.1} s tree and \
             file"
        ))
    }

    fn print_expected_bricks(&self, expected: &Expected) -> Result<(), Failure> {
        let Expected::Bricks { lattice, scalar, slice_by_slice, unpacked, memory } = expected
        else {
            return Ok(());
        };
        if self.json {
            return self.report(json!({
                "dims": lattice.dims,
                "type": scalar.name(),
                "unpacked_bytes": unpacked,
                "expected_memory": memory,
                "slice_by_slice": slice_by_slice,
            }));
        }
        let how = if *slice_by_slice { "slice by slice" } else { "as a whole" };
        print_samples((lattice, *scalar))?;
        output::line(format_args!(
            "bytes           {unpacked} with all levels, before compression"
        ))?;
        output::line(format_args!("memory          about {} MiB, {how}", memory >> 20))
    }
}

fn print_samples((lattice, scalar): (&Lattice, Scalar)) -> Result<(), Failure> {
    let [nx, ny, nz] = lattice.dims;
    output::line(format_args!(
        "samples         {} ({nx} × {ny} × {nz}, {})",
        lattice.len(),
        scalar.name()
    ))
}
