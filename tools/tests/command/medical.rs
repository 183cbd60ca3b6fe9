//! Medical scans: folders of slices, series and times.

#[path = "../../../tests/inputs/medical.rs"]
mod inputs;

use crate::common::*;
use inputs::{dicom, element};

/// A slice of a series at a place along z: a box of 2 × 2 pixels.
fn slice(series: &str, number: &str, words: &str, z: u8) -> Vec<u8> {
    let file = dicom(".1", &[10 + z, 90, 90, 200]);
    let at = file.windows(4).position(|tag| tag == [0x28, 0, 2, 0]).unwrap();
    let (before, after) = file.split_at(at);
    let even = |text: String| if text.len() % 2 == 1 { text + " " } else { text };
    let text =
        |group, tag, kind, text: &str| element(group, tag, kind, even(text.into()).as_bytes());
    [
        before,
        &text(8, 0x103e, "LO", words),
        &text(0x20, 0xe, "UI", series),
        &text(0x20, 0x11, "IS", number),
        &text(0x20, 0x32, "DS", &format!("0\\0\\{z}")),
        &text(0x20, 0x37, "DS", "1\\0\\0\\0\\1\\0"),
        after,
    ]
    .concat()
}

/// A folder of a series of three slices, not evenly spaced, and one of two.
fn study() -> Folder {
    let folder = Folder::new();
    std::fs::create_dir_all(folder.path("study/inner")).unwrap();
    for z in [1, 0, 3] {
        folder.write(&format!("study/{z}"), slice("1.2.3", "4", "Chest thin", z));
    }
    for z in [0, 1] {
        folder.write(&format!("study/inner/{z}"), slice("1.2.5", "9", "Chest thick", z));
    }
    folder.write("study/notes.txt", "not a picture");
    folder
}

#[test]
fn a_folder_is_described_and_drawn() {
    let folder = study();
    let facts = folder.json("info study --json");
    assert_eq!(facts["dims"], serde_json::json!([2, 2, 3]));
    let series = facts["series"].as_array().unwrap();
    assert_eq!(series.len(), 2);
    assert_eq!((series[0]["number"].as_i64(), series[0]["drawn"].as_bool()), (Some(4), Some(true)));
    assert_eq!(series[1]["description"], "Chest thick");
    let printed = folder.run("info study");
    assert!(printed.stdout().contains("series 4        CT “Chest thin”, 3 of 2 × 2, 1.2.3, drawn"));
    let warnings = printed.stderr();
    assert!(warnings.contains("of 2 series, number 4 “Chest thin” has the most pictures"));
    assert!(warnings.contains("the distances between slices are 1.00 to 2.00"), "{warnings}");
    for flags in ["", " --series 9", " --series thick"] {
        let arguments =
            format!("render study{flags} -o a.png --engine cpu --overwrite --size 64x64");
        folder.run(&arguments).ok();
    }
    assert_eq!(folder.json("info study --series 9 --json")["dims"][2], 2);
}

#[test]
fn wrong_choices_are_told() {
    let folder = study();
    std::fs::create_dir(folder.path("empty")).unwrap();
    folder.run("info study --series head").fails(3, &["no series fits “head”", "Chest thin"]);
    folder.run("info study --series chest").fails(3, &["2 series fit “chest”", "1.2.3, 1.2.5"]);
    folder.run("info study --time 2").fails(3, &["has 1 time, but number 2", "leave out --time"]);
    folder.run("info empty").fails(3, &["no series of pictures was found", "DICOM"]);
    folder.put("a.nii", inputs::nifti(|_| {}));
    folder.run("info a.nii --time 1").fails(3, &["has 1 time,", "leave out --time"]);
    folder.run("render a.nii -o a.png --engine cpu --size 64x64").ok();
}

/// A segmentation of two labels, of 4 × 4 × 4 bytes, with the name and the colour of one.
fn segmentation() -> Vec<u8> {
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\n\
                  sizes: 4 4 4\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n\
                  encoding: raw\nSegment0_LabelValue:=7\nSegment0_Name:=left ear\n\
                  Segment0_Color:=1 0 0\n\n";
    let label = |at: usize| if at % 4 < 2 { 7 } else { 40 * u8::from(at / 16 == 3) };
    [header.as_bytes(), &(0..64).map(label).collect::<Vec<u8>>()].concat()
}

#[test]
fn labels_are_named_and_lie_in_the_frame_of_the_patient() {
    let folder = study();
    folder.write("a.seg.nrrd", segmentation());
    folder.write("table.txt", "40 bone 250 240 230 0\n");
    folder.write("wrong.txt", "bone 1\n");
    let run = folder.run("info a.seg.nrrd --labels table.txt");
    assert!(run.stdout().contains("labels          7 left ear, 40 bone"), "{}", run.stdout());
    assert!(run.stdout().contains("frame           RAS"), "{}", run.stdout());
    let render = |arguments: &str| {
        folder.run(&format!("render {arguments} -o b.png --engine cpu --overwrite --size 64x64"))
    };
    let json = |arguments: &str| -> serde_json::Value {
        serde_json::from_str(&render(&format!("{arguments} --json")).stdout()).unwrap()
    };
    let drawn = json("a.seg.nrrd study --axes --scalar-bar --labels table.txt");
    assert_eq!(drawn["overlay"]["axes"], "RLAPSI", "{drawn}");
    let bars = &drawn["overlay"]["scalar_bars"];
    assert_eq!(bars[0]["labels"], serde_json::json!(["left ear", "bone"]), "{drawn}");
    // Without a space, the same samples may lie elsewhere.
    let other = String::from_utf8_lossy(&segmentation())
        .replace("space: left-posterior-superior", "space dimension: 3");
    folder.write("other.nrrd", other.replace("Segment0", "Other0"));
    let warned = render("study other.nrrd").stderr();
    assert!(warned.contains("other.nrrd does not say how its axes lie in the patient, as study"));
    let refused = render("a.seg.nrrd --labels wrong.txt");
    assert!(refused.stderr().contains("wrong.txt: line 1: “bone 1” is not a label"));
    let refused = folder.run("convert a.seg.nrrd -o a.splv");
    assert!(refused.stderr().contains("a label map has no coarser levels"), "{}", refused.stderr());
}
