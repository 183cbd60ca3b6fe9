// Part of ../cases.rs.
vec![
    // LAS, LAZ, E57.
    (
        "count.las",
        at(las(), 107, &u32::MAX.to_le_bytes()),
        "count.las: the number of points is 4294967295, over the limit of 2147483648",
    ),
    (
        "million.las",
        at(las(), 107, &1_000_000u32.to_le_bytes()),
        "million.las: header: counts 1000000 points of 20 bytes, 20000000 in all, but 100 \
         bytes follow",
    ),
    ("none.las", at(las(), 107, &[0; 4]), "none.las: file: contains no points"),
    (
        "scale.las",
        at(las(), 131, &f64::NAN.to_le_bytes()),
        "scale.las: header: has the scale [NaN, 0.01, 0.01] and the offset [0, 0, 0]; both \
         must be finite, and the scale above 0",
    ),
    (
        "flat.las",
        at(las(), 131, &0f64.to_le_bytes()),
        "flat.las: header: has the scale [0, 0.01, 0.01] and the offset [0, 0, 0]; both must \
         be finite, and the scale above 0",
    ),
    (
        "far.las",
        at(las(), 131, &1e300f64.to_le_bytes()),
        "far.las: positions: range from [0.0, 0.0, 0.0] to [4e300, 0.08, 0.12], too wide for \
         32-bit coordinates",
    ),
    (
        "start.las",
        at(las(), 96, &u32::MAX.to_le_bytes()),
        "start.las: header: puts the points at byte 4294967295, but the file has 327 bytes",
    ),
    (
        "size.las",
        at(las(), 105, &[1, 0]),
        "size.las: header: has points of 1 bytes, but those of format 0 need 20",
    ),
    (
        "format.las",
        at(las(), 104, &[63]),
        "format.las: header: has points of format 63, but only 0 to 10 can be read",
    ),
    (
        "count.laz",
        at(laz(), 107, &1_000_000u32.to_le_bytes()),
        "count.laz: chunk table: has 6 points, but the header counts 1000000",
    ),
    ("records.laz", at(laz(), 100, &u32::MAX.to_le_bytes()), "mesh 5 0 0"),
    (
        "laughs.e57",
        e57(|xml| xml.replacen("?>", &format!("?>{laughs}"), 1).replacen("file", "&l29;", 1)),
        "laughs.e57: file: cannot be read as E57: Invalid E57 content: Failed to parse XML \
         data: XML with DTD detected",
    ),
    (
        "count.e57",
        e57(|xml| xml.replace("recordCount=\"2\"", "recordCount=\"18446744073709551615\"")),
        "count.e57: the number of points is 18446744073709551615, over the limit of 2147483648",
    ),
    (
        "more.e57",
        e57(|xml| xml.replace("recordCount=\"2\"", "recordCount=\"2000000000\"")),
        "more.e57: scan 0: ends after 2 points: Invalid E57 content: Found unknown packet ID \
         when trying to read packet header",
    ),
    (
        "none.e57",
        e57(|xml| xml.replace("recordCount=\"2\"", "recordCount=\"0\"")),
        "none.e57: file: contains no points",
    ),
    // Text tables.
    (
        "comma.xyz",
        "1,5 2,5 3,5\n".into(),
        "comma.xyz: line 1: \"1,5 2,5 3,5\" contains neither numbers nor column names",
    ),
    (
        "comma.csv",
        "x;y;z;value\n1,5;2,5;3,5;4,5\n".into(),
        "comma.csv: line 2: “1,5” is not a number",
    ),
    (
        "nan.xyz",
        "1 2 3\n1 nan 3\n".into(),
        "mesh 1 0 0",
    ),
    (
        "inf.xyz",
        "1 2 -inf\n".into(),
        "inf.xyz: positions: none of the 1 points has coordinates that are finite numbers",
    ),
    ("one.xyz", "1 2 3\n".into(), "mesh 1 0 0"),
    ("same.xyz", "1 2 3\n1 2 3\n".into(), "mesh 2 0 0"),
    (
        "count.pts",
        "18446744073709551615\n1 2 3\n".into(),
        "count.pts: line 1: counts 18446744073709551615 points, but there are 1",
    ),
    ("none.pts", "0\n".into(), "none.pts: file: contains no rows of numbers"),
    (
        "wide.csv",
        vec!["1"; 5000].join(",").into(),
        "wide.csv: line 1: has more than 4096 columns",
    ),
    ("mark.csv", "\u{feff}x,y,z,value\r\n1,2,3,4\r\n".into(), "samples 1"),
    ("latin.csv", b"# caf\xe9\nx,y,z,value,n\xe9\n1,2,3,4,5\n".to_vec(), "samples 1"),
    (
        "radius0.csv",
        "x,y,z,value,radius\n1,2,3,4,0\n".into(),
        "radius0.csv: samples: the radius of sample 0 is 0, but radii are above 0",
    ),
    ("radius.csv", "x,y,z,value,radius\n1,2,3,4,1e38\n".into(), "samples 1"),
    (
        "radiusinf.csv",
        "x,y,z,value,radius\n1,2,3,4,1e39\n".into(),
        "radiusinf.csv: samples: the radius of sample 0 is inf, but radii are above 0",
    ),
    (
        "far.csv",
        "x,y,z,value\n0,0,0,1\n1e30,0,0,1\n".into(),
        "far.csv: positions: range from [0.0, 0.0, 0.0] to [1e30, 0.0, 0.0], too wide for \
         32-bit coordinates",
    ),
    (
        "zeros.csv",
        vec![0; 1000],
        "zeros.csv: line 1: \"\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\
         \\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\\0\" contains neither numbers \
         nor column names",
    ),
    // PCD.
    (
        "count.pcd",
        pcd("18446744073709551615", b"DATA binary\n"),
        "count.pcd: the number of points is 18446744073709551615, over the limit of 2147483648",
    ),
    (
        "million.pcd",
        pcd("1000000", b"DATA binary\n0123456789"),
        "million.pcd: data: 10 bytes follow the header where 12000000 were expected",
    ),
    (
        "rows.pcd",
        b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4294967296\nHEIGHT 4294967296\n\
          DATA ascii\n"
            .to_vec(),
        "rows.pcd: the number of points is 18446744073709551615, over the limit of 2147483648",
    ),
    (
        "fields.pcd",
        b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 18446744073709551615\nPOINTS 1\n\
          DATA ascii\n"
            .to_vec(),
        "fields.pcd: header: “COUNT 1 1 18446744073709551615” has an invalid count",
    ),
    (
        "bomb.pcd",
        pcd(
            "2",
            &[b"DATA binary_compressed\n".as_slice(), &counts(&[4, 24]), &[0, 0, 0xff, 0xff]]
                .concat(),
        ),
        "bomb.pcd: byte 79: the packed data end early",
    ),
    ("nan.pcd", pcd("2", b"DATA ascii\nnan nan nan\n1 2 3\n"), "mesh 1 0 0"),
    (
        "comma.pcd",
        pcd("1", b"DATA ascii\n1,5 2,5 3,5\n"),
        "comma.pcd: line 6: “1,5” is not a number",
    ),
    (
        "endless.pcd",
        "# comment\n".repeat(200_000).into(),
        "endless.pcd: line 104859: the header is longer than 1048576 bytes",
    ),
]
