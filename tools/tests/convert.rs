//! `splatkit convert`.

mod common;

use common::*;
use splatkit::{
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
