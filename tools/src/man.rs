//! `splatkit man`: the help texts as manual pages, one for the command and one for each task.

use crate::{failure::Failure, output};
use clap::Args;
use clap_mangen::Man;
use splatkit::disk;
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct Pages {
    /// The folder for the pages, such as /usr/local/share/man/man1; it is created if it does not
    /// exist.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Replace existing files.
    #[arg(long)]
    overwrite: bool,
}

impl Pages {
    /// Writes the pages of `command`, the whole command line.
    pub fn run(self, command: clap::Command) -> Result<(), Failure> {
        std::fs::create_dir_all(&self.folder).map_err(|e| Failure::output(&self.folder, e))?;
        let pages = pages(command).map_err(|e| Failure::output(&self.folder, e))?;
        let pages: Vec<_> =
            pages.into_iter().map(|(name, text)| (self.folder.join(name), text)).collect();
        pages.iter().try_for_each(|(file, _)| output::check(file, self.overwrite))?;
        Ok(pages.iter().try_for_each(|(file, text)| disk::write(file, text))?)
    }
}

/// Returns the name and the text of each page.
fn pages(command: clap::Command) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let source = format!("splatkit {}", env!("CARGO_PKG_VERSION"));
    let mut command = command.disable_help_subcommand(true);
    // Gives each task its full name and the flags that all tasks have.
    command.build();
    let tasks: Vec<_> = command.get_subcommands().cloned().collect();
    let page = |command| {
        let page = Man::new(command).source(&source);
        let mut text = Vec::new();
        page.render(&mut text)?;
        Ok((page.get_filename(), text))
    };
    std::iter::once(command).chain(tasks).map(page).collect()
}
