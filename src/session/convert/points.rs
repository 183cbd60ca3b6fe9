//! Points with their attributes, and edits on the way of a conversion.
//!
//! Files of points that are read in pieces are edited together, in that way. Other inputs are read
//! whole, and edited one by one or as one cloud (`merged`).

use super::{
    Converted, Watch, Work, memory, milliseconds,
    splats::{Frame, Gathered, in_file},
    wrong,
};
use crate::{
    Error, Result,
    about::About,
    edit::{self, Context, Crs, Edit, Editable, Pass, Surface},
    formats::{
        Attribute, Kind, NumberType, PointLayout, PointWriter, Records, Stream, write_points,
    },
    hierarchy::external::memory_of_mesh,
    math::keep,
    progress,
    surface::Mesh,
};
use glam::{DVec3, Vec3};
use std::path::{Path, PathBuf};
use web_time::Instant;

/// What a progress bar calls the stage.
const READING: &str = "Reading and editing points";

impl<W: Watch> Work<'_, W> {
    /// Writes the points of all inputs with their attributes.
    pub fn points(&self) -> Result<Converted, W::Error> {
        let limits = self.conversion.reading.limits();
        let watch = |done, all| self.watch.progress(READING, done, all);
        let Some(pass) = self.pass(limits, None, Some(&watch))? else {
            return self.points_of_surfaces();
        };
        let [has_normals, has_colors] = pass.has();
        let attributes = pass.attributes()?;
        let layout = PointLayout {
            has_normals,
            has_colors,
            bounds: pass.bounds(),
            grid: pass.grid(),
            is_wide: pass.is_wide(),
            crs: pass.first().map(Path::to_owned).filter(|_| pass.crs().is_none()),
            code: pass.crs().and_then(code_of),
            attributes: attributes.clone(),
        };
        let mut writer = write_points(self.output, layout)?;
        let changes = pass.run(|records| writer.put(&records))?;
        self.watch.has_edited(&changes);
        let attributes = names_of(&attributes, &*writer);
        let (points, written) = (pass.points(), writer.finish()?);
        Ok(Converted::Points { points, written, attributes })
    }

    /// Writes the points of inputs that are read whole.
    fn points_of_surfaces(&self) -> Result<Converted, W::Error> {
        let (mut points, mut parts) = (0, Vec::new());
        if self.comparing().is_some() {
            let merged = self.merged(None, false)?;
            points = merged.points;
            parts.push(merged.records);
        } else {
            for path in self.files {
                let mesh = self.mesh_of(path)?;
                points += mesh.positions.len() as u64;
                let names = mesh.about.attributes.clone();
                let mut surface = self.surface(path, mesh, &names)?;
                self.edit_surface(&mut surface, path)?;
                parts.push(surface.into_records());
            }
        }
        let mut layout = layout_of(&parts);
        let crs = self.conversion.edits.iter().rev().find_map(|edit| match edit {
            Edit::Reproject(reprojection) => Some(&reprojection.to),
            _ => None,
        });
        layout.code = crs.and_then(code_of);
        if crs.is_some_and(Crs::is_geographic) {
            layout.grid = Some(edit::grid_of_degrees(layout.bounds));
        }
        let attributes = layout.attributes.clone();
        let mut writer = write_points(self.output, layout)?;
        let attributes = names_of(&attributes, &*writer);
        parts.iter().try_for_each(|part| writer.put(part))?;
        Ok(Converted::Points { points, written: writer.finish()?, attributes })
    }

    /// Opens all inputs as points that are read in pieces; `None` if one cannot be read so. All
    /// attributes are read, or those that the edits need and those of these names.
    fn pass<'a>(
        &'a self,
        limits: &'a crate::input::Limits,
        names: Option<&[String]>,
        watch: progress::Watch<'a>,
    ) -> Result<Option<Pass<'a>>, W::Error> {
        let reading = self.conversion.reading(crate::memory::most());
        let mut streams = Vec::new();
        for path in self.files {
            if !matches!(reading.kind(path)?, Kind::Mesh | Kind::Samples) {
                return Ok(None);
            }
            match Stream::open(path, limits)? {
                Some(stream) if stream.counts().triangles == 0 => streams.push(stream),
                _ => return Ok(None),
            }
        }
        let Some(first) = streams.first() else { return Ok(None) };
        let frame = Frame::of(first.orientation(), || first.guess_orientation())?;
        let context = self.context(&self.files[0], frame.up(self.conversion.up), first.crs());
        self.watch.has_read(self.files)?;
        Ok(Some(Pass::new(streams, &self.conversion.edits, context, names, watch)?))
    }

    pub fn context(&self, file: &Path, up: DVec3, crs: String) -> Context {
        Context { file: file.to_owned(), up, memory: self.conversion.most_memory(), crs }
    }

    /// Returns the splats of points that are edited together: while they are read, or else read
    /// whole if an edit compares them. `None` if there are no edits, or for inputs that are edited
    /// one by one.
    pub fn edited_points(&self) -> Result<Option<Gathered>, W::Error> {
        if self.conversion.edits.is_empty() {
            return Ok(None);
        }
        let start = Instant::now();
        let limits = self.conversion.reading.limits();
        let watch = |done, all| self.watch.progress(READING, done, all);
        let named: Vec<String> =
            self.conversion.attribute().map(str::to_owned).into_iter().collect();
        let mut mesh = Mesh::default();
        match self.pass(limits, Some(&named), Some(&watch))? {
            Some(pass) => {
                mesh.origin = pass.middle();
                mesh.about = About { orientation: pass.orientation(), ..About::default() };
                let changes = pass.run(|records| self.append(&mut mesh, records, named.first()))?;
                self.watch.has_edited(&changes);
            }
            None if self.comparing().is_some() && !self.are_gaussians()? => {
                let merged = self.merged(Some(&named), true)?;
                mesh.origin = merged.records.positions.first().copied().unwrap_or_default().round();
                mesh.about = About { orientation: merged.orientation, ..About::default() };
                self.append(&mut mesh, merged.records, named.first())?;
            }
            None => return Ok(None),
        }
        let path = &self.files[0];
        let (read_ms, start) = (milliseconds(start), Instant::now());
        let (mesh, frame) = self.painted(path, mesh)?;
        let options = self.conversion.surfel_options(limits.deadline());
        let most = self.conversion.most_memory();
        memory::check(path, memory_of_mesh(&mesh, &options, most)?, 0, most)?;
        let set = mesh.surfels(&options).map_err(|error| in_file(path, error))?;
        let (points, splats_ms) = (mesh.positions.len() as u64, milliseconds(start));
        Ok(Some(Gathered { set, closed: false, frame, points, read_ms, splats_ms }))
    }

    /// Adds points to a cloud, with the values of an attribute if one is named.
    fn append(&self, mesh: &mut Mesh, records: Records, named: Option<&String>) -> Result<()> {
        if let Some(name) = named {
            let column = records.column(name).ok_or_else(|| {
                let message = format!("has no attribute “{name}”");
                Error::input(&self.files[0], "points", message)
                    .hint("`splatkit info` lists the attributes")
            })?;
            mesh.values.extend(column.into_iter().map(|value| value as f32));
            mesh.about.name.clone_from(name);
        }
        let place = |place: &DVec3| (*place - mesh.origin).as_vec3();
        mesh.positions.extend(records.positions.iter().map(place));
        // Files of which some have no normals or colours are merged.
        let count = mesh.positions.len();
        if !records.normals.is_empty() || !mesh.normals.is_empty() {
            mesh.normals.resize(count - records.positions.len(), Vec3::ZERO);
            mesh.normals.extend(records.normals);
            mesh.normals.resize(count, Vec3::ZERO);
        }
        if !records.colors.is_empty() || !mesh.colors.is_empty() {
            mesh.colors.resize(count - records.positions.len(), [255; 4]);
            mesh.colors.extend(records.colors);
            mesh.colors.resize(count, [255; 4]);
        }
        Ok(())
    }

    /// Converts points that do not fit in memory: the edited ones are written beside the output for
    /// a while, and converted from there.
    #[cfg(feature = "ply")]
    pub fn edited_in_regions(&self) -> Result<Converted, W::Error> {
        let limits = self.conversion.reading.limits();
        let watch = |done, all| self.watch.progress(READING, done, all);
        let named: Vec<String> =
            self.conversion.attribute().map(str::to_owned).into_iter().collect();
        let Some(pass) = self.pass(limits, Some(&named), Some(&watch))? else {
            let need = self.need().bytes >> 20;
            return Err(wrong(format!(
                "editing this takes about {need} MiB, but only {} MiB may be used; only points in \
                 binary PLY, LAS and LAZ are edited in less; --memory allows more",
                self.conversion.most_memory() >> 20
            ))
            .into());
        };
        let [has_normals, has_colors] = pass.has();
        let layout = PointLayout {
            attributes: pass.attributes()?,
            has_normals,
            // Greys are kept too: the result has no other attribute to make them from.
            has_colors: has_colors || pass.has_greys(),
            bounds: pass.bounds(),
            grid: None,
            is_wide: false,
            crs: None,
            code: None,
        };
        let mut scratch = crate::formats::ply::PointFile::scratch(self.output, layout)?;
        let changes =
            pass.run(|records| crate::formats::PointWriter::put(&mut scratch, &records))?;
        self.watch.has_edited(&changes);
        let (scratch, _) = scratch.end()?;
        let up = self.conversion.up.or(pass.orientation().map(|stand| stand.up));
        let conversion = super::Conversion { edits: Vec::new(), up, ..self.conversion.clone() };
        let files = [scratch.part().to_owned()];
        let source = self.conversion.write_options(self.files, &Frame::default()).source;
        let work = Work {
            conversion: &conversion,
            files: &files,
            output: self.output,
            watch: &Inner(self.watch),
        };
        work.in_regions_named(work.need(), source)
    }

    /// See above.
    #[cfg(not(feature = "ply"))]
    pub fn edited_in_regions(&self) -> Result<Converted, W::Error> {
        Err(wrong("edits of more than fits in memory need the feature “ply”").into())
    }

    /// Returns a mesh or point cloud with the attributes of these names.
    pub fn surface(&self, path: &Path, mesh: Mesh, names: &[String]) -> Result<Surface, W::Error> {
        let count = mesh.positions.len();
        let mut surface = Surface::from(mesh);
        let reading = self.conversion.reading(Some(self.conversion.most_memory()));
        for name in names {
            let values = reading.open_colored(path, Some(name))?.values(name)?;
            if let Some(values) = values.filter(|values| values.len() == count) {
                let values: Vec<f64> = values.into_iter().map(f64::from).collect();
                let attribute = Attribute { name: name.clone(), kind: narrowest(&values) };
                surface.columns.push((attribute, values));
            }
        }
        Ok(surface)
    }

    /// Returns an input as the edits change it.
    pub fn edited_mesh(&self, path: &Path, mesh: Mesh) -> Result<Mesh, W::Error> {
        if self.conversion.edits.is_empty() {
            return Ok(mesh);
        }
        let asked = mesh.about.attributes.iter().filter(|name| self.is_asked(name));
        let names: Vec<String> = asked.cloned().collect();
        let mut surface = self.surface(path, mesh, &names)?;
        self.edit_surface(&mut surface, path)?;
        Ok(surface.mesh)
    }

    fn edit_surface(&self, surface: &mut Surface, path: &Path) -> Result<(), W::Error> {
        let mesh = &surface.mesh;
        let frame = Frame::of(mesh.about.orientation, || Ok(mesh.guess_orientation()))?;
        let crs = mesh.about.crs.clone();
        let context = self.context(path, frame.up(self.conversion.up), crs);
        self.edit_in(surface, &context)
    }

    /// Makes the edits of a scene that is in memory.
    pub fn edit<S: Editable>(&self, scene: &mut S, path: &Path, up: DVec3) -> Result<(), W::Error> {
        self.edit_in(scene, &self.context(path, up, String::new()))
    }

    fn edit_in<S: Editable>(&self, scene: &mut S, context: &Context) -> Result<(), W::Error> {
        if self.conversion.edits.is_empty() {
            return Ok(());
        }
        self.watch.stage(&format!("Editing {}", context.file.display()));
        self.watch.has_edited(&edit::apply(scene, &self.conversion.edits, context)?);
        Ok(())
    }
}

/// What a caller hears of a conversion of edited points: not the file in which they are.
struct Inner<'a, W>(&'a W);

impl<W: Watch> Watch for Inner<'_, W> {
    type Error = W::Error;

    fn progress(&self, stage: &'static str, done: u64, all: u64) {
        self.0.progress(stage, done, all);
    }

    fn has_read(&self, _: &[PathBuf]) -> Result<(), W::Error> {
        Ok(())
    }

    fn has_colored(&self, is_mesh: bool, has_values: bool) -> Result<(), W::Error> {
        self.0.has_colored(is_mesh, has_values)
    }
}

/// Returns the code of a reference system, if it has one, and whether it is geographic.
fn code_of(crs: &Crs) -> Option<(u16, bool)> {
    Some((crs.code()?, crs.is_geographic()))
}

/// Returns the names of the attributes that a file keeps.
fn names_of(attributes: &[Attribute], writer: &dyn PointWriter) -> Vec<String> {
    let names = attributes.iter().map(|attribute| attribute.name.clone());
    names.filter(|name| !writer.left_out().contains(name)).collect()
}

/// Returns what a file of all these points holds.
fn layout_of(parts: &[Records]) -> PointLayout {
    let mut layout = PointLayout {
        has_normals: parts.iter().all(|part| !part.normals.is_empty()),
        has_colors: parts.iter().all(|part| !part.colors.is_empty()),
        bounds: [DVec3::INFINITY, DVec3::NEG_INFINITY],
        ..PointLayout::default()
    };
    for part in parts {
        for place in &part.positions {
            layout.bounds = [layout.bounds[0].min(*place), layout.bounds[1].max(*place)];
            layout.is_wide |= keep::single(*place) != *place;
        }
        for attribute in &part.attributes {
            if !layout.attributes.iter().any(|known| known.name == attribute.name) {
                layout.attributes.push(attribute.clone());
            }
        }
    }
    layout
}

/// Returns the narrowest type that holds values, because readers of whole files give all of them as
/// 32-bit floats. So a class stays a byte.
pub fn narrowest(values: &[f64]) -> NumberType {
    let is_within =
        |most: f64| values.iter().all(|value| value.fract() == 0.0 && (0.0..=most).contains(value));
    if is_within(255.0) {
        NumberType::U8
    } else if is_within(65535.0) {
        NumberType::U16
    } else {
        NumberType::F32
    }
}
