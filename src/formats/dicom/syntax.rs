//! Transfer syntaxes: how a file's data set and its pixels are encoded (PS3.5, section 10).

use super::element::Coding;
use crate::formats::Endian;

/// How pixels are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Packing {
    /// Not at all.
    Native,
    Rle,
    Jpeg,
    JpegLs,
    Jpeg2000,
    /// By the method of this name, which is not read.
    Other(&'static str),
}

/// How a file is encoded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Syntax {
    pub coding: Coding,
    /// Whether the data set is packed as a whole, by deflate.
    pub is_deflated: bool,
    pub packing: Packing,
}

/// Returns the transfer syntax of an identifier.
pub fn syntax(identifier: &str) -> Syntax {
    let packed = |packing| Syntax { coding: Coding::PLAIN, is_deflated: false, packing };
    let native = packed(Packing::Native);
    match identifier.strip_prefix("1.2.840.10008.1.2").unwrap_or("unknown") {
        "" => Syntax { coding: Coding::IMPLICIT, ..native },
        ".1" | ".1.98" => native,
        ".1.99" => Syntax { is_deflated: true, ..native },
        ".2" => Syntax { coding: Coding { is_explicit: true, endian: Endian::Big }, ..native },
        ".5" => packed(Packing::Rle),
        ".4.50" | ".4.51" | ".4.57" | ".4.70" => packed(Packing::Jpeg),
        ".4.80" | ".4.81" => packed(Packing::JpegLs),
        ".4.90" | ".4.91" | ".4.92" | ".4.93" | ".4.201" | ".4.202" | ".4.203" => {
            packed(Packing::Jpeg2000)
        }
        ".4.94" | ".4.95" | ".4.204" | ".4.205" => packed(Packing::Other("JPIP references")),
        ".4.110" | ".4.111" | ".4.112" => packed(Packing::Other("JPEG XL")),
        ".4.100" | ".4.100.1" | ".4.101" | ".4.101.1" => packed(Packing::Other("MPEG-2")),
        ".4.102" | ".4.102.1" | ".4.103" | ".4.103.1" | ".4.104" | ".4.104.1" | ".4.105"
        | ".4.105.1" | ".4.106" | ".4.106.1" => packed(Packing::Other("MPEG-4 AVC")),
        ".4.107" | ".4.108" => packed(Packing::Other("HEVC")),
        _ => packed(Packing::Other("an unknown method")),
    }
}

/// Returns the coding of a data set that comes without a header: by its first element.
pub fn guess(bytes: &[u8]) -> Syntax {
    let is_explicit = bytes.get(4..6).is_some_and(|kind| kind.iter().all(u8::is_ascii_uppercase));
    // Data sets begin with a low group, mostly 0008.
    let is_big = bytes.starts_with(&[0]) && bytes.get(1).is_some_and(|&low| low != 0);
    let endian = if is_big { Endian::Big } else { Endian::Little };
    let coding = Coding { is_explicit, endian };
    Syntax { coding, is_deflated: false, packing: Packing::Native }
}
