//! Segmentations: frames of segments, which become one label map.

use super::*;

fn item(change: impl Fn(&mut Made)) -> Made {
    let mut made = Made::new(".1");
    change(&mut made);
    made
}

/// Frames at heights, each with its segment, of 3 × 2 pixels.
fn segmentation(kind: &str, frames: &[(f64, u16)]) -> Made {
    let shared = item(|made| {
        let measures = item(|made| {
            made.text(tags::PIXEL_SPACING, "2\\3").text(tags::SPACING_BETWEEN_SLICES, "5");
        });
        let planes = item(|made| {
            made.text(tags::ORIENTATION, "1\\0\\0\\0\\1\\0");
        });
        made.sequence(tags::PIXEL_MEASURES, &[measures]);
        made.sequence(tags::PLANE_ORIENTATIONS, &[planes]);
    });
    let frame = |&(z, segment): &(f64, u16)| {
        item(|made| {
            let place = item(|made| {
                made.text(tags::POSITION, &format!("0\\0\\{z}"));
            });
            let identification = item(|made| {
                made.short(tags::SEGMENT_NUMBER, segment);
            });
            made.sequence(tags::PLANE_POSITIONS, &[place]);
            made.sequence(tags::SEGMENT_IDENTIFICATIONS, &[identification]);
        })
    };
    let segment = |number: u16, name: &str, lab: [u16; 3]| {
        item(|made| {
            made.short(tags::SEGMENT_OF_TABLE, number).shorts(tags::SEGMENT_COLOR, "US", &lab);
            made.bytes(tags::SEGMENT_LABEL, "LO", name.as_bytes());
        })
    };
    let groups: Vec<Made> = frames.iter().map(frame).collect();
    let mut made = Made::slice(".1", 3, 2);
    made.text(tags::CLASS, "1.2.840.10008.5.1.4.1.1.66.4").text(tags::MODALITY, "SEG");
    made.bytes(tags::SEGMENTATION_TYPE, "CS", kind.as_bytes());
    made.text(tags::FRAMES, &frames.len().to_string());
    made.sequence(tags::SHARED_GROUPS, &[shared]).sequence(tags::FRAME_GROUPS, &groups);
    // Mid grey, and the red of sRGB.
    let red = [53.24 / 100.0, (80.09 + 128.0) / 255.0, (67.20 + 128.0) / 255.0];
    let red = red.map(|part: f64| (part * 65535.0).round() as u16);
    let grey = [53.585 / 100.0, 128.0 / 255.0, 128.0 / 255.0];
    let grey = grey.map(|part: f64| (part * 65535.0).round() as u16);
    made.sequence(tags::SEGMENTS, &[segment(1, "lung", grey), segment(4, "node", red)]);
    made
}

#[test]
fn frames_of_segments_are_one_label_map() {
    // Slices without any segment have no frame, and frames come segment by segment.
    let mut made = segmentation("BINARY", &[(0.0, 1), (15.0, 1), (5.0, 4), (15.0, 4)]);
    let bits: u32 = 0b1000_0000_0110_1111_1100_0001;
    made.bits(1, 1, 0).bytes(tags::PIXEL_DATA, "OB", &bits.to_le_bytes());
    let volume = read_made(&made);
    assert_eq!(
        (volume.lattice.dims, volume.lattice.spacing()),
        ([3, 2, 4], [3.0, 2.0, 5.0].into())
    );
    let expected = [
        [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 4.0, 4.0, 0.0, 0.0, 0.0],
        [0.0; 6],
        [1.0, 1.0, 1.0, 1.0, 1.0, 4.0],
    ];
    assert_eq!(values(&volume), expected.concat());
    assert!(volume.is_label_map());
    let labels = volume.about.labels.as_ref().unwrap();
    assert_eq!((labels.present.as_slice(), labels.background), (&[0, 1, 4][..], Some(0)));
    let (lung, node) = (labels.get(1).unwrap(), labels.get(4).unwrap());
    assert_eq!((&*lung.name, &*node.name), ("lung", "node"));
    let near = |label: &crate::about::Label, expected: [f64; 3]| {
        let color = label.color.unwrap();
        assert!(color.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.01), "{color:?}");
    };
    near(lung, [0.502; 3]);
    near(node, [1.0, 0.0, 0.0]);
    assert_eq!(volume.about.orientation, Some(Orientation::RAS));
}

#[test]
fn a_segment_lies_where_it_has_half_of_a_pixel() {
    let mut made = segmentation("FRACTIONAL", &[(0.0, 4)]);
    made.short(tags::MOST_FRACTION, 200).bits(8, 8, 0);
    made.bytes(tags::PIXEL_DATA, "OB", &[0, 99, 100, 101, 200, 1]);
    assert_eq!(values(&read_made(&made)), [0.0, 0.0, 4.0, 4.0, 4.0, 0.0]);
}

#[test]
fn values_of_label_maps_are_segments() {
    let mut made = segmentation("LABELMAP", &[(0.0, 1), (5.0, 1)]);
    made.text(tags::CLASS, "1.2.840.10008.5.1.4.1.1.66.7").bits(8, 8, 0);
    made.bytes(tags::PIXEL_DATA, "OB", &[0, 1, 4, 0, 0, 0, 4, 4, 4, 0, 0, 1]);
    let expected = [0.0, 1.0, 4.0, 0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 0.0, 0.0, 1.0];
    assert_eq!(values(&read_made(&made)), expected);
}

#[test]
fn frames_between_slices_are_refused() {
    let mut made = segmentation("BINARY", &[(0.0, 1), (5.0, 1), (8.0, 1)]);
    made.bits(1, 1, 0).bytes(tags::PIXEL_DATA, "OB", &[0; 4]);
    assert!(
        error_of(&made.file()).contains("are not multiples of 3"),
        "{}",
        error_of(&made.file())
    );
    let mut made = segmentation("BINARY", &[(0.0, 1), (5e7, 1)]);
    made.bits(1, 1, 0).bytes(tags::PIXEL_DATA, "OB", &[0; 2]);
    assert!(error_of(&made.file()).contains("at most 65536"), "{}", error_of(&made.file()));
}
