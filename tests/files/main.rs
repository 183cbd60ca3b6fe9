//! Files: what is read from them and written to them. Also the files of the project itself: its
//! modules, and the tables of its documentation.

mod comments;
mod documents;
mod external;
mod frames;
mod house;
mod laboratories;
mod list_of_formats;
#[expect(dead_code, reason = "other programs use the rest")]
#[path = "../inputs/medical.rs"]
mod made;
mod medical;
mod paged;
mod regressions;
#[cfg(feature = "remote")]
mod remote;
#[path = "../testing/mod.rs"]
mod testing;
mod upright;
mod vtk_files;
