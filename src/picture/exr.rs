//! OpenEXR files: colours in linear light, depths, and layers beside them.

use super::{Encoding, Layers, Picture, encoding::not_stored};
use crate::Result;
use exr::prelude::{
    AnyChannel, AnyChannels, FlatSamples, Image, Layer, LayerAttributes, WritableImage, f16,
};

impl Picture {
    /// Returns the bytes of an OpenEXR file of one part, with the channels R, G, B and A, and Z if
    /// the picture has depths. R, G and B are multiplied by A, in linear light with the primaries
    /// of sRGB. Z is the depth in world units, infinite where the picture has none. Layers have
    /// channels of their own: `albedo.R`, `normal.X`, `id.I` and so on.
    pub(super) fn encode_exr(&self, encoding: &Encoding, layers: &Layers) -> Result<Vec<u8>> {
        let colors: Vec<[f32; 4]> =
            self.color.iter().map(|pixel| linear(*pixel, encoding.background)).collect();
        let bits = encoding.bits();
        let mut channels = parts_of(&colors, ["R", "G", "B", "A"], bits);
        if self.depth.len() == self.color.len() {
            channels.push(AnyChannel::new("Z", FlatSamples::F32(self.depth.clone())));
        }
        if let Some(normals) = &layers.normals {
            channels.extend(parts_of(normals, ["normal.X", "normal.Y", "normal.Z"], bits));
        }
        if let Some(albedo) = &layers.albedo {
            let albedo: Vec<[f32; 4]> = albedo.iter().map(|pixel| linear(*pixel, None)).collect();
            channels.extend(parts_of(&albedo, ["albedo.R", "albedo.G", "albedo.B"], bits));
        }
        if let Some(identifiers) = &layers.identifiers {
            channels.push(AnyChannel::new("id.I", FlatSamples::U32(identifiers.clone())));
        }
        let mut attributes = LayerAttributes {
            software_name: Some("splatkit".into()),
            ..LayerAttributes::default()
        };
        attributes.horizontal_density = encoding.dpi.map(|dpi| dpi as f32);
        let layer = Layer::new(
            (self.width as usize, self.height as usize),
            attributes,
            exr::image::Encoding::SMALL_LOSSLESS,
            AnyChannels::sort(channels.into_iter().collect()),
        );
        let mut bytes = std::io::Cursor::new(Vec::new());
        Image::from_layer(layer).write().to_buffered(&mut bytes).map_err(not_stored)?;
        Ok(bytes.into_inner())
    }
}

/// Returns the channels of the first parts of pixels.
fn parts_of<const N: usize, const M: usize>(
    pixels: &[[f32; M]],
    names: [&str; N],
    bits: u32,
) -> Vec<AnyChannel<FlatSamples>> {
    let channel = |(part, name): (usize, &str)| {
        let values = pixels.iter().map(|pixel| pixel[part]);
        let samples = match bits {
            16 => FlatSamples::F16(values.map(f16::from_f32).collect()),
            _ => FlatSamples::F32(values.collect()),
        };
        AnyChannel::new(name, samples)
    };
    names.into_iter().enumerate().map(channel).collect()
}

/// Returns a pixel in linear light, multiplied by its opacity, over a background.
fn linear([r, g, b, a]: [f32; 4], background: Option<[f32; 3]>) -> [f32; 4] {
    match background {
        // As displayed, because the picture was blended so.
        Some(back) => {
            let over = |c: f32, under: f32| decoded(c + (1.0 - a) * under);
            [over(r, back[0]), over(g, back[1]), over(b, back[2]), 1.0]
        }
        None if a > 0.0 => {
            let part = |c: f32| a * decoded(c / a);
            [part(r), part(g), part(b), a]
        }
        None => [0.0; 4],
    }
}

/// Returns a display value (sRGB) as linear light. The curve goes on above 1.
fn decoded(value: f32) -> f32 {
    match value.max(0.0) {
        value if value <= 0.040_45 => value / 12.92,
        value => ((value + 0.055) / 1.055).powf(2.4),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::PictureFormat;
    use exr::prelude::{ReadChannels, ReadLayers, read};

    /// Returns the channels of a file by their names, and pixels an inch.
    fn channels(bytes: &[u8]) -> (Vec<(String, Vec<f32>)>, Option<f32>) {
        let reader = read().no_deep_data().largest_resolution_level().all_channels();
        let image = reader.first_valid_layer().all_attributes();
        let image = image.from_buffered(std::io::Cursor::new(bytes)).unwrap();
        let layer = image.layer_data;
        let list = layer.channel_data.list.iter();
        let values = list.map(|channel| {
            (channel.name.to_string(), channel.sample_data.values_as_f32().collect())
        });
        (values.collect(), layer.attributes.horizontal_density)
    }

    #[test]
    fn files_hold_linear_light_opacity_and_depths() {
        let color =
            vec![[0.5, 1.0, 0.0, 1.0], [0.25, 0.1, 0.0, 0.5], [0.0; 4], [1.5, 0.0, 0.0, 1.0]];
        let depth = vec![2.0, 3.5, f32::INFINITY, 1.0];
        let picture = Picture { width: 4, height: 1, color, depth: depth.clone() };
        for (bits, near) in [(16, 1e-3), (32, 1e-6)] {
            let mut encoding = Encoding::new(PictureFormat::OpenExr);
            (encoding.bits, encoding.dpi) = (Some(bits), Some(300.0));
            let (channels, density) = channels(&picture.encode(&encoding).unwrap());
            let names: Vec<&str> = channels.iter().map(|channel| channel.0.as_str()).collect();
            assert_eq!((names, density), (vec!["A", "B", "G", "R", "Z"], Some(300.0)));
            assert_eq!((&channels[0].1[..], &channels[4].1), (&[1.0, 0.5, 0.0, 1.0][..], &depth));
            // 0.5 as displayed is 0.214 of the light; half of it where half is covered.
            let red = &channels[3].1;
            assert!((red[0] - 0.214_041).abs() < near && (red[1] - 0.107_020).abs() < near);
            // Brighter than white.
            assert!(red[3] > 2.0 && red[2] == 0.0, "{red:?}");
            assert_eq!(channels[2].1[0], 1.0);
            encoding.background = Some([1.0; 3]);
            let (over, _) = self::channels(&picture.encode(&encoding).unwrap());
            assert_eq!(over[0].1, [1.0; 4]);
            assert!((over[3].1[1] - decoded(0.75)).abs() < near && over[3].1[2] == 1.0);
        }
    }

    #[test]
    fn layers_are_channels_beside_the_colours() {
        let picture =
            Picture { width: 2, height: 1, color: vec![[0.5; 4]; 2], depth: vec![1.0; 2] };
        let layers = Layers {
            normals: Some(vec![[0.0, 0.6, -0.8], [0.0; 3]]),
            albedo: Some(vec![[0.5, 1.0, 0.0, 1.0], [0.0; 4]]),
            identifiers: Some(vec![70_000, 0]),
        };
        let encoding = Encoding::new(PictureFormat::OpenExr);
        let (stored, _) = channels(&picture.encode_with(&encoding, &layers).unwrap());
        let of = |name: &str| {
            let channel = stored.iter().find(|channel| channel.0 == name);
            channel.unwrap_or_else(|| panic!("{name} in {stored:?}")).1.clone()
        };
        assert_eq!((stored.len(), of("id.I")), (12, vec![70_000.0, 0.0]));
        assert!((of("normal.Y")[0] - 0.6).abs() < 1e-3 && (of("normal.Z")[0] + 0.8).abs() < 1e-3);
        assert!((of("albedo.R")[0] - 0.214_041).abs() < 1e-3 && of("albedo.G")[0] == 1.0);
        let short = Layers { identifiers: Some(vec![1]), ..Layers::default() };
        assert!(picture.encode_with(&encoding, &short).is_err());
    }
}
