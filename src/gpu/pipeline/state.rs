//! The state of a frame on the GPU, field by field as in shaders/shared/state.wgsl, and the
//! indirect dispatches of a depth pass.

use crate::scene::Scene;
use bytemuck::{Pod, Zeroable};

/// Bytes of `Pass` in frame.wgsl.
pub const PASS_BYTES: u64 = 32;

/// The progress of a frame: the words of state.wgsl.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
pub struct State {
    pub entries: u32,
    pub words: u32,
    pub splats: u32,
    pub passes: u32,
    pub next_sheet: u32,
    pub next_band: u32,
    pub target: u32,
    pub done: u32,
    pub stalled: u32,
    pub overflow: u32,
    pub hidden: u32,
    pub binned: u32,
    pub tiles: u32,
    pub touched: u32,
    pub advanced: u32,
    pub held: [u32; HELD_PASS_WORDS + Scene::MAX_FIELDS],
    pub unused: u32,
}

/// The words of a held pass before the first record words of the fields.
const HELD_PASS_WORDS: usize = 8;

/// Byte offset of the first record words of the fields in a held pass.
pub const HELD_RECORD_STARTS: u64 =
    (std::mem::offset_of!(State, held) + 4 * HELD_PASS_WORDS) as u64;

/// The words `done` and `stalled`.
pub const DONE_WORD: u32 = (std::mem::offset_of!(State, done) / 4) as u32;

pub const STALLED_WORD: u32 = (std::mem::offset_of!(State, stalled) / 4) as u32;

/// Byte offsets of the indirect dispatches in a pass's `arguments` (state.wgsl).
pub const SCAN_ARGUMENTS: u64 = 0;

pub const ORDER_ARGUMENTS: u64 = 16;

pub const MARCH_ARGUMENTS: u64 = 32;

pub const AGAIN_ARGUMENTS: u64 = 48;

pub const TILE_ARGUMENTS: u64 = 64;

pub const ARGUMENT_BYTES: u64 = 80;
