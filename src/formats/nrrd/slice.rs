//! Slices: files of two axes of space. Their headers get a third one, of one sample.

use super::{Header, axes::is_several};
use glam::DVec3;

/// Fields with a word for each axis, and the word of an axis of which nothing is known.
const BY_AXIS: [(&str, &str); 8] = [
    ("sizes", "1"),
    ("kinds", "domain"),
    ("spacings", "nan"),
    ("axis mins", "nan"),
    ("axismins", "nan"),
    ("axis maxs", "nan"),
    ("axismaxs", "nan"),
    ("centers", "???"),
];

impl Header<'_> {
    /// Adds a third axis of space to the header of a slice: of two axes, or of three of which one
    /// has colours or components.
    pub(super) fn deepen(&mut self) {
        let words = |name: &str| -> Vec<String> {
            let text = self.fields.get(name).map_or("", String::as_str);
            text.split_ascii_whitespace().map(str::to_ascii_lowercase).collect()
        };
        let several = words("kinds").iter().filter(|kind| is_several(kind)).count();
        let dimension = words("dimension").first().and_then(|word| word.parse::<usize>().ok());
        let Some(count @ 2..=3) = dimension.filter(|count| count - several.min(*count) == 2) else {
            return;
        };
        self.fields.insert("dimension".into(), (count + 1).to_string());
        for (name, unknown) in BY_AXIS {
            if let Some(text) = self.fields.get_mut(name) {
                text.push(' ');
                text.push_str(unknown);
            }
        }
        if let Some(deep) = self.get(&["space directions"]).and_then(deep_directions) {
            self.fields.insert("space directions".into(), deep);
        }
        if let Some([x, y]) = self.get(&["space origin"]).and_then(vector::<2>) {
            self.fields.insert("space origin".into(), format!("({x},{y},0)"));
        }
    }
}

/// Returns the directions of two axes in the plane or in space with a third one, which is normal
/// to them. `None` for other texts, of which the reader says what is wrong.
fn deep_directions(text: &str) -> Option<String> {
    // “none (1,0) (0, 1)” without spaces inside of brackets.
    let joined = text.split(',').map(str::trim).collect::<Vec<_>>().join(",").replace(')', ") ");
    let parts: Vec<&str> = joined.split_ascii_whitespace().collect();
    let vectors = parts.iter().filter(|part| part.starts_with('('));
    let in_space = |part: &&str| match vector::<2>(part) {
        Some([x, y]) => Some(DVec3::new(x, y, 0.0)),
        None => vector(part).map(DVec3::from_array),
    };
    let [first, second] =
        <[DVec3; 2]>::try_from(vectors.map(in_space).collect::<Option<Vec<_>>>()?).ok()?;
    let normal = first.cross(second).try_normalize()? * first.length();
    let mut rest = [first, second].into_iter();
    let mut words: Vec<String> = Vec::new();
    for part in parts {
        words.push(match part.starts_with('(') {
            true => written(rest.next()?),
            false => part.to_owned(),
        });
    }
    words.push(written(normal));
    Some(words.join(" "))
}

fn written(vector: DVec3) -> String {
    format!("({},{},{})", vector.x, vector.y, vector.z)
}

/// Returns the numbers of “(1,0.5)”.
fn vector<const N: usize>(text: &str) -> Option<[f64; N]> {
    let inside = text.trim().strip_prefix('(')?.strip_suffix(')')?;
    let numbers: Option<Vec<f64>> =
        inside.split(',').take(N + 1).map(|word| word.trim().parse().ok()).collect();
    numbers?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use crate::{
        formats::ReadOptions,
        input::testing::{Folder, read_with},
        volume::Volume,
    };
    use glam::DVec3;

    fn slice(fields: &str, data: &[u8]) -> Volume {
        let text = format!("NRRD0004\ntype: uint8\nencoding: raw\n{fields}\n\n");
        let folder = Folder::new();
        let path = folder.write("a.nrrd", [text.as_bytes(), data].concat());
        read_with(&path, |source| super::super::read(source, &ReadOptions::default())).unwrap()
    }

    #[test]
    fn two_axes_are_a_slice() {
        let grey = slice("dimension: 2\nsizes: 3 2\nspacings: 0.5 2", &[1, 2, 3, 4, 5, 6]);
        assert_eq!((grey.lattice.dims, grey.range), ([3, 2, 1], [1.0, 6.0]));
        assert_eq!(grey.lattice.spacing(), DVec3::new(0.5, 2.0, 1.0));
        let kinds = "dimension: 3\nsizes: 3 2 2\nkinds: RGB-color domain domain";
        let colored = slice(kinds, &[9, 50, 70].repeat(4));
        assert_eq!(colored.lattice.dims, [2, 2, 1]);
        assert_eq!(colored.colors.as_deref(), Some(&[[9, 50, 70, 255]; 4][..]));
    }

    #[test]
    fn slices_lie_in_their_space() {
        let plane = "dimension: 2\nsizes: 2 1\nspace dimension: 2\n\
                     space directions: (0,2)(-3, 0)\nspace origin: (5,6)";
        let volume = slice(plane, &[1, 2]);
        assert_eq!(volume.lattice.position(DVec3::X), DVec3::new(5.0, 8.0, 0.0));
        assert_eq!(volume.lattice.axes.z_axis, DVec3::new(0.0, 0.0, 2.0));
        let body = "dimension: 2\nsizes: 2 1\nspace: RAS\nspace directions: (0,2,0) (0,0,1)\n\
                    space origin: (1,2,3)";
        let volume = slice(body, &[1, 2]);
        assert_eq!(volume.lattice.position(DVec3::X), DVec3::new(1.0, 4.0, 3.0));
        assert_eq!(volume.lattice.axes.z_axis, DVec3::new(2.0, 0.0, 0.0));
    }
}
