// Part of ../cases.rs.
vec![
    // OBJ and the files that it refers to.
    (
        "zero.obj",
        "v 0 0 0\nf 0 1 1\n".into(),
        "zero.obj: line 2: a face refers to vertex 0, but there are 1 (1 … 1, or −1 … −1)",
    ),
    (
        "beyond.obj",
        "v 0 0 0\nf 1 1 2\n".into(),
        "beyond.obj: line 2: a face refers to vertex 2, but there are 1 (1 … 1, or −1 … −1)",
    ),
    (
        "minus.obj",
        "v 0 0 0\nf 1 1 -2\n".into(),
        "minus.obj: line 2: a face refers to vertex -2, but there are 1 (1 … 1, or −1 … −1)",
    ),
    (
        "huge.obj",
        "v 0 0 0\nf 1 1 99999999999999999999\n".into(),
        "huge.obj: line 2: “99999999999999999999” is not a face corner",
    ),
    (
        "nan.obj",
        "v 0 nan 0\nf 1 1 1\n".into(),
        "nan.obj: positions: none of the 1 points has coordinates that are finite numbers",
    ),
    (
        "inf.obj",
        "v 1 2 3\nv 0 1e999 0\nf 1 2 1\n".into(),
        "inf.obj: faces: each uses a point that is not at finite coordinates",
    ),
    (
        "comma.obj",
        "v 1,5 2,5 3,5\nf 1 1 1\n".into(),
        "comma.obj: line 1: “1,5” is not a number",
    ),
    ("commas.obj", "v 1,5 2,5 3,5\n".into(), "commas.obj: line 1: “1,5” is not a number"),
    ("crlf.obj", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n".into(), "mesh 3 1 0"),
    ("numbers.obj", "v 1 2 3 4 5 6 7 8 9\nv 4 5 6\n".into(), "mesh 2 0 0"),
    ("latin.obj", [&b"# caf\xe9\n"[..], &obj("")].concat(), "mesh 3 1 0"),
    ("flat.obj", "v 0 0 0\nf 1 1 1\n".into(), "mesh 1 1 0"),
    (
        "corner.obj",
        "v 0 0 0\nf 1\n".into(),
        "corner.obj: file: has faces, but none with three or more corners",
    ),
    (
        "slashes.obj",
        "v 0 0 0\nf //// 1 1\n".into(),
        "slashes.obj: line 2: “////” is not a face corner",
    ),
    (
        "none.obj",
        "vn 0 0 1\n".into(),
        "none.obj: file: has no vertices (no line that begins with “v ”)",
    ),
    (
        "up.obj",
        obj("mtllib ../up.mtl"),
        "up.obj: mtllib: refers to “../up.mtl”, which leads out of the file's own folder",
    ),
    (
        "absolute.obj",
        obj("mtllib /etc/hostname"),
        "absolute.obj: mtllib: refers to “/etc/hostname”, an absolute path; only files in the \
         same folder or below it are read",
    ),
    (
        "address.obj",
        obj("mtllib file:///etc/hostname"),
        "address.obj: mtllib: refers to “file:///etc/hostname”, an address or a drive; only \
         files in the same folder or below it are read",
    ),
    (
        "drive.obj",
        obj("mtllib C:\\up.mtl"),
        "drive.obj: mtllib: refers to “C:/up.mtl”, an address or a drive; only files in the \
         same folder or below it are read",
    ),
    (
        "share.obj",
        obj("mtllib \\\\server\\share\\up.mtl"),
        "share.obj: mtllib: refers to “//server/share/up.mtl”, an absolute path; only files in \
         the same folder or below it are read",
    ),
    (
        "back.obj",
        obj("mtllib ..\\..\\up.mtl"),
        "back.obj: mtllib: refers to “../../up.mtl”, which leads out of the file's own folder",
    ),
    (
        "self.obj",
        obj("mtllib self.obj"),
        "self.obj: mtllib: refers to “self.obj”, the file itself",
    ),
    (
        "folder.obj",
        obj("mtllib folder"),
        "folder.obj: mtllib: refers to “folder”, which is not a regular file",
    ),
    (
        "chain.obj",
        obj("mtllib chain.mtl\nusemtl m"),
        "chain.obj: material “m”: refers to “../a.png”, which leads out of the file's own \
         folder",
    ),
    ("missing.obj", obj("mtllib missing.mtl"), "mesh 3 1 0"),
    // STL.
    ("a.off", OFF.into(), "mesh 3 1 0"),
    (
        "far.off",
        OFF.replace("3 0 1 2", "3 0 1 9").into(),
        "far.off: line 6: refers to vertex 9, but there are 3, which count from 0",
    ),
    (
        "count.stl",
        at(stl(), 80, &u32::MAX.to_le_bytes()),
        "mesh 3 1 0",
    ),
    (
        "none.stl",
        stl()[..80].iter().copied().chain([0; 4]).collect(),
        "none.stl: file: contains no facets",
    ),
    (
        "nan.stl",
        at(stl(), 96, &f32::NAN.to_le_bytes()),
        "nan.stl: positions: none of the 3 points has coordinates that are finite numbers",
    ),
    ("flat.stl", at(stl(), 96, &[0; 36]), "mesh 3 1 0"),
    (
        "comma.stl",
        STL_TEXT.replace("1 0 0", "1,5 0 0").into(),
        "comma.stl: line 5: a vertex needs three numbers",
    ),
]
