//! What the variable length records of a LAS file say of its points: their extra bytes and their
//! coordinate reference system. Damaged records are not errors, because points are read without
//! them.

use super::{Fields, Header, SIZES, extra::Extra};
use crate::input::{Source, copy};

/// The bytes of a record that describes an extra number.
const DESCRIPTION: usize = 192;

/// Records that are looked at.
const MOST_RECORDS: u32 = 1 << 16;

/// Returns the version and the point format of a file.
pub fn layout(header: &Header) -> String {
    let Header { minor, format, packed, .. } = *header;
    format!("{} 1.{minor}, point format {format}", if packed { "LAZ" } else { "LAS" })
}

/// Returns the numbers in the extra bytes of a point, in their order.
pub fn extras(source: &Source, header: &Header) -> Vec<Extra> {
    let mut extras = Vec::new();
    let mut at = SIZES[usize::from(header.format)];
    let Some(bytes) = record(source, header, "LASF_Spec", 4) else { return extras };
    for description in bytes.chunks_exact(DESCRIPTION) {
        let (kind, options) = (description[2], description[3]);
        let name = copy::lossy(&description[4..36]);
        let name = name.split('\0').next().unwrap_or_default().trim();
        // Bytes of no type; `options` is their number.
        if kind == 0 {
            at += usize::from(options);
            continue;
        }
        // Pairs and triples are deprecated, but written.
        let (count, kind) = (1 + usize::from(kind - 1) / 10, (kind - 1) % 10);
        if count > 3 {
            break;
        }
        for part in 0..count {
            let double = |start: usize| {
                let bytes = description[start + 8 * part..].first_chunk();
                bytes.map_or(0.0, |bytes| f64::from_le_bytes(*bytes))
            };
            let has = |bit: u8| options >> bit & 1 == 1;
            extras.push(Extra {
                name: if count == 1 { name.to_owned() } else { format!("{name}[{part}]") },
                at,
                kind,
                scale: if has(3) { double(112) } else { 1.0 },
                offset: if has(4) { double(136) } else { 0.0 },
                missing: description[40 + 8 * part..].first_chunk().copied().filter(|_| has(0)),
            });
            at += Extra::SIZES[usize::from(kind)];
        }
    }
    extras.retain(|extra| {
        let size = Extra::SIZES[usize::from(extra.kind)];
        !extra.name.is_empty() && extra.at + size <= header.size
    });
    extras
}

/// Returns the coordinate reference system: its code or its name; empty if the file does not say.
pub fn crs(source: &Source, header: &Header) -> String {
    const USER: &str = "LASF_Projection";
    if let Some(bytes) = record(source, header, USER, 2112) {
        let text = copy::lossy(&bytes);
        let name = text.split('"').nth(1).unwrap_or_default().trim();
        if !name.is_empty() {
            return match code_of(&text) {
                Some(code) => format!("{name} ({code})"),
                None => name.to_owned(),
            };
        }
    }
    let Some(keys) = record(source, header, USER, 34735) else { return String::new() };
    let short = |at: usize| {
        let bytes = keys.get(at..at + 2)?;
        Some(u16::from_le_bytes([bytes[0], bytes[1]]))
    };
    // After a head of four numbers, each key has four: its number, where its value is, the count
    // and the value. Projected systems come before geographic ones.
    let value = |wanted: u16| {
        let mut entries = (1..keys.len() / 8).map(|entry| 8 * entry);
        let at = entries.find(|&at| short(at) == Some(wanted) && short(at + 2) == Some(0))?;
        short(at + 6).filter(|&code| code != 0 && code != 32767)
    };
    value(3072).or_else(|| value(2048)).map_or(String::new(), |code| format!("EPSG:{code}"))
}

/// Returns the code at the end of a system in Well-Known Text, that of the whole: `EPSG:25832`.
fn code_of(text: &str) -> Option<String> {
    let at = ["AUTHORITY[", "ID["].iter().filter_map(|word| text.rfind(word)).max()?;
    let words: Vec<&str> =
        text[at..].split(['[', ',', ']']).map(|word| word.trim().trim_matches('"')).collect();
    // That of a part ends before the end of the whole.
    let closed = text[at..].chars().filter(|letter| *letter == ']').count();
    match words[..] {
        [_, authority, code, ..] if closed == 2 => Some(format!("{authority}:{code}")),
        _ => None,
    }
}

/// Returns the bytes of the record with a user's identifier and a number.
pub fn record(source: &Source, header: &Header, user: &str, number: u16) -> Option<Vec<u8>> {
    let bytes = source.part(0..header.start).ok()?;
    let field = Fields { bytes: &bytes, place: "a record" };
    let (mut at, count) = header.records;
    for _ in 0..count.min(MOST_RECORDS) {
        let id = u16::from_le_bytes(field.at(at + 18).ok()?);
        let length = usize::from(u16::from_le_bytes(field.at(at + 20).ok()?));
        let owner = bytes.get(at + 2..at + 18)?;
        let data = bytes.get(at + 54..at + 54 + length)?;
        let is_wanted = id == number
            && owner.starts_with(user.as_bytes())
            && owner.get(user.len()).is_none_or(|&byte| byte == 0);
        if is_wanted {
            return Some(data.to_vec());
        }
        at += 54 + length;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_code_of_the_whole_is_the_last() {
        let part = r#"GEOGCS["ETRS89",AUTHORITY["EPSG","4258"]]"#;
        let whole = format!(r#"PROJCS["ETRS89 / UTM 32",{part},AUTHORITY["EPSG","25832"]]"#);
        assert_eq!(code_of(&whole).as_deref(), Some("EPSG:25832"));
        assert_eq!(code_of(&format!(r#"PROJCS["local",{part},UNIT["metre",1]]"#)), None);
        assert_eq!(code_of(r#"PROJCRS["a",ID["EPSG",25832]]"#).as_deref(), Some("EPSG:25832"));
    }
}
