//! Files: what is read from them, what is written to them, and what is said of bad ones. Also the
//! files of the project itself: its modules, and the tables of its README.

mod bad_input;
mod external;
#[path = "../regressions/flat.rs"]
mod flat;
mod house;
#[path = "../inputs/mod.rs"]
mod inputs;
mod laboratories;
mod list_of_formats;
mod medical;
#[cfg(any(target_os = "linux", target_os = "macos"))]
mod overwritten;
mod paged;
mod regressions;
#[cfg(feature = "remote")]
mod remote;
#[path = "../testing/mod.rs"]
mod testing;
mod upright;
mod vtk_files;
