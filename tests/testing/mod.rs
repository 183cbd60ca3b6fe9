//! Helpers that several integration tests share.

#![allow(dead_code, reason = "each test file uses only a part")]

pub mod folder;
pub mod outline;
pub mod psnr;
