//! Helpers that several tests share.

#![allow(dead_code, reason = "each program uses only a part")]

pub mod folder;
pub mod gpu;
pub mod grid;
pub mod outline;
pub mod psnr;
pub mod server;
