//! Tests of descriptions and scene files.

use super::*;
use crate::{
    Error,
    input::testing::Folder,
    math::{Camera, Projection},
    scene::{Classification, Optics, Settings},
    volume::TransferFunction,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// A scene that sets a field of every part.
fn scene() -> Description {
    file::parse(
        r##"{"splatkit_scene": 2,
            "inputs": [{"file": "a.nrrd", "reading": {"dims": [2, 3, 4], "type": "u8"}},
                       {"file": "b.ply", "visible": false,
                        "appearance": {"color": "red", "opacity": 0.5}}],
            "reading": {"scalar": "heat", "slopes": false, "limits": {"seconds": 7}},
            "appearance": {
                "transfer": {"color": [[0, 1, 1, 1]], "opacity": [[0, 0], [5, 0.125]]},
                "range": [-1, 4.5], "isosurfaces": [{"value": 3}, {"percent": 50, "opacity": 0.5}],
                "colormap": "viridis_r", "nan_color": "#808080", "kernel": "hann", "sharp": true},
            "camera": {"position": [0.1, 2, 3], "focal_point": [0, 0, 0], "view_up": [0, 0, 1],
                       "view_angle": 30},
            "framing": {"view": "left", "azimuth": 20, "zoom": 2, "up": [0, 0, 1]},
            "picture": {"size": [640, 480], "background": "white", "samples": 4,
                        "mode": "splats", "back_to_front": true, "classify": "pre-integrated",
                        "optics": "x-ray", "shade": false, "cut": 3.5,
                        "clips": [{"plane": [1, 0, 0, 2.5]},
                                  {"box": [[0, 0, "0%"], [1, 1, "50%"]], "inside": false},
                                  {"side": {"axis": "x", "below": true, "at": "50%"}}]},
            "overlay": {"axes": true, "caption": "A bone"},
            "engine": "cpu"}"##,
    )
    .expect("a scene")
}

#[test]
fn a_scene_is_written_as_it_is_read() {
    let scene = scene();
    let corners = scene.picture.clips[1].cuboid.expect("a box");
    assert_eq!(corners[1], [Place::World(1.0), Place::World(1.0), Place::Percent(50.0)]);
    assert!(scene.inputs[0].visible && !scene.inputs[1].visible);
    assert_eq!(scene.picture.classify, Some(Classification::PreIntegrated));
    assert_eq!(scene.picture.optics, Some(Optics::XRay));
    assert_eq!(scene.appearance.nan_color, "gray".parse().ok());
    let text = scene.to_json(Path::new(""));
    let mut again = file::parse(&text).expect("its own text");
    assert_eq!(again.reading.limits, LimitsEntry::default(), "the next user decides");
    again.reading.limits = scene.reading.limits;
    assert_eq!(again, scene, "{text}");
    let camera = scene.camera.expect("a camera").camera().expect("valid");
    assert_eq!(CameraEntry::from(&camera), scene.camera.expect("a camera"));
    let flat = Camera { projection: Projection::Orthographic { height: 2.0 }, ..camera };
    assert_eq!(CameraEntry::from(&flat).camera(), Ok(flat));
}

#[test]
fn inputs_have_what_they_do_not_share() {
    let mut scene = scene();
    let appearance = scene.appearance_of(&scene.inputs[1]);
    assert_eq!((appearance.opacity, appearance.range), (Some(0.5), Some([-1.0, 4.5])));
    assert!(appearance.sharp && appearance.color.is_some());
    assert_eq!(scene.appearance_of(&scene.inputs[0]).color, None);
    let reading = scene.reading_of(&scene.inputs[0]);
    assert_eq!((reading.dims, reading.scalar.as_deref()), (Some([2, 3, 4]), Some("heat")));
    assert_eq!(scene.reading_of(&scene.inputs[1]).limits().seconds, 7);
    let transfer = TransferFunction { opacity: vec![(1.0, 0.5)], ..TransferFunction::default() };
    let whole = Some(TransferEntry::Whole(transfer));
    scene.inputs[1].appearance.transfer.clone_from(&whole);
    assert_eq!(scene.appearance_of(&scene.inputs[1]).transfer, whole);
    assert_ne!(scene.appearance_of(&scene.inputs[0]).transfer, whole);
}

#[test]
fn what_is_wrong_is_named() {
    let wrong = |from: &str, to: &str| {
        let text = scene().to_json(Path::new("")).replacen(from, to, 1);
        file::parse(&text).expect_err(to)
    };
    let place = |from: &str, to: &str| wrong(from, to).0;
    assert!(wrong("\"inputs\"", "\"input\"").1.contains("`input`"));
    assert!(wrong("\"visible\"", "\"visable\"").1.contains("visable"));
    assert!(wrong("\"splatkit_scene\": 2", "\"splatkit_scene\": 1").1.contains("version 2"));
    assert_eq!(place("\"view_angle\": 30.0", "\"view_angle\": 0.0"), "camera");
    assert!(wrong("\"view_angle\": 30.0", "\"angle\": 30.0").1.contains("angle"));
    assert!(wrong("\"plane\"", "\"plan\"").0.contains("picture.clips[0]"));
    assert!(place("0.125", "7.5").contains("transfer"), "an opacity above 1");
    let isosurface = place("\"percent\": 50.0", "\"percent\": 150.0");
    assert_eq!(isosurface, "appearance.isosurfaces");
    assert_eq!(place("\"viridis_r\"", "\"virids\""), "appearance.colormap");
    assert_eq!(place("\"#ffffff\"", "\"whitish\""), "picture.background");
    assert_eq!(place("\"x-ray\"", "\"xray\""), "picture.optics");
    assert_eq!(place("\"cut\": 3.5", "\"cut\": -3.5"), "picture.cut");
    assert_eq!(place("\"mode\": \"splats\"", "\"mode\": \"sheets\""), "picture.back_to_front");
    let text = r#"{"splatkit_scene": 2, "inputs": [{"file": "a", "appearance": {"opacity": 0}}]}"#;
    assert_eq!(file::parse(text).expect_err("opacity").0, "inputs[0].appearance.opacity");
    let text = scene().to_json(Path::new(""));
    assert!(file::parse(&format!("{text} {{}}")).is_err(), "two texts");
    assert!(file::parse(&text[..text.len() / 2]).is_err(), "half a text");
}

#[test]
fn a_scene_may_only_lower_limits() {
    let error = |reading: Value, picture: Value| {
        let text = json!({"splatkit_scene": 2, "inputs": [{"file": "a.ply"}],
                          "reading": reading, "picture": picture});
        file::parse(&text.to_string()).err()
    };
    for name in ["points", "bytes", "depth", "texels", "seconds"] {
        assert_eq!(error(json!({"limits": {name: 7}}), json!({})), None);
        let (place, message) =
            error(json!({"limits": {name: 9_999_999_999_999u64}}), json!({})).expect(name);
        assert_eq!(place, format!("reading.limits.{name}"));
        assert!(message.contains("only lower"), "{message}");
    }
    let (place, _) = error(json!({}), json!({"memory": 1})).expect("memory");
    assert_eq!(place, "picture.memory");
}

#[test]
fn counts_and_texts_are_limited() {
    let error = |inputs: usize, overlay: Value, reading: Value| {
        let inputs = vec![json!({"file": "a.ply"}); inputs];
        let whole = json!({"splatkit_scene": 2, "inputs": inputs, "overlay": overlay,
                           "reading": reading});
        file::parse(&whole.to_string()).err()
    };
    let none = || json!({});
    assert_eq!(error(Description::MOST_INPUTS, none(), none()), None);
    let (place, message) = error(Description::MOST_INPUTS + 1, none(), none()).expect("too many");
    assert!(place == "inputs" && message.contains("10001") && message.contains("10000"));
    let caption = |letters: usize| error(1, json!({"caption": "ä".repeat(letters)}), none());
    assert_eq!(caption(Description::MOST_CAPTION), None);
    let (place, message) = caption(500_000).expect("too long");
    assert!(place == "overlay.caption" && message.contains("has 500000 letters"), "{message}");
    let (place, _) = error(1, none(), json!({"scalar": "a".repeat(5000)})).expect("too long");
    assert_eq!(place, "reading.scalar");
    let clips = vec![json!({"plane": [1, 0, 0, 0]}); Settings::MAX_CLIPS + 1];
    let whole = json!({"splatkit_scene": 2, "inputs": [{"file": "a"}],
                       "picture": {"clips": clips}});
    assert_eq!(file::parse(&whole.to_string()).expect_err("too many").0, "picture.clips");
}

#[test]
fn paths_are_relative_to_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let [data, scenes] = ["data", "scenes"].map(|name| folder.path().join(name));
    std::fs::create_dir(&data).expect("a folder");
    std::fs::create_dir(&scenes).expect("a folder");
    for name in ["a.ply", "t.json"] {
        std::fs::write(data.join(name), "{}").expect("a file");
    }
    let path = scenes.join("s.json");
    let mut scene = Description::new([data.join("a.ply")]);
    let transfer = TransferEntry::Name(data.join("t.json").to_string_lossy().into());
    scene.appearance.transfer = Some(transfer);
    scene.write(&path).expect("written");
    let text = std::fs::read_to_string(&path).expect("text");
    assert!(text.contains("../data/a.ply") && text.contains("../data/t.json"), "{text}");
    let error = Description::read(&path, &Limits::default()).expect_err("outside").to_string();
    assert!(error.contains("inputs[0].file") && error.contains("leads out"), "{error}");
    let read = Description::read_trusted(&path, &Limits::default()).expect("read");
    let file = read.appearance.transfer.as_ref().and_then(TransferEntry::file);
    assert!(file.is_some_and(Path::exists));
    let [stored, wanted] = [read.inputs[0].file.clone(), data.join("a.ply")]
        .map(|path| path.canonicalize().expect("a file"));
    assert_eq!(stored, wanted);
}

/// Makes files in a folder and in the folder of a scene inside it. Returns the latter, and names
/// of what lies elsewhere.
fn inside_and_elsewhere(folder: &Path) -> (PathBuf, Vec<&'static str>) {
    let inside = folder.join("scenes");
    std::fs::create_dir_all(inside.join("below")).expect("a folder");
    for file in ["scenes/a.ply", "scenes/below/t.json", "outside.ply"] {
        std::fs::write(folder.join(file), "{}").expect("a file");
    }
    let mut elsewhere = vec![
        "../outside.ply",
        "below/../../outside.ply",
        "/etc/hostname",
        "..\\outside.ply",
        "C:\\outside.ply",
        "//server/share/a.ply",
        "file:///etc/hostname",
        "https://example.org/a.ply",
        "s3://bucket/a.ply",
        "..",
    ];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../outside.ply", inside.join("link.ply")).expect("a link");
        std::os::unix::fs::symlink("..", inside.join("up")).expect("a link");
        elsewhere.extend(["link.ply", "up/outside.ply"]);
    }
    (inside, elsewhere)
}

/// A scene from elsewhere reads no other files of the user's, and asks no server.
#[test]
fn files_elsewhere_need_the_users_word() {
    let folder = tempfile::tempdir().expect("a folder");
    let (inside, elsewhere) = inside_and_elsewhere(folder.path());
    let file = inside.join("s.json");
    let good = ["a.ply", "mri", "below/t.json", "below/t.json", "hann"];
    let write = |[input, transfer, all, labels, kernel]: [&str; 5]| {
        let text = json!({
            "splatkit_scene": 2,
            "inputs": [{"file": "a.ply"},
                       {"file": input, "visible": false, "appearance": {"transfer": transfer}}],
            "appearance": {"transfer": all, "kernel": kernel},
            "reading": {"labels": labels},
        });
        std::fs::write(&file, text.to_string()).expect("a file");
        Description::read(&file, &Limits::default())
    };
    let scene = write(good).expect("a scene");
    assert_eq!(scene.inputs[1].file, inside.join("a.ply"));
    assert_eq!(scene.inputs[1].appearance.transfer, Some(TransferEntry::Name("mri".into())));
    assert_eq!(scene.reading.labels, Some(inside.join("below/t.json")));
    assert_eq!(scene.appearance.kernel, Some(KernelEntry::Name("hann".into())));
    let places = [
        "inputs[1].file",
        "inputs[1].appearance.transfer",
        "appearance.transfer",
        "reading.labels",
        "appearance.kernel",
    ];
    for (number, place) in places.into_iter().enumerate() {
        for name in &elsewhere {
            let mut names = good;
            names[number] = name;
            let error = write(names).expect_err(name);
            let Error::Input { place: named, hint, .. } = &error else { panic!("{error}") };
            assert_eq!(named, place, "{name}: {error}");
            assert!(hint.as_deref().is_some_and(|hint| hint.contains("--trust-scene")));
            assert!(Description::read_trusted(&file, &Limits::default()).is_ok(), "{name}");
        }
    }
}

/// The schema in docs/ is that of the types. `SPLATKIT_WRITE=1` writes it.
#[test]
fn the_schema_is_that_of_the_types() {
    let mut schema = json!(schemars::schema_for!(Description));
    schema["title"] = "A scene of splatkit".into();
    let text = serde_json::to_string_pretty(&schema).expect("JSON") + "\n";
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.schema.json");
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        std::fs::write(&path, &text).expect("written");
    }
    let stored = std::fs::read_to_string(&path).expect("docs/scene.schema.json");
    assert!(stored == text, "docs/scene.schema.json is old: run this test with SPLATKIT_WRITE=1");
}

/// Who describes a scene decides what inputs share, but not what is written.
#[test]
fn what_all_inputs_say_alike_is_written_once() {
    let parsed = |more: &str, inputs: [&str; 2]| {
        let [a, b] = inputs;
        let text = format!(
            r#"{{"splatkit_scene": 2, "inputs": [{{"file": "a.ply"{a}}}, {{"file": "b.ply"{b}}}]
                {more}}}"#
        );
        file::parse(&text).expect(&text)
    };
    let text = |scene: &Description| scene.to_json(Path::new(""));
    let shared = parsed(r#", "appearance": {"opacity": 0.3, "edges": true}"#, ["", ""]);
    let each = r#", "appearance": {"opacity": 0.3, "edges": true}"#;
    let alike = parsed("", [each, each]);
    assert_eq!(text(&alike), text(&shared));
    assert_eq!(file::parse(&text(&alike)), Ok(shared));
    // What differs stays with the inputs.
    let other = r#", "appearance": {"opacity": 0.6, "edges": true}"#;
    let mixed = file::parse(&text(&parsed("", [each, other]))).expect("a scene");
    assert!(mixed.appearance.edges && mixed.appearance.opacity.is_none());
    let opacities = [0, 1].map(|number| mixed.inputs[number].appearance.opacity);
    assert_eq!(opacities, [Some(0.3), Some(0.6)]);
    // An input that differs from what the others share is written as it was.
    let one = parsed(r#", "reading": {"scalar": "heat"}"#, ["", r#", "reading": {"scalar": "p"}"#]);
    assert_eq!(file::parse(&text(&one)), Ok(one));
}

/// Two times of a volume: the second has twice the values.
#[test]
fn another_time_looks_as_the_first_does() {
    let folder = crate::input::testing::Folder::new();
    let values = |factor: u8| (0..27).map(move |at: u8| factor * (at % 9));
    let head = "NRRD0004\ntype: uint8\ndimension: 4\nsizes: 3 3 3 2\nencoding: raw\n\
                kinds: domain domain domain time\n\n";
    let content: Vec<u8> = head.bytes().chain(values(1)).chain(values(2)).collect();
    let file = folder.write("t.nrrd", &content);
    let mut scene = Description::new([file]);
    scene.appearance.isosurfaces =
        Some(vec![IsosurfaceEntry { value: None, percent: Some(50.0), color: None, opacity: 0.5 }]);
    scene.appearance.transfer = Some(TransferEntry::Name("generic".into()));
    let loaded = scene.load(&|_| ()).expect("the first time");
    assert_eq!(loaded.inputs[0].times.map(|times| times.count), Some(2));
    let later = scene.at_time(&loaded, 1);
    let other = later.load(&|_| ()).expect("the second time");
    let parts = |loaded: &Loaded| match &loaded.scene.items[..] {
        [crate::scene::Item::Volume(volume, _, transfer)] => (volume.range, transfer.clone()),
        items => panic!("{} items", items.len()),
    };
    let ((first, transfer), (second, same)) = (parts(&loaded), parts(&other));
    assert_eq!((first, second), ([0.0, 8.0], [0.0, 16.0]));
    assert_eq!(transfer, same);
    assert_eq!(same.isosurfaces.iter().map(|surface| surface.value).collect::<Vec<_>>(), [4.0]);
    // By itself, the second time would have other ends.
    scene.reading.time = Some(1);
    assert_ne!(parts(&scene.load(&|_| ()).expect("the second time")).1, transfer);
    // And back again.
    let again = later.at_time(&other, 0).load(&|_| ()).expect("the first time");
    assert_eq!(parts(&again), (first, transfer));
}

/// Edits are made once an input is moved, and what they leave has the values that colour it.
#[test]
fn inputs_are_edited_before_they_are_drawn() {
    let text = r#"{"splatkit_scene": 2, "inputs": [
        {"file": "a.csv", "transform": {"translate": [10, 0, 0]},
         "edits": ["where:heat > 1 && x < 13", "crop:11,-1,-1,99,1,1"],
         "appearance": {"color": "heat"}}]}"#;
    let scene = Description::parse(text).unwrap();
    let rows = (0..6).map(|at| format!("{at},0,0,{at}\n")).collect::<String>();
    let files = |name: &str, bytes: &[u8]| BTreeMap::from([(name.into(), bytes.to_vec())]);
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n\
         property float z\nproperty float heat\nend_header\n{}",
        rows.replace(',', " ")
    );
    let mut edited = scene.clone();
    edited.inputs[0].file = "a.ply".into();
    let loaded = edited.load_held(&files("a.ply", ply.as_bytes()), &|_| {}).unwrap();
    assert_eq!(loaded.inputs[0].facts.to_json()["count"], 1);
    let [low, high] = [loaded.subject.bounds.min, loaded.subject.bounds.max];
    assert!(low.x > 11.0 && high.x < 13.0, "{low} {high}");
    // Edits are for what has points of its own.
    let volume = crate::volume::phantoms::Phantom::Ball.sample([4; 3]).unwrap();
    let mut field = scene;
    (field.inputs[0].file, field.inputs[0].transform) = ("v.nrrd".into(), Default::default());
    field.inputs[0].appearance = AppearanceEntry::default();
    let folder = Folder::new();
    let path = folder.path("v.nrrd");
    crate::formats::nrrd::write(&volume, &path).unwrap();
    let bytes = std::fs::read(path).unwrap();
    let error = field.load_held(&files("v.nrrd", &bytes), &|_| {}).err().unwrap();
    let message = error.to_string();
    for word in ["v.nrrd", "edits", "a volume cannot be edited"] {
        assert!(message.contains(word), "{message}");
    }
    let bad = text.replace("crop:11", "crops:11");
    let message = Description::parse(&bad).unwrap_err().to_string();
    assert!(message.contains("there is no edit “crops”"), "{message}");
}
