//! Helpers that several integration tests share.

#![allow(dead_code, reason = "each test file uses only a part")]

pub mod folder;
pub mod grid;
pub mod outline;
pub mod psnr;
pub mod server;
