//! `splatkit convert`.

use crate::common::*;
use splatkit::{
    formats,
    hierarchy::Hierarchy,
    input::Limits,
    volume::{Arrangement, Volume},
};

fn volume(folder: &Folder, name: &str) -> Volume {
    formats::load_volume(folder.path(name), &Limits::default(), &formats::ReadOptions::default())
        .unwrap()
}

#[test]
fn volumes_of_any_format_become_nrrd() {
    let folder = Folder::new();
    folder.put("a.raw", ball());
    for input in [
        folder.put("a.vti", vti()),
        folder.put("a.nrrd", nrrd("uint8", &ball())),
        "a.raw --dims 16x16x16 --type u8",
    ] {
        let report = folder.json(&format!("convert {input} -o out.nrrd --overwrite --json"));
        assert_eq!(
            (report["samples_read"].as_u64(), report["samples_written"].as_u64()),
            (Some(4096), Some(4096))
        );
        assert_eq!(
            (report["lattice"].as_str(), report["type"].as_str()),
            (Some("cartesian"), Some("u8"))
        );
        let (read, written) = (volume(&folder, "a.nrrd"), volume(&folder, "out.nrrd"));
        assert_eq!((&read.samples, &read.lattice), (&written.samples, &written.lattice));
    }
}

#[test]
fn body_centred_volumes_are_written_and_read() {
    let folder = Folder::new();
    folder.put("a.vti", vti());
    let text = folder.run("convert a.vti -o bcc.nrrd --lattice bcc").ok().stdout;
    let written = volume(&folder, "bcc.nrrd");
    assert_eq!(
        (&written.lattice.arrangement, written.lattice.dims),
        (&Arrangement::BodyCentred, [11, 11, 22])
    );
    assert!(String::from_utf8_lossy(&text).contains("2662 (11 × 11 × 22, bcc)"));
    // The file's own lattice stays.
    folder.run("convert bcc.nrrd -o again.nrrd").ok();
    let again = volume(&folder, "again.nrrd");
    assert_eq!((&again.samples, &again.lattice), (&written.samples, &written.lattice));
    folder.run("convert bcc.nrrd -o again.nrrd --overwrite --lattice bcc").ok();
    folder
        .run("convert bcc.nrrd -o cartesian.nrrd --lattice cartesian")
        .fails(2, &["bcc", "cartesian"]);
}

#[test]
fn a_hierarchy_of_a_hierarchy_keeps_what_is_told_of_it() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.run("convert a.ply -o a.splk --up x --unit mm --lossless").ok();
    folder.run("convert a.splk -o b.splk --radius-scale 2 --lossless").ok();
    let open = |name: &str| Hierarchy::open(folder.path(name), &Limits::default()).unwrap();
    let (a, b) = (open("a.splk"), open("b.splk"));
    assert_eq!((b.header().orientation, b.header().unit.as_str()), (a.header().orientation, "mm"));
    let widths = |hierarchy: &Hierarchy| {
        let mut widths: Vec<f32> =
            hierarchy.leaves().unwrap().splats.iter().map(|splat| splat.factor[0]).collect();
        widths.sort_by(f32::total_cmp);
        widths
    };
    let doubled: Vec<f32> = widths(&a).iter().map(|width| width * 2.0).collect();
    assert_eq!(widths(&b), doubled);
    folder
        .run("render a.splk -o a.png --radius-scale 2")
        .fails(2, &["a.splk", "convert it with --radius-scale"]);
    for scale in ["1e-7", "2e6", "0", "-1", "nan"] {
        let number = format!("--radius-scale={scale}");
        folder
            .run(&format!("convert a.ply -o c.splk {number}"))
            .fails(2, &["a number from 1e-6 to 1e6 is needed"]);
        folder
            .run(&format!("render a.ply -o c.png {number}"))
            .fails(2, &["a number from 1e-6 to 1e6 is needed"]);
    }
}

#[test]
fn what_cannot_be_converted_is_told() {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.ply", PLY);
    folder.run("convert a.nrrd -o a.nrrd").fails(1, &["exists already", "--overwrite"]);
    folder.run("convert a.nrrd -o none/b.nrrd").fails(1, &["folder does not exist"]);
    folder.run("convert a.ply -o b.nrrd").fails(2, &["a.ply", "holds no volume"]);
    for output in ["b.splk", "b.ply", "b.compressed.ply", "b.splat", "b.spz", "b.sog", "b.glb"] {
        folder
            .run(&format!("convert a.nrrd -o {output}"))
            .fails(2, &["hierarchies are built from meshes and point clouds"]);
    }
    for output in ["b", "-"] {
        folder.run(&format!("convert a.nrrd -o {output}")).fails(
            2,
            &["only .splk, .ply, .splat, .spz, .sog, .glb, .las, .laz, .e57, .nrrd and .splv"],
        );
    }
    folder.put("samples.csv", "x,y,z,value\n1,2,3,4\n5,6,7,8\n");
    folder.run("convert samples.csv -o b.nrrd").fails(
        2,
        &["samples.csv holds scattered samples; only volumes on a lattice can be converted"],
    );
    std::fs::remove_file(folder.path("samples.csv")).unwrap();
    folder.run("convert a.nrrd -o a.splv").ok();
    for output in ["b.nrrd", "b.splv"] {
        folder.run(&format!("convert a.splv -o {output}")).fails(
            2,
            &["a.splv holds a volume in bricks already; convert the volume it was made from"],
        );
    }
    std::fs::remove_file(folder.path("a.splv")).unwrap();
    // No unfinished file is left.
    assert_eq!(folder.names(), ["a.nrrd", "a.ply"]);
}

#[test]
fn flags_are_for_some_formats() {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.ply", PLY);
    for (arguments, flag) in [
        ("a.ply -o b.ply --lossless", "--lossless is for .splk files"),
        ("a.ply -o b.ply --preset best", "--preset is for .splk files"),
        ("a.ply -o b.ply --unit mm", "--unit is for .splk and .splv files"),
        ("a.nrrd -o b.splv --up z", "--up is for .splk files"),
        ("a.nrrd -o b.nrrd --radius-scale 1", "--radius-scale is for .splk, .ply, .splat"),
        ("a.nrrd -o b.splv --degree 1", "--degree is for .splk, .ply, .splat"),
    ] {
        folder.run(&format!("convert {arguments}")).fails(2, &[flag]);
    }
    folder.run("convert a.nrrd -o b.nrrd --lattice fcc").fails(2, &["fcc", "bcc"]);
    folder.run("convert a.nrrd").fails(2, &["--output"]);
    assert_eq!(folder.names(), ["a.nrrd", "a.ply"]);
}

#[test]
fn lattices_that_cannot_be_converted() {
    let folder = Folder::new();
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 1\nencoding: raw\n\n";
    folder.put("flat.nrrd", [header.as_bytes(), &[1; 16]].concat());
    folder.run("convert flat.nrrd -o b.nrrd --lattice bcc").fails(2, &["4 × 4 × 1", "2 or more"]);
    folder.put(
        "odd.nrrd",
        [header.replace("raw", "raw\nlattice:=fcc").as_bytes(), &[1; 16]].concat(),
    );
    folder.run("convert odd.nrrd -o b.nrrd").fails(3, &["odd.nrrd", "lattice", "fcc"]);
    assert_eq!(folder.names(), ["flat.nrrd", "odd.nrrd"]);
}

#[test]
fn files_that_an_input_refers_to_are_not_replaced() {
    let folder = Folder::new();
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 16 16 16\nencoding: raw\n\
        data file: data.nrrd\n";
    folder.put("away.nhdr", header);
    folder.put("data.nrrd", ball());
    folder.put("text.nhdr", header.replace("raw", "ascii").replace("data.nrrd", "text.nrrd"));
    folder.put("text.nrrd", ball().iter().map(|value| format!("{value} ")).collect::<String>());
    let gltf = r#"{"asset": {"version": "2.0"}, "buffers": [{"uri": "away.ply", "byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0}"#;
    folder.put("a.gltf", gltf);
    folder.put(
        "away.ply",
        [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].map(f32::to_le_bytes).concat(),
    );
    folder
        .run("generate scan --from a.gltf -o away.ply --overwrite")
        .fails(1, &["away.ply: is read too: an input or a flag refers to it"]);
    for (input, output) in
        [("away.nhdr", "data.nrrd"), ("text.nhdr", "text.nrrd"), ("a.gltf", "away.ply")]
    {
        let before = std::fs::read(folder.path(output)).unwrap();
        folder.run(&format!("convert {input} -o ./{output} --overwrite")).fails(
            1,
            &[
                &format!("{output}: is read too: an input or a flag refers to it"),
                "give another name",
            ],
        );
        assert_eq!(std::fs::read(folder.path(output)).unwrap(), before);
        let other = format!("other-{output}");
        folder.run(&format!("convert {input} -o {other}")).ok();
        for name in [input, output, &other] {
            std::fs::remove_file(folder.path(name)).unwrap();
        }
    }
    assert_eq!(folder.names(), [""; 0]);
}
