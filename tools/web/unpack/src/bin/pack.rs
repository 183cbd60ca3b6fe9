//! Packs a file by lzip, beside it: tools/web/build packs the engine, so that `splatkit publish`
//! need not.

use lzma_rust2::{LzipOptions, LzipWriter};
use std::{env, fs, io::Write};

fn main() -> std::io::Result<()> {
    for name in env::args().skip(1) {
        let mut packer = LzipWriter::new(Vec::new(), LzipOptions::with_preset(9));
        packer.write_all(&fs::read(&name)?)?;
        fs::write(format!("{name}.lz"), packer.finish()?)?;
    }
    Ok(())
}
