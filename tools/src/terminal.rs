//! Text for people: everything that the command prints goes through here.
//!
//! Names of files, comments, columns and materials come from outside. A terminal obeys control
//! characters in them: they can set its title, hide a part of a message, or reverse its direction.
//! All output of the command is escaped here: messages of errors (`failure`), log lines (`start`),
//! progress (`progress`) and results on stdout (`output`). The command adds its own colours
//! afterwards.

use std::{borrow::Cow, fmt, fmt::Write};
use tracing::{
    Event, Level, Subscriber,
    field::{Field, Visit},
};
use tracing_subscriber::{
    field::RecordFields,
    fmt::{
        FmtContext, FormatEvent, FormatFields,
        format::{Format, Full, Writer},
        time::SystemTime,
    },
    registry::LookupSpan,
};

/// Most characters shown of a text from outside. The middle of a longer text is left out.
const MOST: usize = 2000;
/// Characters shown from the end of such a text, where the command's own words mostly stand.
const END: usize = 500;

/// Whether a terminal may obey a character instead of showing it. These are control characters (C0,
/// DEL, C1), characters that change the direction of the text after them, and characters that end a
/// line or a paragraph.
fn is_unsafe(letter: char) -> bool {
    letter.is_control()
        || matches!(
            letter,
            '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
        )
}

/// Whether a text has no character that a terminal may obey.
pub fn is_safe(text: &str) -> bool {
    !text.contains(is_unsafe)
}

/// Returns a text on one line, with an escape sequence shown as `\u{1b}[31m`. A very long text is
/// shortened.
pub fn safe(text: &str) -> Cow<'_, str> {
    let text = shortened(text);
    if !text.contains(is_unsafe) {
        return text;
    }
    let mut out = String::with_capacity(2 * text.len());
    for letter in text.chars() {
        match letter {
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            _ if is_unsafe(letter) => out.extend(letter.escape_unicode()),
            _ => out.push(letter),
        }
    }
    Cow::Owned(out)
}

/// Like [`safe`], for text of any length whose line breaks are the command's own.
pub fn safe_lines(text: &str) -> Cow<'_, str> {
    if !text.contains(|letter| is_unsafe(letter) && letter != '\n') {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(2 * text.len());
    for letter in text.chars() {
        if is_unsafe(letter) && letter != '\n' {
            out.extend(letter.escape_unicode());
        } else {
            out.push(letter);
        }
    }
    Cow::Owned(out)
}

/// Returns JSON on one line. `serde_json` escapes C0 only. Outside of strings there are no such
/// characters.
pub fn safe_json(value: &serde_json::Value) -> String {
    let text = value.to_string();
    if !text.contains(is_unsafe) {
        return text;
    }
    let mut out = String::with_capacity(2 * text.len());
    for letter in text.chars() {
        if is_unsafe(letter) {
            // All of them have four hexadecimal digits.
            let _ = write!(out, "\\u{:04x}", u32::from(letter));
        } else {
            out.push(letter);
        }
    }
    out
}

fn shortened(text: &str) -> Cow<'_, str> {
    // A text never has fewer bytes than characters.
    if text.len() <= MOST || text.chars().nth(MOST).is_none() {
        return Cow::Borrowed(text);
    }
    let at = |count: usize| text.char_indices().nth(count).map_or(text.len(), |(at, _)| at);
    let from = text.char_indices().nth_back(END - 1).map_or(0, |(at, _)| at);
    let (start, end) = (&text[..at(MOST - END)], &text[from..]);
    let left = text.chars().count() - MOST;
    Cow::Owned(format!("{start} … ({left} characters left out) … {end}"))
}

/// Writes the library's warnings as those of the command look, and other events as log lines.
pub struct Events(pub Format<Full, SystemTime>);

impl<S, N> FormatEvent<S, N> for Events
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        context: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &Event<'_>,
    ) -> fmt::Result {
        if *event.metadata().level() != Level::WARN {
            return self.0.format_event(context, writer, event);
        }
        write!(writer, "warning: ")?;
        context.format_fields(writer.by_ref(), event)?;
        writeln!(writer)
    }
}

/// Writes the fields of log lines, escaped.
pub struct SafeFields;

impl<'writer> FormatFields<'writer> for SafeFields {
    fn format_fields<R: RecordFields>(&self, writer: Writer<'writer>, fields: R) -> fmt::Result {
        let mut line = Line { writer, is_empty: true, result: Ok(()) };
        fields.record(&mut line);
        line.result
    }
}

/// A line whose fields are being written.
struct Line<'writer> {
    writer: Writer<'writer>,
    is_empty: bool,
    result: fmt::Result,
}

impl Line<'_> {
    fn add(&mut self, field: &Field, text: &str) {
        // Events of the crate `log` come with the path of their source, on the machine that built
        // the command.
        if field.name().starts_with("log.") {
            return;
        }
        let text = safe(text);
        let space = if self.is_empty { "" } else { " " };
        self.result = self.result.and_then(|()| match field.name() {
            "message" => write!(self.writer, "{space}{text}"),
            name => write!(self.writer, "{space}{}={text}", name.trim_start_matches("r#")),
        });
        self.is_empty = false;
    }
}

impl Visit for Line<'_> {
    fn record_str(&mut self, field: &Field, value: &str) {
        if field.name() == "message" {
            self.add(field, value);
        } else {
            self.record_debug(field, &value);
        }
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        self.add(field, &format!("{value:?}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_commands_no_terminal() {
        assert_eq!(safe("\x1b]0;title\x07\x1b[31m"), r"\u{1b}]0;title\u{7}\u{1b}[31m");
        assert_eq!(
            safe("a\u{9b}31m\x7f\u{202e}b\u{2066}c\u{2028}\n\t"),
            r"a\u{9b}31m\u{7f}\u{202e}b\u{2066}c\u{2028}\n\t"
        );
        let plain = "Zürich “−1” 東京 … 🐘 é";
        assert!(matches!(safe(plain), Cow::Borrowed(text) if text == plain));
        assert_eq!(safe_lines("a\x1b\nb"), "a\\u{1b}\nb");
        for letter in (0..=0x10_ffff).filter_map(char::from_u32) {
            let text = safe(letter.encode_utf8(&mut [0; 4])).into_owned();
            assert!(text.chars().all(|letter| !is_unsafe(letter)), "{letter:?}: {text:?}");
        }
    }

    #[test]
    fn json_stays_what_it_is() {
        let value = serde_json::json!({ "a\u{85}": ["\u{1b}[31m\u{9b}\u{7f}\u{202e}", "Zürich"] });
        let text = safe_json(&value);
        assert!(!text.contains(is_unsafe) && text.contains("Zürich"), "{text}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }

    #[test]
    fn long_texts_keep_their_ends() {
        let text = format!("begin{}end", "µ".repeat(5000));
        let shortened = safe(&text);
        assert!(shortened.starts_with("beginµ") && shortened.ends_with("µend"), "{shortened}");
        assert!(
            shortened.contains("(3008 characters left out)")
                && shortened.chars().count() < MOST + 50,
            "{shortened}"
        );
        let text = "µ".repeat(MOST);
        assert_eq!(safe(&text), text);
    }
}
