//! The tables of a scene's fields on the GPU: they are made again only for another transfer
//! function.

use crate::{
    bricks::Choice,
    gpu::{
        device::{Gpu, buffers::upload},
        uniforms::{Frame, FrameField},
    },
    math::{Sheets, View},
    plan::{field::Field, tables::Tables},
    scene::{Scene, Settings},
    volume::TransferFunction,
};

/// The tables of all fields, one behind the other.
#[derive(Debug)]
pub struct FieldTables {
    fields: Vec<PackedTables>,
    entries: Vec<[f32; 4]>,
    pub buffer: wgpu::Buffer,
}

/// The tables of one field, whose entries lie with the others.
#[derive(Debug)]
struct PackedTables {
    item: usize,
    transfer: TransferFunction,
    range: [f64; 2],
    diagonal: f64,
    /// The numbers of the tables, without entries.
    tables: Tables,
    starts: [u32; 4],
}

impl FieldTables {
    /// Makes the tables of a scene, unless `last` has them.
    pub fn of(gpu: &Gpu, scene: &Scene, last: Option<Self>) -> Self {
        let numbers = scene.fields();
        let fields = || numbers.iter().map(|number| (*number, &scene.items[*number]));
        let is_same = |last: &Self| {
            last.fields.len() == numbers.len()
                && last.fields.iter().zip(fields()).all(|(packed, (number, item))| {
                    packed.item == number && item.transfer() == Some(&packed.transfer)
                })
        };
        if let Some(last) = last
            && is_same(&last)
        {
            return last;
        }
        let mut entries = Vec::new();
        let made = fields().filter_map(|(number, item)| {
            let (transfer, range) = (item.transfer()?, item.value_range()?);
            let mut tables = Tables::of(item, transfer, range);
            let starts = pack(&mut tables, &mut entries);
            let (transfer, diagonal) = (transfer.clone(), item.field_diagonal());
            Some(PackedTables { item: number, transfer, range, diagonal, tables, starts })
        });
        let fields = made.collect();
        if entries.is_empty() {
            // A binding must hold something.
            entries = vec![[0.0; 4]; 2];
        }
        let buffer = upload(gpu, "tables", bytemuck::cast_slice(&entries));
        Self { fields, entries, buffer }
    }

    /// Returns the entries of the first field's transfer function, and of all tables behind them.
    pub fn entries(&self) -> &[[f32; 4]] {
        &self.entries
    }

    /// Returns the fields of the scene in a view. `choice` is that of a volume in bricks.
    pub fn in_view(
        &self,
        scene: &Scene,
        settings: &Settings,
        (view, choice): (&View, Option<&Choice>),
        sheets: &Sheets,
    ) -> Vec<Field> {
        let field = |packed: &PackedTables| {
            let light = settings.light_of(&packed.transfer, packed.range, packed.diagonal);
            let mut field = Field::new(&scene.items[packed.item], view, settings, choice);
            field.set_tables(&packed.tables, &packed.transfer, light, view, sheets);
            field
        };
        self.fields.iter().map(field).collect()
    }

    /// Packs the fields of a view, with the places of their tables.
    pub fn pack(&self, fields: &[Field], frame: &mut Frame) {
        for ((slot, field), packed) in frame.fields.iter_mut().zip(fields).zip(&self.fields) {
            *slot = FrameField::new(field, packed.starts);
        }
    }
}

/// Moves tables behind the entries of others. Returns where their parts start: the transfer
/// function, its integrals, the gradient's factors, and the kernel with its sections.
fn pack(tables: &mut Tables, entries: &mut Vec<[f32; 4]>) -> [u32; 4] {
    let factors = std::mem::take(&mut tables.factors);
    let factors = factors.into_iter().map(|factor| [factor, 0.0, 0.0, 0.0]).collect();
    let parts = [&mut tables.colors, &mut tables.integrals, &mut tables.radii].map(std::mem::take);
    let [colors, integrals, radii] = parts;
    let starts = [colors, integrals, factors, radii].map(|mut part: Vec<[f32; 4]>| {
        let start = entries.len() as u32;
        entries.append(&mut part);
        start
    });
    entries.append(&mut tables.sections);
    starts
}
