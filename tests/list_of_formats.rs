//! The README's table of formats is the one that the library follows.
//!
//! To update it, run `SPLATKIT_WRITE=1 cargo test --release --test list_of_formats`.

use splatkit::formats::FORMATS;
use std::{fmt::Write, fs, path::Path};

const START: &str = "<!-- formats: written by `SPLATKIT_WRITE=1 cargo test --release --test \
     list_of_formats` -->\n\n";
const END: &str = "\n<!-- end of formats -->";

fn table() -> String {
    let mut text = String::from(
        "| format | files | holds | read in pieces | written |\n|---|---|---|---|---|\n",
    );
    for format in FORMATS {
        let files: Vec<String> =
            format.extensions.iter().map(|extension| format!("`.{extension}`")).collect();
        let files = if files.is_empty() { "any".into() } else { files.join(", ") };
        let holds: Vec<String> = format.holds.iter().map(ToString::to_string).collect();
        let pieces = match format.in_pieces() {
            None => "no",
            Some("") => "yes",
            Some(of) => of,
        };
        let written = format.written.map_or("no".into(), |own| format!("`.{own}`"));
        let (name, holds) = (format.name, holds.join("; "));
        writeln!(text, "| {name} | {files} | {holds} | {pieces} | {written} |")
            .expect("writing to a string");
    }
    text
}

#[test]
fn the_list_of_formats_is_current() {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md");
    let text = fs::read_to_string(&page).expect("README.md").replace('\r', "");
    let (before, rest) = text.split_once(START).expect("the block's first line");
    let (inside, after) = rest.split_once(END).expect("the block's last line");
    let found = table();
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        fs::write(&page, format!("{before}{START}{found}{END}{after}")).expect("README.md");
        return;
    }
    for (old, new) in inside.lines().zip(found.lines()) {
        assert_eq!(old, new, "README.md is out of date; SPLATKIT_WRITE=1 updates it");
    }
    assert_eq!(inside, found, "README.md is out of date; SPLATKIT_WRITE=1 updates it");
}
