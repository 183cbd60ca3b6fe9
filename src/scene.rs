//! The scene (splats, hierarchies and volumes) and the settings of a picture.

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

/// Maximum thickness of sheets in which a lattice is gathered, in smallest sample spacings. In
/// thicker sheets a parabola misses details of the field.
pub(crate) const MOST_GATHERED: f64 = 2.2;

/// An item of a scene.
#[derive(Debug, Clone)]
pub enum Item {
    /// Surfels or 3D Gaussians: splats that carry their own colour and optical depth.
    Radiance(Arc<SplatSet>),
    /// A hierarchy of these splats. A picture shows a cut of it ([`Settings::detail`]).
    Hierarchy(Arc<Hierarchy>),
    /// Scattered samples: splats that carry a value, shown by a transfer function.
    Scalar(Arc<SplatSet>, TransferFunction),
    /// Samples on a lattice, each the centre of one kernel, shown by a transfer function.
    Volume(Arc<Volume>, Kernel, TransferFunction),
    /// A volume that may be larger than memory. A picture shows the bricks that it needs
    /// ([`Settings::detail`], [`Settings::page_memory`]).
    Bricks(Arc<Bricks>, Kernel, TransferFunction),
}

/// The items of a picture. All are drawn together, in the same sheets.
///
/// A volume and a mesh in one picture:
///
/// ```
/// use splatkit::{
///     math::Kernel,
///     scene::Scene,
///     surface::{Mesh, SurfelOptions},
///     volume::{TransferFunction, phantoms::Phantom},
/// };
///
/// let volume = Phantom::Ball.sample_bytes([16; 3])?;
/// let transfer = TransferFunction::automatic(&volume);
/// let scene = Scene::new()
///     .with_volume(volume, Kernel::default(), transfer)
///     .with_splats(Mesh::sphere(2).surfels(&SurfelOptions::default())?);
/// assert_eq!(scene.items.len(), 2);
/// assert!(scene.bounds().diagonal() > 3.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Default)]
pub struct Scene {
    /// The items, in any order.
    pub items: Vec<Item>,
}

impl Scene {
    /// Creates a scene without items.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds splats that carry their own colour and optical depth.
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

    /// Returns the same scene with another transfer function for its volume or sample set.
    ///
    /// # Errors
    /// [`Error::Argument`] if [`validate`](Self::validate) would refuse the function.
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

    /// Returns the scene's kernel if it is a tensor product: the function along each axis of the
    /// lattice. The GPU engine does not draw tensor products.
    pub fn tensor(&self) -> Option<Tensor> {
        self.items.iter().find_map(|item| match item {
            Item::Volume(_, kernel, _) | Item::Bricks(_, kernel, _) => kernel.as_tensor(),
            Item::Radiance(_) | Item::Hierarchy(_) | Item::Scalar(..) => None,
        })
    }

    /// Returns the box around everything that can be seen, footprints included.
    pub fn bounds(&self) -> Bounds {
        self.items.iter().fold(Bounds::EMPTY, |all, item| all.union(item.bounds()))
    }

    /// Whether the scene contains explicit splats (surfaces or scattered samples). These are
    /// widened by [`FOOTPRINT_BLUR`] and have edges.
    pub fn has_splats(&self) -> bool {
        self.items.iter().any(|item| !matches!(item, Item::Volume(..) | Item::Bricks(..)))
    }

    /// Whether any part can become opaque enough to hide what lies behind it. Surfaces can. A field
    /// can if it has isosurfaces, or if a line through its box can absorb nearly all light.
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

    /// Checks that the scene can be drawn with these settings, in addition to
    /// [`validate`](Self::validate): finite numbers, non-empty clips, and options that can be
    /// combined.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason.
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
                "there are {} clips; at most {} are allowed",
                settings.clips.len(),
                Settings::MAX_CLIPS
            ));
        }
        for clip in &settings.clips {
            match clip.shape {
                ClipShape::HalfSpace { normal, offset } => {
                    if !((1e-150..=1e150).contains(&normal.length()) && offset.is_finite()) {
                        return wrong(format!(
                            "a clip plane needs a normal of a length from 1e-150 to 1e150 and a \
                             finite offset, found {normal} and {offset}"
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
            // The transfer function may have changed since the scene was validated.
            numbers::check_transfer(item).map_err(numbers::of_item(number))?;
            match item {
                Item::Radiance(_) | Item::Hierarchy(_) if settings.optics == Optics::Maximum => {
                    return wrong(
                        "a maximum intensity picture takes a volume or samples alone, without \
                         surfaces"
                            .into(),
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
                            "a rectilinear volume takes a Gaussian kernel, unless it is classified \
                             before"
                                .into(),
                        );
                    }
                    if let Some(coefficients) = &volume.coefficients {
                        if before {
                            return wrong(
                                "a sharp volume must be classified after interpolation, in \
                                 image-aligned sheets"
                                    .into(),
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
                            "a volume in bricks must be classified after interpolation, in \
                             image-aligned sheets"
                                .into(),
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
                        "the maximum of a field needs image-aligned sheets, classified after \
                         interpolation"
                            .into(),
                    );
                }
                if !(transfer.isosurfaces.is_empty() && transfer.gradient.is_empty()) {
                    return wrong(
                        "isosurfaces and gradient opacity need image-aligned sheets, classified \
                         after interpolation"
                            .into(),
                    );
                }
            }
        }
        Ok(())
    }

    /// Checks that the engines can draw the scene: payloads that match their items, finite numbers
    /// (the error names the item and the splat), and at most one scalar field. The densities of two
    /// fields under two transfer functions cannot be added in one sheet.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason; [`Error::NothingToDraw`] for a scene without splats and
    /// samples.
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
                "a picture can show one volume or sample set; the scene has {fields}"
            )));
        }
        if self.bounds().is_empty() {
            return Err(Error::NothingToDraw("the scene contains no splats".into()));
        }
        Ok(())
    }

    /// Returns how far a splat of the scene can reach from its centre, in the standard deviations
    /// that widening adds. Returns 0 if there are no explicit splats.
    fn widest_reach(&self) -> f64 {
        let reaches = self.items.iter().map(|item| match item {
            Item::Radiance(set) => f64::from(set.extent) + STEP_BACK,
            Item::Scalar(set, _) => f64::from(set.extent),
            Item::Hierarchy(hierarchy) => f64::from(hierarchy.header().extent) + STEP_BACK,
            Item::Volume(..) | Item::Bricks(..) => 0.0,
        });
        reaches.fold(0.0, f64::max)
    }

    /// Returns the sheets of a picture of this scene. Unless [`Settings::sheet_thickness`] is set,
    /// their thickness follows from the items:
    ///
    /// - Volumes: 4/3 of the sample spacing, and at most 2/3 of the kernel's extent. A kernel of
    ///   extent 2 meets at most four sheets. Sheets are half as thick if the field passes through
    ///   the samples, and half a spacing thick if the kernel is linear.
    /// - Surfaces: a few pixels.
    /// - Both: the finer of the two.
    /// - Volumes in bricks: as for volumes, with the spacing of the drawn levels. Between two
    ///   levels it is interpolated.
    pub fn sheets(&self, view: &View, settings: &Settings) -> Sheets {
        let bounds = self.bounds();
        let choice = self.choice(view, settings, settings.detail, usize::MAX, &bounds);
        self.sheets_of(view, settings, choice.as_ref(), &bounds)
    }

    /// Returns the sheets for a known choice of bricks and the scene's known bounds.
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
        // Widened footprints, which may have stepped back, reach beyond the bounds. Without this
        // margin, a flat surface seen from the front would lie in sheets far thinner than itself.
        let reach = FOOTPRINT_BLUR * self.widest_reach() / view.scale;
        if view.perspective {
            (near, far) = (near * (1.0 - reach), far * (1.0 + reach));
            // Geometric sheets cannot start at 0, and 32 bits do not distinguish smaller distances.
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
                    // A field can bend within a few samples, whatever the kernel's extent; a sharp
                    // field within fewer.
                    let most: f64 = match kernel.as_tensor() {
                        // The field has a kink at every plane of samples.
                        Some(Tensor::Linear) => 0.5,
                        Some(Tensor::CatmullRom) => 2.0 / 3.0,
                        _ if volume.coefficients.is_some() => 2.0 / 3.0,
                        _ => 4.0 / 3.0,
                    };
                    let step =
                        most.min(2.0 / 3.0 * kernel.extent) * volume.lattice.kernel_spacing();
                    // If the lattice's steps differ much in length, sheets stay thin enough to be
                    // gathered.
                    let step = step.min(MOST_GATHERED * volume.lattice.least_kernel_spacing());
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Bricks(bricks, kernel, _) if settings.sheet_thickness.is_none() => {
                    // The thickness follows λ continuously, as the weights of the levels do.
                    let level = choice.map_or(0.0, |choice| choice.lambda);
                    let spacing = level.exp2() * bricks.header().lattice.kernel_spacing();
                    let step = (4.0f64 / 3.0).min(2.0 / 3.0 * kernel.extent) * spacing;
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Volume(..) | Item::Bricks(..) => {}
                Item::Radiance(_) | Item::Hierarchy(_) | Item::Scalar(..) => {
                    pixels = Some(settings.sheet_pixels);
                }
            }
        }
        Sheets::new(view, [near, far], thickness, pixels)
    }
}

/// Returns an error if a tensor product cannot be the kernel of a lattice's samples. `before` says
/// whether samples are classified before they are interpolated.
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

/// Width of a sample's footprint at half its height, in sample spacings. The exact width is 1.8 for
/// a B-spline and 1.65 for the usual Gaussian.
const SAMPLE_WIDTH: f64 = 2.0;

/// Volumes in bricks.
impl Scene {
    /// Returns the bricks of the scene's volume that a view shows, within the settings' memory.
    /// Returns `None` if the scene has no volume in bricks. A detail in splats also limits the
    /// bricks to that number of samples. There are at most `most` bricks. `bounds` are the scene's.
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
                // If kernels reach further than the ranges of blocks cover, the ranges cannot
                // exclude bricks.
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

/// The samples that a sheet mixes.
impl Scene {
    /// Whether sheets are thicker than kernels reach. If so, no sample may be left out: a sheet
    /// then mixes visible samples with samples whose whole neighbourhood is invisible, and these
    /// change its mean. Sheets of the default thickness exceed the reach only along the shortest
    /// steps of uneven lattices, where that cannot be seen. So the typical step is compared for
    /// them.
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

/// Axis-aligned sheets.
impl Scene {
    /// Returns axis-aligned sheets, one for each slice of the data, with the slice in the middle.
    /// Without a lattice, they are as thick as the sheets of a picture would be in the middle of
    /// the scene. Distances are measured along the sheets' normal.
    fn axis_sheets(&self, view: &View, settings: &Settings, bounds: &Bounds) -> Sheets {
        let normal = self.sheet_normal(view);
        let keys = bounds.corners().map(|corner| normal.dot(view.to_view(corner)));
        let [mut near, mut far] =
            keys.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &key| {
                [low.min(key), high.max(key)]
            });
        if view.perspective {
            // Distances are measured from the eye, on both of its sides.
            (near, far) = (near.max(-far).max(0.0), far.max(-near));
        }
        let slices = self.lattice().map(|lattice| {
            let along = |step: DVec3| normal.dot(view.rotation * (lattice.axes * step)).abs();
            // The step along the axis that does not lie in the sheets.
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

    /// Returns the lattice of the scene's volume.
    fn lattice(&self) -> Option<&Lattice> {
        self.items.iter().find_map(|item| match item {
            Item::Volume(volume, ..) => Some(&volume.lattice),
            Item::Bricks(bricks, ..) => Some(&bricks.header().lattice),
            _ => None,
        })
    }

    /// Returns the normal of axis-aligned sheets in view space, pointing away from the eye. The
    /// sheets are parallel to two axes of the data, or of the world without a lattice: those whose
    /// plane faces the view most.
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
    /// Checks that the item can be drawn by itself, as [`Scene::validate`] does for all items.
    ///
    /// # Errors
    /// [`Error::Argument`] for numbers that are not finite, or do not fit 32 bits.
    pub fn validate(&self) -> Result<()> {
        numbers::check_item(self)
    }

    /// Returns the box around the item, footprints included.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Radiance(set) | Self::Scalar(set, _) => set.bounds(),
            Self::Hierarchy(hierarchy) => hierarchy.bounds(),
            Self::Volume(volume, kernel, _) => reached(&volume.lattice, kernel),
            // Kernels of coarser levels reach further, but nothing is drawn outside the field's
            // box.
            Self::Bricks(bricks, kernel, _) => reached(&bricks.header().lattice, kernel),
        }
    }
}

/// Returns the box that the kernels of a lattice reach.
fn reached(lattice: &Lattice, kernel: &Kernel) -> Bounds {
    let axes = lattice.axes * DMat3::from_diagonal(lattice.largest_unit());
    let reach = kernel.extent
        * DVec3::new(axes.row(0).length(), axes.row(1).length(), axes.row(2).length());
    let [low, high] = lattice.bounds();
    Bounds { min: low - reach, max: high + reach }
}

/// The layers that are composited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Mode {
    /// Image-aligned sheets (Mueller & Crawfis 1998): sheets parallel to the picture cut every
    /// kernel into sections.
    #[default]
    Sheets,
    /// Axis-aligned sheets (Westover 1990): slices of the data across the data's axis nearest to
    /// the view direction. Each kernel is added whole to the slice that contains its centre.
    /// Samples are classified before they are added.
    AxisSheets,
    /// Single splats (Westover 1989): each is composited whole, in the order of the distances of
    /// their centres. Samples are classified first.
    Splats(Order),
}

/// The order in which single splats are composited. Both orders give the same picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Order {
    /// The nearest splat first.
    #[default]
    FrontToBack,
    /// The farthest splat first.
    BackToFront,
}

/// When the values of a field are mapped to colour and opacity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Classification {
    /// Everywhere along the ray inside a sheet. The values at its two faces and its mean define a
    /// parabola, over which the transfer function is integrated. Thin shells keep their look in
    /// thick sheets.
    #[default]
    PreIntegrated,
    /// Once per sheet, for its mean (Mueller, Möller & Crawfis 1999).
    Post,
    /// Once per sample, before interpolation (Westover 1990). Blurs edges; for comparison.
    Pre,
}

/// How a ray through a field becomes the colour of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Optics {
    /// Emission and absorption (Max 1995).
    #[default]
    EmissionAbsorption,
    /// The colour and opacity of the largest value on the ray.
    Maximum,
    /// The light that the field absorbs, in white: opacity only, without colour and lighting.
    XRay,
}

/// A shape that cuts the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip {
    /// The shape that bounds the part.
    pub shape: ClipShape,
    /// Whether to keep what is inside the shape (`true`) or outside it (`false`).
    pub inside: bool,
}

/// The shape of a [`Clip`], in world coordinates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ClipShape {
    /// The points x with normal·x ≤ offset are inside.
    HalfSpace {
        /// The direction out of the half-space, in world coordinates; it need not have unit length.
        normal: DVec3,
        /// The distance of its face from the world's origin, times the length of `normal`.
        offset: f64,
    },
    /// A box along the world's axes.
    Box(Bounds),
}

/// How the gradient across the picture is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradient {
    /// From the derivative of the kernels.
    #[default]
    Analytic,
    /// From differences of neighbouring pixels of a sheet (Mueller, Möller & Crawfis 1999, and the
    /// GPU sheet buffers after it).
    Central,
}

/// How the field of a lattice is evaluated in a sheet. The pictures agree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Evaluate {
    /// Gathers a volume if possible, and scatters everything else.
    #[default]
    Auto,
    /// Each pixel adds up the kernels that reach its ray, which is the faster way. The scene must
    /// have exactly one volume, and may have surfaces too. On the GPU engine, the volume needs a
    /// Cartesian lattice and a Gaussian kernel. Other scenes are an error.
    Gather,
    /// Each splat is added to the pixels that it covers.
    Scatter,
}

/// The settings of a picture.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// How splats are gathered into layers.
    pub mode: Mode,
    /// When a field's values become colour and opacity.
    pub classification: Classification,
    /// How the values along a ray become one colour.
    pub optics: Optics,
    /// Clips that cut the scene, at most [`Settings::MAX_CLIPS`].
    pub clips: Vec<Clip>,
    /// How the gradients of fields are found, for light and for `gradient` of transfer functions.
    pub gradient: Gradient,
    /// How the field of a lattice is evaluated in a sheet.
    pub evaluate: Evaluate,
    /// Lighting of volumes, instead of the transfer function's own. `Some(None)` turns it off.
    pub volume_shade: Option<Option<Shade>>,
    /// Lighting of splats with normals. `None` draws their colours unlit.
    pub surface_shade: Option<Shade>,
    /// Maximum thickness of a sheet in world units. `None` derives it from the scene.
    pub sheet_thickness: Option<f64>,
    /// Maximum thickness of a sheet in pixels, if the scene contains explicit splats.
    pub sheet_pixels: f64,
    /// Whether splats behind opaque parts are left out. The picture differs only where less than
    /// 0.0005 of the light passes. Turn it off to compare the cost of a frame.
    pub occlusion: bool,
    /// Level of detail of hierarchies and volumes in bricks. A sample of a volume counts as two
    /// sample spacings wide.
    pub detail: Detail,
    /// Whether nodes of hierarchies that face away from the eye are left out. This saves time where
    /// the front hides them, and loses parts of the picture where it does not. `None` leaves them
    /// out if the source was solid, is seen from outside its bounds, and is not clipped.
    pub cull_backfaces: Option<bool>,
    /// GPU memory, in bytes, for the pages of each hierarchy and for the bricks of a volume. The
    /// lists that frames make from bricks take more.
    pub page_memory: u64,
    /// Nearest distance that perspective views show, in world units; at least a millionth of the
    /// scene's size. `None` is a thousandth of that size.
    pub near: Option<f64>,
}

impl Settings {
    /// Maximum number of clips in a picture.
    pub const MAX_CLIPS: usize = 8;
    /// Maximum number of pixels in a picture. Each takes 20 bytes of memory.
    pub const MAX_PIXELS: u64 = 1 << 29;

    /// Returns the defaults for a picture of `size` pixels (width, height).
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

    /// Whether samples are classified before they are added: on request, or because whole splats
    /// are composited.
    pub fn classifies_samples(&self) -> bool {
        self.mode != Mode::Sheets || self.classification == Classification::Pre
    }

    /// Whether nearer parts may hide farther ones. They do not if all values on a ray count alike,
    /// nor if the farthest comes first.
    pub fn hides(&self) -> bool {
        self.optics != Optics::Maximum && self.mode != Mode::Splats(Order::BackToFront)
    }

    /// Whether nodes that face away are left out of a hierarchy with these bounds. `closed` says
    /// whether the hierarchy bounds a solid.
    pub(crate) fn culls(&self, closed: bool, bounds: &Bounds, view: &View) -> bool {
        let is_outside =
            || !view.perspective || view.distances(bounds)[0] > self.near.unwrap_or(0.0);
        self.cull_backfaces.unwrap_or_else(|| closed && self.clips.is_empty() && is_outside())
    }

    /// Returns the lighting of a volume that `transfer` shows.
    pub fn shade_of(&self, transfer: &TransferFunction) -> Option<Shade> {
        self.volume_shade.unwrap_or(transfer.shade)
    }
}
