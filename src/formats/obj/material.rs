//! MTL libraries. tobj's own reader panics on a colour with fewer than three numbers and does not
//! know texture options. So the few relevant statements are read here, into tobj's types.

use super::super::shared::texture;
use crate::{
    Result,
    input::{Source, copy},
    surface::{Material, Texture},
};
use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

/// Bytes per material besides its name: here, in tobj's lists and in the mesh.
const MATERIAL: u64 = 1024;

/// The materials of one OBJ file, and the pictures already decoded for them.
pub(super) struct Library<'a, 'b> {
    source: &'a Source<'b>,
    pictures: HashMap<String, Option<Arc<Texture>>>,
    /// Libraries already read; naming one again adds nothing.
    names: HashSet<String>,
}

impl<'a, 'b> Library<'a, 'b> {
    pub fn new(source: &'a Source<'b>) -> Self {
        Self { source, pictures: HashMap::new(), names: HashSet::new() }
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
        let text = copy::lossy(file.bytes());
        file.intact()?;
        for (line, number) in text.lines().zip(1..) {
            let line = line.trim();
            let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim();
            let place = || format!("line {number}");
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
            let numbers = || -> Option<Vec<f64>> {
                rest.split_whitespace().map(|word| word.parse().ok()).collect()
            };
            match word {
                "Kd" => match numbers().as_deref() {
                    Some([r, g, b, ..]) => material.diffuse = Some([*r, *g, *b]),
                    Some([grey]) => material.diffuse = Some([*grey; 3]),
                    _ => {
                        return Err(file
                            .error(place(), format!("“{line}” is not a colour of three numbers")));
                    }
                },
                "d" => {
                    material.dissolve =
                        rest.split_whitespace().last().and_then(|word| word.parse().ok());
                }
                // Only `d` is part of the format. Some programs use `Tr` like `d`, and write 1 for
                // opaque. A fully transparent material is unlikely, so `Tr` 1 is read as opaque.
                "Tr" if material.dissolve.is_none() => {
                    material.dissolve = rest
                        .parse()
                        .ok()
                        .map(|clear: f64| 1.0 - clear)
                        .filter(|&opacity| opacity > 0.0);
                }
                "map_Kd" => {
                    material.diffuse_texture =
                        Some(file_name(rest)).filter(|name| !name.is_empty());
                }
                _ => {}
            }
        }
        Ok((materials, index_of))
    }

    /// Returns the material with its picture decoded.
    pub fn finish(&mut self, material: &tobj::Material) -> Result<Material> {
        let texture = match &material.diffuse_texture {
            None => None,
            Some(name) => match self.pictures.get(name) {
                Some(texture) => texture.clone(),
                None => {
                    let place = format!("material “{}”", material.name);
                    let texture = texture::read_reference(self.source, &place, name)?;
                    self.pictures.insert(name.clone(), texture.clone());
                    texture
                }
            },
        };
        // Some programs write a black Kd with a picture, which would make the picture invisible.
        let default = [if texture.is_some() { 1.0 } else { 0.8 }; 3];
        let [r, g, b] = match material.diffuse {
            Some([0.0, 0.0, 0.0]) | None if texture.is_some() => default,
            Some(color) => color,
            None => default,
        };
        let opacity = material.dissolve.unwrap_or(1.0);
        let color = [r, g, b, opacity]
            .map(|part| if part.is_finite() { part.clamp(0.0, 1.0) as f32 } else { 1.0 });
        Ok(Material { name: material.name.clone(), color, texture })
    }
}

/// Returns the file name in a `map_Kd` statement, after its options (`-s 2 2 1 name.png`).
fn file_name(statement: &str) -> String {
    let mut rest = statement.trim();
    while let Some(option) = rest.strip_prefix('-') {
        let (name, mut tail) = option.split_once(char::is_whitespace).unwrap_or((option, ""));
        let most = match name {
            "o" | "s" | "t" => 3,
            "mm" => 2,
            _ => 1,
        };
        for taken in 0..most {
            let Some((value, after)) = tail.trim_start().split_once(char::is_whitespace) else {
                break;
            };
            // Numeric options may have fewer values than their maximum.
            if taken > 0 && value.parse::<f64>().is_err() {
                break;
            }
            tail = after;
        }
        if tail.len() >= rest.len() {
            break;
        }
        rest = tail.trim();
    }
    rest.to_owned()
}
