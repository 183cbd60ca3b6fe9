//! MTL libraries. tobj's own reader panics on a colour with fewer than three numbers and does not
//! know texture options. So the few relevant statements are read here, into tobj's types.

use super::super::shared::texture;
use crate::{
    Result,
    input::{Source, copy, text::without_mark},
    surface::{Material, Texture},
    warning,
};
use glam::Vec2;
use std::{
    collections::{BTreeSet, HashMap, HashSet},
    sync::Arc,
};

/// Bytes per material besides its name: here, in tobj's lists and in the mesh.
const MATERIAL: u64 = 1024;

/// The materials of one OBJ file, and the pictures already decoded for them.
pub(super) struct Library<'a, 'b> {
    source: &'a Source<'b>,
    pictures: HashMap<String, Option<Arc<Texture>>>,
    /// Pictures with a mask, by both statements.
    masked: HashMap<(Option<String>, Option<String>), Arc<Texture>>,
    /// Libraries already read; naming one again adds nothing.
    names: HashSet<String>,
    /// Statements and options that are not drawn.
    idle: BTreeSet<String>,
    /// The first damaged line, with its file.
    damaged: Option<String>,
}

impl<'a, 'b> Library<'a, 'b> {
    pub fn new(source: &'a Source<'b>) -> Self {
        Self {
            source,
            pictures: HashMap::new(),
            masked: HashMap::new(),
            names: HashSet::new(),
            idle: BTreeSet::new(),
            damaged: None,
        }
    }

    /// Reads the library that a `mtllib` statement names. A missing library is a warning and has no
    /// materials.
    pub fn load(&mut self, name: &str) -> Result<(Vec<tobj::Material>, HashMap<String, usize>)> {
        let mut materials: Vec<tobj::Material> = Vec::new();
        let mut index_of = HashMap::new();
        if name.is_empty() || !self.names.insert(name.to_owned()) {
            return Ok((materials, index_of));
        }
        let Some(path) = texture::find(self.source, "mtllib", name)? else {
            return Ok((materials, index_of));
        };
        let file = self.source.open_beside(&path)?;
        let text = copy::lossy(without_mark(file.bytes()));
        file.intact()?;
        for (line, number) in text.lines().zip(1..) {
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            if word == "newmtl" {
                self.source.spend(
                    "the size of the materials in bytes",
                    MATERIAL + 4 * rest.len() as u64,
                )?;
                index_of.insert(rest.to_owned(), materials.len());
                materials.push(tobj::Material { name: rest.to_owned(), ..Default::default() });
                continue;
            }
            let Some(material) = materials.last_mut() else { continue };
            match word {
                "Kd" | "Ke" => match (color(rest), word) {
                    (None, _) => self.damaged(&file, number, line),
                    (color, "Kd") => material.diffuse = color,
                    (Some(color), _) if color.iter().any(|&part| part > 0.0) => self.idle(word),
                    _ => {}
                },
                "d" | "Tr" => {
                    // An option of `d` may come before its number.
                    let value = rest.split_whitespace().last();
                    match value.and_then(|word| word.parse::<f64>().ok()) {
                        None => self.damaged(&file, number, line),
                        Some(opacity) if word == "d" => material.dissolve = Some(opacity),
                        // Only `d` is part of the format. Some programs use `Tr` like `d`, and
                        // write 1 for opaque. A fully transparent material is unlikely, so `Tr` 1
                        // is read as opaque.
                        Some(clear) if material.dissolve.is_none() && clear < 1.0 => {
                            material.dissolve = Some(1.0 - clear);
                        }
                        Some(_) => {}
                    }
                }
                "map_Kd" if !rest.is_empty() => material.diffuse_texture = Some(rest.to_owned()),
                "map_d" if !rest.is_empty() => material.dissolve_texture = Some(rest.to_owned()),
                "map_Ke" | "map_Ks" | "map_Ka" | "map_Ns" | "map_Bump" | "map_bump" | "bump"
                | "norm" | "disp" | "decal" | "refl" => self.idle(word),
                _ => {}
            }
        }
        Ok((materials, index_of))
    }

    /// Keeps a statement that is not drawn, to be named in one warning.
    fn idle(&mut self, word: &str) {
        if word != "map_Ka" {
            self.idle.insert(word.to_owned());
        }
    }

    /// Keeps a damaged line, which is left out.
    fn damaged(&mut self, file: &Source, number: usize, line: &str) {
        self.damaged.get_or_insert_with(|| {
            let text: String = line.chars().take(40).collect();
            format!("{}: line {number}: “{text}” is not valid", file.path.display())
        });
    }

    /// Says which statements are not drawn, and that a line is damaged.
    pub fn warn(&self) {
        let file = self.source.path.display();
        if let Some(damaged) = &self.damaged {
            warning::give!("{damaged}; such lines are left out");
        }
        if !self.idle.is_empty() {
            let idle: Vec<&str> = self.idle.iter().map(String::as_str).collect();
            warning::give!("{file}: its materials have {}, not drawn", idle.join(", "));
        }
    }

    /// Returns the material with its picture decoded, and how it shifts texture coordinates.
    pub fn finish(&mut self, material: &tobj::Material) -> Result<(Material, Shift)> {
        let place = format!("material “{}”", material.name);
        let color = material.diffuse_texture.as_deref().map(Reference::of);
        let mask = material.dissolve_texture.as_deref().map(Reference::of);
        let shift =
            color.as_ref().or(mask.as_ref()).map_or(Shift::NONE, |reference| reference.shift);
        for reference in color.iter().chain(&mask) {
            reference.idle.iter().for_each(|option| self.idle(option));
        }
        let mut texture = self.picture(&place, color.as_ref())?;
        // Some programs write a black Kd with a picture, which would make the picture invisible.
        let default = [if texture.is_some() { 1.0 } else { 0.8 }; 3];
        let [r, g, b] = match material.diffuse {
            Some([0.0, 0.0, 0.0]) | None if texture.is_some() => default,
            Some(color) => color,
            None => default,
        };
        if let Some(mask) = self.picture(&place, mask.as_ref())? {
            let key = (material.diffuse_texture.clone(), material.dissolve_texture.clone());
            texture = match self.masked.get(&key) {
                Some(known) => Some(known.clone()),
                None => {
                    let masked = Arc::new(masked(self.source, texture.as_deref(), &mask)?);
                    self.masked.insert(key, masked.clone());
                    Some(masked)
                }
            };
        }
        let opacity = material.dissolve.unwrap_or(1.0);
        let color = [r, g, b, opacity]
            .map(|part| if part.is_finite() { part.clamp(0.0, 1.0) as f32 } else { 1.0 });
        Ok((Material { name: material.name.clone(), color, texture, unlit: false }, shift))
    }

    /// Returns the picture that a statement names, decoded once.
    fn picture(
        &mut self,
        place: &str,
        reference: Option<&Reference>,
    ) -> Result<Option<Arc<Texture>>> {
        let Some(Reference { name, .. }) = reference.filter(|reference| !reference.name.is_empty())
        else {
            return Ok(None);
        };
        if let Some(known) = self.pictures.get(name) {
            return Ok(known.clone());
        }
        let texture = texture::read_reference(self.source, place, name)?;
        self.pictures.insert(name.clone(), texture.clone());
        Ok(texture)
    }
}

/// Returns a colour of three numbers, or of one for all channels.
fn color(words: &str) -> Option<[f64; 3]> {
    let numbers: Option<Vec<f64>> =
        words.split_whitespace().map(|word| word.parse().ok()).collect();
    match numbers?[..] {
        [r, g, b, ..] => Some([r, g, b]),
        [grey] => Some([grey; 3]),
        _ => None,
    }
}

/// Returns a picture with the opacities of a mask: its alpha if it has one, else its brightness. It
/// has the size of the larger of both. Without a picture it is white.
fn masked(source: &Source, color: Option<&Texture>, mask: &Texture) -> Result<Texture> {
    let of_alpha = mask.texels.iter().any(|texel| texel[3] < 255);
    let [width, height] = match color {
        Some(color) => [color.width.max(mask.width), color.height.max(mask.height)],
        None => [mask.width, mask.height],
    };
    let count = width as usize * height as usize;
    source.room::<[u8; 4]>("a picture with its mask", count)?;
    let at = |texture: &Texture, x: u32, y: u32| -> [u8; 4] {
        if (texture.width, texture.height) == (width, height) {
            return texture.texels.get((y * width + x) as usize).copied().unwrap_or_default();
        }
        let uv = Vec2::new((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
        texture.sample(uv).map(|part| (part * 255.0).round() as u8)
    };
    let texel = |index: usize| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let [r, g, b, a] = color.map_or([255; 4], |color| at(color, x, y));
        let mask = at(mask, x, y);
        let share = if of_alpha { u32::from(mask[3]) } else { brightness(mask) };
        [r, g, b, ((u32::from(a) * share + 127) / 255) as u8]
    };
    Ok(Texture { width, height, texels: (0..count).map(texel).collect() })
}

/// Returns the brightness of a texel, 0 to 255 (Rec. 601).
fn brightness([r, g, b, _]: [u8; 4]) -> u32 {
    (299 * u32::from(r) + 587 * u32::from(g) + 114 * u32::from(b) + 500) / 1000
}

/// How a picture lies on texture coordinates: they are scaled and shifted before they are looked
/// up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shift {
    scale: Vec2,
    offset: Vec2,
}

impl Shift {
    const NONE: Self = Self { scale: Vec2::ONE, offset: Vec2::ZERO };

    /// Returns shifted texture coordinates. (0, 0) is the top left corner, but that at the bottom
    /// for the file.
    pub fn of(self, uv: Vec2) -> Vec2 {
        if self == Self::NONE {
            return uv;
        }
        let [u, v] = (Vec2::new(uv.x, 1.0 - uv.y) * self.scale + self.offset).to_array();
        Vec2::new(u, 1.0 - v)
    }
}

/// A statement that names a picture, as `map_Kd`: `-s 2 2 1 -clamp on name with spaces.png`.
#[derive(Debug, PartialEq)]
struct Reference {
    name: String,
    shift: Shift,
    /// Options that have an effect, but are not drawn.
    idle: Vec<String>,
}

impl Reference {
    fn of(statement: &str) -> Self {
        let mut reference = Self { name: String::new(), shift: Shift::NONE, idle: Vec::new() };
        let mut rest = statement.trim();
        while let Some(option) = rest.strip_prefix('-') {
            let (name, mut tail) = option.split_once(char::is_whitespace).unwrap_or((option, ""));
            let most = match name {
                "o" | "s" | "t" => 3,
                "mm" => 2,
                "blendu" | "blendv" | "boost" | "bm" | "cc" | "clamp" | "imfchan" | "texres"
                | "type" => 1,
                // A name that begins with a dash.
                _ => break,
            };
            let mut values: Vec<&str> = Vec::new();
            while values.len() < most {
                let Some((value, after)) = tail.trim_start().split_once(char::is_whitespace) else {
                    break;
                };
                // Numeric options may have fewer values than their maximum.
                if !values.is_empty() && value.parse::<f64>().is_err() {
                    break;
                }
                values.push(value);
                tail = after;
            }
            reference.apply(name, &values);
            rest = tail.trim();
        }
        reference.name = rest.trim_matches('"').to_owned();
        reference
    }

    /// Applies an option. Missing numbers keep their default.
    fn apply(&mut self, name: &str, values: &[&str]) {
        let number = |at: usize| values.get(at).and_then(|word| word.parse::<f32>().ok());
        let finite = |at: usize| number(at).filter(|number| number.is_finite());
        match name {
            "s" => self.shift.scale = Vec2::new(finite(0).unwrap_or(1.0), finite(1).unwrap_or(1.0)),
            "o" => {
                self.shift.offset = Vec2::new(finite(0).unwrap_or(0.0), finite(1).unwrap_or(0.0));
            }
            "mm" if values != ["0", "1"] => self.idle.push("-mm".into()),
            "clamp" if values == ["on"] => self.idle.push("-clamp on".into()),
            "t" => self.idle.push("-t".into()),
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_of_pictures_are_told_from_their_names() {
        let plain =
            |name: &str| Reference { name: name.into(), shift: Shift::NONE, idle: Vec::new() };
        for (statement, name) in [
            ("a.png", "a.png"),
            ("  wood and stone.png ", "wood and stone.png"),
            ("-bm 0.5 -imfchan l -texres 512 a b.png", "a b.png"),
            ("-s 1 1 1 -o 0 0 0 maps\\a.png", "maps\\a.png"),
            ("-blendu on -blendv off -cc on -clamp off \"a b.png\"", "a b.png"),
            ("-odd.png", "-odd.png"),
        ] {
            assert_eq!(Reference::of(statement), plain(name), "{statement}");
        }
        let shifted = Reference::of("-s 2 3 -o 0.5 7up.png");
        assert_eq!(
            (shifted.shift.scale, shifted.shift.offset),
            (Vec2::new(2.0, 3.0), Vec2::X * 0.5)
        );
        assert_eq!(shifted.name, "7up.png");
        assert_eq!(Reference::of("-clamp on -mm 0 2 a.png").idle, ["-clamp on", "-mm"]);
        // The bottom left corner stays where it is.
        assert_eq!(shifted.shift.of(Vec2::new(0.0, 1.0)), Vec2::new(0.5, 1.0));
    }
}
