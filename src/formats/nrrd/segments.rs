//! The segments of a segmentation, as 3D Slicer writes them into the keys of an NRRD file
//! (`.seg.nrrd`): `Segment0_LabelValue:=1`, `Segment0_Name:=liver`, `Segment0_Color:=0.8 0.4 0.3`.

use crate::about::Label;
use std::collections::{BTreeMap, HashMap};

/// Returns what is known about the labels; `None` if the keys name no segment.
pub fn table(keys: &HashMap<String, String>) -> Option<Vec<Label>> {
    let mut segments = BTreeMap::<u32, Label>::new();
    let mut places: Vec<(u32, &str, &str)> = Vec::new();
    for (key, value) in keys {
        let Some((number, name)) =
            key.strip_prefix("Segment").and_then(|rest| rest.split_once('_'))
        else {
            continue;
        };
        if let Ok(number) = number.parse() {
            places.push((number, name, value));
        }
    }
    for (number, name, value) in places {
        // Older files have no values: segments are numbered from 1 on.
        let label = segments.entry(number).or_insert_with(|| Label {
            value: number.saturating_add(1) as i32,
            ..Label::default()
        });
        match name {
            "LabelValue" => label.value = value.trim().parse().unwrap_or(label.value),
            "Name" => value.trim().clone_into(&mut label.name),
            "Color" => label.color = color(value).or(label.color),
            _ => {}
        }
    }
    (!segments.is_empty()).then(|| segments.into_values().collect())
}

/// Reads red, green and blue in 0 … 1.
fn color(text: &str) -> Option<[f64; 3]> {
    let channels: Vec<f64> =
        text.split_ascii_whitespace().map_while(|word| word.parse().ok()).collect();
    let color = <[f64; 3]>::try_from(channels).ok()?;
    color.iter().all(|channel| (0.0..=1.0).contains(channel)).then_some(color)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_labels() {
        let keys = [
            ("Segment0_LabelValue", "3"),
            ("Segment0_Name", "left ear"),
            ("Segment0_Color", "0.25 0.5 1"),
            ("Segment1_Name", "old"),
            ("Segment1_Color", "7 0 0"),
            ("Segmentation_MasterRepresentation", "Binary labelmap"),
        ];
        let keys = keys.map(|(key, value)| (key.to_owned(), value.to_owned())).into();
        let first = Label {
            value: 3,
            name: "left ear".into(),
            color: Some([0.25, 0.5, 1.0]),
            opacity: None,
        };
        let second = Label { value: 2, name: "old".into(), ..Label::default() };
        assert_eq!(table(&keys), Some(vec![first, second]));
        assert_eq!(table(&HashMap::new()), None);
    }
}
