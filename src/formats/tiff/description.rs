//! The descriptions that ImageJ, OME's programs and tifffile leave in the first page of a file.

use super::{
    imagej::{self, Block},
    meaning::Meaning,
    ome,
};

/// Reads a description, with the pixels along x and y and those per unit that the tags of the page
/// give, and ImageJ's block of data.
pub fn meaning(
    description: &str,
    (size, resolution): ([usize; 2], Option<[f64; 2]>),
    block: &Block,
) -> Meaning {
    let plain = Meaning::plain();
    let text = description.trim_start_matches('\u{feff}').trim_start();
    if text.starts_with("ImageJ=") {
        return imagej::meaning(text, resolution, block, &plain);
    }
    if let Some(meaning) = ome::meaning(text, &plain) {
        return meaning;
    }
    plain.of_shape(text, size).of_ratio(resolution)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Result,
        about::Channel,
        formats::{ReadOptions, shared::several},
        input::{Limits, Source},
    };
    use std::path::Path;

    fn planes(meaning: &Meaning, pages: usize, options: &ReadOptions) -> Result<Vec<usize>> {
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a.tif"), &[], &limits)?;
        let time = meaning.time(&source, pages, options)?;
        let all = vec![Channel::default(); meaning.paged_channels(pages)];
        let channels = several::channels(&source, options, &all)?;
        meaning.planes(&source, pages, [channels[0], time])
    }

    fn of(text: &str, resolution: Option<[f64; 2]>) -> Meaning {
        meaning(text, ([8, 8], resolution), &Block::default())
    }

    #[test]
    fn imagej_gives_order_and_spacing() {
        let text = "ImageJ=1.53t\nimages=12\nchannels=2\nslices=3\nframes=2\nhyperstack=true\n\
                    unit=micron\nspacing=0.5\nloop=false\n";
        let meaning = of(text, Some([4.0, 5.0]));
        assert_eq!(meaning.spacing, [0.25, 0.2, 0.5]);
        assert_eq!((&meaning.unit[..], meaning.in_one), ("µm", Some(12)));
        let default = ReadOptions::default();
        assert_eq!(planes(&meaning, 12, &default).unwrap(), [0, 2, 4]);
        let second = ReadOptions { scalar: Some("channel:1".into()), time: Some(1), ..default };
        assert_eq!(planes(&meaning, 12, &second).unwrap(), [7, 9, 11]);
        let third = ReadOptions::scalar(Some("channel:2"));
        assert!(planes(&meaning, 12, &third).is_err());
        let late = ReadOptions { time: Some(2), ..ReadOptions::default() };
        assert!(planes(&meaning, 12, &late).unwrap_err().to_string().contains("2 times"));
        // Pages that are not as many as the description says.
        assert_eq!(planes(&meaning, 5, &ReadOptions::default()).unwrap(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn ome_gives_order_and_spacing() {
        let text = "<?xml version='1.0'?><OME xmlns='http'><Image ID='Image:0'><Pixels \
                    DimensionOrder=\"XYZCT\" SizeC=\"2\" SizeT='2' SizeX='4' SizeY='4' SizeZ='3' \
                    PhysicalSizeX='200' PhysicalSizeXUnit='nm' PhysicalSizeY='200' \
                    PhysicalSizeYUnit='nm' PhysicalSizeZ='0.6' Type='uint8'><Channel \
                    SamplesPerPixel='1'/></Pixels></Image></OME>";
        let meaning = of(text, None);
        assert_eq!(meaning.unit, "nm");
        assert!((meaning.spacing[2] - 600.0).abs() < 1e-9 && meaning.spacing[1] == 200.0);
        let options =
            |scalar: &str| ReadOptions { time: Some(1), ..ReadOptions::scalar(Some(scalar)) };
        assert_eq!(planes(&meaning, 12, &options("c:1")).unwrap(), [9, 10, 11]);
        assert_eq!(planes(&meaning, 12, &ReadOptions::default()).unwrap(), [0, 1, 2]);
        let colors = text
            .replace("SizeC=\"2\"", "SizeC='3'")
            .replace("SamplesPerPixel='1'", "SamplesPerPixel='3'");
        assert_eq!(of(&colors, None).channels, 1);
    }

    #[test]
    fn shapes_and_ratios_are_read() {
        let meaning = of("{\"shape\": [2, 3, 8, 8]}", Some([72.0, 36.0]));
        assert_eq!((meaning.in_one, meaning.spacing), (Some(6), [1.0, 2.0, 1.0]));
        let second = ReadOptions { time: Some(1), ..ReadOptions::default() };
        assert_eq!(planes(&meaning, 6, &second).unwrap(), [3, 4, 5]);
        let colors = of("{\"shape\": [8, 8, 3]}", None);
        assert_eq!((colors.in_one, colors.times(1)), (None, 1));
        let channels = of("{\"shape\": [2, 3, 8, 8], \"axes\": \"CZYX\"}", None);
        let all = ReadOptions { channels: Some(vec!["1".into()]), ..ReadOptions::default() };
        assert_eq!(planes(&channels, 6, &all).unwrap(), [3, 4, 5]);
        for text in ["", "{\"shape\": [8, 8]}", "<svg/>", "a scan"] {
            assert_eq!(planes(&of(text, None), 3, &ReadOptions::default()).unwrap(), [0, 1, 2]);
        }
    }
}
