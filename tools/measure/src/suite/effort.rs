//! How much is measured, and where the results go: the flags that the suite and the sweep share.

use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct EffortFlags {
    /// Choose how much is measured.
    #[arg(long, value_enum, default_value_t = Effort::Usual)]
    pub effort: Effort,
    /// Measure this many frames of each case of the suite or each step of the sweep [default: 5 in
    /// the suite; in the sweep, a number that follows from --effort]
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    pub frames: Option<u32>,
    /// Replace this machine's tables in the marked block of this file.
    #[arg(long, value_name = "FILE.md")]
    pub write: Option<PathBuf>,
    /// Print the results as JSON.
    #[arg(long)]
    pub json: bool,
}

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Effort {
    /// Everything at a quarter of its length: takes seconds and checks that all works.
    Quick,
    /// A few minutes on a processor without a GPU.
    Usual,
    /// In the suite, also models of 10 million points and volumes of 512³ and 1024³ samples, which
    /// need 16 GiB of memory and much time. In the sweep, more frames of each step.
    Full,
}

impl Effort {
    /// Divisor of each length of a quick case.
    const QUICK: u64 = 4;

    fn divided(self, number: u64, dimensions: u32) -> u64 {
        match self {
            Self::Quick => (number / Self::QUICK.pow(dimensions)).max(1),
            Self::Usual | Self::Full => number,
        }
    }

    /// Returns a picture's width, or a volume's side.
    pub fn side(self, side: usize) -> usize {
        self.divided(side as u64, 1) as usize
    }

    pub fn pixels(self, width: u32) -> u32 {
        self.divided(width.into(), 1) as u32
    }

    pub fn points(self, points: u32) -> u32 {
        self.divided(points.into(), 2) as u32
    }

    pub fn samples(self, samples: u64) -> u64 {
        self.divided(samples, 3)
    }
}
