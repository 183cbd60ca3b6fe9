//! Drawing a scene: the settings of a picture, and renderers that are used again.

use crate::{
    camera::camera,
    errors::{options, wrong},
    film,
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
    picture::Picture,
    scene::{Clip, Item, Region, Scene, Settings},
    session::{
        Captions, Coloring, Data, Description, Engine, Framing, Items, Legend, Mark, Name,
        OverlayEntry, PanelLabels, PictureEntry, Showing, Subject,
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
        let overlay: Option<OverlayEntry> = options(&overlay)?;
        let engine: Option<Engine> = options(&engine)?;
        Ok(Self {
            picture,
            region: options(&region)?,
            keep_samples: keep_samples.unwrap_or(false),
            overlay: overlay.unwrap_or_default(),
            behind: options(&behind)?,
            engine: engine.unwrap_or(Engine::Cpu),
        })
    }

    /// Returns the texts over the picture, if there are any.
    fn texts(&self, items: &Mutex<Versioned>) -> Result<Option<Overlay>, Error> {
        let labels = self.picture.panel_labels.unwrap_or_default();
        let has_labels = !self.picture.views.is_empty() && labels != PanelLabels::None;
        if self.overlay == OverlayEntry::default() && !has_labels {
            return Ok(None);
        }
        let captions = locked(items).captions();
        let letters = self.overlay.caption.as_ref().map_or(0, |text| text.chars().count());
        let most = Description::MOST_CAPTION;
        if letters > most {
            return Err(wrong(format!("a caption has at most {most} letters, not {letters}")));
        }
        let page = Page { background: self.behind, dpi: self.picture.dpi, has_labels };
        Overlay::open(&self.overlay, &captions, page).map_err(film::plain)
    }

    /// Returns the part of a drawn picture that a camera is fitted to: the middle, beside the
    /// scalar bars.
    fn free(
        &self,
        kept: &Kept,
        items: &Mutex<Versioned>,
        size: [u32; 2],
    ) -> Result<[u32; 2], Error> {
        let room = self.texts(items)?.map_or(0, |texts| texts.room(self.picture.size()));
        let [width, height] = size;
        Ok([width.saturating_sub(2 * self.factor(&kept.scene) * room).max(1), height])
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

    /// Returns how many pixels are drawn along each side of a pixel.
    pub fn factor(&self, scene: &Scene) -> u32 {
        self.picture.factor(scene)
    }

    /// Whether meshes can be drawn as facets: in sheets that emit and absorb light.
    fn draws_facets(&self) -> bool {
        self.picture.draws_facets()
    }

    /// Returns the settings of a picture before it is averaged down.
    fn settings(&self, kept: &Kept, stop: &Stop) -> Result<Settings, Error> {
        let mut settings = self.picture.settings(&kept.scene, &kept.subject)?;
        settings.controls.stop = stop.clone();
        settings.region = self.region.map(Region::from);
        kept.scene.validate_settings(&settings)?;
        Ok(settings)
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
        let checked = draw.settings(&kept, &Stop::default());
        self.put(kept, draw.draws_facets());
        checked.map(|_| ())
    }

    /// Returns the fitted camera of a picture.
    pub fn camera(&self, fit: &Framing, draw: &Draw) -> Result<Camera, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let settings = draw.settings(&kept, &Stop::default())?;
        let camera = self.fitted(&mut kept, fit, draw, &settings);
        self.put(kept, draw.draws_facets());
        camera
    }

    /// Returns the camera that is fitted to what is kept of a scene.
    fn fitted(
        &self,
        kept: &mut Kept,
        fit: &Framing,
        draw: &Draw,
        settings: &Settings,
    ) -> Result<Camera, Error> {
        let free = draw.free(kept, &self.items, settings.size)?;
        let seen = kept.fitted(fit, &settings.clips)?;
        fit.camera(&kept.seen_by(&seen), free)
    }

    /// Returns the cameras of a turntable.
    pub fn turntable(&self, fit: &Framing, draw: &Draw, frames: u32) -> Result<Vec<Camera>, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let settings = draw.settings(&kept, &Stop::default())?;
        let seen = kept.fitted(fit, &settings.clips)?;
        let free = draw.free(&kept, &self.items, settings.size)?;
        let cameras = fit.turntable(&kept.seen_by(&seen), free, frames);
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
        let settings = draw.settings(&kept, stop)?;
        let texts = draw.texts(&self.items)?;
        if !draw.picture.views.is_empty() {
            let drawn = self.draw_figure(&mut kept, (viewpoint, draw), texts, &settings);
            self.put(kept, draw.draws_facets());
            return drawn;
        }
        let (camera, is_fitted) = match viewpoint {
            Viewpoint::Camera(text) => (camera(text)?, false),
            Viewpoint::Fitted(fit) => (self.fitted(&mut kept, fit, draw, &settings)?, true),
        };
        let mut renderer = kept.renderer_of(draw)?;
        let sheet = settings.sheet_thickness.or_else(|| sheet_of(&kept.scene));
        let done = renderer.render(&camera, &effort.settings(&settings, sheet));
        kept.renderer = Some((draw.engine, renderer));
        let (factor, scene) = (draw.factor(&kept.scene), kept.scene.clone());
        self.put(kept, draw.draws_facets());
        let (mut picture, stats) = done.map_err(|error| match error {
            Error::Argument(_) if is_fitted => {
                locked(&self.items).items.out_of_sight(&scene, error)
            }
            other => other,
        })?;
        if is_fitted {
            require_content(&picture)?;
        }
        if effort == Effort::EXACT && !draw.keep_samples {
            if factor > 1 {
                picture = picture.reduced(factor)?;
            }
            let edges = (&settings.clips[..], draw.picture.edge_width());
            locked(&self.items).items.draw_edges(&mut picture, &camera, edges)?;
            if let Some(texts) = texts {
                texts.draw(&mut picture, &camera);
            }
        }
        Ok(Drawn { picture, stats, camera })
    }

    /// Draws a picture of several views. The statistics are those of the last.
    fn draw_figure(
        &self,
        kept: &mut Kept,
        (viewpoint, draw): (Viewpoint<'_>, &Draw),
        texts: Option<Overlay>,
        settings: &Settings,
    ) -> Result<Drawn, Error> {
        let Viewpoint::Fitted(fit) = viewpoint else {
            return Err(wrong("a picture has either a camera or views; leave one of them out"));
        };
        if fit.camera_position.is_some() || draw.keep_samples {
            return Err(wrong("views need a camera that is fitted to the scene"));
        }
        let seen = kept.fitted(fit, &settings.clips)?;
        let subject = kept.seen_by(&seen);
        let figure = Figure::new(&draw.picture, texts.as_ref(), (fit, &subject))?;
        let Some(figure) = figure else { return Err(wrong("there are no views")) };
        let factor = draw.factor(&kept.scene);
        let mut settings = settings.clone();
        settings.size = figure.panel_size().map(|side| side.saturating_mul(factor));
        let mut renderer = kept.renderer_of(draw)?;
        let mut last = FrameStats::default();
        let drawn = figure.draw(texts.as_ref(), |camera| {
            let (picture, stats) = renderer.render(camera, &settings)?;
            last = stats;
            let mut picture = if factor > 1 { picture.reduced(factor)? } else { picture };
            let edges = (&settings.clips[..], draw.picture.edge_width());
            locked(&self.items).items.draw_edges(&mut picture, camera, edges)?;
            Ok::<_, Error>(picture)
        });
        kept.renderer = Some((draw.engine, renderer));
        let (picture, _) = drawn?;
        require_content(&picture)?;
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
        let scene = items.scene(facets)?;
        let mut subject = items.items.subject.clone();
        // Points that all lie at one place have no extent, but their splats have one.
        if subject.is_one_place() {
            subject.bounds = scene.bounds();
        }
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
    /// Returns the scene. `facets` says whether its pictures can show facets.
    fn scene(&self, facets: bool) -> Result<Arc<Scene>, Error> {
        let scene = self.items.scene(facets)?;
        scene.validate().map_err(|error| self.items.at_fault(&scene, error))?;
        Ok(Arc::new(scene))
    }

    /// Returns what the inputs say for texts. The colours of a transfer function that was set are
    /// its own.
    fn captions(&self) -> Captions {
        let mut captions = self.items.captions();
        for (number, legend) in &mut captions.legends {
            let edited = self.edited.contains(number);
            let field = self.items.fields().find(|(item, _)| edited && item == number);
            let Some((_, item)) = field else { continue };
            let (Some(transfer), Some(range)) = (item.transfer(), item.value_range()) else {
                continue;
            };
            let labels = match item {
                Item::Volume(volume, ..) => volume.about.labels.as_ref(),
                _ => None,
            };
            let title = (std::mem::take(&mut legend.title), labels);
            *legend = Legend::of_transfer(&Coloring::default(), transfer, range, title);
        }
        captions
    }
}

/// Refuses a picture that shows nothing.
fn require_content(picture: &Picture) -> Result<(), Error> {
    // An opacity that rounds to 0 in a file of 8 bits counts as none.
    if picture.color.iter().all(|pixel| pixel[3] < 0.5 / 255.0) {
        return Err(Error::NothingToDraw("the picture is empty: nothing has opacity".into()));
    }
    Ok(())
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
        let scene = items.scene(facets)?;
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

    /// Returns the points that a camera is fitted to; none if it has a distance already.
    fn fitted(&mut self, fit: &Framing, clips: &[Clip]) -> Result<Arc<Vec<DVec3>>, Error> {
        if fit.is_placed() { Ok(Arc::default()) } else { self.seen(clips) }
    }

    /// Returns the subject of which these points span what is seen.
    fn seen_by(&self, seen: &[DVec3]) -> Subject {
        let mut subject = self.subject.clone();
        subject.seen = seen.to_vec();
        subject
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

/// Returns the thickness of the sheets of the finest volume, about as the scene chooses it.
fn sheet_of(scene: &Scene) -> Option<f64> {
    let thicknesses = scene.items.iter().filter_map(|item| match item {
        Item::Volume(volume, ..) => Some(4.0 / 3.0 * volume.lattice.kernel_spacing()),
        _ => None,
    });
    thicknesses.reduce(f64::min)
}
