//! The attributes of a point that a user may name (LAS specification 1.4 R15, tables 7 to 17).

use super::{
    super::{
        form::{self, NumberType},
        shared::attribute,
    },
    Header, describe,
    extra::Extra,
};
use crate::{Result, about::About, input::Source};

/// An attribute, and what is subtracted from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    of: Of,
    less: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Of {
    Intensity,
    ReturnNumber,
    Returns,
    Classification,
    ScanAngle,
    UserData,
    PointSource,
    Time,
    /// Red, green or blue.
    Channel(usize),
    Extra(Extra),
}

impl Of {
    fn name(&self) -> &str {
        match self {
            Self::Intensity => "intensity",
            Self::ReturnNumber => "return_number",
            Self::Returns => "number_of_returns",
            Self::Classification => "classification",
            Self::ScanAngle => "scan_angle",
            Self::UserData => "user_data",
            Self::PointSource => "point_source_id",
            Self::Time => "gps_time",
            Self::Channel(channel) => ["red", "green", "blue"][*channel],
            Self::Extra(extra) => &extra.name,
        }
    }

    /// Returns the type that holds its values.
    fn kind(&self) -> NumberType {
        match self {
            Self::Intensity | Self::PointSource | Self::Channel(_) => NumberType::U16,
            Self::ReturnNumber | Self::Returns | Self::Classification | Self::UserData => {
                NumberType::U8
            }
            Self::ScanAngle => NumberType::F32,
            Self::Time => NumberType::F64,
            Self::Extra(extra) => extra.number_type(),
        }
    }

    fn unit(&self) -> &'static str {
        match self {
            Self::ScanAngle => "°",
            Self::Time => "s",
            _ => "",
        }
    }
}

impl Attribute {
    /// Finds the attribute of a name. Times are counted from the first point, because in 32 bits
    /// those since 1980 would have steps of half a minute.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) for another name, with the names that there are, and
    /// for times of packed points.
    pub fn named(source: &Source, header: &Header, name: &str) -> Result<Self> {
        let mut all = all(header, &describe::extras(source, header));
        let names: Vec<&str> = all.iter().map(Of::name).collect();
        let at = attribute::named(source, "points", name, &names)?;
        let of = all.swap_remove(at);
        if of != Of::Time {
            return Ok(Self { of, less: 0.0 });
        }
        if header.packed {
            let message = "the times of packed points are not read";
            return Err(source.error("points", message).hint("unpack the file to .las"));
        }
        let first = header.start..header.start + header.size;
        if first.end > source.len() {
            return Ok(Self { of, less: 0.0 });
        }
        let less = Self { of: of.clone(), less: 0.0 }.value(header.format, &source.part(first)?);
        Ok(Self { of, less })
    }

    /// Returns what a scale's title says.
    pub fn about(&self) -> About {
        let (name, unit) = (self.of.name().into(), self.of.unit().into());
        About { name, unit, ..About::default() }
    }

    /// Returns the value in the bytes of a point of a format.
    pub fn value(&self, format: u8, record: &[u8]) -> f64 {
        let short = |at: usize| u16::from_le_bytes([record[at], record[at + 1]]);
        let byte = |at: usize| f64::from(record[at]);
        let is_late = format >= 6;
        let value = match &self.of {
            Of::Intensity => f64::from(short(12)),
            Of::ReturnNumber => f64::from(record[14] & if is_late { 15 } else { 7 }),
            Of::Returns if is_late => f64::from(record[14] >> 4),
            Of::Returns => f64::from(record[14] >> 3 & 7),
            Of::Classification if is_late => byte(16),
            Of::Classification => f64::from(record[15] & 31),
            Of::ScanAngle if is_late => 0.006 * f64::from(short(18) as i16),
            Of::ScanAngle => f64::from(record[16] as i8),
            Of::UserData => byte(17),
            Of::PointSource => f64::from(short(if is_late { 20 } else { 18 })),
            Of::Time => {
                let at = if is_late { 22 } else { 20 };
                record[at..].first_chunk().map_or(f64::NAN, |bytes| f64::from_le_bytes(*bytes))
            }
            Of::Extra(extra) => extra.value(record),
            Of::Channel(channel) => match color_at(format) {
                Some(at) => f64::from(short(at + 2 * channel)),
                None => f64::NAN,
            },
        };
        value - self.less
    }
}

/// Returns the offset of the colour in a point of a format.
pub fn color_at(format: u8) -> Option<usize> {
    match format {
        2 => Some(20),
        3 | 5 => Some(28),
        7 | 8 | 10 => Some(30),
        _ => None,
    }
}

/// Returns the attributes that are read of the points of a file, in 64 bits.
pub fn listed(source: &Source, header: &Header) -> Vec<(form::Attribute, Attribute)> {
    let all = all(header, &describe::extras(source, header)).into_iter();
    let is_read = |of: &Of| *of != Of::Time || !header.packed;
    let named = |of: Of| {
        let described = form::Attribute { name: of.name().to_owned(), kind: of.kind() };
        (described, Attribute { of, less: 0.0 })
    };
    all.filter(is_read).map(named).collect()
}

/// Returns the attributes of the points of a file.
fn all(header: &Header, extras: &[Extra]) -> Vec<Of> {
    let mut all = vec![
        Of::Intensity,
        Of::ReturnNumber,
        Of::Returns,
        Of::Classification,
        Of::ScanAngle,
        Of::UserData,
        Of::PointSource,
    ];
    if matches!(header.format, 1 | 3..=10) {
        all.push(Of::Time);
    }
    if header.color_at.is_some() {
        all.extend([0, 1, 2].map(Of::Channel));
    }
    all.extend(extras.iter().cloned().map(Of::Extra));
    all
}

/// Returns the names of the attributes that may colour the points of a file.
pub fn names(header: &Header, extras: &[Extra]) -> Vec<String> {
    let all = all(header, extras);
    // The times of packed points are not read.
    let is_read = |of: &&Of| **of != Of::Time || !header.packed;
    all.iter().filter(is_read).map(|of| of.name().to_owned()).collect()
}
