//! Drawing a scene: the settings of a picture, and renderers that are used again.

use crate::{
    camera::camera,
    errors::{of_media, options, wrong},
    parts::picture,
    weights,
};
use serde::Deserialize;
use serde_json::{Map, Value};
use splatkit::{
    Device, Error, FrameStats, Renderer, Stop,
    glam::DVec3,
    interaction::{Effort, Histogram},
    math::{Bounds, Camera},
    picture::{Layers, Picture},
    scene::{Clip, Item, Region, Scene, Settings},
    session::{
        Coloring, Data, Drawing, Engine, Framing, Items, Layer, Mark, Name, OverlayEntry,
        PanelLabels, PictureEntry, Showing, Subject,
    },
    volume::TransferFunction,
};
use splatkit_media::{
    figure::Figure,
    overlay::{Overlay, Page},
};
use std::{
    collections::BTreeSet,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// How a picture is drawn.
#[derive(Debug, Clone)]
pub struct Draw {
    picture: PictureEntry,
    region: Option<Part>,
    /// Whether the picture keeps all pixels that are drawn, instead of their means.
    keep_samples: bool,
    /// What is written over the picture.
    overlay: OverlayEntry,
    /// The colour behind the picture, which decides the colour of texts.
    behind: Option<[f32; 3]>,
    engine: Engine,
}

/// The part of a picture that one of several machines draws.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Part {
    #[serde(rename = "box")]
    cuboid: [[f64; 3]; 2],
    level: f64,
}

impl From<Part> for Region {
    fn from(Part { cuboid, level }: Part) -> Self {
        let [min, max] = cuboid.map(DVec3::from_array);
        Self { bounds: Bounds { min, max }, level }
    }
}

/// A scene that several threads may change and draw.
#[derive(Default)]
pub struct Stage {
    items: Mutex<Versioned>,
    /// What is kept for the next picture: for pictures with facets, and for others.
    kept: Mutex<[Option<Kept>; 2]>,
}

/// The items of a scene, and how often they have changed.
#[derive(Clone, Default)]
struct Versioned {
    items: Items,
    /// How the scene was before each input, and how many items it had.
    marks: Vec<(Mark, usize)>,
    /// The items whose transfer function was set since they were added.
    edited: BTreeSet<usize>,
    /// Grows with each input.
    version: usize,
    /// Grows with each change of a transfer function.
    transfer_version: usize,
}

/// An input, and how it is shown.
pub struct Added {
    pub name: Name,
    pub input: Data,
    pub showing: Showing,
}

/// A renderer and what the camera is fitted to, of one version of the scene.
struct Kept {
    version: usize,
    /// The version of the transfer functions.
    transfer_version: usize,
    scene: Arc<Scene>,
    subject: Subject,
    seen: Option<(Vec<Clip>, Arc<Vec<DVec3>>)>,
    renderer: Option<(Engine, Renderer)>,
}

/// An item whose values are shown by a transfer function.
pub struct Field {
    /// The number of the item in its scene.
    pub item: usize,
    pub name: String,
    /// The smallest and the largest value.
    pub range: [f64; 2],
    /// The diagonal of the box around the item, in world units.
    pub diagonal: f64,
    pub transfer: TransferFunction,
}

/// Where a picture is taken from.
pub enum Viewpoint<'a> {
    /// A camera as JSON.
    Camera(&'a str),
    /// A camera that is fitted to the scene.
    Fitted(&'a Framing),
}

/// A finished picture.
pub struct Drawn {
    pub picture: Picture,
    pub stats: FrameStats,
    pub camera: Camera,
}

impl Draw {
    /// Reads the options.
    pub fn parse(text: &str) -> Result<Self, Error> {
        let mut all: Map<String, Value> = options(text)?;
        let mut taken = |name: &str| all.remove(name).unwrap_or(Value::Null).to_string();
        let (region, keep_samples) = (taken("region"), taken("keep_samples"));
        let (overlay, behind, engine) = (taken("overlay"), taken("behind"), taken("engine"));
        let picture = picture(&Value::Object(all).to_string())?;
        let keep_samples: Option<bool> = options(&keep_samples)?;
        let overlay = options::<Option<OverlayEntry>>(&overlay)?.unwrap_or_default();
        overlay.validate()?;
        let engine: Option<Engine> = options(&engine)?;
        Ok(Self {
            picture,
            region: options(&region)?,
            keep_samples: keep_samples.unwrap_or(false),
            overlay,
            behind: options(&behind)?,
            engine: engine.unwrap_or(Engine::Cpu),
        })
    }

    /// Returns the texts over the picture, if there are any.
    fn texts(&self, kept: &Kept, items: &Mutex<Versioned>) -> Result<Option<Overlay>, Error> {
        let labels = self.picture.panel_labels.unwrap_or_default();
        let has_labels = !self.picture.views.is_empty() && labels != PanelLabels::None;
        if self.overlay == OverlayEntry::default() && !has_labels {
            return Ok(None);
        }
        let mut captions = locked(items).items.captions();
        // The colours of a transfer function that was set are its own.
        let transfer = |&number: &usize| Some((number, kept.scene.items.get(number)?.transfer()?));
        let edited = locked(items).edited.clone();
        let transfers = edited.iter().filter_map(transfer);
        captions.take_transfers(&kept.scene, transfers, &Coloring::default());
        let page = Page { background: self.behind, dpi: self.picture.dpi, has_labels };
        Overlay::open(&self.overlay, &captions, page).map_err(of_media)
    }

    /// Returns the part of a drawn picture that a camera is fitted to: the middle, beside the
    /// scalar bars.
    fn free(&self, drawing: &Drawing, texts: Option<&Overlay>) -> [u32; 2] {
        drawing.free(texts.map_or(0, |texts| texts.room(self.picture.size())))
    }

    /// Returns what draws.
    #[cfg(feature = "gpu")]
    fn device(&self) -> Result<Device, Error> {
        match self.engine {
            Engine::Cpu => Ok(Device::Cpu),
            Engine::Gpu => match Device::automatic() {
                Device::Cpu => Err(wrong("engine=\"gpu\": this machine has no GPU that can draw")),
                device => Ok(device),
            },
            _ => Ok(Device::automatic()),
        }
    }

    /// Returns what draws.
    #[cfg(not(feature = "gpu"))]
    fn device(&self) -> Result<Device, Error> {
        if self.engine == Engine::Gpu {
            return Err(wrong(
                "this build of pysplatkit has no GPU engine, so engine=\"gpu\" cannot draw; leave \
                 it out, or build the package with `maturin build --features gpu` in tools/python",
            ));
        }
        Ok(Device::Cpu)
    }

    /// Whether meshes can be drawn as facets: in sheets that emit and absorb light.
    fn draws_facets(&self) -> bool {
        self.picture.draws_facets()
    }

    /// Returns how a picture is drawn and finished.
    fn drawing(&self, kept: &Kept, stop: &Stop) -> Result<Drawing, Error> {
        let mut drawing = self.picture.drawing(&kept.scene, &kept.subject)?;
        drawing.settings.controls.stop = stop.clone();
        drawing.settings.region = self.region.map(Region::from);
        kept.scene.validate_settings(&drawing.settings)?;
        Ok(drawing)
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Stage {
    /// Adds an input, unless the caller has stopped waiting for it.
    pub fn add(&self, added: Added, stop: &Stop) -> Result<(), Error> {
        let mut versioned = locked(&self.items);
        let before = versioned.items.mark();
        let count = versioned.items.contents.len();
        let Added { name, input, showing } = added;
        versioned.items.add(&name, input, &showing, &|_| ())?;
        let last = versioned.items.contents.len() - 1;
        let field = versioned.items.fields().last().filter(|(number, _)| *number == last);
        let checked = field.and_then(|(_, item)| item.transfer()).map_or(Ok(()), |t| t.validate());
        let checked = if stop.is_requested() { Err(Error::Stopped) } else { checked };
        if checked.is_err() {
            versioned.items.restore(before);
            return checked;
        }
        versioned.marks.push((before, count));
        versioned.version += 1;
        *locked(&self.kept) = [None, None];
        Ok(())
    }

    /// Returns a scene of the first inputs alone, which shares what they were made into.
    pub fn forked(&self, count: usize) -> Self {
        let mut forked = locked(&self.items).clone();
        if let Some((mark, items)) = forked.marks.get(count).cloned() {
            forked.items.restore(mark);
            forked.marks.truncate(count);
            forked.edited.retain(|item| *item < items);
        }
        Self { items: Mutex::new(forked), kept: Mutex::default() }
    }

    /// Returns what the scene holds: kind, number of the input, and the number of splats or
    /// samples.
    pub fn contents(&self) -> Vec<(&'static str, usize, u64)> {
        let versioned = locked(&self.items);
        let input = |item: usize| versioned.marks.partition_point(|(_, first)| *first <= item) - 1;
        let contents = versioned.items.contents.iter().enumerate();
        contents.map(|(item, content)| (content.kind, input(item), content.count)).collect()
    }

    /// Returns the box around samples and vertices; `None` if the scene is empty.
    pub fn bounds(&self) -> Option<Bounds> {
        let bounds = locked(&self.items).items.subject.bounds;
        (!bounds.is_empty()).then_some(bounds)
    }

    /// Returns the way up, and the diagonal of the box around the scene in world units.
    pub fn orientation(&self) -> (DVec3, f64) {
        let subject = &locked(&self.items).items.subject;
        (subject.orientation.up, subject.bounds.diagonal())
    }

    /// Returns the fields of the scene.
    pub fn fields(&self) -> Vec<Field> {
        let items = &locked(&self.items).items;
        let field = |(number, item): (usize, &Item)| Field {
            item: number,
            name: items.contents[number].name.text.clone(),
            range: item.value_range().unwrap_or([0.0, 1.0]),
            diagonal: item.bounds().diagonal(),
            transfer: item.transfer().cloned().unwrap_or_default(),
        };
        items.fields().map(field).collect()
    }

    /// Returns how often the values of an item's field are; nothing if it has no field.
    pub fn histogram(&self, number: usize) -> Vec<u64> {
        let field = |items: &Items| {
            items.fields().find(|entry| entry.0 == number).map(|entry| entry.1.clone())
        };
        let item = field(&locked(&self.items).items);
        let histogram = item.and_then(|item| Histogram::of_item(&item));
        histogram.map(|histogram| histogram.counts).unwrap_or_default()
    }

    /// Sets the transfer function of an item's field.
    pub fn set_transfer(&self, number: usize, transfer: TransferFunction) -> Result<(), Error> {
        let mut versioned = locked(&self.items);
        versioned.items.set_transfer(number, transfer)?;
        versioned.edited.insert(number);
        versioned.transfer_version += 1;
        Ok(())
    }

    /// Returns where the work of a picture lies: rows of x, y, z and a weight.
    pub fn weights(&self) -> Result<Vec<[f64; 4]>, Error> {
        let kept = self.take(true)?;
        let weights = weights::of_scene(&kept.scene);
        self.put(kept, true);
        weights
    }

    /// Refuses options that the scene cannot be drawn with.
    pub fn check(&self, draw: &Draw) -> Result<(), Error> {
        let kept = self.take(draw.draws_facets())?;
        let checked = draw.drawing(&kept, &Stop::default());
        self.put(kept, draw.draws_facets());
        checked.map(|_| ())
    }

    /// Returns the fitted camera of a picture.
    pub fn camera(&self, fit: &Framing, draw: &Draw) -> Result<Camera, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let drawing = draw.drawing(&kept, &Stop::default())?;
        let texts = draw.texts(&kept, &self.items)?;
        let camera = kept
            .fitted(fit, &drawing.settings.clips)
            .and_then(|subject| fit.camera(&subject, draw.free(&drawing, texts.as_ref())));
        self.put(kept, draw.draws_facets());
        camera
    }

    /// Returns the cameras of a turntable.
    pub fn turntable(&self, fit: &Framing, draw: &Draw, frames: u32) -> Result<Vec<Camera>, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let drawing = draw.drawing(&kept, &Stop::default())?;
        let texts = draw.texts(&kept, &self.items)?;
        let subject = kept.fitted(fit, &drawing.settings.clips)?;
        let cameras = fit.turntable(&subject, draw.free(&drawing, texts.as_ref()), frames);
        self.put(kept, draw.draws_facets());
        cameras
    }

    /// Draws a picture with this effort, by a camera or one that is fitted to the scene. Only an
    /// exact picture is reduced to the asked size.
    pub fn draw(
        &self,
        viewpoint: Viewpoint<'_>,
        draw: &Draw,
        effort: Effort,
        stop: &Stop,
    ) -> Result<Drawn, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let drawing = draw.drawing(&kept, stop)?;
        let (settings, texts) = (&drawing.settings, draw.texts(&kept, &self.items)?);
        if !draw.picture.views.is_empty() {
            let drawn = self.draw_figure(&mut kept, (viewpoint, draw), texts, drawing);
            self.put(kept, draw.draws_facets());
            return drawn;
        }
        let (camera, is_fitted) = match viewpoint {
            Viewpoint::Camera(text) => (camera(text)?, false),
            Viewpoint::Fitted(fit) => {
                let subject = kept.fitted(fit, &settings.clips)?;
                (fit.camera(&subject, draw.free(&drawing, texts.as_ref()))?, true)
            }
        };
        let mut renderer = kept.renderer_of(draw)?;
        let sheet = settings.sheet_thickness.or_else(|| kept.scene.finest_sheet());
        let done = renderer.render(&camera, &effort.settings(settings, sheet));
        kept.renderer = Some((draw.engine, renderer));
        let (scene, subject) = (kept.scene.clone(), kept.subject.clone());
        self.put(kept, draw.draws_facets());
        let items = locked(&self.items).items.clone();
        let (mut picture, stats) = done
            .map_err(|error| items.undrawn((&scene, &subject), error, &camera, settings.size).0)?;
        if is_fitted {
            draw.picture.require_content(&picture)?;
        }
        if effort == Effort::EXACT && !draw.keep_samples {
            picture = drawing.reduced(picture, &items, &camera)?;
            if let Some(texts) = texts {
                texts.draw(&mut picture, &camera);
            }
        }
        Ok(Drawn { picture, stats, camera })
    }

    /// Draws layers of the picture that a camera takes.
    pub fn layers(
        &self,
        text: &str,
        draw: &Draw,
        wanted: &[Layer],
        stop: &Stop,
    ) -> Result<Layers, Error> {
        if !draw.picture.views.is_empty() || draw.keep_samples || draw.region.is_some() {
            return Err(wrong("layers are of a picture of one view"));
        }
        let mut kept = self.take(draw.draws_facets())?;
        let drawing = draw.drawing(&kept, stop)?;
        let camera = camera(text)?;
        let marks = locked(&self.items).marks.clone();
        let ends = marks.iter().skip(1).map(|(_, first)| *first);
        let ends = ends.chain([kept.scene.items.len()]);
        let inputs: Vec<_> = marks.iter().zip(ends).map(|((_, first), end)| *first..end).collect();
        let (scene, device) = (kept.scene.clone(), draw.device()?);
        let mut renderer = kept.renderer_of(draw)?;
        let mut render = |part: Option<&Scene>, settings: &Settings| {
            let drawn = match part {
                Some(part) => Renderer::new(&device, part)?.render(&camera, settings),
                None => renderer.render(&camera, settings),
            };
            drawn.map(|(picture, _)| picture)
        };
        let layers = drawing.layers(wanted, &camera, (&scene, &inputs), &mut render);
        kept.renderer = Some((draw.engine, renderer));
        self.put(kept, draw.draws_facets());
        layers
    }

    /// Draws a picture of several views. The statistics are those of the last.
    fn draw_figure(
        &self,
        kept: &mut Kept,
        (viewpoint, draw): (Viewpoint<'_>, &Draw),
        texts: Option<Overlay>,
        mut drawing: Drawing,
    ) -> Result<Drawn, Error> {
        let Viewpoint::Fitted(fit) = viewpoint else {
            return Err(wrong("a picture has either a camera or views; leave one of them out"));
        };
        if fit.camera_position.is_some() || draw.keep_samples {
            return Err(wrong("views need a camera that is fitted to the scene"));
        }
        let subject = kept.fitted(fit, &drawing.settings.clips)?;
        let figure = Figure::new(&draw.picture, texts.as_ref(), (fit, &subject))?;
        let Some(figure) = figure else { return Err(wrong("there are no views")) };
        let factor = drawing.factor;
        drawing.settings.size = figure.panel_size().map(|side| side.saturating_mul(factor));
        let mut renderer = kept.renderer_of(draw)?;
        let mut last = FrameStats::default();
        let items = locked(&self.items).items.clone();
        let drawn = figure.draw(texts.as_ref(), |camera| {
            let (picture, stats) = renderer.render(camera, &drawing.settings)?;
            last = stats;
            drawing.reduced(picture, &items, camera)
        });
        kept.renderer = Some((draw.engine, renderer));
        let (picture, _) = drawn?;
        draw.picture.require_content(&picture)?;
        Ok(Drawn { picture, stats: last, camera: figure.cameras()[0].clone() })
    }

    /// Takes what is kept of the scene, or makes it.
    fn take(&self, facets: bool) -> Result<Kept, Error> {
        let items = locked(&self.items);
        let version = items.version;
        let mut kept = locked(&self.kept);
        let slot = &mut kept[usize::from(facets)];
        match slot {
            Some(current) if current.version == version => {
                let subject = current.subject.clone();
                let (scene, seen) = (current.scene.clone(), current.seen.clone());
                let renderer = current.renderer.take();
                let kept = Kept {
                    version,
                    transfer_version: current.transfer_version,
                    scene,
                    subject,
                    seen,
                    renderer,
                };
                return if kept.transfer_version == items.transfer_version {
                    Ok(kept)
                } else {
                    kept.with_transfers_of(&items, facets)
                };
            }
            _ => {}
        }
        drop(kept);
        let (scene, subject) = items.assembled(facets)?;
        let transfer_version = items.transfer_version;
        Ok(Kept { version, transfer_version, scene, subject, seen: None, renderer: None })
    }

    /// Keeps what a picture was drawn with, unless the scene has changed.
    fn put(&self, used: Kept, facets: bool) {
        let items = locked(&self.items);
        if items.version == used.version {
            locked(&self.kept)[usize::from(facets)] = Some(used);
        }
    }
}

impl Versioned {
    /// Returns the scene and its subject. `facets` says whether its pictures can show facets.
    fn assembled(&self, facets: bool) -> Result<(Arc<Scene>, Subject), Error> {
        let fault = |scene: &Scene, error| self.items.at_fault(scene, error);
        let (scene, subject) = self.items.assembled(facets, fault)?;
        Ok((Arc::new(scene), subject))
    }
}

impl Kept {
    /// Takes the renderer that is kept, or makes one for these options.
    fn renderer_of(&mut self, draw: &Draw) -> Result<Renderer, Error> {
        match self.renderer.take() {
            Some((engine, renderer)) if engine == draw.engine => Ok(renderer),
            _ => Renderer::new(&draw.device()?, &self.scene),
        }
    }

    /// Takes over the transfer functions of a scene that has not changed otherwise.
    fn with_transfers_of(mut self, items: &Versioned, facets: bool) -> Result<Self, Error> {
        let (scene, _) = items.assembled(facets)?;
        if let Some((_, renderer)) = &mut self.renderer {
            for number in scene.fields() {
                let [old, new] = [&self.scene, &scene].map(|scene| scene.items[number].transfer());
                if let Some(new) = new.filter(|_| old != new) {
                    renderer.set_transfer(number, new)?;
                }
            }
        }
        Ok(Self { transfer_version: items.transfer_version, scene, seen: None, ..self })
    }

    /// Returns the subject that a camera is fitted to. It needs no points that span what is seen
    /// if the camera has a distance already.
    fn fitted(&mut self, fit: &Framing, clips: &[Clip]) -> Result<Subject, Error> {
        let mut subject = self.subject.clone();
        if !fit.is_placed() {
            subject.seen = self.seen(clips)?.to_vec();
        }
        Ok(subject)
    }

    /// Returns the points that span what is seen with these clips.
    fn seen(&mut self, clips: &[Clip]) -> Result<Arc<Vec<DVec3>>, Error> {
        if let Some((kept_clips, seen)) = &self.seen
            && kept_clips == clips
        {
            return Ok(seen.clone());
        }
        let seen = Arc::new(self.scene.seen(clips)?);
        self.seen = Some((clips.to_vec(), seen.clone()));
        Ok(seen)
    }
}
