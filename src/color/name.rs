//! Colours as people write them.

use color::{Rgba8, Srgb, parse_color};

/// Returns the colour of a text as in CSS: a name, `#rgb`, `#rrggbb` (also without `#`) or
/// `rgb(…)`, without opacity. The parts are red, green and blue in 0 … 1.
///
/// # Errors
/// What a colour is.
pub fn parse(text: &str) -> Result<[f32; 3], String> {
    // The crate knows the names in American spelling only.
    let text = text.trim().to_ascii_lowercase().replace("grey", "gray");
    let is_plain =
        matches!(text.len(), 3 | 4 | 6 | 8) && text.bytes().all(|byte| byte.is_ascii_hexdigit());
    let parsed = parse_color(&if is_plain { format!("#{text}") } else { text });
    let parsed =
        parsed.map_err(|_| "a colour is a name, #rgb or #rrggbb, such as orange or '#ff8800'")?;
    let color = parsed.to_alpha_color::<Srgb>();
    if color.components[3] < 1.0 {
        return Err("a colour has no opacity here: write '#rrggbb', such as '#ff8800'".into());
    }
    let Rgba8 { r, g, b, .. } = color.to_rgba8();
    Ok([r, g, b].map(|channel| f32::from(channel) / 255.0))
}

/// Returns a colour as `#rrggbb`, if the text stands for exactly this colour.
pub fn hex(color: [f32; 3]) -> Option<String> {
    let bytes = color.map(|part| (part * 255.0).round());
    let is_exact = bytes.iter().zip(color).all(|(byte, part)| byte / 255.0 == part);
    let [r, g, b] = bytes.map(|byte| byte as u8);
    is_exact.then(|| format!("#{r:02x}{g:02x}{b:02x}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_read() {
        let orange = Ok([1.0, 136.0 / 255.0, 0.0]);
        for text in ["#ff8800", "ff8800", "#F80", " #f80 ", "rgb(255 136 0)"] {
            assert_eq!(parse(text), orange, "{text}");
        }
        assert_eq!((parse("White"), parse("black")), (Ok([1.0; 3]), Ok([0.0; 3])));
        for bad in ["", "+ff008", "#gg0000", "#ff000", "whitish", "ff", "nan"] {
            let message = parse(bad).unwrap_err();
            assert!(message.contains("such as orange or '#ff8800'"), "{bad}: {message}");
        }
        assert!(parse("#ff880080").unwrap_err().contains("no opacity"));
        assert!(parse("transparent").is_err());
        assert_eq!(parse("hsl(120 100% 50%)"), Ok([0.0, 1.0, 0.0]));
        assert_eq!(parse("RebeccaPurple"), parse("#663399"));
        assert_eq!(parse("LightSlateGrey"), parse("#778899"));
    }

    #[test]
    fn colours_are_written_as_they_are_read() {
        for byte in 0..=255u8 {
            let color = [byte, 255 - byte, 7].map(|part| f32::from(part) / 255.0);
            assert_eq!(parse(&hex(color).expect("exact")), Ok(color));
        }
        assert_eq!(hex([0.123, 0.0, 0.0]), None);
    }
}
