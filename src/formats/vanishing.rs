//! Files that are truncated while they are read, by every way of reading.

use super::{
    Endian, FORMATS, RawLayout, ReadOptions, SampleType, Stream, VolumeStream,
    load::{mesh_of, samples_of, volume_of},
    ply,
};
use crate::{
    Error, Result,
    bricks::{self, Bricks},
    hierarchy::{
        Hierarchy, file,
        testing::{surface, tree},
    },
    input::{Limits, Source, testing::Folder},
    surface::Mesh,
    volume::phantoms::Phantom,
};
use glam::DVec3;
use std::{fs::File, path::Path};

fn cut(path: &Path, length: u64) {
    File::options().write(true).open(path).unwrap().set_len(length).unwrap();
}

fn assert_changed<T>(name: &str, result: Result<T>) {
    let Err(error) = result else { panic!("{name}: was read") };
    assert!(matches!(error, Error::Input { .. }), "{name}: {error}");
    assert!(error.to_string().contains("changed while it was read"), "{name}: {error}");
}

/// Opens a file, truncates it at several lengths and reads the open source.
fn cut_when_open<T>(name: &str, bytes: impl AsRef<[u8]>, read: impl Fn(&Source) -> Result<T>) {
    let (folder, limits, bytes) = (Folder::new(), Limits::default(), bytes.as_ref());
    assert!(bytes.len() > 3 << 12, "{name}: {} bytes are too few pages", bytes.len());
    let path = folder.write(name, bytes);
    let whole = Source::open(&path, &limits).unwrap();
    whole.unless_changed(read(&whole)).unwrap_or_else(|e| panic!("{e}"));
    for parts in [0, 1, 50, 99] {
        let path = folder.write(name, bytes);
        let source = Source::open(&path, &limits).unwrap();
        cut(&path, bytes.len() as u64 * parts / 100);
        assert_changed(name, source.unless_changed(read(&source)));
    }
}

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect()
}

#[test]
fn meshes_and_clouds() {
    let folder = Folder::new();
    let binary = folder.path("a.ply");
    ply::write(&Mesh::knot(80, 20), &binary).unwrap();
    let header =
        "element vertex 3000\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let points = lines(3000, |i| format!("{} {} {}\n", i % 60, i / 60, i % 7));
    let mut stl = vec![0; 80];
    stl.extend(1000u32.to_le_bytes());
    for i in 0..1000 {
        let corner = |at: i32| [(i % 30 + at) as f32, (i / 30) as f32, (at * at) as f32];
        let floats = [[0.0; 3], corner(0), corner(1), corner(2)];
        stl.extend(floats.iter().flatten().flat_map(|v| v.to_le_bytes()));
        stl.extend([0; 2]);
    }
    let mut las = vec![0; 227];
    las[..4].copy_from_slice(b"LASF");
    las[24..26].copy_from_slice(&[1, 2]);
    las[94..96].copy_from_slice(&227u16.to_le_bytes());
    las[96..100].copy_from_slice(&227u32.to_le_bytes());
    las[105..107].copy_from_slice(&20u16.to_le_bytes());
    las[107..111].copy_from_slice(&1500u32.to_le_bytes());
    [131, 139, 147].iter().for_each(|&at| las[at..at + 8].copy_from_slice(&0.01f64.to_le_bytes()));
    for i in 0..1500u32 {
        las.extend([i % 50, i / 50, i % 3].iter().flat_map(|v| v.to_le_bytes()));
        las.extend([0; 8]);
    }
    let pcd = "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 3000\nHEIGHT \
               1\nPOINTS 3000\nDATA ascii\n";
    let faces = lines(2000, |i| format!("f {} {} {}\n", i + 1, i + 2, i + 62));
    let files: [(&str, Vec<u8>); 7] = [
        ("binary.ply", std::fs::read(&binary).unwrap()),
        ("text.ply", format!("ply\nformat ascii 1.0\n{header}{points}").into_bytes()),
        (
            "a.obj",
            (lines(3000, |i| format!("v {} {} {}\n", i % 60, i / 60, i % 7)) + &faces).into_bytes(),
        ),
        ("a.stl", stl),
        ("a.las", las),
        ("a.pcd", format!("{pcd}{points}").into_bytes()),
        ("a.xyz", points.into_bytes()),
    ];
    for (name, bytes) in files {
        cut_when_open(name, bytes, |source| mesh_of(FORMATS, source, &ReadOptions::default()));
    }
}

#[test]
fn volumes_and_samples() {
    let values = lines(30 * 30 * 30, |i| format!("{} ", i % 200));
    let vti = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"ImageData\" version=\"0.1\" \
         byte_order=\"LittleEndian\">\n<ImageData WholeExtent=\"0 29 0 29 0 29\" Origin=\"0 0 0\" \
         Spacing=\"1 1 1\">\n<Piece Extent=\"0 29 0 29 0 29\"><PointData Scalars=\"v\">\n\
         <DataArray type=\"UInt8\" Name=\"v\" format=\"ascii\">{values}</DataArray>\n\
         </PointData></Piece></ImageData></VTKFile>\n"
    );
    let vtk = format!(
        "# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 30 30 30\n\
         POINT_DATA 27000\nSCALARS s int\nLOOKUP_TABLE d\n{values}"
    );
    let samples: Vec<u8> = (0..27_000).map(|i| (i % 200) as u8).collect();
    let nrrd =
        [&b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 30 30 30\nencoding: raw\n\n"[..], &samples]
            .concat();
    cut_when_open("a.vti", vti, |source| volume_of(FORMATS, source, &ReadOptions::default()));
    cut_when_open("a.vtk", vtk, |source| volume_of(FORMATS, source, &ReadOptions::default()));
    cut_when_open("a.nrrd", nrrd, |source| volume_of(FORMATS, source, &ReadOptions::default()));
    let (sample_type, spacing) = (SampleType::from_name("u8").unwrap(), DVec3::ONE);
    let layout =
        RawLayout { dims: [30; 3], sample_type, spacing, endian: Endian::Little, header: 0 };
    cut_when_open("a.raw", &samples, |source| {
        volume_of(FORMATS, source, &ReadOptions::raw(Some(&layout)))
    });
    let table = lines(3000, |i| format!("{},{},{},{}\n", i % 60, i / 60, i % 7, i % 11));
    cut_when_open("a.csv", table, |source| samples_of(FORMATS, source, &ReadOptions::default()));
    let folder = Folder::new();
    let path = folder.write("b.raw", &samples);
    let stream = VolumeStream::open(&path, &Limits::default(), Some(&layout)).unwrap().unwrap();
    assert!(stream.slices(0..3).is_ok());
    cut(&path, 10_000);
    assert_changed("slices", stream.slices(20..23));
    assert_changed("range", stream.range(None));
}

#[test]
fn streams() {
    let folder = Folder::new();
    let path = folder.path("a.ply");
    for length in [0, 10_000] {
        ply::write(&Mesh::knot(80, 20), &path).unwrap();
        let limits = Limits::default();
        let mut stream = Stream::open(&path, &limits).unwrap().unwrap();
        stream.settle(&|_| ()).unwrap();
        cut(&path, length);
        assert_changed("points", stream.points(<[_]>::len, |_| Ok(())));
        assert_changed("triangles", stream.triangles(|_, triangles| triangles.len(), |_| Ok(())));
        stream.position(1599);
        stream.vertex(1599);
        assert_changed("settle", stream.settle(&|_| ()));
    }
}

#[test]
fn hierarchies_and_bricks() {
    let folder = Folder::new();
    let path = folder.path("a.splk");
    file::write(&tree(&surface(5000, 1)), &path, &file::WriteOptions::default()).unwrap();
    let hierarchy = Hierarchy::open(&path, &Limits::default()).unwrap();
    let pages = hierarchy.page_count();
    assert!(hierarchy.read_page(pages - 1).is_ok() && pages > 1);
    cut(&path, 100);
    assert_changed("page", hierarchy.read_page(pages - 1));
    assert_changed("tree", hierarchy.read_tree());
    let path = folder.path("a.splv");
    let volume = Phantom::named("ball").unwrap().sample([60, 60, 60]).unwrap();
    bricks::write(&volume, &path, &bricks::WriteOptions::default(), None).unwrap();
    let bricks = Bricks::open(&path, &Limits::default()).unwrap();
    assert!(bricks.read(0, 7).is_ok());
    cut(&path, 100);
    assert_changed("brick", bricks.read(0, 7));
    assert_changed("level", bricks.volume(0));
}
