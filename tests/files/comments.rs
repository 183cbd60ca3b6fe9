//! Comments and documents are short: sentences and paragraphs that can be understood at first
//! reading.

use crate::house::{files, root};
use std::{fs, path::Path};

/// Maximum words of a sentence. CONTRIBUTING.md asks for 25; a few may be longer.
const SENTENCE: usize = 33;

/// Maximum words of a paragraph.
const PARAGRAPH: usize = 100;

/// A paragraph of a comment, and the line where its comment begins.
#[derive(Debug, PartialEq)]
struct Paragraph {
    line: usize,
    text: String,
}

/// The comment before an item.
#[derive(Default)]
struct Comment {
    line: usize,
    mark: &'static str,
    paragraphs: Vec<String>,
    /// Whether the next line goes on with the last paragraph.
    goes_on: bool,
    in_code: bool,
}

/// Returns the kind of comment that a line holds, and its text.
fn comment(line: &str) -> Option<(&'static str, &str)> {
    let line = line.trim_start();
    let mark = ["///", "//!", "//"].into_iter().find(|mark| line.starts_with(mark))?;
    Some((mark, line[mark.len()..].strip_prefix(' ').unwrap_or(&line[mark.len()..])))
}

/// Returns the text of an item of a list.
fn item(text: &str) -> Option<&str> {
    let text = text.trim_start();
    let rest = text.trim_start_matches(|c: char| c.is_ascii_digit());
    let numbered = rest.strip_prefix(". ").filter(|_| rest.len() < text.len());
    numbered.or_else(|| text.strip_prefix("- ")).or_else(|| text.strip_prefix("* "))
}

impl Comment {
    /// Adds a line. Code, tables and headings are left out.
    fn add(&mut self, text: &str) {
        let is_fence = text.trim_start().starts_with("```");
        let is_break = text.trim().is_empty() || text.starts_with(['|', '#']);
        if is_fence || is_break || self.in_code {
            (self.goes_on, self.in_code) = (false, self.in_code != is_fence);
            return;
        }
        let begins = item(text);
        match self.paragraphs.last_mut().filter(|_| self.goes_on && begins.is_none()) {
            Some(last) => {
                last.push(' ');
                last.push_str(text.trim());
            }
            None => self.paragraphs.push(begins.unwrap_or(text).trim().to_owned()),
        }
        self.goes_on = true;
    }
}

/// Returns the paragraphs of the comments in a source. Help texts are left out: they list what a
/// flag takes, and its default.
fn paragraphs(source: &str) -> Vec<Paragraph> {
    let (mut all, mut current) = (Vec::new(), Comment::default());
    for (number, line) in (1..).zip(source.lines().chain([""])) {
        let comment = comment(line);
        if comment.is_none_or(|(mark, _)| mark != current.mark) {
            let Comment { line: start, paragraphs, .. } = std::mem::take(&mut current);
            let is_help = ["#[arg(", "#[command(", "#[derive(Parser"]
                .iter()
                .any(|of| line.trim_start().starts_with(of));
            let ended = paragraphs.into_iter().map(|text| Paragraph { line: start, text });
            all.extend(ended.filter(|_| !is_help));
        }
        if let Some((mark, text)) = comment {
            if current.mark.is_empty() {
                (current.mark, current.line) = (mark, number);
            }
            current.add(text);
        }
    }
    all
}

/// Returns the numbers of words of the sentences of a paragraph. Code counts as a word, and links
/// as their text.
fn words(text: &str) -> Vec<usize> {
    let text = text.replace("et al.", "et al").replace("e.g.", "eg").replace("i.e.", "ie");
    let mut plain = String::new();
    // Every other part lies between backticks.
    for (number, part) in text.split('`').enumerate() {
        plain.push_str(if number % 2 == 0 { part } else { "code" });
    }
    let mut sentences = vec![0];
    for word in plain.split_whitespace() {
        let place = sentences.len() - 1;
        sentences[place] += usize::from(word.contains(char::is_alphanumeric));
        if word.trim_end_matches([')', '"', '”', ']', '*']).ends_with(['.', '!', '?']) {
            sentences.push(0);
        }
    }
    sentences
}

#[test]
fn comments_are_short() {
    let mut all = Vec::new();
    ["src", "shaders", "tools", "tests", "benches", "examples", "fuzz"]
        .iter()
        .for_each(|folder| files(&root().join(folder), &mut all));
    let is_source = |path: &&std::path::PathBuf| {
        path.extension().is_some_and(|kind| kind == "rs" || kind == "wgsl")
    };
    let mut long = Vec::new();
    for path in all.iter().filter(is_source) {
        let name = path.strip_prefix(root()).unwrap_or(Path::new("")).display().to_string();
        for Paragraph { line, text } in paragraphs(&fs::read_to_string(path).expect("a text")) {
            let counts = words(&text);
            let beginning: String = text.chars().take(50).collect();
            if let Some(most) = counts.iter().max().filter(|count| **count > SENTENCE) {
                long.push(format!("{name}:{line}: a sentence of {most} words in “{beginning}…”"));
            }
            let sum: usize = counts.iter().sum();
            if sum > PARAGRAPH {
                long.push(format!("{name}:{line}: a paragraph of {sum} words: “{beginning}…”"));
            }
        }
    }
    assert!(
        long.is_empty(),
        "sentences have at most {SENTENCE} words, and paragraphs {PARAGRAPH}:\n{}",
        long.join("\n")
    );
}

/// Returns the paragraphs of a document, each with its first line. Code, tables, headings and what
/// programs write are left out.
fn document(text: &str) -> Vec<Paragraph> {
    let (mut inside, mut lines, mut is_written) = (Comment::default(), Vec::new(), false);
    for (number, line) in (1..).zip(text.lines()) {
        let is_mark = line.starts_with("<!--");
        if is_mark {
            is_written = !line.contains("end of");
        }
        let is_code = line.starts_with("    ") && !inside.goes_on;
        let is_left_out = is_mark || is_written || is_code;
        inside.add(if is_left_out { "" } else { line });
        lines.resize(inside.paragraphs.len(), number);
    }
    let paragraphs = lines.into_iter().zip(inside.paragraphs);
    paragraphs.map(|(line, text)| Paragraph { line, text }).collect()
}

#[test]
fn sentences_of_documents_are_short() {
    let mut all = Vec::new();
    files(&root().join("docs"), &mut all);
    all.extend(fs::read_dir(root()).expect("a folder").map(|entry| entry.expect("a file").path()));
    all.retain(|path| path.extension().is_some_and(|kind| kind == "md"));
    assert!(all.len() > 25, "the documents are elsewhere");
    let mut long = Vec::new();
    for path in &all {
        let name = path.strip_prefix(root()).unwrap_or(Path::new("")).display().to_string();
        for Paragraph { line, text } in document(&fs::read_to_string(path).expect("a text")) {
            let most = words(&text).into_iter().max().unwrap_or_default();
            if most > SENTENCE {
                let beginning: String = text.chars().take(50).collect();
                long.push(format!("{name}:{line}: a sentence of {most} words in “{beginning}…”"));
            }
        }
    }
    assert!(
        long.is_empty(),
        "sentences of documents have at most {SENTENCE} words:\n{}",
        long.join("\n")
    );
}

#[test]
fn documents_are_read_without_code_tables_and_written_blocks() {
    let text = "# Title\n\nOne *two.* Three\nfour.\n\n    code\n\n- five\n  six\n| a | b |\n\
                <!-- list: written -->\nseven\n<!-- end of list -->\n```\ncode\n```\neight\n";
    let paragraphs = document(text);
    let texts: Vec<&str> = paragraphs.iter().map(|paragraph| paragraph.text.as_str()).collect();
    assert_eq!(texts, ["One *two.* Three four.", "five six", "eight"]);
    assert_eq!(paragraphs.iter().map(|paragraph| paragraph.line).collect::<Vec<_>>(), [3, 8, 17]);
    assert_eq!(words(texts[0]), [2, 2, 0]);
}

#[test]
fn sentences_and_paragraphs_are_counted() {
    let source = "/// One two. Three\n/// `four five` (six).\n///\n/// - seven\n/// ```\n/// code\n\
                  /// ```\n/// eight\nfn f() {}\n/// Help\n#[arg(long)]\n// nine et al. ten\n";
    let paragraphs = paragraphs(source);
    let texts: Vec<&str> = paragraphs.iter().map(|paragraph| paragraph.text.as_str()).collect();
    assert_eq!(texts, ["One two. Three `four five` (six).", "seven", "eight", "nine et al. ten"]);
    assert_eq!(
        paragraphs.iter().map(|paragraph| paragraph.line).collect::<Vec<_>>(),
        [1, 1, 1, 12]
    );
    assert_eq!(words(texts[0]), [2, 3, 0]);
    assert_eq!(words(texts[3]), [4]);
}
