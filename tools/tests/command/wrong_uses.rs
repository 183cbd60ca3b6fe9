//! Wrong uses of flags and files, and what the command says. The table is also the page
//! docs/wrong-uses.md, which is written by
//! `SPLATKIT_WRITE=1 cargo test --release -p splatkit-tools --test command wrong_uses`.

use crate::common::*;
use std::{fmt::Write, fs, path::Path};

/// What was meant, the arguments, the exit code, and a part of what is said. Commands that draw in
/// spite of the mistake have the exit code 0 and a warning.
const USES: &[(&str, &str, i32, &str)] = &[
    ("no file", "render -o out.png", 2, "<SCENE>"),
    ("a misspelt task", "rendr a.ply -o out.png", 2, "a similar subcommand exists: 'render'"),
    (
        "a misspelt flag",
        "render a.ply -o out.png --zom 2",
        2,
        "a similar argument exists: '--zoom'",
    ),
    ("a file that is not there", "render gone.ply -o out.png", 3, "gone.ply"),
    ("a file alone that is not there", "gone.ply", 3, "gone.ply"),
    (
        "a file in another format",
        "render notes.docx -o out.png",
        3,
        "is in no format that can be read",
    ),
    ("an empty file", "render empty.ply -o out.png", 3, "empty.ply"),
    ("a file that was cut off", "render cut.ply -o out.png", 3, "cut.ply"),
    ("a picture in another format", "render a.ply -o out.tga", 2, "out.tga"),
    (
        "an animation of a camera that stands still",
        "render a.ply -o out.gif",
        2,
        "an animation needs --turntable, --path or --times",
    ),
    (
        "an animation in another format",
        "render a.ply -o out.avi --turntable 9",
        2,
        "use .gif, .webp, .apng, .mp4, .webm or .mov, or .png, .jpg, .tiff or .exr for numbered \
         pictures",
    ),
    (
        "bits that a format lacks",
        "render a.ply -o out.jpg --bits 16",
        2,
        "a .jpg file has 8 bits a channel, not 16",
    ),
    (
        "a width on paper without a resolution",
        "render a.ply -o out.png --width 85mm",
        2,
        "--width: a length on paper needs the pixels an inch (--dpi, in JSON dpi)",
    ),
    (
        "a width on paper without a unit",
        "render a.ply -o out.png --width 85 --dpi 300",
        2,
        "the form is a number above 0 with mm, cm, in or pt, such as 85mm",
    ),
    (
        "several views from one side",
        "render a.ply -o out.png --views front,left --view top",
        2,
        "cannot be used with",
    ),
    (
        "columns of one view",
        "render a.ply -o out.png --columns 2",
        2,
        "--columns: needs several views (--views)",
    ),
    (
        "an animation of several views",
        "render a.ply -o out.gif --views front,left --turntable 9",
        2,
        "cannot be used with",
    ),
    (
        "an animation as a picture on stdout",
        "render a.ply -o - --turntable 9",
        2,
        "the frames of an animation can go to stdout only with --raw",
    ),
    ("a folder that is not there", "render a.ply -o gone/out.png", 1, "its folder does not exist"),
    ("a picture that is there", "render a.ply -o old.png", 1, "old.png: exists already"),
    (
        "one number as the size",
        "render a.ply -o out.png --size 1280",
        2,
        "WIDTHxHEIGHT, such as 1280x720",
    ),
    ("a colour that has no name", "render a.ply -o out.png --background redish", 2, "redish"),
    (
        "a side that is none",
        "render a.ply -o out.png --view above",
        2,
        "[possible values: front, back, left, right, top, bottom, iso]",
    ),
    (
        "an axis that is none",
        "render a.ply -o out.png --up W",
        2,
        "an axis is one of +X, -X, +Y, -Y, +Z, -Z, and a direction is X,Y,Z",
    ),
    (
        "a place and a side",
        "render a.ply -o out.png --view top --camera-position 0,0,9",
        2,
        "cannot be used with",
    ),
    ("a preset that is none", "render a.nrrd -o out.png --transfer bones", 2, "bones"),
    (
        "a window beside the values",
        "render a.nrrd -o out.png --transfer ct-bone --range 900,1200",
        3,
        "but the values of a.nrrd lie between 0 and 223",
    ),
    (
        "a surface beside the values",
        "render a.nrrd -o out.png --iso 900",
        3,
        "shows only the value 900, but the values of a.nrrd lie between 0 and 223",
    ),
    (
        "a share beyond the values",
        "render a.nrrd -o out.png --iso 150%",
        2,
        "a share of the range of values lies between 0% and 100%",
    ),
    (
        "a clip that leaves nothing",
        "render a.ply -o out.png --clip x>200%",
        3,
        "leaves nothing of the scene",
    ),
    ("samples without their layout", "render plain.raw -o out.png", 3, "--dims"),
    (
        "a layout that does not fit",
        "render plain.raw -o out.png --dims 16x16x16 --type u16",
        3,
        "plain.raw",
    ),
    (
        "a volume as a hierarchy",
        "convert a.nrrd -o b.splk",
        2,
        "hierarchies are built from meshes and point clouds",
    ),
    ("a picture and JSON on stdout", "render a.ply -o - --json", 2, "cannot both go to stdout"),
    (
        "a flag of volumes for a mesh",
        "render a.ply -o out.png --sigma 0.8",
        0,
        "--sigma has no effect: it is for volumes and volumes in bricks, but a.ply is a mesh",
    ),
    (
        "an isosurface of a mesh",
        "render a.ply -o out.png --iso 50%",
        0,
        "warning: --iso has no effect",
    ),
    (
        "a flag of meshes for a volume",
        "render a.nrrd -o out.png --crease 30",
        0,
        "warning: --crease has no effect: it is for meshes and cells, but a.nrrd is a volume",
    ),
    (
        "edges of a hierarchy",
        "render a.splk -o out.png --edges",
        0,
        "warning: --edges has no effect: it is for meshes and cells, but a.splk is a hierarchy",
    ),
    (
        "a layout of a file that has its own",
        "render a.nrrd -o out.png --dims 16x16x16 --type u8",
        0,
        "warning: --dims has no effect: it is for raw volumes, but a.nrrd is a volume",
    ),
    (
        "a cut of a mesh",
        "render a.ply -o out.png --cut 4",
        0,
        "--cut has no effect: it is for hierarchies and volumes in bricks, but a.ply is a mesh",
    ),
    (
        "a view angle without perspective",
        "render a.ply -o out.png --orthographic --view-angle 60",
        0,
        "warning: --view-angle has no effect: there is no perspective",
    ),
    (
        "radii of a hierarchy",
        "render a.splk -o out.png --radius-scale 2",
        2,
        "a hierarchy keeps the radii that it was converted with",
    ),
    (
        "a pointer of Git LFS",
        "render pointer.ply -o out.png",
        3,
        "pointer.ply: file: is a pointer of Git LFS, not the data",
    ),
    (
        "a web page that was downloaded instead",
        "render page.nrrd -o out.png",
        3,
        "page.nrrd: file: is a web page, not the data",
    ),
    ("a grid of OpenVDB", "render grid.vdb -o out.png", 3, "numpy.save('volume.npy', array)"),
    ("a scene of Blender", "render room.blend -o out.png", 3, "export glTF or PLY"),
    (
        "NetCDF 3",
        "render flow.nc -o out.png",
        3,
        "python -m pysplatkit render flow.nc -o out.png draws it",
    ),
    ("a model of CAD", "render model.step -o out.png", 3, "gmsh MODEL.step -2 -format stl"),
    ("no picture", "render old.png -o out.png", 3, "the picture cannot be decoded"),
    ("an archive", "render all.zip -o out.png", 3, "unpack it, and name the file inside"),
    ("a folder of other files", "render . -o out.png", 3, "no series of pictures was found"),
    (
        "points that are no numbers",
        "render nan.xyz -o out.png",
        0,
        "3 of 63 points are not at finite coordinates: they are left out",
    ),
    (
        "a face without its vertex",
        "render lacks.obj -o out.png",
        3,
        "line 4: a face refers to vertex 9, but there are 3",
    ),
    ("a mesh without vertices", "render nothing.obj -o out.png", 3, "has no vertices"),
    (
        "fewer samples than stated",
        "render short.nrrd -o out.png",
        3,
        "there are 4096 bytes where 262144 were expected",
    ),
    (
        "a table of labels that is not there",
        "render a.nrrd -o out.png --labels no.txt",
        3,
        "no.txt",
    ),
    (
        "a text as a table of labels",
        "render a.nrrd -o out.png --labels pointer.ply",
        3,
        "a line holds a number, a name, and red, green and blue",
    ),
    (
        "a table that lacks labels",
        "render a.nrrd -o out.png --labels labels.txt",
        0,
        "the table of labels is not used: it lacks some of the values",
    ),
    (
        "labels of a mesh",
        "render a.ply -o out.png --labels labels.txt",
        0,
        "--labels has no effect: it is for volumes, but a.ply is a mesh",
    ),
    (
        "an array that a volume does not have",
        "render a.nrrd -o out.png --scalar density",
        3,
        "nothing has the name “density”",
    ),
    (
        "an attribute that a mesh does not have",
        "render a.ply -o out.png --color intensity",
        3,
        "name one of them: x (f32, points)",
    ),
    (
        "a time of a file without times",
        "render a.nrrd -o out.png --time 3",
        0,
        "--time has no effect: only files of these have one",
    ),
    (
        "an opacity above 1",
        "render a.ply -o out.png --opacity 2",
        2,
        "an opacity lies above 0, up to 1",
    ),
    (
        "a condition that ends early",
        "convert a.ply -o out.las --where x>",
        2,
        "column 3: it ends where a number, a name or “(” is expected",
    ),
    (
        "a condition on an attribute that is not there",
        "convert a.ply -o out.las --where clas==2",
        3,
        "there is no attribute “clas”",
    ),
    (
        "a crop in which nothing lies",
        "convert a.ply -o out.las --crop sphere:99,99,99,1",
        3,
        "--crop: keeps none of 4",
    ),
    (
        "an edit of a picture that leaves nothing",
        "render a.ply -o out.png --edit where:x>99",
        3,
        "--where: keeps none of 4",
    ),
    (
        "an edit that there is not",
        "render a.ply -o out.png --edit grow:2",
        2,
        "there is no edit “grow”",
    ),
    (
        "a reference system that is not known",
        "convert a.ply -o out.las --reproject EPSG:64999",
        2,
        "EPSG:64999 is not known here",
    ),
    (
        "another reference system for a file that does not say its own",
        "convert a.ply -o out.las --reproject EPSG:4326",
        3,
        "does not say its coordinate reference system",
    ),
];

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("b.nrrd", nrrd("uint8", &ball()));
    folder.put("plain.raw", ball());
    folder.put("notes.docx", "PK notes");
    folder.put("empty.ply", "");
    folder.put("cut.ply", &PLY[..PLY.len() - 30]);
    folder.put("old.png", "\u{89}PNG");
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    folder.put("pointer.ply", pointer);
    folder.put("page.nrrd", "<!DOCTYPE html>\n<html><body>404 not found</body></html>\n");
    folder.put("grid.vdb", " BDV and more");
    folder.put("room.blend", "BLENDER-v300");
    folder.put("flow.nc", "CDF\u{1} and more");
    folder.put("model.step", "ISO-10303-21;\n");
    folder.put("all.zip", "PK\u{3}\u{4} and more");
    let points = (0..60).map(|i| format!("{} {} {}\n", i % 7, i / 7, i * 3 % 5));
    folder.put("nan.xyz", points.collect::<String>() + &"nan nan nan\n".repeat(3));
    folder.put("lacks.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
    folder.put("nothing.obj", "# nothing\n");
    let short = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 64 64 64\nencoding: raw\n\n";
    folder.put("short.nrrd", [short.as_bytes(), &[7; 4096]].concat());
    folder.put("labels.txt", "1 left 255 0 0 0\n2 right 0 0 255 0\n");
    folder.run("convert a.ply -o a.splk").ok();
    folder
}

#[test]
fn wrong_uses_are_answered() {
    let folder = folder();
    let mut wrong = Vec::new();
    for (meant, arguments, code, says) in USES {
        let has_size = ["--size", "--width"].iter().any(|flag| arguments.contains(flag));
        let small = match arguments.starts_with("render") && !has_size {
            true => format!("{arguments} --size 32x24 --engine cpu"),
            false => (*arguments).to_owned(),
        };
        let run = folder.run(&small);
        let stderr = run.stderr();
        if run.code() != Some(*code) || !stderr.contains(says) {
            wrong.push(format!("{meant}: {arguments}: {:?}: {stderr}", run.code()));
        }
        fs::remove_file(folder.path("out.png")).ok();
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
}

#[test]
fn the_page_of_wrong_uses_is_current() {
    let mut page = String::from(
        "# Wrong uses, and what the command says\n\n\
         A mistake gives a message that names the file or the flag, and an exit code: 1 the\n\
         picture could not be written, 2 wrong usage, 3 bad input or nothing to draw. A flag that\n\
         has no effect on the inputs gives a warning, and the picture is drawn (0).\n\n\
         <!-- SPLATKIT_WRITE=1 cargo test --release -p splatkit-tools --test command \
         wrong_uses -->\n\n\
         | mistake | command | code | says |\n|---|---|---|---|\n",
    );
    for (meant, arguments, code, says) in USES {
        let escaped = |text: &str| text.replace('|', "\\|");
        let (command, says) = (escaped(arguments), escaped(says).replace('<', "\\<"));
        writeln!(page, "| {meant} | `splatkit {command}` | {code} | {says} |").expect("text");
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/wrong-uses.md");
    if std::env::var_os("SPLATKIT_WRITE").is_some() {
        fs::write(&path, &page).expect("a page");
    }
    let content = fs::read_to_string(&path).unwrap_or_default().replace('\r', "");
    assert_eq!(content, page, "docs/wrong-uses.md is not current: SPLATKIT_WRITE=1 writes it");
}
