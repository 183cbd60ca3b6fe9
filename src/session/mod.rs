//! One way in: any file, opened once and read as what it holds.
//!
//! [`Reading`] says how inputs are read. It opens a file, a folder or a remote object of any kind;
//! [`Opened`] knows the kind, and reads it into [`Data`]. The functions of
//! [`formats`](crate::formats) read one kind each, from files or from bytes in memory.
//! [`Showing`] says how an input is shown: [`Appearance`] its values, and [`Coloring`] its colours.
//! [`Items`] makes a scene of inputs: one item of each, with its [`Legend`]. [`Subject`]
//! gathers where the scene is and how it stands, and [`Framing`] is the camera that shows it.
//! [`convert`] makes other files of inputs.
//!
//! ```no_run
//! use splatkit::session::{Data, Reading};
//!
//! match Reading::default().open("scan.ply".as_ref())?.read()? {
//!     Data::Mesh(mesh) => println!("{} points", mesh.positions.len()),
//!     data => println!("{:?}", data.kind()),
//! }
//! # Ok::<(), splatkit::Error>(())
//! ```

mod appearance;
mod channels;
mod coloring;
pub mod convert;
mod data;
mod description;
mod drawing;
mod editing;
mod facts;
mod fit;
mod framing;
mod glyphs;
mod items;
mod layers;
mod legend;
mod name;
mod oddities;
mod opacity;
mod panels;
mod reading;
mod showing;
mod slices;
mod solid;
mod subject;
mod training;

#[cfg(test)]
mod tests;

pub use appearance::{Appearance, Surface, SurfaceValue, Transfer};
pub use channels::ChannelStyle;
pub use coloring::{Coloring, SurfaceColor, check_log, visible_range_of};
pub use data::{Data, warn_of_holes};
pub use description::{
    AppearanceEntry, Axis, Background, CameraEntry, ChannelEntry, ChannelName, ClipEntry, ClipSide,
    ColorEntry, Composite, Description, EditEntry, Engine, InputEntry, IsosurfaceEntry,
    KernelEntry, LightName, LimitsEntry, Loaded, LoadedInput, OverlayEntry, PaperLength,
    PictureEntry, Place, ReadInput, ReadingEntry, Rotation, Samples, TransferEntry, TransformEntry,
};
pub use drawing::Drawing;
pub use editing::EditedInput;
pub use facts::Facts;
pub use framing::{Framing, Side};
pub use glyphs::{GlyphShape, Glyphs};
pub use items::{Captions, Content, Items, Mark};
pub use layers::{DrawLayer, Layer};
pub use legend::Legend;
pub use name::Name;
pub use panels::{Panel, PanelLabels};
pub use reading::{Opened, Reading, read};
pub use showing::{CellStyle, Showing, Surfaces};
pub use subject::{Origin, Subject};
pub use training::{TrainingView, training_view, training_views};
