//! The description of OME's programs: the element `Pixels` of the first image, and its channels
//! (OME data model, 2016).

use super::meaning::{Meaning, is_length, unit};
use crate::{about::Channel, formats::shared::length::meters};
use quick_xml::{
    Reader, XmlVersion,
    events::{BytesStart, Event},
};
use std::collections::BTreeMap;

type Attributes = BTreeMap<String, String>;

/// What the description says of the pixels.
struct Pixels {
    attributes: Attributes,
    channels: Vec<Attributes>,
}

/// Reads a description; `None` for those that are not OME's.
pub fn meaning(text: &str, plain: &Meaning) -> Option<Meaning> {
    if !(text.starts_with('<') && text.contains("OME")) {
        return None;
    }
    let Pixels { attributes, channels } = pixels(text)?;
    let mut meaning = plain.clone();
    let size = |name: &str| attributes.get(name).and_then(|text| text.parse::<usize>().ok());
    meaning.slices = size("SizeZ");
    // Pixels of several samples have all of their channels in one page.
    let samples = channels.first().and_then(|channel| channel.get("SamplesPerPixel"));
    let samples = samples.and_then(|text| text.parse::<usize>().ok()).unwrap_or(1).max(1);
    let count = size("SizeC").unwrap_or(channels.len()) / samples;
    meaning.channels = count.max(1);
    meaning.shown = channels.iter().map(channel).collect();
    let order = attributes.get("DimensionOrder").map(|text| text.to_ascii_lowercase());
    let letters: Vec<char> =
        order.unwrap_or_default().chars().filter(|c| "zct".contains(*c)).collect();
    meaning.order = letters.try_into().unwrap_or(meaning.order);
    let lengths = ["X", "Y", "Z"].map(|axis| {
        let value = attributes.get(&format!("PhysicalSize{axis}"))?.parse::<f64>().ok()?;
        let unit = attributes.get(&format!("PhysicalSize{axis}Unit")).map(|text| unit(text));
        Some((value, unit.unwrap_or_else(|| "µm".into()))).filter(|(v, _)| is_length(*v))
    });
    if let [Some((x, x_unit)), ..] = &lengths {
        let of = |length: &Option<(f64, String)>| match length {
            Some((value, unit)) => match (meters(unit), meters(x_unit)) {
                (Some(unit), Some(x_unit)) => value * unit / x_unit,
                _ => *value,
            },
            None => *x,
        };
        meaning.spacing = [*x, of(&lengths[1]), of(&lengths[2])];
        meaning.unit.clone_from(x_unit);
    }
    meaning.is_microscopy = true;
    Some(meaning)
}

/// Returns the pixels of the first image; `None` if there are none.
fn pixels(text: &str) -> Option<Pixels> {
    let mut reader = Reader::from_str(text);
    let mut pixels: Option<Pixels> = None;
    loop {
        match reader.read_event().ok()? {
            Event::Start(start) | Event::Empty(start) => match start.local_name().as_ref() {
                "Pixels" if pixels.is_some() => break,
                "Pixels" => {
                    let attributes = attributes(&start);
                    pixels = Some(Pixels { attributes, channels: Vec::new() });
                }
                "Channel" => {
                    if let Some(pixels) = &mut pixels {
                        pixels.channels.push(attributes(&start));
                    }
                }
                _ => {}
            },
            Event::End(end) if end.local_name().as_ref() == "Pixels" => break,
            Event::Eof => break,
            _ => {}
        }
    }
    pixels
}

/// Returns the attributes of an element. Those that are no XML are left out.
fn attributes(element: &BytesStart) -> Attributes {
    let one = |attribute: quick_xml::events::attributes::Attribute| {
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).ok()?;
        Some((attribute.key.local_name().as_ref().to_owned(), value.into_owned()))
    };
    element.attributes().flatten().filter_map(one).collect()
}

/// Returns what an element says of its channel.
fn channel(attributes: &Attributes) -> Channel {
    let name = attributes.get("Name").or_else(|| attributes.get("Fluor"));
    let wavelength = attributes.get("EmissionWavelength").and_then(|text| {
        let length = text.parse::<f64>().ok()?;
        let unit = attributes.get("EmissionWavelengthUnit").map_or("nm", String::as_str);
        Some(length * meters(unit)? * 1e9)
    });
    let color = attributes.get("Color").and_then(|text| color(text));
    Channel {
        name: name.map(|name| name.trim().chars().take(64).collect()).unwrap_or_default(),
        color: color.or_else(|| wavelength.and_then(of_wavelength)),
        window: None,
    }
}

/// Returns the colour of a signed number of 32 bits: red, green, blue and opacity, from the highest
/// byte on. White is the default of programs that set no colour.
fn color(text: &str) -> Option<[f64; 3]> {
    let [red, green, blue, _] = text.trim().parse::<i32>().ok()?.to_be_bytes();
    let color = [red, green, blue].map(|part| f64::from(part) / 255.0);
    (color.iter().any(|part| *part > 0.0) && color != [1.0; 3]).then_some(color)
}

/// Returns the colour of light of a wavelength in nanometres, as bright as a screen shows it;
/// `None` beyond what is visible. The hues follow the usual names of the parts of the spectrum.
fn of_wavelength(nanometers: f64) -> Option<[f64; 3]> {
    let hues = [
        (380.0, [0.35, 0.2, 1.0]),
        (440.0, [0.15, 0.25, 1.0]),
        (490.0, [0.0, 0.9, 1.0]),
        (510.0, [0.0, 1.0, 0.2]),
        (550.0, [0.5, 1.0, 0.0]),
        (580.0, [1.0, 0.9, 0.0]),
        (610.0, [1.0, 0.45, 0.0]),
        (645.0, [1.0, 0.1, 0.05]),
        (780.0, [0.8, 0.0, 0.1]),
    ];
    let pair = hues.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&nanometers))?;
    let share = (nanometers - pair[0].0) / (pair[1].0 - pair[0].0);
    Some([0, 1, 2].map(|part| pair[0].1[part] + share * (pair[1].1[part] - pair[0].1[part])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_signed_numbers() {
        // 0x00FF00FF, and 0xFF00FFFF as a signed number.
        assert_eq!(color("16711935"), Some([0.0, 1.0, 0.0]));
        assert_eq!(color("-16711681"), Some([1.0, 0.0, 1.0]));
        // White, which is what programs write if nobody chose a colour, and nonsense.
        assert_eq!((color("-1"), color("255"), color("blue")), (None, None, None));
    }

    #[test]
    fn wavelengths_have_the_hues_of_the_spectrum() {
        let [blue, green, red] = [450.0, 525.0, 640.0].map(|length| of_wavelength(length).unwrap());
        assert!(blue[2] > 0.9 && blue[0] < 0.2, "{blue:?}");
        assert!(green[1] > 0.9 && green[2] < 0.2, "{green:?}");
        assert!(red[0] > 0.9 && red[1] < 0.2, "{red:?}");
        assert_eq!(of_wavelength(1064.0), None);
    }
}
