//! Folders of slices.

use super::*;

/// A slice at a position, of one pixel of a value.
fn slice(position: [f64; 3], value: u16) -> Made {
    let mut made = Made::slice(".1", 1, 1);
    let [x, y, z] = position;
    made.text(tags::POSITION, &format!("{x}\\{y}\\{z}"));
    made.text(tags::ORIENTATION, "1\\0\\0\\0\\1\\0").text(tags::PIXEL_SPACING, "1\\1");
    made.shorts(tags::PIXEL_DATA, "OW", &[value]);
    made
}

/// Writes files, whose names are in another order than their slices.
fn write(folder: &Folder, files: &[Made]) {
    let count = files.len();
    for (i, made) in files.iter().enumerate() {
        folder
            .write(&format!("{:03}", (i * 7 + 3) % count.next_power_of_two().max(8)), made.file());
    }
    assert_eq!(folder.names().len(), count);
}

fn open(folder: &Folder, options: &ReadOptions) -> Result<Volume> {
    let limits = Limits::default();
    let source = Source::open_any(folder.as_ref(), &limits)?;
    read(&source, options)
}

fn stack(positions: &[[f64; 3]]) -> Volume {
    let folder = Folder::new();
    let files: Vec<Made> = (1..).zip(positions).map(|(v, &p)| slice(p, v)).collect();
    write(&folder, &files);
    open(&folder, &ReadOptions::default()).unwrap()
}

/// Returns where each sample lies in DICOM's frame, with its value.
fn places(volume: &Volume) -> Vec<(DVec3, f64)> {
    let turn = DVec3::new(-1.0, -1.0, 1.0);
    let place = |i| (turn * volume.lattice.sample_position(i), volume.value(i));
    (0..volume.len()).map(place).collect()
}

#[test]
fn slices_are_ordered_by_their_positions() {
    let at = |z: f64| [1.0, 2.0, z];
    let volume = stack(&[at(5.0), at(2.5), at(10.0), at(7.5)]);
    assert_eq!(values(&volume), [2.0, 1.0, 4.0, 3.0]);
    assert_eq!(volume.lattice.arrangement, Arrangement::Cartesian);
    assert_eq!(volume.lattice.axes.z_axis, DVec3::new(0.0, 0.0, 2.5));
    // The patient's x leads to the right and y to the front.
    assert_eq!(volume.lattice.origin, DVec3::new(-1.0, -2.0, 2.5));
    assert_eq!(volume.about.orientation, Some(Orientation::RAS));
    // Rounded positions are even all the same.
    let volume = stack(&[at(0.0), at(0.63), at(1.25), at(1.88), at(2.5)]);
    assert_eq!(volume.lattice.arrangement, Arrangement::Cartesian);
    assert_eq!(volume.lattice.axes.z_axis.z, 0.625);
}

#[test]
fn a_tilted_gantry_gives_a_sheared_lattice() {
    let positions = [0.0, 1.0, 2.0, 3.0].map(|i| [5.0, -20.0 + 0.5 * i, 3.0 * i]);
    let volume = stack(&positions);
    assert_eq!(volume.lattice.arrangement, Arrangement::Cartesian);
    for (i, (place, value)) in places(&volume).into_iter().enumerate() {
        assert!(place.distance(DVec3::from(positions[i])) < 1e-12, "{place}");
        assert_eq!(value, i as f64 + 1.0);
    }
    // Uneven and tilted at once.
    let positions = [0.0, 1.0, 2.5, 7.0].map(|i| [5.0, -20.0 + 0.5 * i, 3.0 * i]);
    let volume = stack(&positions);
    assert!(matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_)));
    for (i, (place, _)) in places(&volume).into_iter().enumerate() {
        assert!(place.distance(DVec3::from(positions[i])) < 1e-12, "{place}");
    }
}

fn heads_of(folder: &Folder) -> Vec<Head> {
    let names = folder.names();
    names.iter().map(|name| read_with(&folder.path(name), Head::read).unwrap()).collect()
}

/// Returns what the stack of slices at these depths says.
fn words(depths: &[f64]) -> Vec<String> {
    let folder = Folder::new();
    let files: Vec<Made> = depths.iter().map(|&z| slice([0.0, 0.0, z], 1)).collect();
    write(&folder, &files);
    let mut stack = stack::stacks(&heads_of(&folder)).swap_remove(0);
    stack.lattice(1, 1);
    stack.words
}

#[test]
fn gaps_and_copies_are_told() {
    let volume = stack(&[0.0, 1.0, 2.0, 4.0, 5.0].map(|z| [0.0, 0.0, z]));
    let Arrangement::Rectilinear(places) = &volume.lattice.arrangement else { panic!() };
    assert_eq!(places[2], [0.0, 1.0, 2.0, 4.0, 5.0]);
    assert!(words(&[0.0, 1.0, 2.0, 3.0]).is_empty());
    let of_gap = words(&[10.0, 11.0, 12.0, 14.0, 15.0]);
    assert!(of_gap[0].starts_with("1 slice is missing, between 12.00 and 14.00"), "{of_gap:?}");
    let of_gaps = words(&[0.0, 1.0, 2.0, 5.0, 6.0, 8.0]);
    assert!(of_gaps[0].starts_with("3 slices are missing, between 2.00 and 5.00"), "{of_gaps:?}");
    assert!(of_gaps[0].contains("and elsewhere"));
    let uneven = words(&[0.0, 1.0, 2.3, 4.0]);
    assert!(uneven[0].starts_with("the distances between slices are 1.00 to 1.70"), "{uneven:?}");
    let twice = words(&[0.0, 1.0, 1.0, 2.0]);
    assert_eq!(twice, ["1 slice lies where another does, and is left out"]);
    // Copies of one file have one identifier.
    let folder = Folder::new();
    let mut files = [0.0, 1.0, 1.0, 2.0].map(|z| slice([0.0, 0.0, z], z as u16));
    files.iter_mut().zip(["1.1", "1.2", "1.2", "1.3"]).for_each(|(made, name)| {
        made.text(tags::INSTANCE, name);
    });
    write(&folder, &files);
    assert_eq!(values(&open(&folder, &ReadOptions::default()).unwrap()), [0.0, 1.0, 2.0]);
}

#[test]
fn slices_that_step_aside_are_told() {
    let folder = Folder::new();
    let sides = [0.0, 0.0, 2.0, 0.0];
    let files: Vec<Made> = (0..4).map(|i| slice([sides[i], 0.0, i as f64], 1)).collect();
    write(&folder, &files);
    let mut stack = stack::stacks(&heads_of(&folder)).swap_remove(0);
    stack.lattice(1, 1);
    assert_eq!(stack.words, ["slices lie up to 2.0 beside a straight line, and are drawn on it"]);
}

#[test]
fn times_and_echoes_are_told_apart() {
    let folder = Folder::new();
    let mut files = Vec::new();
    // Two echoes at two times; the number of the picture grows in another order.
    for (i, (time, echo, z)) in (0..8).map(|i| (i, (i & 1, i >> 1 & 1, i >> 2))) {
        let mut made = slice([0.0, 0.0, f64::from(z)], i as u16);
        made.text(tags::TEMPORAL_POSITION, &time.to_string());
        made.text(tags::ECHO_TIME, &(10 * echo).to_string());
        // Each slice has a time of its own, which tells nothing apart.
        made.text(tags::ACQUISITION_TIME, &i.to_string());
        files.push(made);
    }
    write(&folder, &files);
    let at = |time| ReadOptions { time: Some(time), ..ReadOptions::default() };
    for (number, expected) in [[0.0, 4.0], [2.0, 6.0], [1.0, 5.0], [3.0, 7.0]].iter().enumerate() {
        assert_eq!(values(&open(&folder, &at(number)).unwrap()), expected);
    }
    assert_eq!(values(&open(&folder, &ReadOptions::default()).unwrap()), [0.0, 4.0]);
    assert!(open(&folder, &at(4)).unwrap_err().to_string().contains("has 4 times"));
    // Without marks, the numbers of the pictures tell them apart.
    let folder = Folder::new();
    let files: Vec<Made> = (0..6)
        .map(|i| {
            let mut made = slice([0.0, 0.0, f64::from(i % 3)], i as u16);
            made.text(tags::INSTANCE_NUMBER, &(i + 1).to_string());
            made
        })
        .collect();
    write(&folder, &files);
    assert_eq!(values(&open(&folder, &at(1)).unwrap()), [3.0, 4.0, 5.0]);
}

#[test]
fn localizers_and_other_directions_are_left_out() {
    let folder = Folder::new();
    let mut files = vec![slice([0.0, 0.0, 0.0], 1), slice([0.0, 0.0, 1.0], 2)];
    for y in [3.0, 4.0, 5.0] {
        let mut across = slice([0.0, y, 0.0], 9);
        across.text(tags::ORIENTATION, "1\\0\\0\\0\\0\\-1");
        across.text(tags::IMAGE_TYPE, "ORIGINAL\\PRIMARY\\LOCALIZER");
        files.push(across);
    }
    let mut wide = Made::slice(".1", 2, 1);
    wide.shorts(tags::PIXEL_DATA, "OW", &[7, 7]);
    files.push(wide);
    write(&folder, &files);
    assert_eq!(values(&open(&folder, &ReadOptions::default()).unwrap()), [1.0, 2.0]);
}

#[test]
fn slices_with_their_own_slopes_and_signs() {
    let folder = Folder::new();
    let mut files = [slice([0.0, 0.0, 0.0], 10), slice([0.0, 0.0, 1.0], 0xfffe)];
    files[0].text(tags::SLOPE, "0.5").text(tags::INTERCEPT, "1");
    files[1].bits(16, 16, 1);
    write(&folder, &files);
    let volume = open(&folder, &ReadOptions::default()).unwrap();
    assert_eq!(volume.samples, Samples::F32(vec![6.0, -2.0]));
}

/// A study of three series and files of other kinds.
fn study() -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("DISC")).unwrap();
    let mut at = 0;
    for (name, number, words, count) in [
        ("1.2.3", "4", "Chest thin", 3),
        ("1.2.4", "2", "Scout", 1),
        ("1.2.5", "7", "Chest thick", 2),
    ] {
        for z in 0..count {
            let mut made = slice([0.0, 0.0, f64::from(z)], 10 * count as u16 + z as u16);
            made.text(tags::SERIES, name).text(tags::SERIES_NUMBER, number);
            made.text(tags::SERIES_DESCRIPTION, words).text(tags::INSTANCE, &format!("{name}.{z}"));
            folder.write(&format!("DISC/IM{at}"), made.file());
            at += 1;
        }
    }
    let mut outlines = Made::new(".1");
    outlines.text(tags::CLASS, "1.2.840.10008.5.1.4.1.1.481.3").text(tags::SERIES, "1.2.6");
    folder.write("RTSS", outlines.file());
    folder.write("README.TXT", "not a picture");
    folder
}

#[test]
fn a_series_is_chosen() {
    let folder = study();
    let of = |series: &str| {
        let series = Some(series.into());
        open(&folder, &ReadOptions { series, ..ReadOptions::default() })
    };
    let message = |series: &str| match of(series).unwrap_err() {
        Error::Input { message, hint, .. } => format!("{message}; {}", hint.unwrap_or_default()),
        other => panic!("{other}"),
    };
    let default = open(&folder, &ReadOptions::default()).unwrap();
    assert_eq!(values(&default), [30.0, 31.0, 32.0]);
    assert_eq!(values(&of("7").unwrap()), [20.0, 21.0]);
    assert_eq!(values(&of("1.2.4").unwrap()), [10.0]);
    assert_eq!(values(&of("THICK").unwrap()), [20.0, 21.0]);
    assert_eq!(
        message("head"),
        "no series fits “head”; there are: number 2 “Scout”; number 4 “Chest thin”; number 7 \
         “Chest thick”"
    );
    assert_eq!(message("chest"), "2 series fit “chest”; name one by its identifier: 1.2.3, 1.2.5");
    let limits = Limits::default();
    let source = Source::open_any(folder.as_ref(), &limits).unwrap();
    let listed = crate::formats::series(&source, &ReadOptions::default()).unwrap();
    let summary: Vec<_> = listed
        .iter()
        .map(|one| (one.number, &*one.description, one.pictures, one.is_drawn))
        .collect();
    let expected =
        [(2, "Scout", 1, false), (4, "Chest thin", 3, true), (7, "Chest thick", 2, false)];
    assert_eq!(summary, expected.map(|(n, words, count, is)| (Some(n), words, count, is)));
    assert!(crate::formats::load_volume(&folder, &limits, &ReadOptions::default()).is_ok());
    let none = Folder::new();
    none.write("a.txt", "text");
    let error = crate::formats::load_volume(&none, &limits, &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("is not a volume that can be read"), "{error}");
}

#[test]
fn a_directory_lists_files() {
    let folder = study();
    let record = |parts: &str| {
        let mut made = Made::new(".1");
        made.bytes(tags::REFERENCED_FILE, "CS", parts.as_bytes());
        made
    };
    let mut directory = Made::new(".1");
    directory.bytes(tags::MEDIA_CLASS, "UI", b"1.2.840.10008.1.3.10");
    // One name is in another case, one leads out, one is not there.
    let records =
        [record("DISC\\IM4 "), record("disc\\im5 "), record("..\\..\\x "), record("DISC\\IM9 ")];
    directory.sequence(tags::DIRECTORY_RECORDS, &records);
    let path = folder.write("DICOMDIR", directory.file());
    let options = ReadOptions::default();
    let volume = read_with(&path, |source| read(source, &options)).unwrap();
    assert_eq!(values(&volume), [20.0, 21.0]);
    let mut lost = Made::new(".1");
    lost.bytes(tags::MEDIA_CLASS, "UI", b"1.2.840.10008.1.3.10");
    lost.sequence(tags::DIRECTORY_RECORDS, &[record("DISC\\IM9 ")]);
    let path = folder.write("DICOMDIR", lost.file());
    let error = read_with(&path, |source| read(source, &options)).unwrap_err().to_string();
    assert!(error.contains("directory: lists no files that are beside it"), "{error}");
}

#[test]
fn a_damaged_slice_of_a_series_is_told() {
    let folder = Folder::new();
    let files: Vec<Made> = (0..3).map(|z| slice([0.0, 0.0, f64::from(z)], 1)).collect();
    write(&folder, &files);
    let name = folder.names()[1].clone();
    let mut bytes = std::fs::read(folder.path(&name)).unwrap();
    bytes.pop();
    folder.write(&name, bytes);
    let error = open(&folder, &ReadOptions::default()).unwrap_err().to_string();
    assert!(error.contains(&format!("{name}: pixel data: 2 bytes were expected")), "{error}");
    // A file that does not say what it belongs to is passed over.
    folder.write(&name, &files[0].file()[..150]);
    assert_eq!(open(&folder, &ReadOptions::default()).unwrap().len(), 2);
}
