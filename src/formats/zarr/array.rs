//! What the metadata of an array says: `.zarray` of Zarr 2, `zarr.json` of Zarr 3.

use super::codecs::{Chain, Codec};
use crate::formats::{Endian, SampleType, shared::grid::Element};
use half::f16;
use serde_json::Value;

/// Most axes of an array.
pub const MOST_AXES: usize = 8;

/// What the metadata of an array says.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Elements along each axis, the last one fastest.
    pub shape: Vec<usize>,
    /// Elements of an object of the store along each axis: a chunk, or a shard of chunks.
    pub object: Vec<usize>,
    /// Elements of a chunk along each axis.
    pub chunk: Vec<usize>,
    /// How the chunks of a shard are found, if an object holds several.
    pub shards: Option<Shards>,
    pub element: Element,
    pub endian: Endian,
    /// The bytes of an element that was never written.
    pub fill: Vec<u8>,
    pub chain: Chain,
    pub keys: Keys,
    /// The names of the axes, as Zarr 3 has them; empty if there are none.
    pub names: Vec<String>,
}

/// Where a shard says which of its bytes are a chunk's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shards {
    pub at_start: bool,
    pub endian: Endian,
    pub is_checked: bool,
}

/// How the place of an object becomes its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Keys {
    /// Whether names begin with `c`.
    pub prefixed: bool,
    pub separator: char,
}

impl Keys {
    /// Returns the name of the object at a place.
    pub fn name(self, place: &[usize]) -> String {
        let mut parts: Vec<String> = place.iter().map(usize::to_string).collect();
        if self.prefixed {
            parts.insert(0, "c".into());
        } else if parts.is_empty() {
            parts.push("0".into());
        }
        parts.join(&self.separator.to_string())
    }
}

type Read<T> = Result<T, String>;

impl Layout {
    /// Reads the metadata of an array. The error is a message.
    pub fn of(metadata: &Value) -> Read<Self> {
        let layout = match metadata.get("zarr_format").and_then(Value::as_u64) {
            Some(2) => Self::of_2(metadata)?,
            Some(3) => Self::of_3(metadata)?,
            _ => return Err("has no “zarr_format” of 2 or 3".into()),
        };
        layout.check()?;
        Ok(layout)
    }

    fn check(&self) -> Read<()> {
        let axes = self.shape.len();
        if axes > MOST_AXES {
            return Err(format!("has {axes} axes, but at most {MOST_AXES} are read"));
        }
        if self.object.len() != axes || self.chunk.len() != axes {
            return Err(format!("has {axes} axes in its shape, but not in its chunks"));
        }
        if self.object.contains(&0) || self.chunk.contains(&0) {
            return Err("has chunks without elements".into());
        }
        if !self.object.iter().zip(&self.chunk).all(|(all, one)| all.is_multiple_of(*one)) {
            return Err("has shards that are no whole number of chunks".into());
        }
        let mut order = self.chain.order.clone();
        order.sort_unstable();
        if !(order.is_empty() || order.into_iter().eq(0..axes)) {
            return Err("turns axes that it does not have".into());
        }
        Ok(())
    }

    fn of_2(metadata: &Value) -> Read<Self> {
        let (element, endian) = numpy_type(text(metadata, "dtype")?)?;
        let (shape, chunk) = (sizes(metadata, "shape")?, sizes(metadata, "chunks")?);
        let is_fortran = metadata.get("order").and_then(Value::as_str) == Some("F");
        let order = if is_fortran { (0..shape.len()).rev().collect() } else { Vec::new() };
        let filters = metadata.get("filters").and_then(Value::as_array).into_iter().flatten();
        let compressor = metadata.get("compressor").filter(|value| !value.is_null());
        let codec = |value: &Value| Codec::named(text(value, "id")?, value);
        let packing = filters.chain(compressor).map(codec).collect::<Read<_>>()?;
        let separator = match metadata.get("dimension_separator").and_then(Value::as_str) {
            Some("/") => '/',
            _ => '.',
        };
        Ok(Self {
            object: chunk.clone(),
            shape,
            chunk,
            shards: None,
            element,
            endian,
            fill: fill(metadata.get("fill_value"), element, endian)?,
            chain: Chain { order, packing },
            keys: Keys { prefixed: false, separator },
            names: Vec::new(),
        })
    }

    fn of_3(metadata: &Value) -> Read<Self> {
        let shape = sizes(metadata, "shape")?;
        let element = named_type(&metadata["data_type"])?;
        let grid = &metadata["chunk_grid"];
        if grid["name"].as_str() != Some("regular") {
            return Err("has a grid of chunks that is not regular".into());
        }
        let object = sizes(&grid["configuration"], "chunk_shape")?;
        let encoding = &metadata["chunk_key_encoding"];
        let prefixed = encoding["name"].as_str() != Some("v2");
        let separator = match encoding["configuration"]["separator"].as_str() {
            Some(".") => '.',
            None if !prefixed => '.',
            _ => '/',
        };
        let codecs = Codecs::of(&metadata["codecs"], shape.len())?;
        let names = metadata["dimension_names"].as_array().into_iter().flatten();
        let mut layout = Self {
            shape,
            chunk: object.clone(),
            object,
            shards: None,
            element,
            endian: codecs.endian,
            fill: Vec::new(),
            chain: codecs.chain,
            keys: Keys { prefixed, separator },
            names: names.map(|name| name.as_str().unwrap_or_default().to_owned()).collect(),
        };
        if let Some(settings) = codecs.sharding {
            layout.set_shards(settings)?;
        }
        layout.fill = fill(metadata.get("fill_value"), element, layout.endian)?;
        Ok(layout)
    }

    /// Takes the settings of shards: the chunks inside, and how they are packed.
    fn set_shards(&mut self, settings: &Value) -> Read<()> {
        if self.chain != Chain::default() {
            return Err("packs or turns whole shards, which is not read".into());
        }
        let inner = Codecs::of(&settings["codecs"], self.shape.len())?;
        if inner.sharding.is_some() {
            return Err("has shards in shards, which are not read".into());
        }
        let index = Codecs::of(&settings["index_codecs"], 1)?;
        let is_checked = match index.chain.packing[..] {
            [] => false,
            [Codec::Crc32c] => true,
            _ => return Err("packs the lists of its shards, which is not read".into()),
        };
        let at_start = settings["index_location"].as_str() == Some("start");
        self.chunk = sizes(settings, "chunk_shape")?;
        (self.chain, self.endian) = (inner.chain, inner.endian);
        self.shards = Some(Shards { at_start, endian: index.endian, is_checked });
        Ok(())
    }

    /// Returns the number of elements; `None` if they exceed 64 bits.
    pub fn len(&self) -> Option<u64> {
        self.shape.iter().try_fold(1u64, |all, &n| all.checked_mul(n as u64))
    }

    /// Returns the bytes of a chunk; `None` if they exceed what can be counted.
    pub fn chunk_bytes(&self) -> Option<usize> {
        self.chunk.iter().try_fold(self.element.bytes(), |all, &n| all.checked_mul(n))
    }

    /// Returns how many chunks an object has along each axis.
    pub fn chunks_of_object(&self) -> Vec<usize> {
        self.object.iter().zip(&self.chunk).map(|(all, one)| all / one).collect()
    }
}

/// The codecs of an array, or of the chunks of a shard.
struct Codecs<'a> {
    chain: Chain,
    endian: Endian,
    sharding: Option<&'a Value>,
}

impl<'a> Codecs<'a> {
    fn of(list: &'a Value, axes: usize) -> Read<Self> {
        let list = list.as_array().ok_or("has no list of codecs")?;
        let mut codecs = Self { chain: Chain::default(), endian: Endian::Little, sharding: None };
        for codec in list {
            let name = codec.as_str().map_or_else(|| text(codec, "name"), Ok)?;
            let settings = &codec["configuration"];
            match name {
                "bytes" | "endian" => {
                    let is_big = settings["endian"].as_str() == Some("big");
                    codecs.endian = if is_big { Endian::Big } else { Endian::Little };
                }
                "transpose" => codecs.turn(settings, axes)?,
                "sharding_indexed" => codecs.sharding = Some(settings),
                _ => codecs.chain.packing.push(Codec::named(name, settings)?),
            }
        }
        Ok(codecs)
    }

    fn turn(&mut self, settings: &Value, axes: usize) -> Read<()> {
        let order = match settings["order"].as_str() {
            Some("F") => (0..axes).rev().collect(),
            Some(_) => (0..axes).collect(),
            None => sizes(settings, "order")?,
        };
        let before = std::mem::take(&mut self.chain.order);
        let outer = |axis: usize| match before.is_empty() {
            true => Ok(axis),
            false => before.get(axis).copied().ok_or("turns axes that it does not have"),
        };
        self.chain.order = order.into_iter().map(outer).collect::<Result<_, _>>()?;
        Ok(())
    }
}

fn text<'a>(value: &'a Value, name: &str) -> Read<&'a str> {
    value.get(name).and_then(Value::as_str).ok_or_else(|| format!("has no text “{name}”"))
}

/// Returns a list of whole numbers.
fn sizes(value: &Value, name: &str) -> Read<Vec<usize>> {
    let wrong = || format!("has no list of whole numbers “{name}”");
    let list = value.get(name).and_then(Value::as_array).ok_or_else(wrong)?;
    if list.len() > 64 {
        return Err(format!("has {} numbers in “{name}”", list.len()));
    }
    let size = |n: &Value| n.as_u64().and_then(|n| usize::try_from(n).ok()).ok_or_else(wrong);
    list.iter().map(size).collect()
}

/// Reads a type as NumPy writes it: `<u2`.
fn numpy_type(name: &str) -> Read<(Element, Endian)> {
    let wrong = || format!("has the type “{}”, which is not read", excerpt(name));
    let (endian, kind) = match name.split_at_checked(1).ok_or_else(wrong)? {
        (">", kind) => (Endian::Big, kind),
        ("<" | "|" | "=", kind) => (Endian::Little, kind),
        _ => return Err(wrong()),
    };
    let long = match kind {
        "b1" => "bool",
        "i1" => "int8",
        "i2" => "int16",
        "i4" => "int32",
        "i8" => "int64",
        "u1" => "uint8",
        "u2" => "uint16",
        "u4" => "uint32",
        "u8" => "uint64",
        "f2" => "float16",
        "f4" => "float32",
        "f8" => "float64",
        "c8" => "complex64",
        "c16" => "complex128",
        _ => return Err(wrong()),
    };
    Ok((named_type(&Value::from(long))?, endian))
}

fn named_type(name: &Value) -> Read<Element> {
    Ok(match name.as_str() {
        Some("bool") => Element::Bool,
        Some("int8") => Element::Real(SampleType::I8),
        Some("int16") => Element::Real(SampleType::I16),
        Some("int32") => Element::Real(SampleType::I32),
        Some("int64") => Element::Real(SampleType::I64),
        Some("uint8") => Element::Real(SampleType::U8),
        Some("uint16") => Element::Real(SampleType::U16),
        Some("uint32") => Element::Real(SampleType::U32),
        Some("uint64") => Element::Real(SampleType::U64),
        Some("float16") => Element::Half,
        Some("float32") => Element::Real(SampleType::F32),
        Some("float64") => Element::Real(SampleType::F64),
        Some("complex64") => Element::Complex(SampleType::F32),
        Some("complex128") => Element::Complex(SampleType::F64),
        _ => {
            let name = excerpt(&name.to_string());
            return Err(format!("has the type {name}, but real and complex numbers are read"));
        }
    })
}

fn excerpt(text: &str) -> String {
    text.chars().take(40).collect()
}

/// Returns the bytes of the value that elements have which were never written.
fn fill(value: Option<&Value>, element: Element, endian: Endian) -> Read<Vec<u8>> {
    let value = value.unwrap_or(&Value::Null);
    let mut bytes = match element {
        Element::Complex(part) => {
            let parts = value.as_array().map_or(&[][..], Vec::as_slice);
            let part = |at| number(parts.get(at).unwrap_or(&Value::Null), Element::Real(part));
            let (mut first, mut second) = (part(0)?, part(1)?);
            if endian == Endian::Big {
                first.reverse();
                second.reverse();
            }
            return Ok([first, second].concat());
        }
        _ => number(value, element)?,
    };
    if endian == Endian::Big {
        bytes.reverse();
    }
    Ok(bytes)
}

/// Returns the bytes of a number, the lowest first.
fn number(value: &Value, element: Element) -> Read<Vec<u8>> {
    let wrong =
        || format!("has the fill value {}, which is no number", excerpt(&value.to_string()));
    let size = element.bytes();
    if let Some(digits) = value.as_str().and_then(|text| text.strip_prefix("0x")) {
        let bits = u64::from_str_radix(digits, 16).map_err(|_| wrong())?;
        return Ok(bits.to_le_bytes()[..size].to_vec());
    }
    let float = match value {
        Value::Null => 0.0,
        Value::Bool(is_set) => f64::from(u8::from(*is_set)),
        Value::String(text) => match text.as_str() {
            "NaN" => f64::NAN,
            "Infinity" => f64::INFINITY,
            "-Infinity" => f64::NEG_INFINITY,
            "" => 0.0,
            text => text.parse().map_err(|_| wrong())?,
        },
        other => other.as_f64().ok_or_else(wrong)?,
    };
    Ok(match element {
        Element::Half => f16::from_f64(float).to_le_bytes().to_vec(),
        Element::Real(SampleType::F32) => (float as f32).to_le_bytes().to_vec(),
        Element::Real(SampleType::F64) => float.to_le_bytes().to_vec(),
        _ => match (value.as_i64(), value.as_u64()) {
            (Some(whole), _) => whole.to_le_bytes()[..size].to_vec(),
            (_, Some(whole)) => whole.to_le_bytes()[..size].to_vec(),
            _ => (float as i64).to_le_bytes()[..size].to_vec(),
        },
    })
}
