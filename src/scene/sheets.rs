//! The sheets of a picture: how thick they are, and along which axis they lie.

use super::{Classification, Item, Mode, Scene, Settings};
use crate::{
    bricks::Choice,
    cells::Place,
    facet::FacetSet,
    gaussians::EXTENT,
    math::{Bounds, Kernel, Sheets, Tensor, View, hull::percentiles},
    splat::{FOOTPRINT_BLUR, STEP_BACK, TRAINED_BLUR},
    volume::{Arrangement, Lattice, Volume},
};
use glam::{DMat3, DVec3, Vec3};

/// Maximum thickness of sheets in which a lattice is gathered, in smallest sample spacings. In
/// thicker sheets a parabola misses details of the field.
pub(crate) const MOST_GATHERED: f64 = 2.2;

/// How far away, in sizes of a scene, a few of its parts may be so that the sheets begin where the
/// others need it.
const MOST_AFAR: f64 = 1e5;

/// Thickness of sheets of label maps, in sample spacings: a sheet has the label of its middle.
const LABEL_SHEETS: f64 = 0.5;

/// Thickness of sheets of linear fields, in sample spacings. Their values are cheap, and a line
/// between two samples bends less than other kernels. Half of that if only means are classified.
const LINEAR_SHEETS: f64 = 2.0;

/// Thickness of sheets of tetrahedra, in typical edges: with values of points, and with values of
/// tetrahedra, which do not mix in a sheet.
const CELL_SHEETS: [f64; 2] = [0.5, 0.2];

/// The thinnest sheets of tetrahedra, as a share of the depth of the scene.
const LEAST_CELL_SHEET: f64 = 1e-3;

/// The thickness of the sheets of trained Gaussians alone, as a share of their distance, and of the
/// depth of the scene. Within a sheet, their order is not known.
const TRAINED_SHEETS: f64 = 1.0 / 512.0;

/// How far the pixel that a facet fills in part reaches beyond it, in the same unit as splats.
const FACET_REACH: f64 = 1.5 / FOOTPRINT_BLUR;

/// Returns the largest thickness of the sheets of a volume.
fn of_volume(volume: &Volume, kernel: &Kernel, classification: Classification) -> f64 {
    // A field can bend within a few samples, whatever the kernel's extent; a sharp field within
    // fewer.
    let most: f64 = match kernel.as_tensor() {
        // A label ends halfway between two samples.
        _ if volume.is_label_map() => LABEL_SHEETS,
        Some(Tensor::Linear) => match classification {
            Classification::Post => 0.5 * LINEAR_SHEETS,
            _ => LINEAR_SHEETS,
        },
        _ if volume.coefficients.is_some() => 2.0 / 3.0,
        Some(_) => 4.0 / 3.0,
        None => (4.0f64 / 3.0).min(2.0 / 3.0 * kernel.extent),
    };
    let step = most * volume.lattice.kernel_spacing();
    // If the lattice's steps differ much in length, sheets stay thin enough to be gathered.
    step.min(MOST_GATHERED * volume.lattice.least_kernel_spacing())
}

impl Scene {
    /// Returns how far a splat of the scene can reach from its centre, in the standard deviations
    /// that widening adds. Returns 0 if there are no explicit splats.
    fn widest_reach(&self) -> f64 {
        let reaches = self.items.iter().map(|item| match item {
            Item::Radiance(set) => f64::from(set.extent) + STEP_BACK,
            Item::Scalar(set, _) => f64::from(set.extent),
            // A rod also has a radius in pixels.
            Item::Facets(set) => FACET_REACH + f64::from(set.rods.unwrap_or(0.0)) / FOOTPRINT_BLUR,
            Item::Solid(_) => FACET_REACH,
            Item::Gaussians(_) => f64::from(EXTENT) * TRAINED_BLUR / FOOTPRINT_BLUR,
            Item::Hierarchy(hierarchy) => f64::from(hierarchy.header().extent) + STEP_BACK,
            Item::Volume(..) | Item::Bricks(..) | Item::Cells(..) => 0.0,
        });
        reaches.fold(0.0, f64::max)
    }

    /// Returns a hundred times the diagonal of the box around nine tenths of the splats, and of
    /// everything else. This is the size of the scene, if few splats far away make it larger than
    /// that. The parts that lie together must not be nearer than the first sheet.
    fn usual_size(&self) -> f64 {
        const MOST: usize = 1 << 12;
        const FEWEST: usize = 20;
        const SHARE: f64 = 0.05;
        let usual = |places: Vec<Vec3>, origin: DVec3| {
            let [low, high] = percentiles(&places, SHARE);
            (places.len() >= FEWEST).then(|| Bounds::between(origin, [low, high]))
        };
        let step = |count: usize| count.div_ceil(MOST).max(1);
        let of_facets = |set: &FacetSet| {
            let some = set.facets.iter().step_by(step(set.facets.len()));
            usual(some.map(|facet| facet.corners[0].into()).collect(), set.origin)
        };
        let of_item = |(number, item): (usize, &Item)| {
            let bounds = match item {
                Item::Radiance(set) if !set.splats.is_empty() => {
                    let some = set.splats.iter().step_by(step(set.splats.len()));
                    usual(some.map(|splat| splat.center.into()).collect(), set.origin)
                }
                Item::Facets(set) if !set.facets.is_empty() => of_facets(set),
                Item::Solid(solid) => of_facets(solid.boundary()),
                Item::Gaussians(set) if !set.is_empty() => {
                    let some = set.centers.iter().step_by(step(set.len()));
                    usual(some.copied().collect(), set.origin)
                }
                _ => None,
            };
            let bounds = bounds.unwrap_or_else(|| item.bounds());
            self.view_pose(number).bounds(&bounds)
        };
        let all = self.items.iter().enumerate().map(of_item).fold(Bounds::EMPTY, Bounds::union);
        100.0 * all.diagonal()
    }

    /// Returns the sheets of a picture of this scene. Unless [`Settings::sheet_thickness`] is set,
    /// their thickness follows from the items:
    ///
    /// - Volumes: 4/3 of the sample spacing, and at most 2/3 of the extent of a radial kernel. A
    ///   kernel of extent 2 meets at most four sheets. Sheets are half as thick if the volume is
    ///   sharp. If the kernel is linear they are two spacings thick, and one if their means are
    ///   classified ([`Classification::Post`]).
    /// - Cells: half a typical edge, and a fifth if each has one value.
    /// - Surfaces: a few pixels.
    /// - Trained Gaussians alone: at most 1/512 of their distance, and of the depth of the scene.
    ///   They are counted by the depths of their centres along the view's axis, and so are these
    ///   sheets.
    /// - Several of these: the finest of them.
    /// - Volumes in bricks: as for volumes, with the spacing of the drawn levels. Between two
    ///   levels it is interpolated.
    pub fn sheets(&self, view: &View, settings: &Settings) -> Sheets {
        let bounds = self.bounds();
        let choice = |number: usize| {
            let scene = self.with_one_field(number);
            scene.choice(view, settings, settings.detail, usize::MAX, &bounds)
        };
        let choices: Vec<Choice> = self.fields().into_iter().filter_map(choice).collect();
        self.sheets_of(view, settings, &choices, &bounds)
    }

    /// Returns the thickness of the sheets of the finest volume in memory, about as
    /// [`sheets`](Self::sheets) chooses it: what coarser pictures of moving views begin with.
    /// `None` beside a label map, which no thicker sheets can show.
    pub fn finest_sheet(&self) -> Option<f64> {
        if self.items.iter().any(Item::is_label_map) {
            return None;
        }
        let thicknesses = self.items.iter().filter_map(|item| match item {
            Item::Volume(volume, ..) => Some(4.0 / 3.0 * volume.lattice.kernel_spacing()),
            _ => None,
        });
        thicknesses.reduce(f64::min)
    }

    /// Returns the sheets for the known choices of bricks, one for each volume in bricks, and the
    /// scene's known bounds.
    pub(crate) fn sheets_of(
        &self,
        view: &View,
        settings: &Settings,
        choices: &[Choice],
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
            let mut size = bounds.diagonal();
            // Parts still farther away leave no precision for the others.
            if near < 1e-3 * size {
                let usual = self.usual_size();
                size = if size < MOST_AFAR * usual { size.min(usual) } else { size };
            }
            near = near.max(settings.near.unwrap_or(1e-3 * size).max(1e-6 * size));
        } else {
            (near, far) = (near - reach, far + reach);
        }
        let mut thickness = settings.sheet_thickness;
        let (mut pixels, mut choices) = (None, choices.iter());
        for item in &self.items {
            match item {
                Item::Volume(volume, kernel, _) if settings.sheet_thickness.is_none() => {
                    let step = of_volume(volume, kernel, settings.classification);
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Bricks(bricks, kernel, _) if settings.sheet_thickness.is_none() => {
                    // The thickness follows λ continuously, as the weights of the levels do.
                    let level = choices.next().map_or(0.0, |choice| choice.lambda);
                    let spacing = level.exp2() * bricks.header().lattice.kernel_spacing();
                    let step = (4.0f64 / 3.0).min(2.0 / 3.0 * kernel.extent) * spacing;
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Cells(cells, _) if settings.sheet_thickness.is_none() => {
                    let step =
                        CELL_SHEETS[usize::from(cells.place() == Place::Cells)] * cells.spacing();
                    // Thinner sheets would not be seen.
                    let middle = 0.5 * (near + far);
                    let pixel = if view.perspective { middle } else { 1.0 } / view.scale;
                    let step = step.max(LEAST_CELL_SHEET * (far - near)).max(0.5 * pixel);
                    thickness = Some(thickness.map_or(step, |t: f64| t.min(step)));
                }
                Item::Volume(..) | Item::Bricks(..) | Item::Cells(..) => {}
                Item::Radiance(_)
                | Item::Facets(_)
                | Item::Solid(_)
                | Item::Gaussians(_)
                | Item::Hierarchy(_)
                | Item::Scalar(..) => {
                    pixels = Some(settings.sheet_pixels);
                }
            }
        }
        if self.is_by_centers(settings) {
            let most = TRAINED_SHEETS * (far - near);
            thickness = Some(thickness.map_or(most, |thickness: f64| thickness.min(most)));
            if view.perspective {
                // At the picture's edge, depths are smaller than distances.
                near *= view.smallest_cosine();
                pixels = pixels.map(|pixels: f64| pixels.min(TRAINED_SHEETS * view.scale));
            }
        }
        Sheets::new(view, [near, far], thickness, pixels)
    }
}

impl Scene {
    /// Whether sheets are thicker than the kernels of an item reach ([`Item::mixes_afar`]).
    pub(crate) fn mixes_afar(
        &self,
        settings: &Settings,
        sheets: &Sheets,
        choice: Option<&Choice>,
    ) -> bool {
        self.items.iter().any(|item| item.mixes_afar(settings, sheets, choice))
    }
}

impl Item {
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
        let reach = match self {
            Self::Volume(volume, kernel, _) => Some(kernel.extent * step(&volume.lattice)),
            Self::Bricks(bricks, kernel, _) => {
                let coarser = choice.map_or(0.0, |choice| choice.lambda).exp2();
                Some(kernel.extent * step(&bricks.header().lattice) * coarser)
            }
            _ => None,
        };
        !settings.classifies_samples() && reach.is_some_and(|reach| reach < sheets.step)
    }
}

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
            (normal.dot(view.to_view(lattice.position(lattice.step_range().min))), distance * share)
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
