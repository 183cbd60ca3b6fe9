//! Materials: base colours, pictures, and how alpha modes change opacities.

use super::{super::shared::texture, Builder, buffers, displayed};
use crate::{
    Result,
    surface::{Material, Texture},
};
use ::gltf::json::{self, material::AlphaMode, validation::Checked};
use std::sync::Arc;

/// The base colour of a material.
pub(super) struct Base<'a> {
    name: &'a str,
    /// RGB in linear light, and opacity.
    factor: [f32; 4],
    pub texture: Option<&'a json::texture::Info>,
    pub alpha: Alpha,
    unlit: bool,
}

/// Returns what to do about an extension that is not read.
pub(super) fn remedy(extension: &str) -> String {
    let tool = "npx @gltf-transform/cli";
    match extension {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            format!("write the file without compression: {tool} copy in.glb out.glb")
        }
        "KHR_texture_basisu" => {
            format!("write its pictures as PNG: {tool} ktxdecompress in.glb out.glb")
        }
        "EXT_texture_avif" => format!("write its pictures as WebP: {tool} webp in.glb out.glb"),
        _ => "write the file without this extension".into(),
    }
}

/// How the alphas of texels and vertices are converted (glTF 2.0, section 3.9.4).
///
/// MASK compares the product of factor, texel and vertex alpha with the cutoff. Texels and vertices
/// are stored separately, so each is compared as if the other were opaque. That is exact if one of
/// the two is opaque; otherwise it hides nothing that should be visible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Alpha {
    /// BLEND: alphas are kept.
    Blend,
    /// Opaque from this alpha on, and invisible below: 0 for OPAQUE, 256 if a mask hides
    /// everything.
    From(u16),
}

impl Alpha {
    const OPAQUE: Self = Self::From(0);

    fn of(material: &json::Material, factor: f32) -> Self {
        match material.alpha_mode {
            Checked::Valid(AlphaMode::Blend) => Self::Blend,
            Checked::Valid(AlphaMode::Mask) => {
                let cutoff = material.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0);
                let shows = |alpha: &u16| factor * f32::from(*alpha) / 255.0 >= cutoff;
                Self::From((0..=255).find(shows).unwrap_or(256))
            }
            // An unknown mode counts as the default.
            Checked::Valid(AlphaMode::Opaque) | Checked::Invalid => Self::OPAQUE,
        }
    }

    pub fn apply(self, alpha: u8) -> u8 {
        match self {
            Self::Blend => alpha,
            Self::From(least) if u16::from(alpha) >= least => 255,
            Self::From(_) => 0,
        }
    }
}

impl<'a> Builder<'a> {
    /// Returns the base colour of a file's material (`None`: the default one). `place` names what
    /// refers to it.
    pub(super) fn base(&mut self, material: Option<usize>, place: &str) -> Result<Base<'a>> {
        let root = self.root;
        let Some(index) = material else {
            return Ok(Base {
                name: "default",
                factor: [1.0; 4],
                texture: None,
                alpha: Alpha::OPAQUE,
                unlit: false,
            });
        };
        let Some(material) = root.materials.get(index) else {
            return Err(self
                .source
                .error(place, format!("refers to material {index}, which does not exist")));
        };
        // If a file has both, the extension takes precedence over the core material, which is a
        // fallback for programs that do not know the extension.
        let extensions = material.extensions.as_ref();
        let (factor, texture) =
            match extensions.and_then(|extensions| extensions.pbr_specular_glossiness.as_ref()) {
                Some(glossy) => (glossy.diffuse_factor.0, &glossy.diffuse_texture),
                None => {
                    let rough = &material.pbr_metallic_roughness;
                    (rough.base_color_factor.0, &rough.base_color_texture)
                }
            };
        let name = material.name.as_deref().unwrap_or_default();
        let alpha = Alpha::of(material, factor[3]);
        let unlit = extensions.is_some_and(|extensions| extensions.unlit.is_some());
        let mut base = Base { name, factor, texture: texture.as_ref(), alpha, unlit };
        let emission = material.emissive_factor.0;
        if !unlit && emission.iter().any(|&part| part > 0.0) {
            // A black surface shows its emission alone.
            if factor[..3] == [0.0; 3] {
                base.factor[..3].copy_from_slice(&emission);
                base.texture = material.emissive_texture.as_ref();
                base.unlit = true;
            } else {
                self.idle.insert("emission".into());
            }
        }
        if !base.unlit && material.normal_texture.is_some() {
            self.idle.insert("normal maps".into());
        }
        if !base.unlit && material.occlusion_texture.is_some() {
            self.idle.insert("occlusion maps".into());
        }
        Ok(base)
    }

    /// Returns the index of a material in the mesh; adds the material at its first use.
    pub(super) fn material(&mut self, index: Option<usize>, base: &Base) -> Result<u32> {
        if let Some(&known) = self.material_of.get(&index) {
            return Ok(known);
        }
        let mut color = displayed(base.factor);
        if base.alpha != Alpha::Blend {
            // The alphas of texels and vertices include the factor's alpha. Without them, the
            // factor's alpha alone decides.
            color[3] = f32::from(base.alpha.apply(255)) / 255.0;
        }
        let texture =
            base.texture.map(|info| self.texture(info.index.value(), base.alpha)).transpose()?;
        let id = self.mesh.materials.len() as u32;
        self.mesh.materials.push(Material {
            name: base.name.into(),
            color,
            texture,
            unlit: base.unlit,
        });
        self.material_of.insert(index, id);
        Ok(id)
    }

    fn texture(&mut self, index: usize, alpha: Alpha) -> Result<Arc<Texture>> {
        let Some(texture) = self.root.textures.get(index) else {
            let count = self.root.textures.len();
            return Err(self.source.error(
                format!("texture {index}"),
                format!(
                    "does not exist; there are {count} \
                                                            textures"
                ),
            ));
        };
        let others = texture.extensions.as_ref().map(|extensions| &extensions.others);
        let source_of = |name: &str| others?.get(name)?.get("source")?.as_u64();
        if let Some(image) = source_of("EXT_texture_webp") {
            return self.picture(usize::try_from(image).unwrap_or(usize::MAX), alpha);
        }
        let image = texture.source.value();
        if image == u32::MAX as usize {
            let place = format!("texture {index}");
            let other = others.and_then(|others| others.keys().next());
            return Err(match other {
                Some(name) => self
                    .source
                    .error(place, format!("has its picture by {name}, which is not supported"))
                    .hint(remedy(name)),
                None => self.source.error(place, "has no picture"),
            });
        }
        self.picture(image, alpha)
    }

    /// Returns a picture with the alphas of an alpha mode, made once for each mode. Modes that
    /// leave all alphas unchanged share it.
    fn picture(&mut self, image: usize, alpha: Alpha) -> Result<Arc<Texture>> {
        if let Some(known) = self.pictures.get(&(image, alpha)) {
            return Ok(known.clone());
        }
        let mut picture = match alpha {
            Alpha::Blend => self.decode(image)?,
            Alpha::From(_) => self.picture(image, Alpha::Blend)?,
        };
        if picture.texels.iter().any(|texel| alpha.apply(texel[3]) != texel[3]) {
            self.source.room::<[u8; 4]>("a picture", picture.texels.len())?;
            for texel in &mut Arc::make_mut(&mut picture).texels {
                texel[3] = alpha.apply(texel[3]);
            }
        }
        self.pictures.insert((image, alpha), picture.clone());
        Ok(picture)
    }

    fn decode(&self, image: usize) -> Result<Arc<Texture>> {
        let place = format!("image {image}");
        let Some(entry) = self.root.images.get(image) else {
            return Err(self.source.error(
                place,
                format!(
                    "does not exist; there are {} \
                                       images",
                    self.root.images.len()
                ),
            ));
        };
        match (&entry.uri, entry.buffer_view) {
            (Some(uri), _) => {
                texture::decode(self.source, &place, &buffers::resolve(self.source, &place, uri)?)
            }
            (None, Some(view)) => {
                texture::decode(self.source, &place, self.buffers.view(view.value(), &place)?.0)
            }
            (None, None) => Err(self.source.error(place, "has neither a URI nor a buffer view")),
        }
    }
}
