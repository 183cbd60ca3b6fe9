//! The page: one file with everything inside, or a folder.

use super::{content::Content, packing, viewer::Viewer};
use crate::failure::Failure;
use splatkit::{Error, disk};
use std::{collections::BTreeMap, fmt::Write as _, fs, path::Path};

/// What a page shows.
pub struct Page {
    pub title: String,
    /// The scene file.
    pub scene: String,
    /// The files that it names.
    pub files: BTreeMap<String, Content>,
    /// What is behind the picture.
    pub background: Option<[f32; 3]>,
    pub version: &'static str,
}

/// The scripts of a page in one file.
const BOOT: &str = include_str!("../../web/js/page.js");

/// What a page in one file may do: nothing but run what is inside. WebAssembly is compiled, and no
/// text becomes a program.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; \
                      worker-src blob:; style-src 'unsafe-inline'; img-src blob: data:";

/// What the page of a folder may do: run the scripts beside it, and read the files beside it.
const FOLDER_POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src \
                             'self'; connect-src 'self'; style-src 'unsafe-inline'; img-src blob: \
                             data:";

impl Page {
    /// Writes one file with everything inside. Returns its bytes.
    pub fn write_file(&self, path: &Path, viewer: &Viewer) -> Result<u64, Failure> {
        let mut text = self.head(POLICY);
        writeln!(text, "<splatkit-viewer label=\"{}\"></splatkit-viewer>", escaped(&self.title))
            .ok();
        text += NO_SCRIPT;
        writeln!(
            text,
            "<script type=\"application/json\" id=\"scene\">{}</script>",
            // No text inside can end the element.
            self.scene.replace('<', "\\u003c")
        )
        .ok();
        packed(&mut text, "id=\"worker\"", &viewer.worker)?;
        packed(&mut text, "id=\"engine\"", &viewer.engine)?;
        for (name, content) in &self.files {
            let attribute = format!("data-file=\"{}\"", escaped(name));
            packed(&mut text, &attribute, &content.bytes()?)?;
        }
        let element = String::from_utf8_lossy(&viewer.element);
        if [&*element, BOOT].iter().any(|script| script.contains("</script")) {
            let message = "its scripts cannot be put into a page: they contain “</script”";
            return Err(Error::input(path, "viewer", message).into());
        }
        write!(text, "<script type=\"module\">\n{element}\n{BOOT}</script>\n</body>\n</html>\n")
            .ok();
        disk::write(path, text.as_bytes())?;
        Ok(text.len() as u64)
    }

    /// Writes a folder for a static host. Returns the bytes of all files.
    pub fn write_folder(&self, folder: &Path, viewer: &Viewer) -> Result<u64, Failure> {
        let mut sum = 0;
        for (name, content) in self.in_files(viewer) {
            let path = folder.join(name);
            let above = path.parent().unwrap_or(folder);
            fs::create_dir_all(above).map_err(|error| Failure::output(above, error))?;
            disk::may_replace(&path, true);
            sum += content.write(&path)?;
        }
        Ok(sum)
    }

    /// Returns the files of a folder, by their names.
    pub fn in_files(&self, viewer: &Viewer) -> Vec<(String, Content)> {
        let mut text = self.head(FOLDER_POLICY);
        writeln!(
            text,
            "<splatkit-viewer src=\"scene.json\" label=\"{}\"></splatkit-viewer>",
            escaped(&self.title)
        )
        .ok();
        text += NO_SCRIPT;
        text += "<script type=\"module\" src=\"splatkit-viewer.js\"></script>\n</body>\n</html>\n";
        let held = |bytes: &[u8]| Content::Held(bytes.to_vec());
        let mut all = vec![
            ("index.html".into(), held(text.as_bytes())),
            ("scene.json".into(), held(self.scene.as_bytes())),
        ];
        all.extend(viewer.files().map(|(name, bytes)| (name.into(), held(bytes))));
        all.extend(self.files.clone());
        all
    }

    /// Returns the beginning of a page.
    fn head(&self, policy: &str) -> String {
        let title = escaped(&self.title);
        let policy =
            format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n");
        let behind = self.background.map_or("Canvas".into(), |color| {
            let [red, green, blue] = color.map(|part| (255.0 * part).round());
            format!("rgb({red} {green} {blue})")
        });
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{policy}\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"generator\" content=\"splatkit {}\">\n<title>{title}</title>\n\
             <link rel=\"icon\" href=\"data:,\">\n<style>\n\
             :root {{ color-scheme: light dark; }}\n\
             html, body {{ margin: 0; height: 100%; background: {behind}; }}\n\
             splatkit-viewer {{ position: fixed; inset: 0; }}\n</style>\n</head>\n<body>\n",
            self.version
        )
    }
}

/// Browsers have no longer texts.
const MOST_LETTERS: usize = 500_000_000;

const NO_SCRIPT: &str = "<noscript>This page shows a scene in three dimensions. It needs \
                         JavaScript.</noscript>\n";

/// Adds bytes to a page as an element.
fn packed(text: &mut String, attribute: &str, bytes: &[u8]) -> Result<(), Failure> {
    let packed = packing::packed(bytes);
    let (strides, letters) = packed.map_err(|error| Failure::output(Path::new("page"), error))?;
    if letters.len() > MOST_LETTERS {
        return Err(Failure::Usage(format!(
            "an input has {} MB, too much for a page in one file: publish a folder",
            bytes.len() / 1_000_000
        )));
    }
    writeln!(
        text,
        "<script type=\"text/plain\" {attribute} data-strides=\"{strides}\">{letters}</script>"
    )
    .ok();
    Ok(())
}

/// Returns a text as HTML, also within quotation marks.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn names_of_files_are_no_markup() {
        let name = "<script>\"a\" & b</script>.ply";
        assert_eq!(escaped(name), "&lt;script&gt;&quot;a&quot; &amp; b&lt;/script&gt;.ply");
    }
}
