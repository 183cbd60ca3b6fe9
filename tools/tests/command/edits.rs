//! Edits on the way of `splatkit convert`, statistics, and scenes that are compared.

use crate::common::*;

/// A cloud of 40 × 40 points in the plane z = 0 with an intensity and a class, and one far point.
fn cloud() -> String {
    let mut text = String::from(
        "ply\nformat ascii 1.0\nelement vertex 1601\nproperty float x\nproperty float y\nproperty \
         float z\nproperty ushort intensity\nproperty uchar classification\nend_header\n",
    );
    for index in 0..1600 {
        let (x, y) = (index % 40, index / 40);
        text += &format!("{x} {y} 0 {index} {}\n", if x < 10 { 2 } else { 5 });
    }
    text + "20 20 300 7 7\n"
}

fn count(folder: &Folder, name: &str) -> u64 {
    folder.json(&format!("info {name} --json"))["count"].as_u64().unwrap()
}

/// Returns points of a wavy sheet as binary PLY.
fn points(count: usize) -> Vec<u8> {
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {count}\nproperty float x\n\
         property float y\nproperty float z\nend_header\n"
    )
    .into_bytes();
    for index in 0..count {
        let part = |by: f64| ((index as f64 * by).fract() * 20.0 - 10.0) as f32;
        let (x, y) = (part(0.754_877_666), part(0.569_840_291));
        [x, y, x.sin() * y.cos()].iter().for_each(|value| out.extend(value.to_le_bytes()));
    }
    out
}

#[test]
fn edits_are_made_in_their_order() {
    let folder = Folder::new();
    folder.put("a.ply", cloud());
    let report = folder.json(
        "convert a.ply -o b.las --remove-floaters --where classification==2 --translate 100,0,0 \
         --crop=105,-1,-1,200,100,1 --json",
    );
    assert_eq!(
        (report["points_read"].as_u64(), report["points"].as_u64()),
        (Some(1601), Some(200))
    );
    let steps: Vec<(&str, u64)> = report["edits"]
        .as_array()
        .unwrap()
        .iter()
        .map(|edit| (edit["edit"].as_str().unwrap(), edit["after"].as_u64().unwrap()))
        .collect();
    assert_eq!(steps, [("remove-floaters", 1600), ("where", 400), ("move", 400), ("crop", 200)]);
    // The same edits in another order: the crop comes before the move.
    folder
        .run("convert a.ply -o c.las --crop=105,-1,-1,200,100,1 --translate 100,0,0")
        .fails(3, &["a.ply: --crop: keeps none of 1601", "--stats"]);
    assert!(!folder.path("c.las").exists());
    let facts = folder.json("info b.las --json --stats");
    let of = |name: &str| {
        let all = facts["stats"].as_array().unwrap();
        all.iter().find(|one| one["name"] == name).unwrap_or_else(|| panic!("{name}")).clone()
    };
    assert_eq!(of("x")["range"], serde_json::json!([105.0, 109.0]));
    assert_eq!(of("intensity")["mean"].as_f64(), Some(787.0));
    assert_eq!(of("classification")["deviation"].as_f64(), Some(0.0));
    let printed = folder.run("info b.las --stats").stdout();
    assert!(printed.contains("deviation") && printed.contains('█'), "{printed}");
}

#[test]
fn every_kind_is_edited_and_written() {
    let folder = Folder::new();
    folder.put("cloud.ply", cloud());
    folder.put("mesh.ply", PLY);
    folder.run("convert cloud.ply -o cloud.laz --normals").ok();
    folder.run("convert cloud.laz -o cloud.splk").ok();
    folder.run("generate gaussians --points 3000 -o trained.ply").ok();
    for (input, edit, output) in [
        ("cloud.ply", "--thin 3", "a.laz"),
        ("cloud.laz", "--thin 50%", "a.points.ply"),
        ("cloud.laz", "--where NormalZ>0.5||NormalZ<-0.5", "a.splk"),
        ("cloud.splk", "--where opacity>0.5 --thin 25%", "b.splk"),
        ("cloud.splk", "--rotate x:90", "a.ply"),
        ("mesh.ply", "--scale 2", "c.splk"),
        ("trained.ply", "--thin 10% --rotate 1,2,3:40", "a.spz"),
        ("trained.ply", "--where scale<0.07&&opacity>0.2", "d.splk"),
        ("trained.ply", "--keep-cluster 1", "a.splat"),
    ] {
        folder.run(&format!("convert {input} -o {output} {edit}")).ok();
        assert!(count(&folder, output) > 0, "{output}");
    }
    assert!((180..=230).contains(&count(&folder, "a.laz")), "{}", count(&folder, "a.laz"));
    assert_eq!(count(&folder, "a.points.ply"), 801);
    assert!((250..=300).contains(&count(&folder, "a.spz")));
    folder.run("render a.splk -o a.png --size 40x30").ok();
    // A trained scene that is turned stays turned, although its file states no frame.
    folder.run("convert trained.ply -o turned.ply --rotate x:90").ok();
    let bounds = |name: &str| {
        let facts = folder.json(&format!("info {name} --json"));
        [0, 1, 2].map(|axis| facts["bounds"]["max"][axis].as_f64().unwrap())
    };
    let (before, after) = (bounds("trained.ply"), bounds("turned.ply"));
    assert!((after[2] - before[1]).abs() < 1e-3, "{before:?} {after:?}");
}

#[test]
fn edits_of_more_than_memory_are_the_same() {
    let folder = Folder::new();
    folder.put("a.ply", points(500_000));
    let edits = "--crop=-9,-9,-9,9,9,9 --thin 50% --rotate z:30";
    let whole = folder.json(&format!("convert a.ply -o a.splk {edits} --json"));
    let parts = folder.json(&format!("convert a.ply -o b.splk {edits} --json --memory 200MiB"));
    assert_eq!(whole["points"], parts["points"]);
    let text = folder.run("check b.splk").stdout();
    assert!(
        text.contains("no damage") || text.contains("fine") || !text.contains("error"),
        "{text}"
    );
    let compared = folder.json("compare a.splk b.splk --json");
    let farthest = compared["distances"][0]["95%"].as_f64().unwrap();
    assert!(farthest < 1e-3, "{compared}");
    // Nothing but the results is left.
    let mut names: Vec<String> = std::fs::read_dir(folder.path(""))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    assert_eq!(names, ["a.ply", "a.splk", "b.splk"]);
}

/// Degrees are written as finely as metres, and the file says its new system.
#[test]
fn points_get_another_reference_system_and_their_own_back() {
    let folder = Folder::new();
    folder.put("a.ply", cloud());
    folder
        .run(
            "convert a.ply -o there.laz --translate 565000,5934000,0 --reproject EPSG:4326 \
             --from-crs EPSG:25832",
        )
        .ok();
    let there = folder.json("info there.laz --json");
    assert_eq!(there["crs"], "EPSG:4326", "{there}");
    let low: Vec<f64> = serde_json::from_value(there["bounds"]["min"].clone()).unwrap();
    // The corner of the cloud, from pyproj; z stays.
    for (at, wanted) in low.iter().zip([9.981_100_311, 53.550_862_883, 0.0]) {
        assert!((at - wanted).abs() < 1e-5, "{low:?}");
    }
    folder
        .run("convert there.laz -o back.las --reproject EPSG:25832 --translate -565000,-5934000,0")
        .ok();
    assert_eq!(folder.json("info back.las --json")["crs"], "EPSG:25832");
    let compared = folder.json("compare a.ply back.las --json");
    for way in [0, 1] {
        let farthest = compared["distances"][way]["largest"].as_f64().unwrap();
        assert!(farthest < 0.002, "{compared}");
    }
    // Splats have shapes that no map keeps.
    folder.run("convert a.ply -o g.ply").ok();
    folder
        .run("convert g.ply -o h.ply --reproject EPSG:4326 --from-crs EPSG:25832")
        .fails(2, &["--reproject is for points and meshes"]);
    assert!(!folder.path("h.ply").exists());
}

/// A picture of edited inputs is that of the file that convert writes with the same edits.
#[test]
fn edited_pictures_are_those_of_edited_files() {
    let folder = Folder::new();
    folder.put("a.ply", cloud());
    let edits = "--edit where:x>9&&z<1 --edit a.ply=crop:xy:0,0,30,0,30,30,0,30";
    // Greys of intensities are spread over all points of a file.
    let view = "--size 64x48 --engine cpu --up +Z --view top --color orange";
    folder.run(&format!("render a.ply -o a.png {edits} {view}")).ok();
    folder.run("convert a.ply -o b.points.ply --where x>9&&z<1 --crop xy:0,0,30,0,30,30,0,30").ok();
    folder.run(&format!("render b.points.ply -o b.png {view}")).ok();
    let [a, b] = ["a.png", "b.png"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert!(is_png(&a, 64, 48) && a == b, "the pictures differ");
}

#[test]
fn points_of_different_formats_are_thinned_together() {
    let folder = Folder::new();
    // A grid of 40 × 40 points, and nearly the same places without attributes.
    folder.put("a.ply", cloud());
    let rows: String =
        (0..1600).map(|index| format!("{} {} 0.01\n", index % 40, index / 40)).collect();
    folder.put("b.xyz", rows);
    folder.run("convert a.ply b.xyz -o c.points.ply --thin 0.5 --where z<1").ok();
    // Of two points at one place, one is kept.
    assert_eq!(count(&folder, "c.points.ply"), 1600);
    let text = std::fs::read(folder.path("c.points.ply")).unwrap();
    let header = String::from_utf8_lossy(&text[..1000]).into_owned();
    assert!(header.contains("intensity") && header.contains("classification"), "{header}");
    folder.run("convert a.ply b.xyz -o c.splk --keep-cluster 1").ok();
    assert!((3000..=3300).contains(&count(&folder, "c.splk")));
}

#[test]
fn what_cannot_be_edited_is_told() {
    let folder = Folder::new();
    folder.put("a.ply", cloud());
    folder.put("mesh.ply", PLY);
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    for (arguments, code, words) in [
        ("convert a.ply -o b.las --where intensity>", 2, &["column 11", "ends"][..]),
        ("convert a.ply -o b.las --where height>1&&colour>1", 3, &["column 11", "intensity"]),
        ("convert a.ply -o b.las --crop 1,2,3", 2, &["sphere:X,Y,Z,RADIUS"]),
        ("convert a.nrrd -o b.nrrd --crop 0,0,0,1,1,1", 2, &["not for volumes"]),
        ("convert a.nrrd -o b.laz", 2, &["a.nrrd holds no mesh or point cloud"]),
        ("convert mesh.ply a.ply -o b.splk --thin 50%", 2, &["--thin", "one by one"]),
        ("convert a.ply -o b.las --color height", 2, &["--color", "files of points"]),
        ("convert a.ply -o b.points.ply --lossless", 2, &["--lossless", ".points.ply"]),
        ("convert a.ply --plan parts --thin 1", 2, &["--thin", ".laz first"]),
        ("compare a.ply a.nrrd", 2, &["two pictures are compared, or two scenes"]),
        ("compare a.ply a.ply --threshold 3", 2, &["--tolerance"]),
    ] {
        folder.run(arguments).fails(code, words);
        assert!(!folder.path("b.las").exists() && !folder.path("b.splk").exists(), "{arguments}");
    }
}

#[test]
fn scenes_are_compared() {
    let folder = Folder::new();
    folder.put("a.ply", cloud());
    folder.run("convert a.ply -o b.laz --translate 0,0,0.25 --remove-floaters").ok();
    let compared = folder.json("compare a.ply b.laz --json");
    assert_eq!(compared["counts"], serde_json::json!([1601, 1600]));
    assert_eq!(compared["distances"][0]["median"].as_f64(), Some(0.25));
    assert_eq!(compared["distances"][1]["largest"].as_f64(), Some(0.25));
    let values = compared["values"].as_array().unwrap();
    assert!(values.iter().any(|value| value["name"] == "intensity"));
    folder.run("compare a.ply b.laz --tolerance 400").ok();
    folder.run("compare a.ply b.laz --tolerance 1").fails(5, &["farther than 1"]);
    assert!(folder.run("compare a.ply b.laz").stdout().contains("first to second"));
}
