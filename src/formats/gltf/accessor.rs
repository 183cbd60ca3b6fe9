//! Typed access to buffers: dequantised floats, colours and indices. Every range is checked before
//! a byte is read.

use super::buffers::Buffers;
use crate::Result;
use ::gltf::json::{self, accessor::ComponentType, validation::Checked};

/// A checked accessor.
struct Layout<'a> {
    count: usize,
    component: ComponentType,
    multiplicity: usize,
    normalized: bool,
    /// The bytes from the first element on, and the stride between elements. `None` means zeros.
    data: Option<(&'a [u8], usize)>,
    sparse: Option<Sparse<'a>>,
}

/// Elements that replace those of the base: packed indices (ascending or not) and packed values.
struct Sparse<'a> {
    component: ComponentType,
    indices: &'a [u8],
    values: &'a [u8],
}

impl Buffers<'_> {
    /// Returns the number of elements that an accessor claims; 0 if it does not exist.
    pub fn claimed(&self, index: usize) -> u64 {
        self.root.accessors.get(index).map_or(0, |accessor| accessor.count.0)
    }

    /// Returns all elements of an accessor with `N` components. Normalised integers are scaled to 0
    /// … 1 or −1 … 1; with `fractions`, all integers are.
    pub fn floats<const N: usize>(
        &self,
        index: usize,
        place: &str,
        fractions: bool,
    ) -> Result<Vec<[f32; N]>> {
        let layout = self.layout(index, place)?;
        if layout.multiplicity != N {
            let message = format!("has {} components where {N} are needed", layout.multiplicity);
            return Err(self.source.error(format!("{place}, accessor {index}"), message));
        }
        let size = layout.component.size();
        let scale = layout.normalized || fractions;
        let element = |bytes: &[u8]| {
            std::array::from_fn(|i| {
                let value = number(&bytes[i * size..], layout.component);
                (if scale { fraction(value, layout.component) } else { value }) as f32
            })
        };
        let mut out = match layout.data {
            Some((data, stride)) => {
                (0..layout.count).map(|i| element(&data[i * stride..])).collect()
            }
            None => vec![[0.0; N]; layout.count],
        };
        if let Some(sparse) = &layout.sparse {
            let values = sparse.values.chunks_exact(size * N);
            for (at, value) in sparse.indices.chunks_exact(sparse.component.size()).zip(values) {
                let at = number(at, sparse.component) as usize;
                let count = layout.count;
                let Some(slot) = out.get_mut(at) else {
                    let message =
                        format!("its sparse index {at} is not below its count of {count}");
                    return Err(self.source.error(format!("{place}, accessor {index}"), message));
                };
                *slot = element(value);
            }
        }
        Ok(out)
    }

    /// Returns linear colours with opacity, from three or four components.
    pub fn colors(&self, index: usize, place: &str) -> Result<Vec<[f32; 4]>> {
        if self.layout(index, place)?.multiplicity == 3 {
            let colors: Vec<[f32; 3]> = self.floats(index, place, true)?;
            return Ok(colors.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect());
        }
        self.floats(index, place, true)
    }

    /// Returns vertex indices, each below `vertices`.
    pub fn indices(&self, index: usize, place: &str, vertices: usize) -> Result<Vec<u32>> {
        let layout = self.layout(index, place)?;
        let place = format!("{place}, accessor {index}");
        let whole =
            matches!(layout.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        let (Some((data, stride)), true, 1, None) =
            (layout.data, whole, layout.multiplicity, &layout.sparse)
        else {
            return Err(self.source.error(place, "indices must be plain unsigned integers"));
        };
        (0..layout.count)
            .map(|i| {
                let vertex = number(&data[i * stride..], layout.component) as u32;
                if vertex as usize >= vertices {
                    let message =
                        format!("index {i} refers to vertex {vertex}, but there are {vertices}");
                    return Err(self.source.error(place.as_str(), message));
                }
                Ok(vertex)
            })
            .collect()
    }

    fn layout(&self, index: usize, place: &str) -> Result<Layout<'_>> {
        let place = format!("{place}, accessor {index}");
        let error = |message: String| self.source.error(place.as_str(), message);
        let Some(accessor) = self.root.accessors.get(index) else {
            return Err(error(format!(
                "does not exist; there are {} \
                                      accessors",
                self.root.accessors.len()
            )));
        };
        let (Checked::Valid(component), Checked::Valid(kind)) =
            (accessor.component_type, accessor.type_)
        else {
            return Err(error("has an unknown type".into()));
        };
        let (component, multiplicity) = (component.0, kind.multiplicity());
        let size = component.size() * multiplicity;
        let count = self.source.check_points(&format!("{place}: the count"), accessor.count.0)?;
        let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
        let data = match accessor.buffer_view {
            Some(view) => {
                let (bytes, stride) = self.view(view.value(), &place)?;
                let stride = stride.unwrap_or(size);
                if stride < size {
                    return Err(error(format!(
                        "the stride of {stride} bytes is less than an element's {size}"
                    )));
                }
                let before = (count as u64).saturating_sub(1).checked_mul(stride as u64);
                let last = if count == 0 { 0 } else { size as u64 };
                let end = before.and_then(|before| before.checked_add(last)?.checked_add(offset));
                if end.is_none_or(|end| end > bytes.len() as u64) {
                    let message = format!(
                        "{count} elements from byte {offset} reach beyond the view's {}",
                        bytes.len()
                    );
                    return Err(error(message));
                }
                Some((&bytes[offset as usize..], stride))
            }
            // The elements are zeros that the sparse part replaces. No bytes bound their count, so
            // the size of the whole file does.
            None if accessor.sparse.is_none() => {
                return Err(error("has no data".into())
                    .hint("compressed (meshopt, Draco) meshes are not read"));
            }
            None if (count as u64).saturating_mul(size as u64) > self.total() => {
                return Err(error(format!(
                    "claims {count} elements without a buffer view to hold them"
                )));
            }
            None => None,
        };
        let sparse = match &accessor.sparse {
            Some(sparse) => Some(self.sparse(sparse, size, &place)?),
            None => None,
        };
        Ok(Layout { count, component, multiplicity, normalized: accessor.normalized, data, sparse })
    }

    fn sparse(
        &self,
        sparse: &json::accessor::sparse::Sparse,
        size: usize,
        place: &str,
    ) -> Result<Sparse<'_>> {
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(self.source.error(place, "has sparse indices of an unknown type"));
        };
        let component = component.0;
        let part = |view: usize, offset: u64, size: usize| -> Result<&[u8]> {
            let bytes = self.view(view, place)?.0;
            let end = sparse
                .count
                .0
                .checked_mul(size as u64)
                .and_then(|length| length.checked_add(offset));
            match end.filter(|&end| end <= bytes.len() as u64) {
                Some(end) => Ok(&bytes[offset as usize..end as usize]),
                None => Err(self.source.error(
                    place,
                    format!(
                        "{} sparse elements reach beyond their view of {} bytes",
                        sparse.count.0,
                        bytes.len()
                    ),
                )),
            }
        };
        let (indices, values) = (&sparse.indices, &sparse.values);
        Ok(Sparse {
            component,
            indices: part(indices.buffer_view.value(), indices.byte_offset.0, component.size())?,
            values: part(values.buffer_view.value(), values.byte_offset.0, size)?,
        })
    }
}

/// Converts a component of this type to a number. `bytes` has at least its size.
fn number(bytes: &[u8], component: ComponentType) -> f64 {
    match component {
        ComponentType::I8 => f64::from(bytes[0] as i8),
        ComponentType::U8 => f64::from(bytes[0]),
        ComponentType::I16 => f64::from(i16::from_le_bytes([bytes[0], bytes[1]])),
        ComponentType::U16 => f64::from(u16::from_le_bytes([bytes[0], bytes[1]])),
        ComponentType::U32 => {
            f64::from(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        }
        ComponentType::F32 => {
            f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        }
    }
}

/// Converts a normalised integer to a fraction (glTF 2.0, section 3.11).
fn fraction(value: f64, component: ComponentType) -> f64 {
    match component {
        ComponentType::I8 => (value / 127.0).max(-1.0),
        ComponentType::U8 => value / 255.0,
        ComponentType::I16 => (value / 32767.0).max(-1.0),
        ComponentType::U16 => value / 65535.0,
        ComponentType::U32 | ComponentType::F32 => value,
    }
}
