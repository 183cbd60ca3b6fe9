//! Inputs that give no picture of a volume have an exit code and a message. They fail before a GPU
//! is opened if possible.

use crate::common::*;

/// 16³ samples of 32 bits.
fn floats(value: impl Fn(usize) -> f32) -> Vec<u8> {
    nrrd("float", &(0..4096).flat_map(|i| value(i).to_le_bytes()).collect::<Vec<_>>())
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.put("flat.nrrd", nrrd("uint8", &[7; 4096]));
    folder.put("nan.nrrd", floats(|_| f32::NAN));
    folder.put("a.ply", PLY);
    folder.put("far.nrrd", floats(|i| if i == 7 { 1e30 } else { i as f32 }));
    folder.put("clear.json", r#"{"color": [[0, 1, 1, 1]], "opacity": [[0, 0], [255, 0]]}"#);
    folder.put(
        "steep.json",
        r#"{"color": [[0, 1, 1, 1]], "opacity": [[0, 1]], "gradient": [[5, 1], [2, 0]]}"#,
    );
    folder.put("cone.csv", "1\n0.5\n0\n");
    folder.put("cone.json", "[1, 0.5, 0]");
    folder.put("words.csv", "1\none half\n");
    folder.put("old.csv", "1\r0.5\rone half\r");
    folder.put("negative.json", "[-1, 0]");
    folder.put("twins.csv", "x,y,z,value\n1,2,3,4\n1,2,3,8\n");
    folder.put("hole.csv", "x,y,z,value\n1,2,3,4\n1,nan,3,8\n");
    folder.put("cut.las", [&b"LASF"[..], &[0; 100]].concat());
    folder.put("cut.laz", "LAS");
    folder.put("cut.e57", [&b"ASTM-E57"[..], &[0; 1016]].concat());
    folder.put("cut.stl", [&[b' '; 80][..], &9u32.to_le_bytes(), &[0; 50]].concat());
    folder.put("open.stl", "solid of one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n");
    folder.put("short.pts", "3\n1 2 3\n4 5 6\n");
    folder.put("two.xyz", "1 2\n");
    folder.put("gone.csv", "x,y,z,red,green\n1,2,3,4,5\n");
    let fields = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
    folder.put("many.pcd", format!("{fields}POINTS 4294967295\nDATA binary\n0123456789"));
    folder.put("comma.xyz", "1,5 2,5 3,5\n");
    folder.put("comma.obj", "v 1,5 2,5 3,5\nf 1 1 1\n");
    folder.put("corner.obj", "v 0 0 0\nf 1\n");
    folder.put("lists.json", format!("{{\"color\": {}", "[".repeat(100_000)));
    folder.put("lists.gltf", "[".repeat(100_000));
    folder.put(
        "list.nhdr",
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 1\nencoding: raw\ndata file: LIST\n\
         ../a.raw\n",
    );
    folder.put("none.pcd", format!("{fields}POINTS 1\nDATA ascii\nnan nan nan\n"));
    folder.put("single.csv", "1\n");
    folder
        .put("sudden.json", r#"{"color": [[0, 1, 1, 1], [1e-30, 1, 0, 0]], "opacity": [[0, 1]]}"#);
    let volume = |lines: &str| format!("NRRD0004\ntype: uint8\ndimension: 3\n{lines}\n");
    folder.put("twice.nrrd", volume("sizes: 2 2 2\nsizes: 2 2 1\nencoding: raw\n") + "12345678");
    folder.put(
        "twice.nhdr",
        volume("sizes: 2 2 2\nencoding: raw\ndata file: long.raw\ndatafile: other.raw"),
    );
    folder.put("long.nhdr", volume("sizes: 2 2 2\nencoding: raw\ndata file: long.raw"));
    folder.put("long.raw", "123456789");
    folder.put("huge.nrrd", volume("sizes: 1048576 1048576 1\nencoding: raw\n") + "12345678");
    folder.put(
        "crossed.nrrd",
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nlattice:=fcc\nencoding: raw\n\n\
          12345678",
    );
    folder
}

/// The arguments after `render`, the exit code, and a part of the message.
const WRONG: &[(&str, i32, &str)] = &[
    // Inputs.
    (
        "a.nrrd --transfer clear.json",
        3,
        "clear.json: transfer function: a transfer function without opacity shows nothing: every \
         opacity is 0",
    ),
    ("a.nrrd --transfer steep.json", 3, "gradient point 1 is at 2, before the previous one at 5"),
    ("nan.nrrd", 3, "nan.nrrd: samples: none of the 4096 samples has a value: all are not finite"),
    (
        "flat.nrrd --transfer ct-bone",
        3,
        "nothing to draw: the transfer function shows values between 150 and inf, but the values \
         of flat.nrrd lie between 7 and 7",
    ),
    (
        "flat.nrrd --iso 8",
        3,
        "nothing to draw: the transfer function shows only the value 8, but the values of \
         flat.nrrd lie between 7 and 7",
    ),
    ("crossed.nrrd", 3, "crossed.nrrd: lattice: “fcc” is not a known lattice"),
    ("hole.csv", 3, "hole.csv: 1 of 2 points is not at finite coordinates"),
    ("a.nrrd --sharp --sigma 2", 2, "smaller sigma"),
    // Meshes and clouds.
    (
        "cut.las",
        3,
        "cut.las: header: the header extends to byte 105, but only 104 bytes are \
                    present",
    ),
    ("cut.laz", 3, "cut.laz: header: does not begin with “LASF”"),
    ("cut.e57", 3, "cut.e57: file: cannot be read as E57"),
    ("cut.stl", 3, "cut.stl: header: counts 9 facets, which need 534 bytes, but the file has 134"),
    ("open.stl", 3, "open.stl: line 4: the file ends inside a facet: it is cut"),
    ("short.pts", 3, "short.pts: line 1: counts 3 points, but there are 2"),
    ("two.xyz", 3, "two.xyz: line 1: has 2 columns without names"),
    ("gone.csv", 3, "nothing to draw: all values of gone.csv are 4"),
    ("many.pcd", 3, "many.pcd: the number of points is 4294967295, over the limit"),
    (
        "many.pcd --limit-points 5000000000",
        3,
        "many.pcd: the size of the points in bytes is 51539607540, over the limit",
    ),
    ("none.pcd", 3, "none.pcd: positions: none of the 1 points has coordinates"),
    ("comma.xyz", 3, "contains neither numbers nor column names"),
    ("comma.xyz", 3, "write numbers with a decimal point, not a comma"),
    ("comma.obj", 3, "comma.obj: line 1: “1,5” is not a number"),
    ("corner.obj", 3, "corner.obj: file: has faces, but none with three or more corners"),
    (
        "a.nrrd --transfer lists.json",
        3,
        "lists.json: transfer function: invalid type: sequence, expected f64",
    ),
    ("lists.gltf", 3, "lists.gltf: JSON: invalid type: sequence"),
    (
        "list.nhdr",
        3,
        "list.nhdr: data file: refers to “../a.raw”, which leads out of the file's own folder",
    ),
    // Kernels.
    (
        "a.nrrd --sigma 0",
        2,
        "invalid value '0' for '--sigma <SAMPLES>': a number above 0 is needed",
    ),
    (
        "a.nrrd --sigma 3 --extent 1",
        2,
        "a Gaussian of sigma 3 cut at 1 samples is a block; cut it at 3 or more",
    ),
    ("a.nrrd --extent 1000", 2, "a kernel's extent must lie in 0.71 … 16 samples, found 1000"),
    ("a.nrrd --extent 0.5", 2, "a kernel's extent must lie in 0.71 … 16 samples, found 0.5"),
    (
        "a.nrrd --kernel sinc",
        2,
        "there is no kernel “sinc”; the kernels are gaussian, b-spline, hann, linear, \
         catmull-rom, cubic-b-spline, or a file",
    ),
    ("a.nrrd --kernel linear --extent 1", 2, "leave out the extent"),
    (
        "a.nrrd --kernel linear --classify pre",
        2,
        "the kernel linear is classified after interpolation",
    ),
    ("a.nrrd --kernel hann --sigma 1", 2, "sigma applies to the gaussian kernel only, not to hann"),
    (
        "a.nrrd --kernel cone.csv",
        2,
        "cone.csv: a kernel from a file needs an extent (--extent), the distance of its last value",
    ),
    ("a.nrrd --kernel none.csv --extent 2", 3, "none.csv: cannot open"),
    ("a.nrrd --kernel words.csv --extent 2", 3, "words.csv: line 2: “one half” is not a number"),
    ("a.nrrd --kernel old.csv --extent 2", 3, "old.csv: line 3: “one half” is not a number"),
    (
        "a.nrrd --kernel negative.json --extent 2",
        3,
        "negative.json: content: a kernel's values must add up to more than 0 help: the form is a \
         JSON array",
    ),
    (
        "a.nrrd --kernel single.csv --extent 2",
        3,
        "single.csv: content: a kernel's table has 2 to 65536 finite values",
    ),
    ("a.nrrd --kernel negative.json --extent 99", 2, "a kernel's extent must lie in 0.71"),
    (
        "a.ply far.nrrd --range 0,4096",
        2,
        "--range 0,4096: the transfer function changes from 0 to 4096, too close",
    ),
    ("a.nrrd --range 0,1e-9", 2, "the values are those of a.nrrd"),
    (
        "a.nrrd --transfer generic --opacity-unit 1e-300",
        2,
        "--transfer generic --opacity-unit 1e-300: the transfer function: the unit of 1e-300",
    ),
    (
        "a.nrrd --transfer sudden.json",
        3,
        "sudden.json: content: the transfer function changes from 0 to \
         0.000000000000000000000000000001, too close together",
    ),
    (
        "a.nrrd --transfer sudden.json --range 0,1e-9",
        2,
        "--transfer sudden.json --range 0,1e-9: the transfer",
    ),
    // NRRD.
    (
        "twice.nrrd",
        3,
        "twice.nrrd: line 5: the field “sizes” is given twice, in line 4 too; give it once",
    ),
    ("twice.nhdr", 3, "twice.nhdr: line 7: the field “datafile” is given twice, in line 6 too"),
    (
        "long.nhdr",
        3,
        "long.raw: data: there are 9 bytes where 8 were expected help: “sizes” or “type” in the \
         header is wrong",
    ),
    ("huge.nrrd", 3, "huge.nrrd: data: there are 8 bytes where 1099511627776 were expected"),
    (
        "a.nrrd --range=-20,-10 --iso 300",
        3,
        "nothing to draw: spread over the range -20, -10, the transfer function shows only the \
         value 300, but the values of a.nrrd lie",
    ),
    // Clips.
    (
        "a.nrrd --clip box:20,20,20:30,30,30",
        3,
        "nothing to draw: --clip 'box:20,20,20:30,30,30' leaves nothing of the scene, which lies \
         between [0, 0, 0] and [15, 15, 15]",
    ),
    ("a.nrrd --clip x<-100%", 3, "nothing to draw: --clip 'x<-100%' leaves nothing of the scene"),
    (
        "a.nrrd --cut-out plane:0,0,1,99",
        3,
        "nothing to draw: --cut-out 'plane:0,0,1,99' leaves nothing of the scene",
    ),
    (
        "a.nrrd --clip box:1,1,1:0,2,2",
        2,
        "the first corner of a box must lie below the second on every axis",
    ),
    (
        "a.nrrd --clip box:50%,0,0:1,9,9",
        2,
        "a clip box from [7.5, 0, 0] to [1, 9, 9] holds nothing",
    ),
    ("a.nrrd --clip plane:0,0,0,1", 2, "a plane needs a direction that is not 0,0,0"),
    (
        "a.nrrd --clip plane:1e200,0,0,1",
        2,
        "a plane's direction needs a length from 1e-150 to 1e150",
    ),
    ("a.nrrd --range=-1e308,1e308", 2, "LOW and HIGH are too far apart to subtract"),
    (
        "a.nrrd --clip w<3",
        2,
        "the forms are plane:NX,NY,NZ,OFFSET, box:X0,Y0,Z0:X1,Y1,Z1 and 'x<AT' or 'x>AT'",
    ),
    (
        "a.nrrd --clip x<9 --clip x<9 --clip x<9 --clip x<9 --clip x<9 --cut-out x<1 \
         --cut-out x<1 --cut-out x<1 --cut-out x<1",
        2,
        "--clip: 9 shapes are given; at most 8 are allowed",
    ),
    // Options that cannot be combined.
    (
        "a.nrrd --back-to-front",
        2,
        "--back-to-front: needs the mode splats (--mode splats): it sets the order",
    ),
    ("a.nrrd --mip --x-ray", 2, "the argument '--mip' cannot be used with '--x-ray'"),
    (
        "a.nrrd --mode splats --iso 50",
        2,
        "isosurfaces and gradient opacity need image-aligned sheets, classified after \
         interpolation",
    ),
    (
        "a.nrrd --classify pre --gradient-opacity 0,0:9,1",
        2,
        "isosurfaces and gradient opacity need image-aligned sheets, classified after \
         interpolation",
    ),
    (
        "a.nrrd --mode axis-sheets --mip",
        2,
        "the maximum of a field needs image-aligned sheets, classified after interpolation",
    ),
    ("a.nrrd --size 4294967295x4294967295", 2, "pixels is larger than 536870912 pixels"),
    ("a.nrrd --size 60000x60000", 2, "pixels is larger than 536870912 pixels"),
    ("a.nrrd --depth out.png", 2, "out.png: the picture and its depths would be one file"),
    ("a.nrrd --depth ./out.png", 2, "the picture and its depths would be one file"),
    ("a.nrrd --iso 1,2,3,4,5,6,7,8,9", 2, "9 isosurfaces are given; at most 8 are allowed"),
    ("a.nrrd --iso 50:2", 2, "the opacity of a surface must be above 0 and at most 1"),
    (
        "a.nrrd --gradient-opacity 5,0:2,1",
        2,
        "gradient point 1 is at 2, before the previous one at 5",
    ),
];

#[test]
fn each_wrong_input_has_its_message() {
    let folder = folder();
    let mut others = Vec::new();
    for (arguments, code, message) in WRONG {
        let run = folder.run(&format!("render {arguments} -o out.png"));
        let is_reported = run.code() == Some(*code) && run.stderr().contains(message);
        if !is_reported || folder.path("out.png").exists() {
            others.push(format!("{arguments}: {:?}, {}", run.code(), run.stderr()));
        }
    }
    assert!(others.is_empty(), "{}", others.join("\n"));
}

#[test]
fn what_cannot_be_generated_is_told() {
    let folder = Folder::new();
    folder.put("cloud.xyz", "1 2 3\n4 5 6\n7 8 10\n");
    for (arguments, message) in [
        ("ball -o a.nrrd --dims 18446744073709551615x1x1", "samples can be made at once"),
        ("ball -o a.nrrd --dims 100000x100000x100000", "samples can be made at once"),
        (
            "specimen -o a.nrrd --type u8 --dims 4294967295x4294967295x1",
            "samples can be made at once",
        ),
        ("ball -o a.nrrd --lattice bcc --dims 100000x1x1", "samples can be made at once"),
        ("ball -o a.vtr --dims 1000x1000x1000", "samples can be made at once"),
        ("scan --from cloud.xyz -o a.ply", "cloud.xyz has no triangles to subdivide"),
    ] {
        folder.run(&format!("generate {arguments}")).fails(2, &[message]);
    }
    assert!(["a.nrrd", "a.vtr", "a.ply"].iter().all(|name| !folder.path(name).exists()));
}

/// Inputs over a limit: the arguments, the message, and the flag that the hint names.
const OVER: &[(&str, &str, &str)] = &[
    (
        "info a.ply --limit-points 3",
        "a.ply: the count of element “vertex” is 4, over the limit of 3",
        "--limit-points",
    ),
    (
        "check a.ply --limit-points 3",
        "a.ply: the count of element “vertex” is 4, over the limit of 3",
        "--limit-points",
    ),
    (
        "render a.ply -o out.png --limit-bytes 99",
        "a.ply: the file's size in bytes is",
        "--limit-bytes",
    ),
    (
        "info a.nrrd --limit-bytes 5000",
        "the size of the header in bytes together with what was read before is 5012, over the \
         limit of 5000",
        "--limit-bytes",
    ),
    (
        "info packed.gz --dims 16x16x16 --type u8 --limit-bytes 5000",
        "the unpacked size in bytes together with what was read before is 8207, over the limit of \
         5000",
        "--limit-bytes",
    ),
    (
        "info deep.gltf --limit-depth 2",
        "deep.gltf: node 2: the nesting depth is 3, over the limit of 2",
        "--limit-depth",
    ),
    (
        "info a.glb --limit-texels 3",
        "a.glb: image 0: the number of texels is 4, over the limit of 3",
        "--limit-texels",
    ),
    (
        "info a.ply --limit-seconds 0",
        "a.ply: the reading time in seconds is 1, over the limit of 0",
        "--limit-seconds",
    ),
    (
        "info a.glb --limit-seconds 0",
        "a.glb: the reading time in seconds is 1, over the limit of 0",
        "--limit-seconds",
    ),
    (
        "info points.csv --limit-seconds 0",
        "the reading time in seconds is 1, over the limit of 0",
        "--limit-seconds",
    ),
    (
        "info points.csv --limit-points 1",
        "points.csv: the number of lines is 3, over the limit of 1",
        "--limit-points",
    ),
    (
        "render a.nrrd -o out.png --transfer clear.json --limit-bytes 9",
        "over the limit of 9",
        "--limit-bytes",
    ),
    ("info a.splk --limit-points 1", "a.splk: the number of leaves is", "--limit-points"),
    ("info a.splk --limit-bytes 99", "a.splk: the file's size in bytes is", "--limit-bytes"),
    ("info a.splv --limit-bytes 99", "a.splv: the file's size in bytes is", "--limit-bytes"),
    (
        "compare a.png a.png --limit-texels 3",
        "a.png: picture: the number of texels is 4, over the limit of 3",
        "--limit-texels",
    ),
];

#[test]
fn each_limit_names_its_flag() {
    let folder = folder();
    folder.put("a.ply", PLY);
    folder.put("a.glb", glb());
    folder.put("points.csv", "x,y,z\n1,2,3\n4,5,6\n");
    folder.put(
        "deep.gltf",
        r#"{"asset":{"version":"2.0"},"nodes":[{"children":[1]},{"children":[2]},{}]}"#,
    );
    let picture = splatkit::picture::Picture {
        width: 2,
        height: 2,
        color: vec![[1.0; 4]; 4],
        depth: Vec::new(),
    };
    folder.put(
        "a.png",
        picture
            .encode(&splatkit::picture::Encoding::new(splatkit::picture::PictureFormat::Png))
            .unwrap(),
    );
    // 4096 bytes of 7 in a gzip file that stores them uncompressed.
    let stored =
        [&[0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 3, 1, 0x00, 0x10, 0xff, 0xef][..], &[7; 4096]].concat();
    folder.put("packed.gz", stored);
    folder.run("convert a.ply -o a.splk").ok();
    folder.run("convert a.nrrd -o a.splv").ok();
    for (arguments, message, flag) in OVER {
        let run = folder.run(arguments);
        let stderr = run.stderr();
        run.fails(3, &[message, &format!("raise {flag}")]);
        // The number in the hint is enough for the limit that was exceeded.
        let number = |text: &str| text.split(' ').find_map(|word| word.parse::<u64>().ok());
        let least =
            stderr.split_once(&format!("raise {flag} to ")).and_then(|(_, rest)| number(rest));
        assert!(least.is_some() || flag == &"--limit-seconds", "{arguments}: {stderr}");
        if let (Some(least), Some((start, _))) = (least, arguments.rsplit_once(' ')) {
            let again = folder.run(&format!("{start} {}", least + 1)).stderr();
            assert!(!again.contains(message), "{arguments}: {again}");
        }
    }
}

/// Inputs that would block, have no end or lie elsewhere are refused before they are opened.
#[cfg(unix)]
#[test]
fn pipes_devices_and_folders_are_refused() {
    let folder = folder();
    std::fs::create_dir(folder.path("folder.ply")).unwrap();
    folder.run("info folder.ply").fails(3, &["folder.ply: path: is not a regular file"]);
    std::os::unix::fs::symlink("/dev/zero", folder.path("zero.ply")).unwrap();
    folder.run("info zero.ply").fails(3, &["zero.ply: path: is not a regular file"]);
    if std::process::Command::new("mkfifo")
        .arg(folder.path("pipe.ply"))
        .status()
        .is_ok_and(|status| status.success())
    {
        folder.run("info pipe.ply").fails(3, &["pipe.ply: path: is not a regular file"]);
        folder.put("pipe.obj", "mtllib pipe.ply\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        folder
            .run("info pipe.obj")
            .fails(3, &["pipe.obj: mtllib: refers to “pipe.ply”, which is not a regular file"]);
    }
    folder.put("up.obj", "mtllib ../up.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder
        .run("info up.obj")
        .fails(3, &["which leads out of the file's own folder", "put the file beside the one"]);
}

#[test]
fn clouds_of_every_text_draw() {
    let folder = Folder::new();
    let points: Vec<[usize; 3]> =
        (0..400).map(|i| [i % 20, i / 20, (i % 20) * (i / 20) / 20]).collect();
    let lines = |end: &str| {
        points.iter().map(|[x, y, z]| format!("{x} {y} {z}{end}\n")).collect::<String>()
    };
    let fields =
        "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nVIEWPOINT 9 9 99 1 0 0 0\nPOINTS 400\nDATA ascii\n";
    for (name, content) in [
        ("a.xyz", lines("")),
        ("a.txt", lines(" 255 128 0")),
        ("a.csv", format!("x y z red green blue\n{}", lines(" 255 128 0"))),
        ("a.pts", format!("400\n{}", lines(" -700 255 128 0"))),
        ("a.pcd", format!("{fields}{}", lines(""))),
        (
            "b.stl",
            "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
             endfacet\nendsolid"
                .into(),
        ),
    ] {
        folder.put(name, content);
        let report =
            folder.json(&format!("render {name} -o out.png --overwrite --json --size 32x24"));
        assert!(report["splats"].as_u64().is_some_and(|count| count >= 3), "{name}: {report}");
    }
}

#[test]
fn what_is_unusual_draws() {
    let folder = folder();
    for arguments in [
        // A constant volume, which needs a function of its own.
        "flat.nrrd --transfer generic --range 0,7",
        // Two samples at one place count as their mean.
        "twins.csv",
        "a.nrrd --sharp",
        "a.nrrd --kernel b-spline",
        "a.nrrd --kernel cone.csv --extent 2",
        "a.nrrd --kernel cone.json --extent 1.5",
        "a.nrrd --iso 50,100:#ff0000:0.5 --iso 150:0.3",
        "a.nrrd --transfer generic --iso 100 --gradient-opacity 0,0:20,1",
        "a.nrrd --classify pre",
        "a.nrrd --mode axis-sheets",
        "a.nrrd --mode splats --back-to-front",
        "a.nrrd --mip",
        // A view along the up axis.
        "a.nrrd --camera-position 7.5,7.5,60 --focal-point 7.5,7.5,7.5",
        "a.nrrd --x-ray",
        "a.nrrd --clip plane:1,1,0,15 --clip y>20% --cut-out box:0,0,0:50%,50%,50%",
    ] {
        let report =
            folder.json(&format!("render {arguments} -o out.png --overwrite --json --size 32x24"));
        let settings = &report["settings"];
        for name in ["mode", "classify", "optics", "clips"] {
            assert!(!settings[name].is_null(), "{arguments}: {name}: {report}");
        }
        assert!(
            arguments.contains("twins") || settings["field"]["kernel"]["extent"].is_f64(),
            "{report}"
        );
    }
    // Only the picture shows that several clips together leave nothing.
    folder.run("render a.nrrd -o none.png --size 32x24 --clip x<30% --clip x>70%").fails(
        3,
        &["the camera sees no splat that has opacity after clipping by --clip 'x<30%' --clip \
           'x>70%'"],
    );
}

/// Scripts close a command's output early. Its exit code stays the same.
#[test]
fn errors_that_nobody_reads_keep_their_code() {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_splatkit"));
    let mut child =
        command.args(["info", "gone.ply"]).stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(3));
    // The same holds if nobody reads the log.
    let folder = folder();
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_splatkit"));
    command.args(["-vv", "convert", "a.nrrd", "-o", "a.splv"]).current_dir(folder.path(""));
    let mut child = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert!(folder.path("a.splv").exists());
}

/// An escape sequence that sets a terminal's title, one of C1, DEL, and a change of direction.
const HOSTILE: &str = "\u{1b}]0;title\u{7}\u{1b}[31m\u{9b}32m\u{7f}\u{202e}";

fn hostile_files(folder: &Folder) {
    let elements = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float s\nproperty float t\nelement face 1\n\
        property list uchar int vertex_indices\nend_header\n";
    let rows = "0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n";
    for (name, text) in [
        ("name.ply", format!("ply\nformat ascii 1.0\nelement vertex {HOSTILE}\nend_header\n")),
        (
            "comment.ply",
            format!("ply\nformat ascii 1.0\ncomment TextureFile {HOSTILE}.png\n{elements}{rows}"),
        ),
        ("a.pcd", format!("{HOSTILE} x y z\n")),
        ("a.obj", format!("v 0 0 {HOSTILE}\n")),
        ("b.obj", format!("mtllib {HOSTILE}.mtl\n{OBJ}")),
        (
            "a.nrrd",
            format!(
                "NRRD0004\ntype: {HOSTILE}\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n12345678"
            ),
        ),
        ("a.csv", format!("x,y,z,value\n1,2,{HOSTILE},3\n")),
        (
            "a.vtk",
            format!(
                "# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\n{HOSTILE} 1 2 3\n"
            ),
        ),
        ("a.vti", "<VTKFile type=\"\u{9b}31m\u{7f}\u{202e}\"></VTKFile>".into()),
        (
            "a.gltf",
            r#"{"asset": {"version": "2.0"}, "extensionsRequired": ["\u001b[31m\u009b32m"]}"#
                .into(),
        ),
        ("a.json", r#"{"color": [], "opacity": [], "\u001b[31m\u009b32m": 1}"#.into()),
    ] {
        folder.put(name, text);
    }
    folder.put("ball.nrrd", nrrd("uint8", &ball()));
}

/// The text of a file is shown, but does nothing to the terminal that shows it.
#[test]
fn no_text_of_a_file_commands_the_terminal() {
    let folder = Folder::new();
    hostile_files(&folder);
    let is_quiet = |run: &Run, what: &str| {
        let printed = run.printed();
        let control = printed
            .chars()
            .find(|&c| (c.is_control() && c != '\n') || ('\u{202a}'..='\u{202e}').contains(&c));
        assert_eq!(control, None, "{what}: {printed:?}");
        printed
    };
    let mut warned = 0;
    for name in [
        "name.ply",
        "comment.ply",
        "a.pcd",
        "a.obj",
        "b.obj",
        "a.nrrd",
        "a.csv",
        "a.vtk",
        "a.vti",
        "a.gltf",
    ] {
        let run = folder.run(&format!("info {name}"));
        let printed = is_quiet(&run, name);
        assert!(printed.contains(r"\u{9b}3"), "{name}: {printed}");
        warned += usize::from(run.code() == Some(0));
    }
    assert_eq!(warned, 2, "warnings of missing pictures and materials");
    let run = folder.run("render ball.nrrd --transfer a.json -o out.png");
    assert!(is_quiet(&run, "a.json").contains(r"\u{1b}[31m\u{9b}32m"));
    // Otherwise, log lines are unchanged.
    folder.put("points.xyz", "1 2 3\n4 5 6\n7 8 10\n");
    let log = folder.run("-vv convert points.xyz -o points.splk").stderr();
    assert!(log.contains(": close time.busy="), "{log}");
    // Names of files, of flags, and in results.
    let name = format!("{}.nrrd", HOSTILE.replace('/', ""));
    folder.put(&name, nrrd("uint8", &ball()));
    for arguments in [&["info", &name][..], &["info", "--json", &name], &["info", "-vv", &name]] {
        let run = folder.run_with(arguments);
        let printed = is_quiet(&run, "name");
        assert!(run.code() == Some(0) && printed.contains("title"), "{printed}");
        if arguments.contains(&"--json") {
            let value: serde_json::Value = serde_json::from_str(&run.stdout()).unwrap();
            assert_eq!(value["file"], name.as_str());
        }
    }
    is_quiet(&folder.run_with(&["info", &format!("none{name}")]), "missing");
    let run = folder.run_with(&["info", &format!("--{HOSTILE}")]);
    assert_eq!(run.code(), Some(2));
    is_quiet(&run, "flag");
}

/// Without a terminal, messages are whole lines, because other programs read them. The texts of
/// files in them have a limited length.
#[test]
fn messages_are_whole_lines_and_not_too_long() {
    let folder = Folder::new();
    folder.put(
        "a.gltf",
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["{}"]}}"#,
            "long ".repeat(50)
        ),
    );
    let run = folder.run("info a.gltf");
    assert!(
        run.printed().lines().next().unwrap().ends_with("long  is not supported"),
        "{}",
        run.printed()
    );
    folder.put(
        "b.gltf",
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["{}"]}}"#,
            "x".repeat(1 << 20)
        ),
    );
    let run = folder.run("info b.gltf");
    assert!(
        run.printed().len() < 4096 && run.printed().contains("characters left out"),
        "{}",
        run.printed().len()
    );
    run.fails(3, &["b.gltf: extensionsRequired: the extension xxx", "is not supported"]);
}

#[test]
fn points_at_one_place_draw() {
    let folder = Folder::new();
    folder.put("one.xyz", "1 2 3\n");
    folder.put("three.xyz", "1 2 3\n1 2 3\n1 2 3\n");
    folder.put("far.xyz", "1e8 2e8 3e8\n1e8 2e8 3e8\n");
    folder.put(
        "one.nrrd",
        "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 1 1 1\nencoding: raw\n\n\x07",
    );
    for name in ["one.xyz", "three.xyz", "far.xyz", "one.nrrd --transfer generic"] {
        let report = folder
            .json(&format!("render {name} -o out.png --overwrite --json --size 32x24 --reference"));
        let number = |vector: &serde_json::Value, axis: usize| vector[axis].as_f64().unwrap();
        let camera = &report["camera"];
        let way = (0..3).map(|axis| {
            (number(&camera["position"], axis) - number(&camera["focal_point"], axis)).powi(2)
        });
        let distance = way.sum::<f64>().sqrt();
        assert!((1.0..100.0).contains(&distance), "{name}: {report}");
        let file = std::fs::read(folder.path("out.png")).unwrap();
        assert!(file.len() > 100, "{name}: an empty picture");
    }
    folder
        .run("render one.xyz -o out.png --overwrite --camera-position 1,2,3 --focal-point 1,2,3")
        .fails(2, &["the camera is at its own focal point"]);
}

#[test]
fn trained_gaussians_are_told() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    folder.run("convert a.ply -o gaussians.ply").ok();
    let facts = folder.json("info gaussians.ply --json");
    assert_eq!(facts["kind"].as_str(), Some("trained Gaussians"));
    // Whoever names an array asks for points.
    let run = folder.run("info gaussians.ply --scalar opacity");
    let text = run.stdout();
    assert!(text.contains("kind            samples"), "{text}{}", run.stderr());
    folder
        .run("transfer gaussians.ply -o t.json")
        .fails(3, &["gaussians.ply", "colours of its own"]);
    folder
        .run("convert gaussians.ply -o a.nrrd")
        .fails(2, &["gaussians.ply holds no volume", "trained Gaussians"]);
    folder
        .run("render gaussians.ply -o a.png --color red")
        .fails(2, &["--color colours meshes, point clouds and the boundary of cells"]);
    folder.put("a.lcc", [0; 4096]);
    folder
        .run("render a.lcc -o a.png")
        .fails(3, &["a packed scene of trained 3D Gaussians", "splat-transform"]);
    assert!(!folder.run("info a.ply").stderr().contains("Gaussians"));
}

/// Any result that could not be printed is a failure.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_fails_what_is_printed() {
    let folder = Folder::new();
    folder.put("a.ply", PLY);
    for arguments in [
        "help",
        "--help",
        "--version",
        "help info",
        "render --help",
        "info a.ply",
        "info --json a.ply",
        "check a.ply",
    ] {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_splatkit"));
        command.args(arguments.split(' ')).current_dir(folder.path("")).env("NO_COLOR", "1");
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        let output = command.stdout(full).output().unwrap();
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments}: {message}");
        assert!(
            message.contains("stdout: cannot be written: No space left on device"),
            "{arguments}: {message}"
        );
    }
    for arguments in ["help", "--version", "render --help"] {
        let run = folder.run(arguments);
        assert!(
            run.code() == Some(0) && run.stdout().contains("splatkit"),
            "{arguments}: {}",
            run.printed()
        );
    }
}

/// Headers of two gigabytes. All but a few bytes are zeros, which take no space on the disk.
#[cfg(unix)]
#[test]
fn headers_of_two_gigabytes_are_refused_soon() {
    let folder = Folder::new();
    for (name, start, message) in [
        (
            "a.ply",
            &b"ply\nformat ascii 1.0\ncomment "[..],
            "a.ply: header line 3: the header is longer than 1048576 bytes",
        ),
        ("a.nrrd", b"NRRD0004\n# ", "a.nrrd: line 2: the header is longer than 67108864 bytes"),
        ("a.pcd", b"FIELDS x", "a.pcd: line 1: the line is longer than 1048576 bytes"),
        (
            "a.vtk",
            b"# vtk DataFile Version 3.0\n",
            "a.vtk: byte 27: the line is longer than 1048576 bytes",
        ),
        (
            "b.vtk",
            b"# vtk DataFile Version 3.0\n\nASCII\n",
            "b.vtk: byte 34: the line is longer than 1048576 bytes",
        ),
        (
            "a.npy",
            b"\x93NUMPY\x02\x00\xf0\xff\xff\x7f",
            "a.npy: header: is cut off, is longer than 1 MiB",
        ),
    ] {
        folder.put(name, start);
        std::fs::File::options()
            .write(true)
            .open(folder.path(name))
            .unwrap()
            .set_len(2 << 30)
            .unwrap();
        let begun = std::time::Instant::now();
        let run = folder.run(&format!("info {name}"));
        // Pages of holes take seconds on a busy machine.
        assert!(begun.elapsed().as_secs() < 40, "{name}: {:?}", begun.elapsed());
        assert!(!run.stderr().contains("raise --limit"), "{name}: {}", run.stderr());
        run.fails(3, &[message]);
        std::fs::remove_file(folder.path(name)).unwrap();
    }
    // Raising a limit does not help a file of a few bytes that claims many points; it helps a file
    // that has them.
    folder.put("many.ply", PLY.replace("vertex 4", "vertex 4000000000"));
    folder
        .run("info many.ply")
        .fails(3, &["over the limit", "cannot hold that: it is cut or damaged"]);
}
