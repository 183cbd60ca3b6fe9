//! What the elements of a file say of its pixels and of its series.

use super::{
    element::{Set, Value},
    file::File,
    frames::{Frame, frames},
    segmentation::{self, Segmentation},
    syntax::Packing,
    tags,
};
use crate::{Result, about::Modality, input::Source, warning};
use std::path::PathBuf;

/// A file of pictures, without its pixels.
pub struct Head {
    pub path: PathBuf,
    pub series: SeriesName,
    /// The identifier of this file's content.
    pub instance: String,
    pub layout: Layout,
    pub frames: Vec<Frame>,
    pub nature: Nature,
    /// What the frames are of a segmentation; `None` for pictures.
    pub segmentation: Option<Segmentation>,
}

/// What tells a series from others.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SeriesName {
    pub identifier: String,
    pub number: Option<i64>,
    pub description: String,
    /// The code of what measured it (“CT”).
    pub modality: String,
}

/// How the numbers of pixels are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Numbers {
    /// Whole numbers.
    Whole {
        allocated: u16,
        stored: u16,
        high: u16,
        is_signed: bool,
    },
    F32,
    F64,
}

const EIGHT_BITS: Numbers = Numbers::Whole { allocated: 8, stored: 8, high: 7, is_signed: false };

/// What the values of pixels mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Colors {
    Grey,
    /// Low values are bright.
    Inverted,
    Palette,
    Rgb,
    /// Luminance comes first.
    Luminance,
    /// Luminance and colours, of which two pixels share the colours.
    Halved,
}

/// How pixels are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    pub columns: usize,
    pub rows: usize,
    /// Numbers per pixel.
    pub channels: usize,
    pub numbers: Numbers,
    pub colors: Colors,
    /// Whether the channels are stored one after the other.
    pub is_planar: bool,
    pub packing: Packing,
    /// The lowest and the highest stored number that stand for no value.
    pub padding: Option<[f64; 2]>,
}

/// What the values are.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Nature {
    pub modality: Option<Modality>,
    pub unit: String,
    /// Whether the picture only shows where other slices lie.
    pub is_localizer: bool,
}

impl Layout {
    /// Whether its pixels are colours.
    pub fn is_colored(&self) -> bool {
        self.channels > 1 || self.colors == Colors::Palette
    }

    /// Numbers of one frame.
    pub fn frame_numbers(&self) -> usize {
        self.columns.saturating_mul(self.rows).saturating_mul(self.channels)
    }
}

impl Head {
    /// Reads the elements of a file.
    pub fn read(source: &Source) -> Result<Self> {
        let file = File::open(source)?;
        let set = file.set()?;
        let series = SeriesName {
            identifier: set.text(tags::SERIES).unwrap_or_default(),
            number: set.decimal(tags::SERIES_NUMBER).map(|number| number as i64),
            description: set.text(tags::SERIES_DESCRIPTION).unwrap_or_default(),
            modality: set.text(tags::MODALITY).unwrap_or_default(),
        };
        if let Some(what) = no_slices(&set) {
            return Err(what.error(source));
        }
        let mut layout = layout(&file, &set)?;
        let segmentation = segmentation::of(&set)?;
        if segmentation.is_some() {
            // Labels are numbers, whatever colours they have.
            layout.colors = Colors::Grey;
        }
        let nature = nature(&set, &series);
        Ok(Self {
            path: source.path.to_owned(),
            series,
            instance: set.text(tags::INSTANCE).unwrap_or_default(),
            frames: frames(source, &set, pixel_bytes(&set))?,
            layout,
            nature,
            segmentation,
        })
    }
}

/// Reads how pixels are stored.
fn layout(file: &File, set: &Set) -> Result<Layout> {
    let source = file.source;
    let has = |tag| set.get(tag).is_some();
    let numbers = if has(tags::FLOAT_PIXELS) {
        Numbers::F32
    } else if has(tags::DOUBLE_PIXELS) {
        Numbers::F64
    } else if has(tags::PIXEL_DATA) {
        whole_numbers(source, set)?
    } else {
        return Err(without_pixels(source, set));
    };
    let need = |tag, name: &str| match set.short(tag) {
        Some(number) if number > 0 => Ok(usize::from(number)),
        size => {
            let size = size.map_or("missing".into(), |number| number.to_string());
            Err(source.error(name, format!("is {size}, but a number of pixels was expected")))
        }
    };
    let channels = set.short(tags::SAMPLES_PER_PIXEL).unwrap_or(1);
    let colors = colors(source, set, channels)?;
    let is_deep = matches!(numbers, Numbers::Whole { stored: 8.., .. });
    if channels > 1 && (!is_deep || colors == Colors::Halved && numbers != EIGHT_BITS) {
        let message = "colours are read if they have 8 bits or more, and 8 if pixels share them";
        return Err(source.error("Bits Stored", message));
    }
    let is_signed = matches!(numbers, Numbers::Whole { is_signed: true, .. });
    let signed = |number: u16| if is_signed { f64::from(number as i16) } else { number.into() };
    let padding = set.short(tags::PADDING).map(|first| {
        let last = set.short(tags::PADDING_LIMIT).unwrap_or(first);
        let [first, last] = [signed(first), signed(last)];
        [first.min(last), first.max(last)]
    });
    if has(tags::MODALITY_TABLES) && set.decimal(tags::SLOPE).is_none() {
        warning::give!("{}: its table of values is not applied", source.path.display());
    }
    Ok(Layout {
        columns: need(tags::COLUMNS, "Columns")?,
        rows: need(tags::ROWS, "Rows")?,
        channels: channels.into(),
        numbers,
        colors,
        is_planar: set.short(tags::PLANAR) == Some(1),
        packing: file.syntax.packing,
        padding,
    })
}

fn whole_numbers(source: &Source, set: &Set) -> Result<Numbers> {
    let allocated = set.short(tags::BITS_ALLOCATED).unwrap_or(0);
    let stored = set.short(tags::BITS_STORED).unwrap_or(allocated);
    let high = set.short(tags::HIGH_BIT).unwrap_or(stored.saturating_sub(1));
    if ![1, 8, 16, 32].contains(&allocated) {
        let bits = if allocated == 0 { "missing".into() } else { allocated.to_string() };
        let message = format!("is {bits}, but 1, 8, 16 or 32 was expected");
        return Err(source.error("Bits Allocated", message));
    }
    if !(1..=allocated).contains(&stored) || high >= allocated || high + 1 < stored {
        let message = format!(
            "{stored} bits up to bit {high} do not lie in the {allocated} bits of a number"
        );
        return Err(source.error("Bits Stored", message));
    }
    let is_signed = set.short(tags::REPRESENTATION) == Some(1);
    Ok(Numbers::Whole { allocated, stored, high, is_signed })
}

fn colors(source: &Source, set: &Set, channels: u16) -> Result<Colors> {
    let name = set.text(tags::PHOTOMETRIC).unwrap_or_default();
    Ok(match (name.as_str(), channels) {
        ("MONOCHROME1", 1) => Colors::Inverted,
        ("PALETTE COLOR", 1) => Colors::Palette,
        (_, 1) => Colors::Grey,
        ("RGB" | "YBR_RCT" | "YBR_ICT", 3) => Colors::Rgb,
        ("YBR_FULL_422" | "YBR_PARTIAL_422", 3) => Colors::Halved,
        ("YBR_FULL", 3) => Colors::Luminance,
        _ => {
            let name = super::excerpt(&name);
            let message = format!("“{name}” of {channels} numbers a pixel is not read");
            let hint = "grey values, palettes, RGB and YBR are read";
            return Err(source.error("Photometric Interpretation", message).hint(hint));
        }
    })
}

/// Files of a class that are no slices of a volume.
struct Other {
    /// What they hold, after “holds”.
    what: &'static str,
    hint: &'static str,
}

const OTHERS_HINT: &str = "name files of CT, MR, PET or other pictures";

impl Other {
    fn error(&self, source: &Source) -> crate::Error {
        let message = format!("holds {}, not slices of a volume", self.what);
        source.error("SOP class", message).hint(self.hint)
    }
}

/// What the classes of files are called that never hold slices (PS3.4, annex B.5), below
/// 1.2.840.10008.5.1.4.1.1. A name that ends with a point is that of a family.
const OTHERS: &[(&str, &str)] = &[
    ("77.1.6", "tiles of a whole slide"),
    ("481.3", "outlines of radiotherapy (RT Structure Set)"),
    ("481.5", "a plan of radiotherapy"),
    ("481.8", "a plan of radiotherapy"),
    ("481.4", "a record of radiotherapy"),
    ("481.6", "a record of radiotherapy"),
    ("481.7", "a record of radiotherapy"),
    ("481.9", "a record of radiotherapy"),
    ("104.1", "a PDF document"),
    ("104.2", "a clinical document (CDA)"),
    ("104.", "a surface (STL, OBJ or MTL) inside DICOM"),
    ("66.5", "a surface (Surface Segmentation)"),
    ("66.6", "lines (Tractography)"),
    ("66.1", "a registration"),
    ("66.2", "places of reference (Spatial Fiducials)"),
    ("66.3", "a registration"),
    ("66", "raw data"),
    ("88.59", "a selection of other files (Key Objects)"),
    ("88.", "a report"),
    ("4.2", "a spectrum"),
    ("11.", "a presentation of other pictures"),
    ("9.", "a waveform"),
    ("67", "a mapping to real values"),
];

/// Returns what a file holds if its class says that it has no slices of a volume.
fn no_slices(set: &Set) -> Option<Other> {
    let class = set.text(tags::CLASS).unwrap_or_default();
    let suffix = class.strip_prefix("1.2.840.10008.5.1.4.1.1.")?;
    let fits =
        |name: &str| if name.ends_with('.') { suffix.starts_with(name) } else { suffix == name };
    let &(_, what) = OTHERS.iter().find(|(name, _)| fits(name))?;
    let is_slide = suffix == "77.1.6";
    let hint = match is_slide {
        true => {
            "one level of the slide can be written as a picture by OpenSlide or wsidicom; pictures \
             are not drawn"
        }
        false => OTHERS_HINT,
    };
    Some(Other { what, hint })
}

/// Returns the error for a file without pixels.
fn without_pixels(source: &Source, set: &Set) -> crate::Error {
    let modality = set.text(tags::MODALITY).unwrap_or_default();
    let modality =
        if modality.is_empty() { String::new() } else { format!(" (modality {modality})") };
    let message = format!("holds other data{}, not a picture", super::excerpt(&modality));
    source.error("data set", message).hint(OTHERS_HINT)
}

/// Reads what the values are.
fn nature(set: &Set, series: &SeriesName) -> Nature {
    let has_scale = set.decimal(tags::SLOPE).is_some() || set.get(tags::SHARED_GROUPS).is_some();
    let of_scale = set.text(tags::RESCALE_TYPE);
    let modality = match series.modality.as_str() {
        // Other values than Hounsfield units cannot be shown as these.
        "CT" if has_scale && of_scale.as_deref().is_none_or(|unit| unit == "HU") => {
            Some(Modality::Ct)
        }
        "MR" => Some(Modality::Mr),
        "PT" | "NM" => Some(Modality::Emission),
        "US" | "IVUS" => Some(Modality::Ultrasound),
        "SM" | "GM" => Some(Modality::Microscopy),
        _ => None,
    };
    let unit = match (modality, set.text(tags::UNITS), set.text(tags::DOSE_UNITS)) {
        (Some(Modality::Ct), ..) => "HU".into(),
        (_, Some(unit), _) if unit == "BQML" => "Bq/ml".into(),
        (_, Some(unit), _) if unit == "CNTS" => "counts".into(),
        (_, Some(unit), _) => unit,
        (.., Some(unit)) if unit == "GY" => "Gy".into(),
        _ => of_scale.filter(|unit| unit != "US" && unit != "normalized").unwrap_or_default(),
    };
    let is_localizer = set.words(tags::IMAGE_TYPE).iter().any(|word| word == "LOCALIZER");
    Nature { modality, unit, is_localizer }
}

/// Returns the pixels of a set, as its elements hold them.
pub fn pixels<'s, 'a>(set: &'s Set<'a>) -> Option<&'s Value<'a>> {
    [tags::PIXEL_DATA, tags::FLOAT_PIXELS, tags::DOUBLE_PIXELS]
        .iter()
        .find_map(|&tag| set.get(tag))
        .map(|element| &element.value)
}

/// Returns the bytes of the pixels that are there.
fn pixel_bytes(set: &Set) -> usize {
    match pixels(set) {
        Some(Value::Bytes(bytes) | Value::Cut(bytes, _)) => bytes.len(),
        Some(Value::Fragments(fragments)) => fragments.iter().map(|part| part.len()).sum(),
        Some(Value::Items(..)) | None => 0,
    }
}
