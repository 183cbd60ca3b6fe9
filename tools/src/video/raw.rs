//! Raw frames on stdout, for another program.

use super::Encoder;
use crate::{failure::Failure, output};

pub struct Raw;

impl Encoder for Raw {
    fn add(&mut self, rgba: &[u8]) -> Result<bool, Failure> {
        output::offer(rgba)
    }

    fn finish(self: Box<Self>) -> Result<(), Failure> {
        Ok(())
    }
}
