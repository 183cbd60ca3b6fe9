//! The fields of a picture: what each adds to the sheets of a ray.

use super::{
    Frame,
    cells::Solids,
    classify::Classifier,
    clip,
    composite::{Added, Medium, Step},
    face::Face,
    field::{ClippedLayer, Field, Layer},
    gather,
    kernel::{Kernel, Load},
    labels::LabelMap,
    product::Product,
    ray::Ray,
    sheet::Mean,
};
use crate::{
    cells::Place,
    math::{self, Sheets, View},
    scene::{Classification, Evaluate, Gradient, Item, MOST_GATHERED, Optics, Settings},
    volume::{Lattice, Shade},
};
use glam::DVec3;

/// The values at a pixel's faces in the pixels to the left, right, above and below.
pub(super) type Around = [Vec<Option<f64>>; 4];

/// A field in a picture that is being drawn, classified after interpolation.
pub(super) struct Drawn<'a> {
    pub field: Field<'a>,
    /// Its samples, except those of tensor products and cells.
    pub kernels: Vec<Kernel<'a>>,
    /// The same field, if its kernels are tensor products.
    product: Option<Product<'a>>,
    /// The same field, if its values are labels.
    labels: Option<LabelMap<'a>>,
    /// The same field, if it is that of cells.
    solids: Option<Solids>,
    /// Whether gradients are known in the middles of sheets: those of gathered fields.
    has_middles: bool,
    /// The minimum sum of kernels for which a value exists.
    pub least_sum: f64,
}

/// A ray through a field.
pub(super) struct Through<'r> {
    pub ray: &'r Ray,
    /// The samples that the ray may meet.
    pub kernels: &'r [&'r Kernel<'r>],
    /// The values beside the ray, if gradients are their differences.
    pub around: Option<Around>,
    /// The parts of the ray that the clips leave.
    pub allowed: &'r [[f64; 2]],
}

/// Whether sheets are so thin that the field in one is known from its faces and its middle.
fn is_thin(sheets: &Sheets, lattice: &Lattice) -> bool {
    sheets.step <= MOST_GATHERED * lattice.least_kernel_spacing() * (1.0 + 1e-9)
}

/// Splits what a field adds evenly to a sheet at a distance.
fn split((medium, steps): Added, place: f64) -> [Option<Added>; 2] {
    let mut parts = [Vec::new(), Vec::new()];
    for Step { depth, span: [from, to] } in steps {
        let middle = place.clamp(from, to);
        for (part, span) in parts.iter_mut().zip([[from, middle], [middle, to]]) {
            part.push(Step { depth: depth * (span[1] - span[0]) / (to - from), span });
        }
    }
    parts.map(|steps| {
        let depth = steps.iter().map(|step| step.depth).sum();
        Some((Medium { depth, ..medium }, steps))
    })
}

impl<'a> Drawn<'a> {
    /// Returns the field of an item; `None` if it has none.
    pub fn new(item: &'a Item, view: &View, settings: &Settings, sheets: &Sheets) -> Option<Self> {
        let transfer = item.transfer()?;
        let is_dark = settings.optics == Optics::XRay;
        let lattice = item.lattice();
        let field = Field {
            classifier: Classifier::new(transfer),
            lattice,
            shade: item.light(settings).filter(|_| !is_dark),
            surfaces: if is_dark { &[] } else { &transfer.isosurfaces },
            inside: settings.classification == Classification::PreIntegrated
                && !item.is_label_map(),
        };
        let shows_all = settings.optics == Optics::Maximum;
        let product = match item {
            Item::Volume(volume, kernel, _) => Product::new(volume, kernel, view),
            _ => None,
        };
        let labels = match item {
            Item::Volume(volume, ..) => LabelMap::new(volume, view),
            _ => None,
        };
        let solids = match item {
            Item::Cells(cells, _) => Some(Solids::new(cells, view, &field, shows_all)),
            _ => None,
        };
        let has_middles = settings.evaluate != Evaluate::Scatter
            && settings.gradient == Gradient::Analytic
            && lattice.is_some_and(|lattice| is_thin(sheets, lattice));
        let least_sum = item
            .kernel()
            .map_or_else(|| math::Kernel::default().least_sum(), math::Kernel::least_sum);
        let kernels = gather::samples(item, view);
        Some(Self { field, kernels, product, labels, solids, has_middles, least_sum })
    }

    /// Sums the samples at distances along a ray, in ascending order: the faces of its sheets, or
    /// their middles.
    pub fn faces(&self, ray: &Ray, kernels: &[&Kernel], planes: &[f64]) -> Vec<Face> {
        if let Some(product) = &self.product {
            return planes.iter().map(|&plane| product.face(ray, plane)).collect();
        }
        let mut faces = vec![Face::default(); planes.len()];
        for kernel in kernels {
            let Load::Sample(sample) = &kernel.load else { continue };
            let Some(crossing) = kernel.cross(ray) else { continue };
            let [from, to] = crossing.span();
            let first = planes.partition_point(|&plane| plane < from);
            let past = planes.partition_point(|&plane| plane <= to);
            for (face, &plane) in faces.iter_mut().zip(planes).take(past).skip(first) {
                face.add(sample, kernel.center, &crossing, ray, plane);
            }
        }
        faces
    }

    /// Sums the samples in the middles of a ray's sheets, if their gradients count there.
    fn middles(&self, frame: &Frame, ray: &Ray, kernels: &[&Kernel]) -> Vec<Face> {
        if !self.has_middles || !self.field.needs_gradients() {
            return Vec::new();
        }
        let middle = |sheet: usize| {
            let [from, to] = frame.span(sheet);
            0.5 * (from + to)
        };
        let places: Vec<f64> = (0..frame.count()).map(middle).collect();
        self.faces(ray, kernels, &places)
    }

    /// Sums the samples over the sheets of a ray.
    fn means(&self, frame: &Frame, ray: &Ray, kernels: &[&Kernel]) -> Vec<Mean> {
        let mut means = vec![Mean::default(); frame.count()];
        for kernel in kernels {
            let Load::Sample(sample) = &kernel.load else { continue };
            let Some(crossing) = kernel.cross(ray) else { continue };
            for k in frame.sheets_between(crossing.span()) {
                means[k].add(sample, kernel.center, &crossing, ray, frame.span(k));
            }
        }
        means
    }

    /// Returns the gradients at the faces of a ray's sheets.
    fn gradients(&self, frame: &Frame, on: &Through, faces: &[Face]) -> Vec<Option<DVec3>> {
        let Some(around) = &on.around else {
            return faces.iter().map(|face| face.gradient(self.least_sum)).collect();
        };
        let places = faces.iter().zip(&frame.planes).enumerate();
        places
            .map(|(i, (face, &plane))| {
                let beside = around.each_ref().map(|values| values[i]);
                face.central_gradient(self.least_sum, on.ray, plane, beside)
            })
            .collect()
    }

    /// Returns the field in each sheet of a ray.
    fn layers(&self, frame: &Frame, on: &Through) -> Vec<Option<ClippedLayer>> {
        if let Some(solids) = &self.solids {
            return solids.layers(frame, on.ray, on.allowed);
        }
        let Through { ray, kernels, allowed, .. } = *on;
        let depth =
            self.field.lattice.map(|lattice| Shade::BEHIND_CLIPS * lattice.least_kernel_spacing());
        let clipped = |end: f64| {
            let clips = allowed.iter().map(|[from, _]| *from).filter(|from| *from < end);
            let last = clips.reduce(f64::max).filter(|last| last.is_finite());
            last.zip(depth).map(|(clip, depth)| [clip, depth])
        };
        if let (Some(labels), Some(lattice)) = (&self.labels, self.field.lattice) {
            let held = clip::intersection(allowed, clip::sample_box(ray, &frame.view, lattice));
            let layer = |span: [f64; 2]| {
                let pieces = clip::intersection(&held, Some(span));
                let layer = labels.layer(ray, span, &pieces)?;
                Some((Layer { clipped: clipped(span[1]), ..layer }, pieces))
            };
            return (0..frame.count()).map(|k| layer(frame.span(k))).collect();
        }
        let means = self.means(frame, ray, kernels);
        let faces = self.faces(ray, kernels, &frame.planes);
        let middles = self.middles(frame, ray, kernels);
        let gradients = self.gradients(frame, on, &faces);
        let held = match self.field.lattice {
            Some(lattice) => {
                clip::intersection(allowed, clip::sample_box(ray, &frame.view, lattice))
            }
            None => allowed.to_vec(),
        };
        let layer = |k: usize| {
            let [from, to] = frame.span(k);
            let pieces = clip::intersection(&held, Some([from, to]));
            let mean = match &self.product {
                Some(_) if pieces.is_empty() => return None,
                Some(product) => product.mean(ray, [from, to]),
                None => means[k],
            };
            let is_full = self.field.lattice.is_some();
            let layer = Layer {
                span: [from, to],
                mean: mean.value(self.least_sum, to - from)?,
                faces: [&faces[k], &faces[k + 1]].map(|face| face.value(self.least_sum)),
                gradients: [gradients[k], gradients[k + 1]],
                middle: middles.get(k).and_then(|face| face.gradient(self.least_sum)),
                filling: if is_full { 1.0 } else { (mean.weight / (to - from)).min(1.0) },
                clipped: clipped(to),
            };
            Some((layer, pieces))
        };
        (0..frame.count()).map(layer).collect()
    }

    /// Returns what the field adds to each sheet of a ray, before the facets of the sheet and
    /// behind them. `places` are the distances of the facets.
    pub fn media(
        &self,
        frame: &Frame,
        on: &Through,
        places: &[Option<f64>],
    ) -> Vec<[Option<Added>; 2]> {
        let lit = (on.ray, frame.lamps.as_ref());
        let shine = |(layer, pieces): &ClippedLayer, place: f64| {
            [[f64::NEG_INFINITY, place], [place, f64::INFINITY]].map(|part| {
                let pieces = clip::intersection(pieces, Some(part));
                (!pieces.is_empty()).then(|| layer.shine(&self.field, lit, &pieces))
            })
        };
        let places = places.iter().map(|place| place.unwrap_or(f64::INFINITY));
        let mut media: Vec<[Option<Added>; 2]> = match &self.solids {
            Some(solids) if solids.place() == Place::Cells => {
                let whole = solids.media(frame, &self.field, on.ray, on.allowed);
                let halves = |(added, place): (Option<Added>, f64)| {
                    added.map_or([None, None], |added| split(added, place))
                };
                whole.into_iter().zip(places).map(halves).collect()
            }
            _ => {
                let layers = self.layers(frame, on).into_iter().zip(places);
                let halves = |(layer, place): (Option<ClippedLayer>, f64)| {
                    layer.map_or([None, None], |layer| shine(&layer, place))
                };
                layers.map(halves).collect()
            }
        };
        if frame.optics == Optics::XRay {
            let all = media.iter_mut().flatten().flatten();
            all.for_each(|(medium, _)| medium.color = DVec3::ONE);
        }
        media
    }

    /// Returns the largest value on a ray.
    pub fn largest(&self, frame: &Frame, on: &Through) -> Option<f64> {
        match &self.solids {
            Some(solids) if solids.place() == Place::Cells => {
                solids.largest(frame, on.ray, on.allowed)
            }
            _ => {
                let layers = self.layers(frame, on).into_iter().flatten();
                let largest = |(layer, pieces): ClippedLayer| layer.largest(&self.field, &pieces);
                layers.filter_map(largest).reduce(f64::max)
            }
        }
    }
}
