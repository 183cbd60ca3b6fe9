//! Volumes whose colours follow one array, and whose opacity follows another.

use super::{Appearance, Name};
use crate::{
    Result,
    color::ColorMap,
    memory,
    parallel::prelude::*,
    scene::Optics,
    volume::{TransferFunction, Volume},
};
use std::sync::Arc;

/// The largest opacity of a colour over a step. Colours that are all opaque would be a picture
/// without opacities.
const MOST: f64 = 254.0;

impl Appearance {
    /// Gives a volume the colours of its values, as opaque as the values of
    /// [`Volume::opacities`] make it: they become opacity as those of any volume do. Returns the
    /// transfer function of the colours; `None` if the volume has colours of its own.
    ///
    /// # Errors
    /// Those of [`of_volume`](Self::of_volume), for both arrays;
    /// [`Error::Input`](crate::Error::Input) for an array of another size, and beside options that
    /// show values alone.
    pub(super) fn color_by_two(
        &self,
        name: &Name,
        volume: &mut Volume,
        opacities: &Volume,
    ) -> Result<Option<TransferFunction>> {
        let unfit = |message: &str, hint: &str| name.unfit("content", message, hint);
        if !self.isosurfaces.is_empty() || self.optics != Optics::EmissionAbsorption {
            let message = "the opacity of another array is for colours in light";
            return Err(unfit(message, "leave out isosurfaces and other optics, or that array"));
        }
        if opacities.lattice.dims != volume.lattice.dims {
            let [a, b] =
                [opacities, volume].map(|volume| volume.lattice.dims.map(|n| n.to_string()));
            let message = format!(
                "the array of opacities has {} samples, and the values {}",
                a.join(" × "),
                b.join(" × ")
            );
            return Err(unfit(&message, "both need the same size"));
        }
        let plain = Self { opacity_unit: self.opacity_unit, ..Self::default() };
        let density = plain.of_volume(&format!("{}, opacity", name.text), opacities)?;
        let step = volume.lattice.kernel_spacing();
        let opacity = |at: usize| {
            let depth = density.extinction(opacities.value(at)) * step;
            (255.0 * -(-depth).exp_m1()).round().min(MOST) as u8
        };
        memory::room("the colours of a volume", 4 * volume.len() as u64)?;
        if let Some(colors) = &volume.colors {
            let with = |(at, &[r, g, b, _]): (usize, &[u8; 4])| [r, g, b, opacity(at)];
            let colors: Vec<[u8; 4]> = colors.par_iter().enumerate().map(with).collect();
            volume.colors = Some(Arc::from(colors));
            return Ok(None);
        }
        let mut even = self.clone();
        if even.transfer.is_none() {
            let coloring = &mut even.coloring;
            coloring.map.get_or_insert(ColorMap::VIRIDIS);
            coloring.range.get_or_insert(volume.range);
        }
        let transfer = even.of_volume(&name.text, volume)?;
        let byte = |part: f64| (255.0 * part.clamp(0.0, 1.0)).round() as u8;
        let color = |at: usize| {
            let [r, g, b] = transfer.color(volume.value(at)).map(byte);
            [r, g, b, opacity(at)]
        };
        let colors: Vec<[u8; 4]> = (0..volume.len()).into_par_iter().map(color).collect();
        volume.colors = Some(Arc::from(colors));
        Ok(Some(transfer))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::{Lattice, Samples};
    use glam::DVec3;

    const SIDE: usize = 24;

    /// A volume of values at places from −1 to 1.
    fn volume(value: impl Fn(DVec3) -> f32) -> Volume {
        let lattice = Lattice::with_spacing([SIDE; 3], DVec3::splat(0.5));
        let place = |at: usize| {
            let index = [at % SIDE, at / SIDE % SIDE, at / SIDE / SIDE];
            DVec3::from_array(index.map(|n| n as f64 / (SIDE - 1) as f64 * 2.0 - 1.0))
        };
        let values = (0..SIDE.pow(3)).map(|at| value(place(at))).collect();
        Volume::new(lattice, Samples::F32(values)).unwrap()
    }

    #[test]
    fn one_array_gives_colours_and_another_opacity() {
        let name = Name { text: "a".into(), is_file: true };
        let ball = volume(|at| if at.length() < 0.6 { 100.0 } else { 0.0 });
        let mut colored = volume(|at| at.x as f32);
        let transfer = Appearance::default().color_by_two(&name, &mut colored, &ball).unwrap();
        let colors = colored.colors.as_deref().unwrap();
        let [inside, outside] = [[SIDE / 2; 3], [1; 3]].map(|[i, j, k]| i + SIDE * (j + SIDE * k));
        assert!(colors[inside][3] > 100 && colors[outside][3] == 0, "{:?}", colors[inside]);
        let transfer = transfer.unwrap();
        let byte = |part: f64| (255.0 * part).round() as u8;
        assert_eq!(colors[inside][..3], transfer.color(colored.value(inside)).map(byte));
        // The colours follow the values, also where nothing is seen of them.
        assert_ne!(colors[outside][..3], colors[inside][..3]);
        let flat = volume(|_| 3.0);
        assert!(Appearance::default().color_by_two(&name, &mut colored.clone(), &flat).is_err());
        let lattice = Lattice::with_spacing([2; 3], DVec3::ONE);
        let small = Volume::new(lattice, Samples::U8((0..8).collect())).unwrap();
        let error = Appearance::default().color_by_two(&name, &mut colored, &small).unwrap_err();
        assert!(error.to_string().contains("has 2 × 2 × 2 samples"), "{error}");
    }
}
