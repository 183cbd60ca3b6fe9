//! Checks the XML that describes an E57 file, before a parser reads it.

use super::Source;
use crate::Result;

/// Bytes of the parser's tree per byte of XML.
const TREE: u64 = 40;
/// The parser compares each of these with all others of its kind: the attributes of an element, and
/// the names of namespaces, which every element may add to.
const MOST_ATTRIBUTES: usize = 256;
const MOST_NAMESPACES: usize = 256;

/// Returns an error for XML that would take the parser forever, or far more memory than it has
/// bytes.
pub fn check(source: &Source, xml: &[u8]) -> Result<()> {
    source.spend("the size of the description in bytes", TREE.saturating_mul(xml.len() as u64))?;
    let wrong = |at: usize, message: String| source.error("XML", format!("byte {at}: {message}"));
    let (mut in_tag, mut quote, mut attributes, mut namespaces) = (false, None, 0, 0);
    for (at, &byte) in xml.iter().enumerate() {
        match (byte, quote) {
            (_, Some(open)) if byte == open => quote = None,
            (_, Some(_)) => {}
            (b'<', None) => (in_tag, attributes) = (true, 0),
            (b'>', None) => in_tag = false,
            (b'"' | b'\'', None) if in_tag => quote = Some(byte),
            (b'=', None) if in_tag => {
                attributes += 1;
                if attributes > MOST_ATTRIBUTES {
                    return Err(wrong(
                        at,
                        format!("an element has more than {MOST_ATTRIBUTES} attributes"),
                    ));
                }
            }
            _ => {}
        }
        if byte == b'x' && xml[at..].starts_with(b"xmlns") {
            namespaces += 1;
            if namespaces > MOST_NAMESPACES {
                return Err(wrong(at, format!("there are more than {MOST_NAMESPACES} namespaces")));
            }
        }
    }
    Ok(())
}
