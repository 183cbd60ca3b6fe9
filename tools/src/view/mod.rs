//! `splatkit view`: a window.
//!
//! A [`Document`] says what is shown, as a scene file. The [`Window`](window::Window) loads it in
//! the background ([`loader`]), gives orders to the [`painter`], and shows its frames. The
//! [`panels`], the [`keys`] and the [`hand`] in the picture show models and return [`action`]s,
//! which the window applies. What it shows is what `splatkit render` draws from the same scene
//! file.

mod action;
#[cfg(test)]
mod alike;
mod canvas;
mod choices;
mod curve;
mod dialogs;
mod document;
mod export;
mod hand;
mod handles;
mod keys;
mod loader;
mod outline;
mod painter;
mod panels;
mod recent;
mod saving;
mod scene_view;
mod screen;
mod selection;
mod slices;
#[cfg(test)]
mod tests;
mod window;
mod words;

use crate::{failure::Failure, given::Given, progress::Progress, render::Render};
use clap::Args;
use dialogs::Dialogs;
use document::Document;
use eframe::egui;
use recent::Recent;
use splatkit::Error;
use std::path::Path;
use window::{Surroundings, Window};

/// The size of the window at first, in points.
const SIZE: [f32; 2] = [1280.0, 800.0];

/// Flags of `render` that say what is written.
const OF_FILES: [&str; 12] = [
    "output",
    "depth",
    "layers",
    "split-channels",
    "overwrite",
    "turntable",
    "path",
    "times",
    "fps",
    "raw",
    "reference",
    "json",
];

#[derive(Args, Debug)]
// A window may open without anything; the flags that write files are `render`'s.
#[command(
    mut_arg("inputs", |inputs| inputs.required(false)),
    mut_arg("output", |flag| flag.hide(true)),
    mut_arg("depth", |flag| flag.hide(true)),
    mut_arg("layers", |flag| flag.hide(true)),
    mut_arg("split_channels", |flag| flag.hide(true)),
    mut_arg("overwrite", |flag| flag.hide(true)),
    mut_arg("turntable", |flag| flag.hide(true)),
    mut_arg("path", |flag| flag.hide(true)),
    mut_arg("times", |flag| flag.hide(true)),
    mut_arg("fps", |flag| flag.hide(true)),
    mut_arg("raw", |flag| flag.hide(true)),
    mut_arg("reference", |flag| flag.hide(true)),
    mut_arg("json", |flag| flag.hide(true)),
)]
pub struct View {
    #[command(flatten)]
    scene: Render,
}

impl View {
    pub fn run(self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        if let Some(flag) = OF_FILES.into_iter().find(|flag| given.has(flag)) {
            return Err(Failure::Usage(format!(
                "--{flag} is for `splatkit render`; the window saves pictures itself"
            )));
        }
        let job = self.scene.job(given)?;
        // What cannot be opened is said here, as `render` says it, and not in a window.
        job.check_files().map_err(|failure| job.blamed(failure, &[]))?;
        let mut document = Document::new(job.scene, job.device);
        document.is_trusting = self.scene.trusts_scenes();
        document.path = self.scene.scene_file().map(Path::to_owned);
        progress.clear();
        open(document)
    }
}

/// Opens the window and waits until it is closed.
fn open(document: Document) -> Result<(), Failure> {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    if cfg!(target_os = "linux") && !["DISPLAY", "WAYLAND_DISPLAY"].into_iter().any(is_set) {
        let message = "a window needs a display, but neither DISPLAY nor WAYLAND_DISPLAY is set; \
                       `splatkit render` draws without one";
        return Err(Failure::Usage(message.into()));
    }
    let size = document.scene().picture.size.map_or(SIZE, |size| size.map(|side| side as f32));
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(document.title())
            .with_inner_size(size)
            .with_drag_and_drop(true),
        // It would cost a processor without a GPU much, and a picture must not be changed.
        dithering: false,
        ..eframe::NativeOptions::default()
    };
    let create = |context: &eframe::CreationContext<'_>| {
        let surroundings =
            Surroundings { recent: Recent::of_user(), dialogs: Dialogs::of_system() };
        let state = context.wgpu_render_state.as_ref();
        let window = Window::new(document, surroundings, &context.egui_ctx, state)?;
        Ok(Box::new(App(window)) as Box<dyn eframe::App>)
    };
    eframe::run_native("splatkit", options, Box::new(create)).map_err(|error| {
        Error::NoAdapter(format!(
            "a window cannot be opened: {error}; `splatkit render` draws without one"
        ))
        .into()
    })
}

/// The window as an application.
struct App(Window);

impl eframe::App for App {
    fn ui(&mut self, ui: &mut egui::Ui, _frame: &mut eframe::Frame) {
        self.0.ui(ui);
    }
}
