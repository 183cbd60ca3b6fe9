//! Writing an edited input in the background, as `splatkit convert` does.

use crate::output;
use splatkit::session::convert::{Conversion, Target};
use std::{
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, TryRecvError, channel},
};

/// An edited input that is being written.
pub struct Saving {
    pub output: PathBuf,
    result: Receiver<Result<(), String>>,
}

impl Saving {
    /// Starts to write. `tell` is called at the end.
    pub fn start(
        conversion: Conversion,
        input: PathBuf,
        output: &Path,
        tell: impl Fn() + Send + 'static,
    ) -> Result<Self, String> {
        Target::of(output).map_err(|error| error.to_string())?;
        let inputs = [input];
        output::try_writing(output, &inputs).map_err(|failure| failure.to_string())?;
        let (send, result) = channel();
        let file = output.to_owned();
        let thread = std::thread::Builder::new().name("saving".into());
        let started = thread.spawn(move || {
            let done = conversion.convert(&inputs, &file, &()).map_err(|error| error.to_string());
            send.send(done.map(drop)).ok();
            tell();
        });
        started.map_err(|error| error.to_string())?;
        Ok(Self { output: output.to_owned(), result })
    }

    /// Takes the result, once there is one.
    pub fn take(&self) -> Option<Result<(), String>> {
        match self.result.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err("the file could not be written".into())),
        }
    }
}
