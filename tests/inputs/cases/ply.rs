// Part of ../cases.rs.
vec![
    // PLY: wrong counts.
    (
        "count0.ply",
        vertices("0", ""),
        "count0.ply: header: has no element “vertex” with at least one row",
    ),
    (
        "count32.ply",
        vertices("4294967296", "1 2 3\n"),
        "count32.ply: the count of element “vertex” is 4294967296, over the limit of \
         2147483648",
    ),
    (
        "count31.ply",
        vertices("2147483647", "1 2 3\n"),
        "count31.ply: element “vertex”, row 1, byte 115: the file ends, though the header \
         claims 2147483647 rows",
    ),
    (
        "count63.ply",
        vertices("18446744073709551615", "1 2 3\n"),
        "count63.ply: the count of element “vertex” is 18446744073709551615, over the limit of \
         2147483648",
    ),
    (
        "count64.ply",
        vertices("18446744073709551616", "1 2 3\n"),
        "count64.ply: header line 3: “18446744073709551616” is not a row count",
    ),
    (
        "countminus.ply",
        vertices("-1", "1 2 3\n"),
        "countminus.ply: header line 3: “-1” is not a row count",
    ),
    (
        "bare.ply",
        ply(&format!("element nothing 40000000000\nelement vertex 1\n{FLOATS}"), "1 2 3\n"),
        "mesh 1 0 0",
    ),
    (
        "barevertex.ply",
        ply("element vertex 40000000000\n", ""),
        "barevertex.ply: the count of element “vertex” is 40000000000, over the limit of \
         2147483648",
    ),
    (
        "bareface.ply",
        ply(&format!("element vertex 1\n{FLOATS}element face 40000000000\n"), "1 2 3\n"),
        "bareface.ply: the count of element “face” is 40000000000, over the limit of \
         2147483648",
    ),
    (
        "list32.ply",
        faces("uint int", "4294967295 0 1 2\n"),
        "list32.ply: element “face”, row 0, byte 171: the line ends before the value of \
         “vertex_indices”",
    ),
    (
        "listminus.ply",
        faces("int int", "-1\n"),
        "listminus.ply: element “face”, row 0, byte 170: the list “vertex_indices” has the \
         impossible length -1",
    ),
    (
        "listhalf.ply",
        faces("float int", "2.5 0 1 2\n"),
        "listhalf.ply: element “face”, row 0, byte 172: the list “vertex_indices” has the \
         impossible length 2.5",
    ),
    (
        "index.ply",
        faces("uchar int", "3 0 1 3\n"),
        "index.ply: element “face”, row 0, byte 172: refers to vertex 3, but there are 3 (0 … \
         2)",
    ),
    (
        "indexminus.ply",
        faces("uchar int", "3 0 1 -1\n"),
        "indexminus.ply: element “face”, row 0, byte 172: refers to vertex -1, but there are 3 \
         (0 … 2)",
    ),
    (
        "columns.ply",
        ply(&format!("element vertex 1\n{}", "property float x\n".repeat(5000)), ""),
        "columns.ply: header line 4099: more than 4096 elements and properties",
    ),
    (
        "endless.ply",
        format!("ply\nformat ascii 1.0\n{}", "comment\n".repeat(200_000)).into(),
        "endless.ply: header line 131072: the header is longer than 1048576 bytes and has no \
         “end_header” line",
    ),
    // PLY: numbers that are not finite, or not numbers.
    (
        "nan.ply",
        vertices("2", "1 2 3\n1 nan 3\n"),
        "mesh 1 0 0",
    ),
    (
        "inf.ply",
        vertices("1", "1 2 inf\n"),
        "inf.ply: positions: none of the 1 points has coordinates that are finite numbers",
    ),
    (
        "minusinf.ply",
        vertices("1", "-Infinity 2 3\n"),
        "minusinf.ply: positions: none of the 1 points has coordinates that are finite numbers",
    ),
    (
        "far.ply",
        vertices("2", "0 0 0\n1e30 0 0\n"),
        "far.ply: positions: range from [0.0, 0.0, 0.0] to [1e30, 0.0, 0.0], too wide for \
         32-bit coordinates",
    ),
    (
        "comma.ply",
        vertices("1", "1,5 2,5 3,5\n"),
        "comma.ply: element “vertex”, row 0, byte 100: “1,5” is not a number (for “x”)",
    ),
    (
        "words.ply",
        vertices("1", "one two three\n"),
        "words.ply: element “vertex”, row 0, byte 100: “one” is not a number (for “x”)",
    ),
    (
        "more.ply",
        vertices("1", "1 2 3 4\n"),
        "more.ply: element “vertex”, row 0, byte 100: the line has more values than the header \
         names",
    ),
    (
        "fewer.ply",
        vertices("1", "1 2\n"),
        "fewer.ply: element “vertex”, row 0, byte 100: the line ends before the value of “z”",
    ),
    // PLY: files that strict parsers refuse, but that exist in practice.
    (
        "crlf.ply",
        String::from_utf8_lossy(&vertices("2", "1 2 3\n4 5 6\n")).replace('\n', "\r\n").into(),
        "mesh 2 0 0",
    ),
    (
        "mac.ply",
        String::from_utf8_lossy(&vertices("2", "1 2 3\n4 5 6\n")).replace('\n', "\r").into(),
        "mesh 2 0 0",
    ),
    ("blank.ply", vertices("2", "1 2 3\n\n\n4 5 6\n"), "mesh 2 0 0"),
    (
        "latin.ply",
        [
            &b"ply\nformat ascii 1.0\ncomment caf\xe9 \xff\n"[..],
            &after_header("ply\nformat ascii 1.0\n", ""),
        ]
        .concat(),
        "mesh 1 0 0",
    ),
    (
        "scalar.ply",
        ply(&format!("element vertex 1\n{FLOATS}property float scalar.x\n"), "1 2 3 4\n"),
        "mesh 1 0 0",
    ),
    (
        "nannormal.ply",
        ply(
            &format!(
                "element vertex 1\n{FLOATS}property float nx\nproperty float ny\n\
             property float nz\n"
            ),
            "1 2 3 nan NaN -nan\n",
        ),
        "mesh 1 0 0",
    ),
    (
        "double.ply",
        vertices("2", "4500000.001 5400000.002 100.003\n4500000.004 5400000.009 100\n"),
        "mesh 2 0 0",
    ),
    (
        "grid.ply",
        ply(
            &format!(
                "obj_info num_cols 2\nobj_info num_rows 1\nelement vertex 1\n\
             {FLOATS}element range_grid 2\nproperty list uchar int vertex_indices\n"
            ),
            "1 2 3\n1 0\n0\n",
        ),
        "mesh 1 0 0",
    ),
    ("one.ply", vertices("1", "1 2 3\n"), "mesh 1 0 0"),
    ("same.ply", vertices("3", "1 2 3\n1 2 3\n1 2 3\n"), "mesh 3 0 0"),
    ("flat.ply", faces("uchar int", "3 0 0 1\n"), "mesh 3 1 0"),
    (
        "nofaces.ply",
        ply(
            &format!(
                "element vertex 1\n{FLOATS}element face 0\nproperty list uchar int \
             vertex_indices\n"
            ),
            "1 2 3\n",
        ),
        "mesh 1 0 0",
    ),
    (
        "empty.ply",
        Vec::new(),
        "empty.ply: header line 1: the header has no “end_header” line; the file is cut off or \
         is not PLY",
    ),
    (
        "zeros.ply",
        vec![0; 100],
        "zeros.ply: header line 1: the header has no “end_header” line; the file is cut off or \
         is not PLY",
    ),
]
