//! `splatkit convert`.

mod common;

use common::*;
use splatkit::{
    hierarchy::Hierarchy,
    io::{self, Limits},
    volume::{Arrangement, Volume},
};

fn volume(folder: &Folder, name: &str) -> Volume {
    io::load_volume(&folder.path(name), &Limits::default(), None).unwrap()
}

#[test]
fn volumes_of_any_format_become_nrrd() {
    let folder = Folder::new("convert");
    folder.put("a.raw", ball());
    for input in
        [folder.put("a.vti", vti()), folder.put("a.nrrd", nrrd("uint8", &ball())), "a.raw --dims 16x16x16 --type u8"]
    {
        let told = folder.json(&format!("convert {input} -o out.nrrd --overwrite --json"));
        assert_eq!((told["samples_read"].as_u64(), told["samples_written"].as_u64()), (Some(4096), Some(4096)));
        assert_eq!((told["lattice"].as_str(), told["type"].as_str()), (Some("cartesian"), Some("u8")));
        let (read, written) = (volume(&folder, "a.nrrd"), volume(&folder, "out.nrrd"));
        assert_eq!((&read.samples, &read.lattice), (&written.samples, &written.lattice));
    }
}

#[test]
fn body_centred_volumes_are_written_and_read() {
    let folder = Folder::new("bcc");
    folder.put("a.vti", vti());
    let text = folder.run("convert a.vti -o bcc.nrrd --lattice bcc").ok().stdout;
    let written = volume(&folder, "bcc.nrrd");
    assert_eq!((&written.lattice.arrangement, written.lattice.dims), (&Arrangement::BodyCentred, [11, 11, 22]));
    assert!(String::from_utf8_lossy(&text).contains("2662 (11 × 11 × 22, bcc)"));
    // A lattice of the file's own stays.
    folder.run("convert bcc.nrrd -o again.nrrd").ok();
    let again = volume(&folder, "again.nrrd");
    assert_eq!((&again.samples, &again.lattice), (&written.samples, &written.lattice));
    folder.run("convert bcc.nrrd -o again.nrrd --overwrite --lattice bcc").ok();
    folder.run("convert bcc.nrrd -o cartesian.nrrd --lattice cartesian").fails(2, &["bcc", "cartesian"]);
}

#[test]
fn a_hierarchy_of_a_hierarchy_keeps_what_is_told_of_it() {
    let folder = Folder::new("again");
    folder.put("a.ply", PLY);
    folder.run("convert a.ply -o a.splk --up x --unit mm --lossless").ok();
    folder.run("convert a.splk -o b.splk --radius-scale 2 --lossless").ok();
    let open = |name: &str| Hierarchy::open(&folder.path(name), &Limits::default()).unwrap();
    let (a, b) = (open("a.splk"), open("b.splk"));
    assert_eq!((b.header().up, b.header().unit.as_str()), (a.header().up, "mm"));
    let widths = |hierarchy: &Hierarchy| {
        let mut widths: Vec<f32> = hierarchy.leaves().unwrap().splats.iter().map(|splat| splat.factor[0]).collect();
        widths.sort_by(f32::total_cmp);
        widths
    };
    let doubled: Vec<f32> = widths(&a).iter().map(|width| width * 2.0).collect();
    assert_eq!(widths(&b), doubled);
    folder.run("render a.splk -o a.png --radius-scale 2").fails(2, &["a.splk", "convert it with --radius-scale"]);
    for scale in ["1e-7", "2e6", "0", "-1", "nan"] {
        let number = format!("--radius-scale={scale}");
        folder.run(&format!("convert a.ply -o c.splk {number}")).fails(2, &["a number from 1e-6 to 1e6 is needed"]);
        folder.run(&format!("render a.ply -o c.png {number}")).fails(2, &["a number from 1e-6 to 1e6 is needed"]);
    }
}

#[test]
fn what_cannot_be_converted_is_told() {
    let folder = Folder::new("refused");
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("a.ply", PLY);
    folder.run("convert a.nrrd -o a.nrrd").fails(1, &["exists already", "--overwrite"]);
    folder.run("convert a.nrrd -o none/b.nrrd").fails(1, &["folder does not exist"]);
    folder.run("convert a.ply -o b.nrrd").fails(2, &["a.ply", "holds no volume"]);
    for output in ["b.splk", "b.ply"] {
        folder.run(&format!("convert a.nrrd -o {output}")).fails(2, &["hierarchies are made of meshes and clouds"]);
    }
    for output in ["b", "-"] {
        folder
            .run(&format!("convert a.nrrd -o {output}"))
            .fails(2, &["only .splk, .ply, .nrrd and .splv files can be written"]);
    }
    folder.run("convert a.nrrd -o b.nrrd --lattice fcc").fails(2, &["fcc", "bcc"]);
    folder.run("convert a.nrrd").fails(2, &["--output"]);
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 1\nencoding: raw\n\n";
    folder.put("flat.nrrd", [header.as_bytes(), &[1; 16]].concat());
    folder.run("convert flat.nrrd -o b.nrrd --lattice bcc").fails(2, &["4 × 4 × 1", "2 or more"]);
    folder.put("odd.nrrd", [header.replace("raw", "raw\nlattice:=fcc").as_bytes(), &[1; 16]].concat());
    folder.run("convert odd.nrrd -o b.nrrd").fails(3, &["odd.nrrd", "lattice", "fcc"]);
    // Nothing half done is left.
    let mut names: Vec<_> = std::fs::read_dir(&folder.0).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    names.sort();
    assert_eq!(names, ["a.nrrd", "a.ply", "flat.nrrd", "odd.nrrd"]);
}
