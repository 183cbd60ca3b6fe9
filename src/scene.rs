//! What is drawn and how: a scene of splat sets and volumes, and the settings of a picture.

mod numbers;

use crate::{
    Error, Result,
    bricks::{self, Bricks, Choice},
    hierarchy::{Detail, Hierarchy},
    math::{Bounds, Kernel, Profile, Sheets, Tensor, View},
    splat::{FOOTPRINT_BLUR, Payload, STEP_BACK, SplatSet},
    volume::{
        Arrangement, Lattice, Shade, TransferFunction, Volume,
        reach::{EVERYTHING, first_visible},
    },
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// A lattice is gathered in sheets of up to this many of its least steps; thicker ones hold more than a parabola tells.
pub(crate) const MOST_GATHERED: f64 = 2.2;

/// One thing in a scene.
#[derive(Debug, Clone)]
pub enum Item {
    /// Surfels, 3D Gaussians: splats that carry their own colour and optical depth.
    Radiance(Arc<SplatSet>),
    /// A hierarchy of such splats, of which a picture shows a cut ([`Settings::detail`]).
    Hierarchy(Arc<Hierarchy>),
    /// Scattered samples: splats that carry a value, shown by a transfer function.
    Scalar(Arc<SplatSet>, TransferFunction),
    /// Samples on a lattice, each the centre of one kernel, shown by a transfer function.
    Volume(Arc<Volume>, Kernel, TransferFunction),
    /// A volume beyond memory, of which a picture shows the bricks that it needs ([`Settings::detail`],
    /// [`Settings::page_memory`]).
    Bricks(Arc<Bricks>, Kernel, TransferFunction),
}

/// The items of a picture. All are drawn together by the same sheets.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    pub items: Vec<Item>,
}

impl Scene {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds splats that carry radiance.
    #[must_use]
    pub fn with_splats(mut self, set: impl Into<Arc<SplatSet>>) -> Self {
        self.items.push(Item::Radiance(set.into()));
        self
    }

    /// Adds a hierarchy of splats.
    #[must_use]
    pub fn with_hierarchy(mut self, hierarchy: impl Into<Arc<Hierarchy>>) -> Self {
        self.items.push(Item::Hierarchy(hierarchy.into()));
        self
    }

    /// Adds scattered samples.
    #[must_use]
    pub fn with_samples(
        mut self,
        set: impl Into<Arc<SplatSet>>,
        transfer: TransferFunction,
    ) -> Self {
        self.items.push(Item::Scalar(set.into(), transfer));
        self
    }

    /// Adds a volume.
    #[must_use]
    pub fn with_volume(
        mut self,
        volume: impl Into<Arc<Volume>>,
        kernel: Kernel,
        transfer: TransferFunction,
    ) -> Self {
        self.items.push(Item::Volume(volume.into(), kernel, transfer));
        self
    }

    /// Adds a volume in bricks.
    #[must_use]
    pub fn with_bricks(
        mut self,
        bricks: impl Into<Arc<Bricks>>,
        kernel: Kernel,
        transfer: TransferFunction,
    ) -> Self {
        self.items.push(Item::Bricks(bricks.into(), kernel, transfer));
        self
    }

    /// The same scene with another transfer function for its volume or sample set.
    ///
    /// # Errors
    /// [`Error::Argument`] for one that [`validate`](Self::validate) would refuse.
    pub(crate) fn shown_by(&self, transfer: &TransferFunction) -> Result<Self> {
        let mut scene = self.clone();
        for (number, item) in scene.items.iter_mut().enumerate() {
            if let Item::Scalar(_, shown) | Item::Volume(_, _, shown) | Item::Bricks(_, _, shown) =
                item
            {
                shown.clone_from(transfer);
            }
            numbers::check_field(item).map_err(numbers::of_item(number))?;
        }
        Ok(scene)
    }

    /// The function along the axes of a lattice, where a kernel of the scene is a product of them. The GPU engine draws none.
    pub fn tensor(&self) -> Option<Tensor> {
        self.items.iter().find_map(|item| match item {
            Item::Volume(_, kernel, _) | Item::Bricks(_, kernel, _) => kernel.as_tensor(),
            Item::Radiance(_) | Item::Hierarchy(_) | Item::Scalar(..) => None,
        })
    }

    /// The box around everything that can be seen, footprints included.
    pub fn bounds(&self) -> Bounds {
        self.items.iter().fold(Bounds::EMPTY, |all, item| all.union(item.bounds()))
    }

    /// Whether it holds explicit splats, which are widened by [`FOOTPRINT_BLUR`] and have edges: surfaces and scattered samples.
    pub fn has_splats(&self) -> bool {
        self.items.iter().any(|item| !matches!(item, Item::Volume(..) | Item::Bricks(..)))
    }

    /// Whether any part can become so opaque that it hides what lies behind it: surfaces can, a field only where a line
    /// through its box takes nearly all light.
    pub(crate) fn can_hide(&self) -> bool {
        const OPTICAL_DEPTH: f64 = 7.0;
        self.items.iter().any(|item| match item {
            Item::Radiance(_) | Item::Hierarchy(_) => true,
            Item::Scalar(_, transfer)
            | Item::Volume(_, _, transfer)
            | Item::Bricks(_, _, transfer) => {
                let Bounds { min, max } = item.bounds();
                !transfer.isosurfaces.is_empty()
                    || transfer.most_extinction() * (max - min).length() > OPTICAL_DEPTH
            }
        })
    }

    /// Checks that the scene can be drawn with the settings, beyond [`validate`](Self::validate): numbers and clips that are
    /// some, and
    /// combinations that mean something.
    pub fn validate_settings(&self, settings: &Settings) -> Result<()> {
        let wrong = |message: String| Err(Error::Argument(message));
        numbers::check_settings(settings)?;
        let [width, height] = settings.size;
        if u64::from(width) * u64::from(height) > Settings::MAX_PIXELS {
            let most = Settings::MAX_PIXELS;
            return wrong(format!(
                "a picture of {width}x{height} pixels is larger than {most} pixels"
            ));
        }
        if settings.clips.len() > Settings::MAX_CLIPS {
            return wrong(format!(
                "{} clips are more than {}",
                settings.clips.len(),
                Settings::MAX_CLIPS
            ));
        }
        for clip in &settings.clips {
            match clip.shape {
                ClipShape::HalfSpace { normal, offset } => {
                    if !((1e-150..=1e150).contains(&normal.length()) && offset.is_finite()) {
                        return wrong(format!(
                            "a clip plane needs a direction of a length from 1e-150 to 1e150 and a finite offset, \
                             found {normal} and {offset}"
                        ));
                    }
                }
                ClipShape::Box(bounds) => {
                    if !(bounds.min.is_finite()
                        && bounds.max.is_finite()
                        && bounds.min.cmplt(bounds.max).all())
                    {
                        let Bounds { min, max } = bounds;
                        return wrong(format!("a clip box from {min} to {max} holds nothing"));
                    }
                }
            }
        }
        let before = settings.classifies_samples();
        for (number, item) in self.items.iter().enumerate() {
            // It may have been changed since the scene was looked at as a whole.
            numbers::check_transfer(item).map_err(numbers::of_item(number))?;
            match item {
                Item::Radiance(_) | Item::Hierarchy(_) if settings.optics == Optics::Maximum => {
                    return wrong(
                        "a maximum intensity picture takes a volume or samples alone, without surfaces".into(),
                    );
                }
                Item::Radiance(_) | Item::Hierarchy(_) => {}
                Item::Volume(volume, kernel, _) => {
                    let is_gaussian = matches!(kernel.profile, Profile::Gaussian(_));
                    if let Some(tensor) = kernel.as_tensor() {
                        check_tensor(tensor, &volume.lattice, before).map_err(Error::Argument)?;
                    }
                    if matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_))
                        && !is_gaussian
                        && !before
                    {
                        return wrong(
                            "a rectilinear volume takes a Gaussian kernel, unless it is classified before".into(),
                        );
                    }
                    if let Some(coefficients) = &volume.coefficients {
                        if before {
                            return wrong(
                                "a sharp volume is classified after interpolation, in image-aligned sheets".into(),
                            );
                        }
                        if coefficients.kernel != *kernel {
                            return wrong("the volume was made sharp for another kernel".into());
                        }
                    }
                }
                Item::Bricks(_, kernel, _) => {
                    if !matches!(kernel.profile, Profile::Gaussian(_)) {
                        return wrong("a volume in bricks takes a Gaussian kernel".into());
                    }
                    if before {
                        return wrong(
                            "a volume in bricks is classified after interpolation, in image-aligned sheets".into(),
                        );
                    }
                }
                Item::Scalar(..) => {}
            }
            if let Item::Scalar(_, transfer) | Item::Volume(_, _, transfer) = item
                && before
            {
                if settings.optics == Optics::Maximum {
                    return wrong(
                        "the maximum of a field needs image-aligned sheets, classified after interpolation".into(),
                    );
                }
                if !(transfer.isosurfaces.is_empty() && transfer.gradient.is_empty()) {
                    return wrong(
                        "isosurfaces and gradient opacity need image-aligned sheets, classified after interpolation"
                            .into(),
                    );
                }
            }
        }
        Ok(())
    }

    /// Checks that the engine can draw the scene: payloads that fit their items, numbers that are finite (it names the item
    /// and the splat), and one scalar field at most (the densities of two fields under two transfer functions cannot be added
    /// in one sheet).
    pub fn validate(&self) -> Result<()> {
        let mut fields = 0;
        for item in &self.items {
            let (set, payload) = match item {
                Item::Radiance(set) => (set, Payload::Radiance),
                Item::Scalar(set, _) => (set, Payload::Scalar),
                Item::Hierarchy(_) => continue,
                Item::Volume(..) | Item::Bricks(..) => {
                    fields += 1;
                    continue;
                }
            };
            fields += usize::from(payload == Payload::Scalar);
            if set.payload != payload {
                return Err(Error::Argument(format!(
                    "a set of {:?} splats was added as {payload:?}",
                    set.payload
                )));
            }
            if !(set.extent > 0.0 && set.extent <= SplatSet::MAX_EXTENT) {
                let most = SplatSet::MAX_EXTENT;
                return Err(Error::Argument(format!(
                    "a splat set's extent must lie in 0 … {most}, is {}",
                    set.extent
                )));
            }
        }
        for (number, item) in self.items.iter().enumerate() {
            numbers::check_item(item).map_err(numbers::of_item(number))?;
        }
        if fields > 1 {
            return Err(Error::Argument(format!(
                "a picture takes one volume or sample set, the scene has {fields}"
            )));
        }
        if self.bounds().is_empty() {
            return Err(Error::NothingToDraw("the scene holds no splats".into()));
        }
        Ok(())
    }

    /// How far from its centre a splat of the scene can reach, in the standard deviations that widening adds; 0 without any.
    fn widest_reach(&self) -> f64 {
        let reaches = self.items.iter().map(|item| match item {
            Item::Radiance(set) => f64::from(set.extent) + STEP_BACK,
            Item::Scalar(set, _) => f64::from(set.extent),
            Item::Hierarchy(hierarchy) => f64::from(hierarchy.header().extent) + STEP_BACK,
            Item::Volume(..) | Item::Bricks(..) => 0.0,
        });
        reaches.fold(0.0, f64::max)
    }

    /// The sheets of a picture of this scene: 4/3 of a sample's spacing for volumes (a kernel of extent 2 meets at most four),
    /// half of that where they pass through the samples, half a spacing where the kernel is linear, a few pixels for surfaces, the finer of both where the scene holds both. Of a volume
    /// in bricks the spacing is that of the levels drawn, between two of them in between.
    pub fn sheets(&self, view: &View, settings: &Settings) -> Sheets {
        let bounds = self.bounds();
        let choice = self.choice(view, settings, settings.detail, usize::MAX, &bounds);
        self.sheets_of(view, settings, choice.as_ref(), &bounds)
    }

    /// The sheets where it is known which bricks are drawn, and the scene's bounds.
    pub(crate) fn sheets_of(
        &self,
        view: &View,
        settings: &Settings,
        choice: Option<&Choice>,
        bounds: &Bounds,
    ) -> Sheets {
        if settings.mode == Mode::AxisSheets {
            return self.axis_sheets(view, settings, bounds);
        }
        let [mut near, mut far] = view.distances(bounds);
        // Widened footprints, which may have stepped back, reach beyond the bounds: a flat surface seen from the front would
        // lie in sheets far thinner than itself.
        let reach = FOOTPRINT_BLUR * self.widest_reach() / view.scale;
        if view.perspective {
            (near, far) = (near * (1.0 - reach), far * (1.0 + reach));
            // Growing from 0, sheets would never get anywhere; and 32 bits tell nothing nearer apart.
            let size = bounds.diagonal();
            near = near.max(settings.near.unwrap_or(1e-3 * size).max(1e-6 * size));
        } else {
            (near, far) = (near - reach, far + reach);
        }
        let mut thickness = settings.sheet_thickness;
        let mut pixels = None;
        for item in &self.items {
            match item {
                Item::Volume(volume, kernel, _) if settings.sheet_thickness.is_none() => {
                    // Fields turn within few samples, whatever the kernel's extent; sharp ones within fewer.
                    let most: f64 = match kernel.as_tensor() {
                        // A kink at every plane of samples.
                        Some(Tensor::Linear) => 0.5,
                        Some(Tensor::CatmullRom) => 2.0 / 3.0,
                        _ if volume.coefficients.is_some() => 2.0 / 3.0,
                        _ => 4.0 / 3.0,
                    };
                    let step =
                        most.min(2.0 / 3.0 * kernel.extent) * volume.lattice.kernel_spacing();
                    // Sheets of lattices with steps of very different lengths stay thin enough to be gathered.
                    let step = step.min(MOST_GATHERED * volume.lattice.least_kernel_spacing());
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Bricks(bricks, kernel, _) if settings.sheet_thickness.is_none() => {
                    // It follows λ without steps, as the shares of the levels do.
                    let level = choice.map_or(0.0, |choice| choice.lambda);
                    let spacing = level.exp2() * bricks.header().lattice.kernel_spacing();
                    let step = (4.0f64 / 3.0).min(2.0 / 3.0 * kernel.extent) * spacing;
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Volume(..) | Item::Bricks(..) => {}
                Item::Radiance(_) | Item::Hierarchy(_) | Item::Scalar(..) => {
                    pixels = Some(settings.sheet_pixels)
                }
            }
        }
        Sheets::new(view, [near, far], thickness, pixels)
    }
}

/// Says in words why a tensor product cannot be the kernel of a lattice's samples, where these are classified `before` they are
/// interpolated or after.
fn check_tensor(tensor: Tensor, lattice: &Lattice, before: bool) -> Result<(), String> {
    let name = tensor.name();
    if lattice.arrangement != Arrangement::Cartesian {
        return Err(format!(
            "the kernel {name} takes a Cartesian lattice: it is a product along the lattice's axes"
        ));
    }
    if before {
        return Err(format!(
            "the kernel {name} is classified after interpolation, in image-aligned sheets"
        ));
    }
    Ok(())
}

/// The width of a sample's footprint at half its height, in steps between samples: that of a B-spline is 1.8, of the usual
/// Gaussian 1.65.
const SAMPLE_WIDTH: f64 = 2.0;

/// Volumes in bricks.
impl Scene {
    /// Which bricks of the scene's volume a view shows, within the settings' memory; none without such a volume. A detail
    /// that counts splats bounds the bricks by as many samples; there are no more than `most` bricks. `bounds` are the scene's.
    pub(crate) fn choice(
        &self,
        view: &View,
        settings: &Settings,
        detail: Detail,
        most: usize,
        bounds: &Bounds,
    ) -> Option<Choice> {
        let own = |item: &Item| match item {
            Item::Bricks(bricks, kernel, transfer) => {
                let room = settings.page_memory / bricks::slot_bytes(bricks);
                let (pixels, room) = match detail {
                    Detail::Pixels(pixels) => (pixels, room),
                    Detail::Splats(splats) => {
                        (Detail::PIXELS, room.min(splats / bricks::SIDE.pow(3) as u64))
                    }
                    Detail::Milliseconds(_) => (Detail::PIXELS, room),
                };
                let most = usize::try_from(room).unwrap_or(usize::MAX).min(most).max(1);
                let choose = |shown: &[u16; 256]| {
                    bricks::choice(bricks, view, kernel.extent, pixels / SAMPLE_WIDTH, shown, most)
                };
                // Where kernels reach further than ranges hold for, these tell nothing.
                if kernel.extent > bricks::REACH as f64 {
                    return Some(choose(&EVERYTHING));
                }
                let choice = choose(&first_visible(transfer, bricks.header().range));
                let sheets = self.sheets_of(view, settings, Some(&choice), bounds);
                Some(if self.mixes_afar(settings, &sheets, Some(&choice)) {
                    choose(&EVERYTHING)
                } else {
                    choice
                })
            }
            _ => None,
        };
        self.items.iter().find_map(own)
    }
}

/// What sheets mix.
impl Scene {
    /// Whether sheets are thicker than kernels reach, so that samples count of whose neighbourhood nothing shows: they change the
    /// mean of a sheet beside what shows. Sheets of the usual thickness are thicker than that along the shortest steps of uneven
    /// lattices alone, where it is not seen: there the typical step counts.
    pub(crate) fn mixes_afar(
        &self,
        settings: &Settings,
        sheets: &Sheets,
        choice: Option<&Choice>,
    ) -> bool {
        let step = |lattice: &Lattice| match settings.sheet_thickness {
            Some(_) => lattice.least_kernel_spacing(),
            None => lattice.kernel_spacing(),
        };
        let reach = |item: &Item| match item {
            Item::Volume(volume, kernel, _) => Some(kernel.extent * step(&volume.lattice)),
            Item::Bricks(bricks, kernel, _) => {
                let coarser = choice.map_or(0.0, |choice| choice.lambda).exp2();
                Some(kernel.extent * step(&bricks.header().lattice) * coarser)
            }
            _ => None,
        };
        !settings.classifies_samples()
            && self.items.iter().filter_map(reach).any(|reach| reach < sheets.step)
    }
}

/// The planes of axis-aligned sheets.
impl Scene {
    /// Axis-aligned sheets: slices of the data, each in the middle of a sheet; without a lattice, as thick as sheets of the
    /// picture would be in the middle of the scene. Distances are counted along their normal.
    fn axis_sheets(&self, view: &View, settings: &Settings, bounds: &Bounds) -> Sheets {
        let normal = self.sheet_normal(view);
        let keys = bounds.corners().map(|corner| normal.dot(view.to_view(corner)));
        let [mut near, mut far] =
            keys.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &key| {
                [low.min(key), high.max(key)]
            });
        if view.perspective {
            // Both sides of the eye count from it.
            (near, far) = (near.max(-far).max(0.0), far.max(-near));
        }
        let slices = self.lattice().map(|lattice| {
            let along = |step: DVec3| normal.dot(view.rotation * (lattice.axes * step)).abs();
            // The axis that is not in the sheets.
            let distance =
                [DVec3::X, DVec3::Y, DVec3::Z].map(along).into_iter().fold(0.0, f64::max);
            let share = match &lattice.arrangement {
                Arrangement::Cartesian => 1.0,
                Arrangement::BodyCentred => 0.5,
                Arrangement::Rectilinear(_) => (lattice.spacing() / lattice.edges()).max_element(),
            };
            (normal.dot(view.to_view(lattice.position(lattice.step_range()[0]))), distance * share)
        });
        let (start, thickness) = slices.unwrap_or_else(|| {
            let middle =
                if view.perspective { view.to_view(bounds.center()).length() } else { 1.0 };
            (near, settings.sheet_thickness.unwrap_or(settings.sheet_pixels * middle / view.scale))
        });
        let thickness = thickness.max((far - near) / Sheets::MAX as f64);
        let first = ((near - start) / thickness - 0.5).floor();
        Sheets::new(view, [start + (first + 0.5) * thickness, far], Some(thickness), None)
    }

    /// The lattice of the scene's volume.
    fn lattice(&self) -> Option<&Lattice> {
        self.items.iter().find_map(|item| match item {
            Item::Volume(volume, ..) => Some(&volume.lattice),
            Item::Bricks(bricks, ..) => Some(&bricks.header().lattice),
            _ => None,
        })
    }

    /// The normal of axis-aligned sheets in view space, away from the eye: of the planes of two axes of the data (of the
    /// world, without a lattice) that face the view most.
    pub(crate) fn sheet_normal(&self, view: &View) -> DVec3 {
        let axes = self.lattice().map_or(DMat3::IDENTITY, |lattice| lattice.axes);
        let normals = (view.rotation * axes).inverse().transpose();
        let normals = [normals.x_axis, normals.y_axis, normals.z_axis].map(DVec3::normalize);
        let first = if normals[1].z.abs() > normals[0].z.abs() { 1 } else { 0 };
        let nearest = if normals[2].z.abs() > normals[first].z.abs() { 2 } else { first };
        normals[nearest] * normals[nearest].z.signum()
    }
}

impl Item {
    /// Checks that this can be drawn by itself, as [`Scene::validate`] does for all items.
    ///
    /// # Errors
    /// [`Error::Argument`] for numbers that are none, or beyond what 32 bits hold.
    pub fn validate(&self) -> Result<()> {
        numbers::check_item(self)
    }

    /// The box around the item, footprints included.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Radiance(set) | Self::Scalar(set, _) => set.bounds(),
            Self::Hierarchy(hierarchy) => hierarchy.bounds(),
            Self::Volume(volume, kernel, _) => reached(&volume.lattice, kernel),
            // What coarser levels reach beyond it lies outside of the field's box.
            Self::Bricks(bricks, kernel, _) => reached(&bricks.header().lattice, kernel),
        }
    }
}

/// The box of what the kernels of a lattice reach.
fn reached(lattice: &Lattice, kernel: &Kernel) -> Bounds {
    let axes = lattice.axes * DMat3::from_diagonal(lattice.largest_unit());
    let reach = kernel.extent
        * DVec3::new(axes.row(0).length(), axes.row(1).length(), axes.row(2).length());
    let [low, high] = lattice.bounds();
    Bounds { min: low - reach, max: high + reach }
}

/// What is composited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Image-aligned sheets (Mueller & Crawfis 1998): sheets parallel to the picture cut every kernel into sections.
    #[default]
    Sheets,
    /// Axis-aligned sheets (Westover 1990): whole kernels are added in the slice of the data that their centre lies in, of
    /// the data's axis nearest to the view. Samples are classified before they are added.
    AxisSheets,
    /// Every splat on its own (Westover 1989), whole, in the order of the distances of their centres. Samples are
    /// classified before.
    Splats(Order),
}

/// The order in which single splats are composited; the picture is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Order {
    #[default]
    FrontToBack,
    BackToFront,
}

/// When a field's values become colour and opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Classification {
    /// Everywhere along the ray inside a sheet: the values at its two faces and its mean make a parabola, and the transfer
    /// function is integrated over it. Thin shells keep their look in thick sheets.
    #[default]
    PreIntegrated,
    /// Once per sheet, its mean (Mueller, Möller & Crawfis 1999).
    Post,
    /// Once per sample, before interpolation (Westover 1990). Blurs edges; for comparison.
    Pre,
}

/// What a ray makes of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Optics {
    /// Emission and absorption (Max 1995).
    #[default]
    EmissionAbsorption,
    /// The colour and opacity of the largest value on the ray.
    Maximum,
    /// The light that the field absorbs, in white: opacity alone, without light or colour.
    XRay,
}

/// A part of space that a scene is cut to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip {
    pub shape: ClipShape,
    /// Keeps what is inside the shape; else what is outside.
    pub inside: bool,
}

/// The shape of a [`Clip`], in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClipShape {
    /// The points x with normal·x ≤ offset are inside.
    HalfSpace {
        normal: DVec3,
        offset: f64,
    },
    Box(Bounds),
}

/// How the gradient across the picture is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradient {
    /// Derivative of the kernels.
    #[default]
    Analytic,
    /// Differences of neighbouring pixels of a sheet (Mueller, Möller & Crawfis 1999, and the GPU sheet buffers after it).
    Central,
}

/// How a sheet of a lattice's field is filled. The pictures agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Evaluate {
    /// Gathers what can be gathered, and scatters the rest.
    #[default]
    Auto,
    /// Each pixel adds up the kernels that reach its ray. Takes one volume, of the GPU engine one on a Cartesian lattice with a
    /// Gaussian kernel, and whatever surfaces are in the same scene; other scenes are an error. It is the faster way.
    Gather,
    /// Each splat is added to the pixels that it covers.
    Scatter,
}

/// The settings of a picture.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub mode: Mode,
    pub classification: Classification,
    pub optics: Optics,
    /// All of them cut, at most [`Settings::MAX_CLIPS`].
    pub clips: Vec<Clip>,
    pub gradient: Gradient,
    /// How a sheet of a lattice's field is filled.
    pub evaluate: Evaluate,
    /// Light on volumes, instead of the transfer function's own; `Some(None)` for none.
    pub volume_shade: Option<Option<Shade>>,
    /// Light on splats with normals; `None` draws their colours as they are.
    pub surface_shade: Option<Shade>,
    /// Largest thickness of a sheet in world units; chosen from the scene where `None`.
    pub sheet_thickness: Option<f64>,
    /// Largest thickness of a sheet in pixels, where the scene holds explicit splats.
    pub sheet_pixels: f64,
    /// Whether what lies behind opaque parts is left out. The picture is the same but for what less than
    /// 0.0005 of the light shows; off, a frame's cost can be compared.
    pub occlusion: bool,
    /// How fine hierarchies and volumes in bricks are drawn. A sample of the latter counts as two steps wide.
    pub detail: Detail,
    /// Whether nodes of hierarchies that face away from the eye are left out: a saving where the front hides them, a loss
    /// where it does not. `None`: where the source was solid, is seen from outside its bounds, and nothing is cut away.
    pub cull_backfaces: Option<bool>,
    /// GPU memory that each hierarchy's pages, or a volume's bricks, may take, in bytes; without what frames make of bricks.
    pub page_memory: u64,
    /// Perspective views show nothing nearer than this (world units), nor than a millionth of the scene; a thousandth of it where
    /// `None`.
    pub near: Option<f64>,
}

impl Settings {
    /// The most clips of one picture.
    pub const MAX_CLIPS: usize = 8;
    /// Pixels of the largest picture: each takes 20 bytes of memory.
    pub const MAX_PIXELS: u64 = 1 << 29;

    /// The defaults for a picture of `size` pixels (width, height).
    pub fn new(size: [u32; 2]) -> Self {
        Self {
            size,
            mode: Mode::default(),
            classification: Classification::default(),
            optics: Optics::default(),
            clips: Vec::new(),
            gradient: Gradient::default(),
            evaluate: Evaluate::default(),
            volume_shade: None,
            surface_shade: Some(Shade { ambient: 0.2, diffuse: 0.75, specular: 0.15, power: 24.0 }),
            sheet_thickness: None,
            sheet_pixels: 8.0,
            occlusion: true,
            detail: Detail::default(),
            cull_backfaces: None,
            page_memory: 1 << 30,
            near: None,
        }
    }

    /// Whether samples are classified before they are added: asked for, or because whole splats are composited.
    pub fn classifies_samples(&self) -> bool {
        self.mode != Mode::Sheets || self.classification == Classification::Pre
    }

    /// Whether what is nearer may hide what is farther: not where all values count alike, or the farthest comes first.
    pub fn hides(&self) -> bool {
        self.optics != Optics::Maximum && self.mode != Mode::Splats(Order::BackToFront)
    }

    /// Whether nodes that face away are left out of a hierarchy that bounds a solid, or does not, within some bounds.
    pub(crate) fn culls(&self, closed: bool, bounds: &Bounds, view: &View) -> bool {
        let is_outside =
            || !view.perspective || view.distances(bounds)[0] > self.near.unwrap_or(0.0);
        self.cull_backfaces.unwrap_or_else(|| closed && self.clips.is_empty() && is_outside())
    }

    /// The light on a volume that `transfer` shows.
    pub fn shade_of(&self, transfer: &TransferFunction) -> Option<Shade> {
        self.volume_shade.unwrap_or(transfer.shade)
    }
}
