//! Drawing a scene: the settings of a picture, and renderers that are used again.

use crate::{
    camera::{Fit, Subject, camera},
    errors::{options, wrong},
    items::{Added, Items},
};
use serde::Deserialize;
use splatkit::{
    Device, Error, FrameStats, Renderer, Stop,
    glam::DVec3,
    hierarchy::Detail,
    interaction::ClipEntry,
    math::{Bounds, Camera},
    picture::Picture,
    scene::{Classification, Clip, Evaluate, Gradient, Item, Mode, Optics, Order, Scene, Settings},
};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Most pixels drawn if the picture's size decides how many are averaged.
const MOST_PIXELS: u64 = 1 << 18;

/// How a picture is drawn.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Draw {
    size: [u32; 2],
    mode: Option<String>,
    back_to_front: bool,
    classify: Option<String>,
    optics: Option<String>,
    samples: Option<u32>,
    shade: Option<bool>,
    gradient: Option<String>,
    evaluate: Option<String>,
    sheet_thickness: Option<f64>,
    cut: Option<f64>,
    budget: Option<u64>,
    memory: Option<u64>,
    cull_backfaces: Option<bool>,
    occlusion: Option<bool>,
    clips: Vec<ClipEntry>,
}

/// A scene that several threads may change and draw.
#[derive(Default)]
pub struct Stage {
    items: Mutex<Items>,
    /// What is kept for the next picture: for pictures with facets, and for others.
    kept: Mutex<[Option<Kept>; 2]>,
}

/// A renderer and what the camera is fitted to, of one version of the scene.
struct Kept {
    version: usize,
    scene: Arc<Scene>,
    subject: Subject,
    seen: Option<(Vec<Clip>, Arc<Vec<DVec3>>)>,
    renderer: Option<Renderer>,
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
        let own: Self = options(text)?;
        if own.size.contains(&0) {
            return Err(wrong("a picture needs a width and a height above 0"));
        }
        if own.samples.is_some_and(|samples| ![1, 4, 9, 16, 64].contains(&samples)) {
            return Err(wrong("samples is “auto”, 1, 4, 9, 16 or 64"));
        }
        if own.back_to_front && own.mode.as_deref() != Some("splats") {
            return Err(wrong("back_to_front needs the mode “splats”"));
        }
        own.method(&mut Settings::new(own.size))?;
        Ok(own)
    }

    /// Returns how many pixels are drawn along each side of a pixel.
    pub fn factor(&self, scene: &Scene) -> u32 {
        let [width, height] = self.size.map(u64::from);
        let drawn = |factor: u32| u64::from(factor * factor).saturating_mul(width * height);
        // Explicit splats have edges and are widened, which takes more pixels than a volume does.
        let most = if scene.has_splats() { 8 } else { 4 };
        match self.samples {
            None => (2..=most).rev().find(|factor| drawn(*factor) <= MOST_PIXELS).unwrap_or(1),
            Some(samples) => samples.isqrt(),
        }
    }

    fn method(&self, settings: &mut Settings) -> Result<(), Error> {
        let order = if self.back_to_front { Order::BackToFront } else { Order::FrontToBack };
        settings.mode = choose(
            "mode",
            self.mode.as_deref(),
            [
                ("sheets", Mode::Sheets),
                ("axis-sheets", Mode::AxisSheets),
                ("splats", Mode::Splats(order)),
            ],
        )?;
        settings.classification = choose(
            "classify",
            self.classify.as_deref(),
            [
                ("pre-integrated", Classification::PreIntegrated),
                ("post", Classification::Post),
                ("pre", Classification::Pre),
            ],
        )?;
        settings.optics = choose(
            "optics",
            self.optics.as_deref(),
            [
                ("light", Optics::EmissionAbsorption),
                ("maximum", Optics::Maximum),
                ("x-ray", Optics::XRay),
            ],
        )?;
        settings.gradient = choose(
            "gradient",
            self.gradient.as_deref(),
            [("analytic", Gradient::Analytic), ("central", Gradient::Central)],
        )?;
        settings.evaluate = choose(
            "evaluate",
            self.evaluate.as_deref(),
            [
                ("auto", Evaluate::Auto),
                ("gather", Evaluate::Gather),
                ("scatter", Evaluate::Scatter),
            ],
        )?;
        Ok(())
    }

    /// Whether meshes can be drawn as facets: in sheets that emit and absorb light.
    fn draws_facets(&self) -> bool {
        let is = |text: &Option<String>, usual| text.as_deref().is_none_or(|text| text == usual);
        is(&self.mode, "sheets") && is(&self.optics, "light")
    }

    /// Returns the settings of a picture before it is averaged down.
    fn settings(&self, scene: &Scene, stop: &Stop) -> Result<Settings, Error> {
        let factor = self.factor(scene);
        let mut settings = Settings::new(self.size.map(|side| side.saturating_mul(factor)));
        settings.stop = stop.clone();
        settings.sheet_thickness = self.sheet_thickness;
        // Explicit extra pixels do not change sheets and cuts. If their number is automatic, a
        // small picture is drawn like a larger one.
        let wider = if self.samples.is_some() { f64::from(factor) } else { 1.0 };
        settings.sheet_pixels *= wider;
        settings.occlusion = self.occlusion.unwrap_or(true);
        self.method(&mut settings)?;
        match self.shade {
            Some(false) => {
                settings.volume_shade = Some(None);
                settings.surface_shade = None;
            }
            Some(true) => {
                let fields = scene.items.iter().filter_map(Item::transfer);
                let own = fields.clone().find_map(|transfer| transfer.shade);
                let mut shade = own.unwrap_or_default();
                if fields.count() > 1 {
                    // Each field knows itself which of its gradients are certain.
                    shade.certain = None;
                }
                settings.volume_shade = Some(Some(shade));
            }
            None => {}
        }
        settings.detail = match self.budget {
            Some(splats) => Detail::Splats(splats),
            None => Detail::Pixels(self.cut.unwrap_or(Detail::PIXELS) * wider),
        };
        settings.cull_backfaces = self.cull_backfaces;
        settings.page_memory = self.memory.unwrap_or(settings.page_memory);
        let clips = self.clips.iter().map(|entry| entry.clip().map_err(wrong));
        settings.clips = clips.collect::<Result<_, _>>()?;
        scene.validate_settings(&settings)?;
        Ok(settings)
    }
}

/// Returns what a name stands for; without a name, the first.
fn choose<T: Copy, const N: usize>(
    what: &str,
    name: Option<&str>,
    choices: [(&str, T); N],
) -> Result<T, Error> {
    let Some(name) = name else { return Ok(choices[0].1) };
    let found = choices.iter().find(|(own, _)| *own == name);
    found.map(|(_, choice)| *choice).ok_or_else(|| {
        let names = choices.map(|(name, _)| name).join(", ");
        wrong(format!("{what} is one of {names}, not “{name}”"))
    })
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Stage {
    /// Adds an input, unless the caller has stopped waiting for it.
    pub fn add(&self, added: Added, stop: &Stop) -> Result<(), Error> {
        let mut items = locked(&self.items);
        let (count, subject) = (items.contents.len(), items.subject.clone());
        items.add(added)?;
        if stop.is_requested() {
            items.restore(count, subject);
            return Err(Error::Stopped);
        }
        *locked(&self.kept) = [None, None];
        Ok(())
    }

    /// Returns what the scene holds: kind, name, and the number of splats or samples.
    pub fn contents(&self) -> Vec<(&'static str, String, u64)> {
        locked(&self.items).contents.clone()
    }

    /// Returns the box around samples and vertices; `None` if the scene is empty.
    pub fn bounds(&self) -> Option<Bounds> {
        let bounds = locked(&self.items).subject.bounds;
        (!bounds.is_empty()).then_some(bounds)
    }

    /// Returns the fitted camera of a picture.
    pub fn camera(&self, fit: &Fit, draw: &Draw) -> Result<Camera, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let settings = draw.settings(&kept.scene, &Stop::default())?;
        let seen = kept.fitted(fit, &settings.clips)?;
        let camera = fit.camera(&kept.subject, &seen, settings.size);
        self.put(kept, draw.draws_facets());
        camera
    }

    /// Returns the cameras of a turntable.
    pub fn turntable(&self, fit: &Fit, draw: &Draw, frames: u32) -> Result<Vec<Camera>, Error> {
        let mut kept = self.take(draw.draws_facets())?;
        let settings = draw.settings(&kept.scene, &Stop::default())?;
        let seen = kept.fitted(fit, &settings.clips)?;
        let cameras = fit.turntable(&kept.subject, &seen, settings.size, frames);
        self.put(kept, draw.draws_facets());
        cameras
    }

    /// Draws a picture. Without a camera, the usual one is fitted to the scene.
    pub fn draw(&self, own: Option<&str>, draw: &Draw, stop: &Stop) -> Result<Drawn, Error> {
        let own = own.map(camera).transpose()?;
        let is_fitted = own.is_none();
        let mut kept = self.take(draw.draws_facets())?;
        let settings = draw.settings(&kept.scene, stop)?;
        let camera = match own {
            Some(camera) => camera,
            None => {
                let seen = kept.seen(&settings.clips)?;
                Fit::default().camera(&kept.subject, &seen, settings.size)?
            }
        };
        let mut renderer = match kept.renderer.take() {
            Some(renderer) => renderer,
            None => Renderer::new(&Device::Cpu, &kept.scene)?,
        };
        let (mut picture, stats) = renderer.render(&camera, &settings)?;
        // An opacity that rounds to 0 in a file of 8 bits counts as none.
        if is_fitted && picture.color.iter().all(|pixel| pixel[3] < 0.5 / 255.0) {
            return Err(Error::NothingToDraw("the picture is empty: nothing has opacity".into()));
        }
        let factor = draw.factor(&kept.scene);
        if factor > 1 {
            picture = picture.reduced(factor)?;
        }
        kept.renderer = Some(renderer);
        self.put(kept, draw.draws_facets());
        Ok(Drawn { picture, stats, camera })
    }

    /// Takes what is kept of the scene, or makes it.
    fn take(&self, facets: bool) -> Result<Kept, Error> {
        let items = locked(&self.items);
        let version = items.contents.len();
        let mut kept = locked(&self.kept);
        let slot = &mut kept[usize::from(facets)];
        match slot {
            Some(own) if own.version == version => {
                let renderer = own.renderer.take();
                let (scene, seen) = (own.scene.clone(), own.seen.clone());
                return Ok(Kept { version, scene, seen, renderer, subject: own.subject.clone() });
            }
            _ => {}
        }
        drop(kept);
        let scene = Arc::new(items.scene(facets)?);
        let mut subject = items.subject.clone();
        // Points that all lie at one place have no extent, but their splats have one.
        if is_one_place(&subject.bounds) {
            subject.bounds = scene.bounds();
        }
        Ok(Kept { version, scene, subject, seen: None, renderer: None })
    }

    /// Keeps what a picture was drawn with, unless the scene has changed.
    fn put(&self, own: Kept, facets: bool) {
        let items = locked(&self.items);
        if items.contents.len() == own.version {
            locked(&self.kept)[usize::from(facets)] = Some(own);
        }
    }
}

impl Kept {
    /// Returns the points that a camera is fitted to; none if it has a distance already.
    fn fitted(&mut self, fit: &Fit, clips: &[Clip]) -> Result<Arc<Vec<DVec3>>, Error> {
        if fit.is_placed() { Ok(Arc::default()) } else { self.seen(clips) }
    }

    /// Returns the points that span what is seen with these clips.
    fn seen(&mut self, clips: &[Clip]) -> Result<Arc<Vec<DVec3>>, Error> {
        if let Some((own, seen)) = &self.seen
            && own == clips
        {
            return Ok(seen.clone());
        }
        let seen = Arc::new(self.scene.seen(clips)?);
        self.seen = Some((clips.to_vec(), seen.clone()));
        Ok(seen)
    }
}

/// Whether a box is no larger than the rounding error of its coordinates.
fn is_one_place(bounds: &Bounds) -> bool {
    bounds.diagonal() <= 1e-13 * bounds.center().abs().max_element()
}
