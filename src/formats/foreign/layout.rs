//! Raw volumes and the small texts that describe them: the flags that read them.

use super::{Advice, head};
use crate::{formats::SampleType, input::Source};
use std::path::Path;

/// Sides of cubes and of slices that raw volumes often have.
const SIDES: [u64; 11] = [32, 64, 96, 100, 128, 192, 200, 256, 400, 512, 1024];

/// The layout of a raw volume, as flags.
struct Flags {
    dims: [u64; 3],
    sample_type: SampleType,
    spacing: Option<[f64; 3]>,
    is_big: bool,
}

impl Flags {
    fn bytes(&self) -> Option<u64> {
        let size = self.sample_type.bytes() as u64;
        self.dims.iter().try_fold(size, |all, &n| all.checked_mul(n))
    }

    /// Returns the command that draws a file.
    fn command(&self, file: &Path) -> String {
        let [x, y, z] = self.dims;
        let name = self.sample_type.name();
        let spacing =
            self.spacing.map_or(String::new(), |[x, y, z]| format!(" --spacing {x},{y},{z}"));
        let endian = if self.is_big { " --endian big" } else { "" };
        let file = quoted(&file.display().to_string());
        format!(
            "splatkit render {file} --dims {x}x{y}x{z} --type {name}{spacing}{endian} -o out.png"
        )
    }
}

/// Returns a name as a shell reads it.
fn quoted(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=,@".contains(c);
    if name.chars().all(is_plain) {
        name.into()
    } else {
        format!("'{}'", name.replace('\'', "'\\''"))
    }
}

/// Says what a text that describes a raw file means: QVis (`.dat`), or PVM's text before its data.
pub fn advice(source: &Source) -> Option<Advice> {
    let extension = source.path.extension()?.to_str()?.to_ascii_lowercase();
    if !matches!(extension.as_str(), "dat" | "hdr" | "inf" | "info") {
        return None;
    }
    let text = head(source);
    let field = |name: &str| {
        text.lines().find_map(|line| {
            let (key, value) = line.split_once(':').or_else(|| line.split_once('='))?;
            key.trim().eq_ignore_ascii_case(name).then(|| value.trim().to_owned())
        })
    };
    let (file, sizes) = (field("ObjectFileName")?, field("Resolution")?);
    let numbers = |text: &str| -> Option<[f64; 3]> {
        let all: Option<Vec<f64>> =
            text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
        all?.try_into().ok()
    };
    let dims = numbers(&sizes)?.map(|size| size as u64);
    let spacing = field("SliceThickness").and_then(|text| numbers(&text));
    let kind = field("Format").unwrap_or_else(|| "UCHAR".into()).to_ascii_uppercase();
    let sample_type = match kind.as_str() {
        "UCHAR" => SampleType::U8,
        "CHAR" => SampleType::I8,
        // 12 bits in 16.
        "USHORT" | "USHORT_12" => SampleType::U16,
        "SHORT" => SampleType::I16,
        "FLOAT" => SampleType::F32,
        "DOUBLE" => SampleType::F64,
        _ => return None,
    };
    let endian = field("Endianness").or_else(|| field("Endianess")).unwrap_or_default();
    let is_big = endian.eq_ignore_ascii_case("big");
    let flags = Flags { dims, sample_type, spacing, is_big };
    let beside = source.path.with_file_name(&file);
    Some(Advice {
        what: format!("the header of a raw volume (QVis), whose samples are in {file}"),
        hint: flags.command(&beside),
    })
}

/// Guesses the layout of a raw file from its name (`head_256x256x128_uint8.raw`) and its size.
pub fn raw(source: &Source) -> Option<Advice> {
    let name = source.path.file_name()?.to_str()?.to_ascii_lowercase();
    let extension = source.path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    let is_raw = ["raw", "vol", "bin", "dat", "img", "data"]
        .iter()
        .any(|known| extension.eq_ignore_ascii_case(known));
    let size = source.bytes().len() as u64;
    let named = sizes_in(&name).map(|dims| (dims, type_in(&name)));
    let guess = match named {
        Some((dims, kind)) => of_dims(dims, kind, size).map(|sample_type| Flags {
            dims,
            sample_type,
            spacing: None,
            is_big: name.contains("big"),
        }),
        None if is_raw && !is_text(source) => cube(size, type_in(&name)),
        None => return None,
    };
    let file = source.path;
    let what = match &named {
        Some(([x, y, z], _)) => format!("a raw volume of {x} × {y} × {z} samples, by its name"),
        None => format!("perhaps a raw volume, of {size} bytes without a header"),
    };
    let hint = match guess {
        Some(flags) => flags.command(file),
        None => format!(
            "give its layout: splatkit render {} --dims XxYxZ --type u8|i16|u16|f32 -o out.png; \
             X · Y · Z times the bytes of a sample must be {size}, or add --header BYTES",
            quoted(&file.display().to_string())
        ),
    };
    Some(Advice { what, hint })
}

/// Returns whether a file is too short for a volume, or begins as text.
fn is_text(source: &Source) -> bool {
    let bytes = source.bytes();
    let is_word = |&b: &u8| b.is_ascii_graphic() || b.is_ascii_whitespace();
    bytes.len() < 4096 || bytes[..512].iter().all(is_word)
}

/// Returns three sizes in a name: “256x256x128”, “256_256_128”.
fn sizes_in(name: &str) -> Option<[u64; 3]> {
    let words: Vec<&str> = name.split(|c: char| !c.is_ascii_digit()).collect();
    let joins: Vec<&str> =
        name.split(|c: char| c.is_ascii_digit()).filter(|s| !s.is_empty()).collect();
    let numbers: Vec<u64> = words.iter().filter_map(|word| word.parse().ok()).collect();
    // Between the numbers stands the same sign: x, × or _.
    let starts_with_digit = name.starts_with(|c: char| c.is_ascii_digit());
    let offset = usize::from(!starts_with_digit);
    (0..numbers.len().saturating_sub(2)).find_map(|at| {
        let [first, second] = [joins.get(at + offset)?, joins.get(at + offset + 1)?];
        let is_join = first == second && matches!(*first, "x" | "×" | "_" | "-" | "*");
        let dims = [numbers[at], numbers[at + 1], numbers[at + 2]];
        (is_join && dims.iter().all(|&n| n > 1)).then_some(dims)
    })
}

/// Returns the type of samples that a name tells.
fn type_in(name: &str) -> Option<SampleType> {
    let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
    let has = |all: &[&str]| all.iter().any(|word| words.contains(word));
    [
        (&["uint8", "u8", "uchar", "8bit", "byte", "ubyte"][..], SampleType::U8),
        (&["int8", "i8", "char"], SampleType::I8),
        (&["uint16", "u16", "ushort", "16bit"], SampleType::U16),
        (&["int16", "i16", "short", "int16le"], SampleType::I16),
        (&["uint32", "u32", "uint"], SampleType::U32),
        (&["int32", "i32", "int"], SampleType::I32),
        (&["float32", "f32", "float", "32f"], SampleType::F32),
        (&["float64", "f64", "double"], SampleType::F64),
    ]
    .into_iter()
    .find_map(|(names, kind)| has(names).then_some(kind))
}

/// Returns the type of samples that makes these dimensions fill a file.
fn of_dims(dims: [u64; 3], named: Option<SampleType>, size: u64) -> Option<SampleType> {
    let fills = |kind: &SampleType| {
        let flags = Flags { dims, sample_type: *kind, spacing: None, is_big: false };
        flags.bytes() == Some(size)
    };
    let likely = [SampleType::U8, SampleType::U16, SampleType::F32, SampleType::F64];
    named.filter(fills).or_else(|| likely.into_iter().find(fills))
}

/// Returns a layout of usual sizes that fills a file: a cube, or slices of a square.
fn cube(size: u64, named: Option<SampleType>) -> Option<Flags> {
    let kinds = match named {
        Some(kind) => vec![kind],
        None => vec![SampleType::U8, SampleType::U16, SampleType::F32],
    };
    let flags = |dims, sample_type| Flags { dims, sample_type, spacing: None, is_big: false };
    let samples = |kind: &SampleType| {
        let bytes = kind.bytes() as u64;
        size.is_multiple_of(bytes).then_some(size / bytes).filter(|&n| n > 0)
    };
    for &kind in &kinds {
        let Some(count) = samples(&kind) else { continue };
        let side = (count as f64).cbrt().round() as u64;
        if side > 1 && side.checked_pow(3) == Some(count) {
            return Some(flags([side; 3], kind));
        }
    }
    for &kind in &kinds {
        let Some(count) = samples(&kind) else { continue };
        for side in SIDES.into_iter().rev() {
            let slices = count / (side * side);
            if count.is_multiple_of(side * side) && slices > 1 && slices <= 4 * side {
                return Some(flags([side, side, slices], kind));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::tests::asked;

    fn hint(name: &str, size: usize) -> String {
        asked(name, &vec![0; size]).map_or(String::new(), |advice| advice.hint)
    }

    #[test]
    fn raw_files_are_guessed() {
        for (name, size, flags) in [
            ("head_4x5x6_uint8.raw", 120, "--dims 4x5x6 --type u8 -o"),
            ("head_4x5x6_uint16.raw", 240, "--dims 4x5x6 --type u16 -o"),
            ("head_4x5x6.raw", 240, "--dims 4x5x6 --type u16 -o"),
            ("3_head-4_5_6-int16.vol", 240, "--dims 4x5x6 --type i16 -o"),
            ("4x5x6_float32.bin", 480, "--dims 4x5x6 --type f32 -o"),
            ("a b.raw", 64 * 64 * 64, "render 'a b.raw' --dims 64x64x64 --type u8 -o"),
            ("scan.raw", 4 * 32 * 32 * 7, "--dims 64x64x7 --type u8 -o"),
            ("scan_int16.raw", 4 * 32 * 32 * 7, "--dims 32x32x14 --type i16 -o"),
            ("scan.raw", 12_345, "times the bytes of a sample must be 12345"),
            ("head_4x5x6.raw", 7, "must be 7"),
        ] {
            assert!(hint(name, size).contains(flags), "{name}: {}", hint(name, size));
        }
        assert_eq!(asked("a.unknown", &[0; 4096]), None);
        assert_eq!(asked("a.raw", b"hello"), None);
    }

    #[test]
    fn headers_of_raw_files_give_the_flags() {
        let text = "ObjectFileName: engine.raw\nTaggedFileName: ---\nResolution: 256 256 \
                    110\nSliceThickness: 1 1 1.5\nFormat: USHORT\nEndianness: BIG\n";
        let advice = asked("folder/engine.dat", text.as_bytes()).unwrap();
        assert_eq!(
            advice.hint,
            "splatkit render folder/engine.raw --dims 256x256x110 --type u16 --spacing 1,1,1.5 \
             --endian big -o out.png"
        );
        assert!(advice.what.contains("(QVis)"));
    }
}
