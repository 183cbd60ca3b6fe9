//! The chunks of points of a LAZ file. The `laz` crate unpacks each chunk. Before that, this module
//! checks that the chunks lie within the file and how much memory they claim.

use super::{Fields, Header, Point, describe, time::Times};
use crate::{
    Result,
    input::{Source, isolate::isolated},
    parallel::prelude::*,
};
use laz::{
    DecompressionSelection, LazItem, LazItemType, LazVlr,
    laszip::ChunkTable,
    record::{
        LayeredPointRecordDecompressor, RecordDecompressor, SequentialPointRecordDecompressor,
    },
};
use std::{io::Cursor, ops::Range};

/// Points that are unpacked between two checks of the time limit.
const POINTS: usize = 1 << 16;

/// Bytes of an entry of the chunk table, at most: two numbers of 32 bits, which badly predicted
/// take somewhat more.
const MOST_ENTRY: usize = 64;

/// A chunk: its byte range in the file, and its number of points.
pub(super) struct Chunk {
    pub number: usize,
    pub bytes: Range<usize>,
    pub points: usize,
}

pub fn read(source: &Source, header: &Header) -> Result<Vec<Point>> {
    let layout = layout(source, header)?;
    let chunks = chunks(source, header, &layout)?;
    // Once in chunks, and once joined.
    source.room::<[Point; 2]>("the points", header.points)?;
    let parts: Vec<Vec<Point>> = chunks
        .par_iter()
        .map(|chunk| unpack(source, header, &layout, chunk))
        .collect::<Result<_>>()?;
    Ok(parts.into_iter().flatten().collect())
}

/// Returns how the points are packed. Isolated, because the decoder trusts what it reads and panics
/// on impossible values.
pub(super) fn layout(source: &Source, header: &Header) -> Result<LazVlr> {
    isolated(source, "LASzip record", || find_layout(source, header))
}

/// Returns how the points are packed, from one of the file's variable length records.
fn find_layout(source: &Source, header: &Header) -> Result<LazVlr> {
    let place = "LASzip record";
    let bytes = source.part(0..header.start)?;
    let (mut at, count) = header.records;
    for _ in 0..count {
        let field = Fields { bytes: &bytes, place: "a record before the points" };
        let cut = |message: String| source.error("header", message);
        let id = u16::from_le_bytes(field.at(at + 18).map_err(cut)?);
        let length = usize::from(u16::from_le_bytes(field.at(at + 20).map_err(cut)?));
        let is_wanted =
            id == LazVlr::RECORD_ID && bytes[at + 2..].starts_with(LazVlr::USER_ID.as_bytes());
        at += 54;
        let Some(data) = bytes.get(at..at + length) else {
            return Err(source.error("header", "a record before the points overlaps them"));
        };
        at += length;
        if is_wanted {
            let layout = LazVlr::from_buffer(data)
                .map_err(|error| source.error(place, error.to_string()))?;
            check(header, layout.items()).map_err(|message| source.error(place, message))?;
            return Ok(layout);
        }
    }
    Err(source.error("header", "marks the points as compressed, but has no LASzip record"))
}

/// Checks that the items that a point is packed as are those of its format.
fn check(header: &Header, items: &[LazItem]) -> Result<(), String> {
    let size: usize = items.iter().map(|item| usize::from(item.size())).sum();
    if size != header.size {
        return Err(format!(
            "packs points of {size} bytes, but the header claims points of {} bytes",
            header.size
        ));
    }
    let layered = header.format >= 6;
    let first = if layered { LazItemType::Point14 } else { LazItemType::Point10 };
    if items.first().map(LazItem::item_type) != Some(first) {
        return Err(format!("does not begin with the item of point format {}", header.format));
    }
    let versions = if layered { 3..=4 } else { 1..=2 };
    match items.iter().find(|item| !versions.contains(&item.version())) {
        Some(item) => Err(format!(
            "uses version {} of an item, which is not known for this \
                         format",
            item.version()
        )),
        None => Ok(()),
    }
}

/// Returns the chunks from the file's chunk table. Isolated, as [`layout`].
pub(super) fn chunks(source: &Source, header: &Header, layout: &LazVlr) -> Result<Vec<Chunk>> {
    isolated(source, "chunk table", || find_chunks(source, header, layout))
}

fn find_chunks(source: &Source, header: &Header, layout: &LazVlr) -> Result<Vec<Chunk>> {
    // Before version 2 of LASzip there were no chunks: the points are packed as one.
    const POINT_WISE: [u8; 2] = 1u16.to_le_bytes();
    let described = describe::record(source, header, LazVlr::USER_ID, LazVlr::RECORD_ID);
    if header.points > 0 && described.is_some_and(|data| data.starts_with(&POINT_WISE)) {
        let bytes = header.start..source.len();
        return Ok(vec![Chunk { number: 0, bytes, points: header.points }]);
    }
    let (wrong, length) = (|message: String| source.error("chunk table", message), source.len());
    let long = |at: usize| -> Result<i64> {
        let bytes = source.part(at.min(length)..length.min(at + ChunkTable::OFFSET_SIZE))?;
        let bytes = bytes.first_chunk().ok_or_else(|| wrong(format!("ends at byte {length}")))?;
        Ok(i64::from_le_bytes(*bytes))
    };
    // Writers that cannot seek back put the table's offset at the end of the file instead of the
    // start.
    let mut table = long(header.start)?;
    if table <= header.start as i64 {
        table = long(length - ChunkTable::OFFSET_SIZE)?;
    }
    let table = usize::try_from(table).ok().filter(|&table| table > header.start && table < length);
    let Some(table) = table else {
        return Err(wrong("lies outside of the file: it is cut".into()));
    };
    // The crate allocates all entries that the table claims.
    let claimed = (long(table)? >> 32) as u32 as usize;
    if claimed > table - header.start {
        return Err(wrong(format!("claims {claimed} chunks in {} bytes", table - header.start)));
    }
    source.room::<[Chunk; 2]>("the chunk table", claimed)?;
    // The crate expects the offset of the table before it.
    let most = claimed.saturating_mul(MOST_ENTRY).saturating_add(MOST_ENTRY);
    let mut bytes = (ChunkTable::OFFSET_SIZE as i64).to_le_bytes().to_vec();
    bytes.extend_from_slice(&source.part(table..table.saturating_add(most).min(length))?);
    let entries = ChunkTable::read_from(&mut Cursor::new(bytes), layout)
        .map_err(|error| wrong(error.to_string()))?;
    let mut at = header.start + ChunkTable::OFFSET_SIZE;
    let mut left = header.points;
    let mut chunks = Vec::new();
    for (number, entry) in (&entries).into_iter().enumerate() {
        let points = usize::try_from(entry.point_count).unwrap_or(usize::MAX).min(left);
        let end = usize::try_from(entry.byte_count).ok().and_then(|size| at.checked_add(size));
        let Some(end) = end.filter(|&end| end <= table) else {
            return Err(wrong(format!("chunk {number} ends after the packed points")));
        };
        chunks.push(Chunk { number, bytes: at..end, points });
        at = end;
        left -= points;
    }
    if left > 0 {
        return Err(wrong(format!(
            "has {} points, but the header counts {}",
            header.points - left,
            header.points
        )));
    }
    chunks.retain(|chunk| chunk.points > 0);
    Ok(chunks)
}

/// Unpacks a chunk point by point, so that memory grows with the points actually unpacked.
pub(super) fn unpack(
    source: &Source,
    header: &Header,
    layout: &LazVlr,
    chunk: &Chunk,
) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    visit(source, header, layout, chunk, |record| points.extend(header.point(record)))?;
    Ok(points)
}

/// Calls `take` with the bytes of each point of a chunk. Isolated, as [`layout`].
pub(super) fn visit(
    source: &Source,
    header: &Header,
    layout: &LazVlr,
    chunk: &Chunk,
    take: impl FnMut(&[u8]),
) -> Result<()> {
    isolated(source, &format!("chunk {}", chunk.number), || {
        visit_here(source, header, layout, chunk, take)
    })
}

fn visit_here(
    source: &Source,
    header: &Header,
    layout: &LazVlr,
    chunk: &Chunk,
    mut take: impl FnMut(&[u8]),
) -> Result<()> {
    let wrong = |message: String| source.error(format!("chunk {}", chunk.number), message);
    let bytes = source.part(chunk.bytes.clone())?;
    let input = Cursor::new(&*bytes);
    let mut decoder: Box<dyn RecordDecompressor<Cursor<&[u8]>>> = if header.format >= 6 {
        check_layers(&bytes, header, layout).map_err(wrong)?;
        let mut decoder = LayeredPointRecordDecompressor::new(input);
        decoder.set_fields_from(layout.items()).map_err(|error| wrong(error.to_string()))?;
        // Times have a layer of their own, which is skipped: see time.rs.
        decoder.set_selection(DecompressionSelection::all().skip_gps_time());
        Box::new(decoder)
    } else {
        let mut decoder = SequentialPointRecordDecompressor::new(input);
        for &item in layout.items() {
            match (item.item_type(), item.version()) {
                (LazItemType::GpsTime, 2) => decoder.add_field_decompressor(Times::new()),
                _ => decoder
                    .set_fields_from(&vec![item])
                    .map_err(|error| wrong(error.to_string()))?,
            }
        }
        Box::new(decoder)
    };
    let mut record = vec![0; header.size];
    for number in 0..chunk.points {
        if number.is_multiple_of(POINTS) {
            source.check_time()?;
        }
        let unpacked = decoder.decompress_next(&mut record);
        unpacked.map_err(|error| {
            wrong(format!("ends after {number} of {} points: {error}", chunk.points))
        })?;
        take(&record);
    }
    Ok(())
}

/// Checks the sizes of the layers. A layered chunk begins with its first point, its count and the
/// size of each layer. The decoder allocates these sizes.
fn check_layers(bytes: &[u8], header: &Header, layout: &LazVlr) -> Result<(), String> {
    let layers = layout.items().iter().map(|item| match item.item_type() {
        LazItemType::Point14 => 9,
        LazItemType::RGBNIR14 => 2,
        LazItemType::Byte14(count) => usize::from(count),
        _ => 1,
    });
    let first = header.size + 4;
    let sizes = bytes.get(first..first + 4 * layers.sum::<usize>());
    let Some(sizes) = sizes else { return Err("ends before its layers".into()) };
    let size = |bytes: &[u8]| {
        u64::from(bytes.iter().rev().fold(0u32, |size, &byte| size << 8 | u32::from(byte)))
    };
    let claimed: u64 = sizes.chunks_exact(4).map(size).sum();
    let present = bytes.len() - first - sizes.len();
    if claimed > present as u64 {
        return Err(format!("claims {claimed} bytes of layers, but has {present}"));
    }
    Ok(())
}
