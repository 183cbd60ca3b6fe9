{
    let vertices =
        |count: &str, rows: &str| ply(&format!("element vertex {count}\n{FLOATS}"), rows);
    let faces = |list: &str, rows: &str| {
        let head = format!(
            "element vertex 3\n{FLOATS}element face 1\nproperty list {list} \
             vertex_indices\n"
        );
        ply(&head, &format!("0 0 0\n1 0 0\n0 1 0\n{rows}"))
    };
    let after_header = |text: &str, insert: &str| -> Vec<u8> {
        String::from_utf8_lossy(&vertices("1", "1 2 3\n")).replacen(text, insert, 1).into_bytes()
    };
    let obj = |text: &str| -> Vec<u8> {
        format!("{text}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").into_bytes()
    };
    let buffer = |uri: &str| -> Vec<u8> { gltf_with(uri, r#"{"mesh":0}"#).into_bytes() };
    let scene = |nodes: &str| -> Vec<u8> {
        gltf().replace(r#""nodes":[{"mesh":0}]"#, &format!(r#""nodes":[{nodes}]"#)).into_bytes()
    };
    let changed = |from: &str, to: &str| -> Vec<u8> {
        assert!(gltf().contains(from));
        gltf().replacen(from, to, 1).into_bytes()
    };
    let at = |mut bytes: Vec<u8>, place: usize, new: &[u8]| -> Vec<u8> {
        bytes[place..place + new.len()].copy_from_slice(new);
        bytes
    };
    let vti = |content: &str| -> Vec<u8> {
        vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", content))).into_bytes()
    };
    let binary = |attributes: &str, bytes: &[u8]| -> Vec<u8> {
        use ::base64::Engine;
        let text = ::base64::engine::general_purpose::STANDARD.encode(bytes);
        vtk_xml("ImageData", attributes, &vti_piece(&array("format='binary'", &text))).into_bytes()
    };
    let counts =
        |numbers: &[u32]| -> Vec<u8> { numbers.iter().flat_map(|n| n.to_le_bytes()).collect() };
    let chain = |count: usize| -> Vec<u8> {
        let nodes: Vec<String> =
            (1..count).map(|child| format!(r#"{{"children":[{child}]}}"#)).collect();
        gltf()
            .replace(r#"{"mesh":0}"#, &format!(r#"{},{{"mesh":0}}"#, nodes.join(",")))
            .into_bytes()
    };
    // A PNG that claims a size. Only its header is valid.
    let claim = {
        let mut png = png(2, 2);
        png[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
        let crc = crc32fast::hash(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        png
    };
    let large = {
        let mut png = claim.clone();
        png[16..24].copy_from_slice(&[0, 0, 0x40, 0, 0, 0, 0x40, 0]);
        let crc = crc32fast::hash(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        png
    };
    let picture = |bytes: &[u8]| -> Vec<u8> {
        use ::base64::Engine;
        let text = ::base64::engine::general_purpose::STANDARD.encode(bytes);
        let material = format!(
            "\"materials\":[{{\"pbrMetallicRoughness\":{{\"baseColorTexture\":{{\"index\":0}}}}}}],\
             \"textures\":[{{\"source\":0}}],\"images\":[{{\"uri\":\"data:image/png;base64,\
             {text}\"}}],\"meshes\""
        );
        gltf()
            .replacen(r#""meshes""#, &material, 1)
            .replacen(r#""indices":1"#, r#""indices":1,"material":0"#, 1)
            .into_bytes()
    };
    let mut laughs = String::from("<!DOCTYPE a [<!ENTITY l0 \"ha\">");
    for level in 1..30 {
        laughs += &format!(
            "<!ENTITY l{level} \"&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};\
             &l{0};&l{0};\">",
            level - 1
        );
    }
    laughs += "]>";
    let lists = |count: usize| "[".repeat(count);
    let bricks = || splv(&Folder::new());
    // The header of SPZ without gzip, and bytes behind it.
    let spz = |version: u8, count: u32, degree: u8, more: usize| -> Vec<u8> {
        let head = [&b"NGSP"[..], &[version, 0, 0, 0], &count.to_le_bytes(), &[degree, 12, 0, 0]];
        [head.concat(), vec![0; more]].concat()
    };
    let trainer = |properties: &str| -> Vec<u8> {
        let each = properties.split(' ').map(|name| format!("property float {name}\n"));
        let each: String = each.collect();
        ply(&format!("element vertex 1\n{FLOATS}{each}"), &"0 ".repeat(60))
    };
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
        // glTF: references.
        (
            "up.gltf",
            buffer("../up.bin"),
            "up.gltf: buffer 0: refers to “../up.bin”, which leads out of the file's own folder",
        ),
        (
            "stride.gltf",
            changed(r#""byteLength":36"#, r#""byteLength":36,"byteStride":9223372036854775808"#),
            "stride.gltf: mesh 0, primitive 0, accessor 0: 3 elements from byte 0 reach beyond the \
             view's 36",
        ),
        (
            "coded.gltf",
            buffer("%2e%2e%2fup.bin"),
            "coded.gltf: buffer 0: refers to “../up.bin”, which leads out of the file's own folder",
        ),
        (
            "bytes.gltf",
            buffer("%ff%fe.bin"),
            "bytes.gltf: buffer 0: refers to “%ff%fe.bin”, whose percent codes do not decode to \
             UTF-8 text",
        ),
        (
            "percent.gltf",
            buffer("100%.bin"),
            "percent.gltf: buffer 0: refers to “100%.bin”, whose percent codes do not decode to \
             UTF-8 text",
        ),
        (
            "absolute.gltf",
            buffer("/etc/hostname"),
            "absolute.gltf: buffer 0: refers to “/etc/hostname”, an absolute path; only files in \
             the same folder or below it are read",
        ),
        (
            "address.gltf",
            buffer("file:///etc/hostname"),
            "address.gltf: buffer 0: refers to “file:///etc/hostname”, an address or a drive; only \
             files in the same folder or below it are read",
        ),
        (
            "net.gltf",
            buffer("http://example.org/a.bin"),
            "net.gltf: buffer 0: refers to “http://example.org/a.bin”, an address or a drive; only \
             files in the same folder or below it are read",
        ),
        (
            "drive.gltf",
            buffer("C:\\\\a.bin"),
            "drive.gltf: buffer 0: refers to “C:\\a.bin”, an address or a drive; only files in the \
             same folder or below it are read",
        ),
        (
            "share.gltf",
            buffer("\\\\\\\\server\\\\share\\\\a.bin"),
            "share.gltf: buffer 0: refers to “\\\\server\\share\\a.bin”, an absolute path; only \
             files in the same folder or below it are read",
        ),
        (
            "self.gltf",
            buffer("self.gltf"),
            "self.gltf: buffer 0: refers to “self.gltf”, the file itself",
        ),
        (
            "folder.gltf",
            buffer("folder"),
            "folder.gltf: buffer 0: refers to “folder”, which is not a regular file",
        ),
        (
            "missing.gltf",
            buffer("missing.bin"),
            "missing.gltf: buffer 0: refers to “missing.bin”: No such file or directory (os error \
             2)",
        ),
        (
            "zero.gltf",
            buffer("a%00.bin"),
            "zero.gltf: buffer 0: refers to “a%00.bin”, whose percent codes do not decode to UTF-8 \
             text",
        ),
        (
            "base64.gltf",
            buffer("data:;base64,????"),
            "base64.gltf: buffer 0: is not valid base64: Invalid symbol 63, offset 0.",
        ),
        (
            "short.gltf",
            buffer("data:;base64,AAAA"),
            "short.gltf: buffer 0: claims 42 bytes but holds 3",
        ),
        (
            "comma.gltf",
            buffer("data:;base64"),
            "comma.gltf: buffer 0: has a data URI without a comma",
        ),
        // glTF: counts and nodes.
        (
            "cycle.gltf",
            scene(r#"{"children":[1]},{"children":[0],"mesh":0}"#),
            "cycle.gltf: node 0: is its own ancestor, or has two parents",
        ),
        (
            "self.node.gltf",
            scene(r#"{"children":[0],"mesh":0}"#),
            "self.node.gltf: node 0: is its own ancestor, or has two parents",
        ),
        (
            "twice.gltf",
            scene(r#"{"children":[1,1]},{"mesh":0}"#),
            "twice.gltf: node 1: is its own ancestor, or has two parents",
        ),
        (
            "node.gltf",
            scene(r#"{"children":[9]}"#),
            "node.gltf: node 9: does not exist; there are 1 nodes",
        ),
        (
            "mesh.gltf",
            scene(r#"{"mesh":9}"#),
            "mesh.gltf: mesh 9: does not exist; there are 1 meshes",
        ),
        (
            "deep.gltf",
            chain(65),
            "deep.gltf: node 64: the nesting depth is 65, over the limit of 64",
        ),
        ("deepest.gltf", chain(64), "mesh 3 1 0"),
        (
            "count.gltf",
            changed(r#""count":3,"type":"VEC3""#, r#""count":4294967296,"type":"VEC3""#),
            "count.gltf: the number of vertices is 4294967296, over the limit of 2147483648",
        ),
        (
            "count64.gltf",
            changed(r#""count":3,"type":"VEC3""#, r#""count":18446744073709551616,"type":"VEC3""#),
            "count64.gltf: JSON: invalid type: floating point `1.8446744073709552e+19`, expected \
             u64 at line 1 column 231",
        ),
        (
            "more.gltf",
            changed(r#""count":3,"type":"VEC3""#, r#""count":4,"type":"VEC3""#),
            "more.gltf: mesh 0, primitive 0, accessor 0: 4 elements from byte 0 reach beyond the \
             view's 36",
        ),
        (
            "index.gltf",
            changed(r#""count":3,"type":"VEC3""#, r#""count":2,"type":"VEC3""#),
            "index.gltf: mesh 0, primitive 0, accessor 1: index 2 refers to vertex 2, but there \
             are 2",
        ),
        (
            "nothing.gltf",
            changed(r#""count":3,"type":"VEC3""#, r#""count":0,"type":"VEC3""#),
            "nothing.gltf: mesh 0, primitive 0, accessor 1: index 0 refers to vertex 0, but there \
             are 0",
        ),
        (
            "sparse.gltf",
            changed(
                r#""bufferView":0,"componentType":5126,"count":3,"type":"VEC3""#,
                "\"componentType\":5126,\"count\":2000000000,\"type\":\"VEC3\",\
                 \"sparse\":{\"count\":1,\"indices\":{\"bufferView\":1,\"componentType\":5123},\
                 \"values\":{\"bufferView\":0}}",
            ),
            "sparse.gltf: the size of the scene in bytes is 320000000120, over the limit of \
             34359738368",
        ),
        (
            "view.gltf",
            changed(r#""byteLength":36"#, r#""byteLength":99999"#),
            "view.gltf: buffer view 0: 99999 bytes from byte 0 reach beyond the buffer's 42",
        ),
        (
            "offset.gltf",
            changed(r#""byteOffset":36"#, r#""byteOffset":18446744073709551615"#),
            "offset.gltf: buffer view 1: 6 bytes from byte 18446744073709551615 reach beyond the \
             buffer's 42",
        ),
        (
            "buffer.gltf",
            changed(r#""byteLength":42"#, r#""byteLength":9007199254740992"#),
            "buffer.gltf: buffer 0: claims 9007199254740992 bytes but holds 42",
        ),
        (
            "stride.gltf",
            changed(r#""byteLength":36"#, r#""byteLength":36,"byteStride":0"#),
            "stride.gltf: mesh 0, primitive 0, accessor 0: the stride of 0 bytes is less than an \
             element's 12",
        ),
        (
            "nan.gltf",
            scene(r#"{"mesh":0,"translation":[1e39,0,0]}"#),
            "nan.gltf: JSON: number out of range at line 1 column 100",
        ),
        (
            "far.gltf",
            scene(r#"{"mesh":0,"scale":[1e30,1,1]}"#),
            "far.gltf: positions: range from [0.0, 0.0, 0.0] to [1.0000000150474662e30, 1.0, 0.0], \
             too wide for 32-bit coordinates",
        ),
        (
            "lists.gltf",
            lists(100_000).into(),
            "lists.gltf: JSON: invalid type: sequence, expected index into child of root at line 1 \
             column 3",
        ),
        (
            "extras.gltf",
            changed(
                r#""scene":0"#,
                &format!(r#""scene":0,"extras":{}{}"#, lists(1000), "]".repeat(1000)),
            ),
            "extras.gltf: JSON: invalid type: sequence, expected unit at line 1 column 47",
        ),
        (
            "extra.gltf",
            changed(r#""scene":0"#, r#""scene":0,"extras":{"a":{"b":[1]}}"#),
            "mesh 3 1 0",
        ),
        (
            "draco.gltf",
            changed(
                r#""scene":0"#,
                "\"scene\":0,\"extensionsRequired\":[\"KHR_draco_mesh_\
                 compression\"]",
            ),
            "draco.gltf: extensionsRequired: the extension KHR_draco_mesh_compression is not \
             supported",
        ),
        (
            "chunk.glb",
            at(glb(), 12, &u32::MAX.to_le_bytes()),
            "chunk.glb: byte 12: a GLB chunk reaches beyond the end",
        ),
        (
            "version.glb",
            at(glb(), 4, &[9]),
            "version.glb: byte 4: the GLB version is 9; only version 2 is read",
        ),
        // Pictures.
        (
            "png.gltf",
            picture(&claim),
            "png.gltf: image 0: the number of texels is 4294967296, over the limit of 268435456",
        ),
        (
            "large.gltf",
            picture(&large),
            "large.gltf: image 0: the picture claims 16384 × 16384 texels, more than 86 bytes can \
             hold",
        ),
        (
            "notpng.gltf",
            picture(b"not a picture"),
            "notpng.gltf: image 0: the picture cannot be decoded: The image format could not be \
             determined",
        ),
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
        // NPY.
        (
            "rows.npy",
            npy("(18446744073709551615, 4)", &[]),
            "rows.npy: the number of rows is 18446744073709551615, over the limit of 2147483648",
        ),
        (
            "million.npy",
            npy("(1000000, 4)", &[1.0]),
            "million.npy: data: there are 4 bytes where 16000000 were expected",
        ),
        ("none.npy", npy("(0, 4)", &[]), "none.npy: file: contains no samples"),
        (
            "nan.npy",
            npy("(1, 4)", &[f32::NAN, 2.0, 3.0, 4.0]),
            "nan.npy: samples: none is at finite coordinates",
        ),
        ("shape.npy", npy("((((((", &[]), "shape.npy: header: has no “shape”"),
        (
            "five.npy",
            npy("(2, 3, 4, 5, 6)", &[]),
            "five.npy: header: has the shape (2, 3, 4, 5, 6), but (z, y, x) was expected for a \
             volume",
        ),
        (
            "huge.npy",
            npy("(1048576, 1048576, 1048576)", &[1.0]),
            "huge.npy: the size of the samples in bytes is 4611686018427387904, over the limit of \
             34359738368",
        ),
        // MetaImage, MRC, TIFF and HDF5.
        (
            "size.mha",
            mha("100 100 100", "", b"1234"),
            "size.mha: data: there are 4 bytes where 1000000 were expected",
        ),
        (
            "none.mha",
            mha("0 4 4", "", b""),
            "none.mha: header: a volume of 0 × 4 × 4 samples holds none",
        ),
        (
            "bomb.mha",
            mha("1 1 1", "CompressedData = True\n", &zlib(&[7; 1 << 20])),
            "volume [1, 1, 1] [7.0, 7.0]",
        ),
        (
            "lie.mha",
            mha("100 100 100", "CompressedData = True\n", &zlib(&[7; 1000])),
            "lie.mha: data: unpacks to 1000 bytes where 1000000 were expected",
        ),
        (
            "mode.mrc",
            mrc([1, 1, 1], 99, &[0]),
            "mode.mrc: header, mode: is 99, but 0, 1, 2, 3, 4, 6, 12, 16 or 101 was expected",
        ),
        (
            "size.mrc",
            mrc([1000, 1000, 1000], 0, &[0]),
            "size.mrc: data: there are 1 bytes where 1000000000 were expected",
        ),
        (
            "one.tif",
            tiff(1),
            "one.tif: pages: there is one page of 2 × 1 pixels: this is a picture, or one slice of \
             a volume",
        ),
        (
            "flat.h5",
            hdf5(&[2, 2]),
            "flat.h5: file: has no numbers of three dimensions; it has “v”, u8 (2, 2)",
        ),
        // NRRD.
        (
            "size.nrrd",
            nrrd("4294967296 4294967296 4294967296", "encoding: raw", b""),
            "size.nrrd: header: 4294967296 × 4294967296 × 4294967296 samples are more than memory \
             can hold",
        ),
        (
            "large.nrrd",
            nrrd("1000 1000 1000", "encoding: raw", b"1234"),
            "large.nrrd: data: there are 4 bytes where 1000000000 were expected",
        ),
        (
            "none.nrrd",
            nrrd("0 4 4", "encoding: raw", b""),
            "none.nrrd: header: a volume of 0 × 4 × 4 samples holds none",
        ),
        (
            "minus.nrrd",
            nrrd("-4 4 4", "encoding: raw", b""),
            "minus.nrrd: sizes: “-4 4 4” is not a list of 3 numbers",
        ),
        (
            "four.nrrd",
            nrrd("4 4 4 4", "encoding: raw", b""),
            "four.nrrd: sizes: “4 4 4 4” is not a list of 3 numbers",
        ),
        (
            "lie.nrrd",
            nrrd("1000 1000 1000", "encoding: gzip", &gzip(&[0; 1000])),
            "lie.nrrd: data: unpacks to 1000 bytes where 1000000000 were expected",
        ),
        (
            "bomb.nrrd",
            nrrd("1 1 1", "encoding: gzip", &gzip(&vec![0; 1 << 24])),
            "bomb.nrrd: data: unpacks to too many bytes where 1 were expected",
        ),
        (
            "notgzip.nrrd",
            nrrd("1 1 1", "encoding: gzip", b"not packed"),
            "notgzip.nrrd: data: cannot be unpacked after 0 bytes: invalid gzip header",
        ),
        (
            "bzip.nrrd",
            nrrd("1 1 1", "encoding: bzip2", b""),
            "bzip.nrrd: encoding: “bzip2” is not supported",
        ),
        ("same.nrrd", nrrd("2 2 1", "encoding: raw", &[7; 4]), "volume [2, 2, 1] [7.0, 7.0]"),
        (
            "spacing.nrrd",
            nrrd("2 2 1", "spacings: 0 1 1\nencoding: raw", &[7; 4]),
            "spacing.nrrd: header: the spacing is 0 × 1 × 1, but every step needs a length",
        ),
        (
            "origin.nrrd",
            nrrd("2 2 1", "space origin: (nan,0,0)\nencoding: raw", &[7; 4]),
            "origin.nrrd: header: the origin and the steps between samples must be finite",
        ),
        (
            "skip.nrrd",
            nrrd("2 2 1", "byte skip: 99\nencoding: raw", &[7; 4]),
            "skip.nrrd: data: there are 0 bytes where 4 were expected",
        ),
        (
            "skips.nrrd",
            nrrd("2 2 1", "byte skip: 9223372036854775807\nencoding: gzip", &gzip(&[7; 4])),
            "skips.nrrd: the unpacked size in bytes is 9223372036854775811, over the limit of \
             34359738368",
        ),
        (
            "commas.nrrd",
            nrrd("2 2 1", "encoding: ascii", b"1,5 2,5"),
            "volume [2, 2, 1] [1.0, 5.0]",
        ),
        (
            "missing.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: missing.raw", b""),
            "missing.nhdr: data file: refers to “missing.raw”: No such file or directory (os error \
             2)",
        ),
        (
            "up.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: ../up.raw", b""),
            "up.nhdr: data file: refers to “../up.raw”, which leads out of the file's own folder",
        ),
        (
            "absolute.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: /etc/hostname", b""),
            "absolute.nhdr: data file: refers to “/etc/hostname”, an absolute path; only files in \
             the same folder or below it are read",
        ),
        (
            "drive.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: C:\\up.raw", b""),
            "drive.nhdr: data file: refers to “C:\\up.raw”, an address or a drive; only files in \
             the same folder or below it are read",
        ),
        (
            "address.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: file:///etc/hostname", b""),
            "address.nhdr: data file: refers to “file:///etc/hostname”, an address or a drive; \
             only files in the same folder or below it are read",
        ),
        (
            "self.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: self.nhdr", b""),
            "self.nhdr: data file: refers to “self.nhdr”, the file itself",
        ),
        (
            "folder.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: folder", b""),
            "folder.nhdr: data file: refers to “folder”, which is not a regular file",
        ),
        (
            "list.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: LIST 1\n../a.raw\n/etc/hostname", b""),
            "list.nhdr: data file: refers to “../a.raw”, which leads out of the file's own folder",
        ),
        (
            "pattern.nhdr",
            nrrd("2 2 1", "encoding: raw\ndata file: ../a%03d.raw 1 2 1 1", b""),
            "pattern.nhdr: data file: refers to “../a001.raw”, which leads out of the file's own \
             folder",
        ),
        // VTK.
        (
            "extent.vti",
            vtk_xml("ImageData", "", &vti_piece(""))
                .replace("0 1 0 1 0 0", "0 9223372036854775807 0 1 0 0")
                .into(),
            "extent.vti: extent: 0 to 9223372036854775807 is not a valid range of indices",
        ),
        (
            "wrap.vti",
            vtk_xml("ImageData", "", &vti_piece(""))
                .replace("0 1 0 1 0 0", "-9223372036854775808 9223372036854775807 0 1 0 0")
                .into(),
            "wrap.vti: extent: -9223372036854775808 to 9223372036854775807 is not a valid range of \
             indices",
        ),
        (
            "backwards.vti",
            vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", "1")))
                .replace("0 1 0 1 0 0", "1 0 0 1 0 0")
                .into(),
            "backwards.vti: extent: 1 to 0 is not a valid range of indices",
        ),
        (
            "large.vti",
            vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", "1")))
                .replace("0 1 0 1 0 0", "0 999 0 999 0 999")
                .into(),
            "large.vti: DataArray “v”: there are 1 numbers where 1000000000 were expected",
        ),
        (
            "fewer.vti",
            vti("1 2 3"),
            "fewer.vti: DataArray “v”: there are 3 numbers where 4 were expected",
        ),
        (
            "more.vti",
            vti("1 2 3 4 5"),
            "more.vti: DataArray “v”: there are more than the 4 numbers expected",
        ),
        (
            "words.vti",
            vti("1 2 three 4"),
            "words.vti: DataArray “v”: number 2 is “three”, which is not a valid u8",
        ),
        ("comma.vti", vti("1,5 2,5"), "volume [2, 2, 1] [1.0, 5.0]"),
        (
            "count.vti",
            binary("", &counts(&[u32::MAX, 1])),
            "count.vti: DataArray “v”: claims 4294967295 bytes where 4 were expected",
        ),
        (
            "blocks.vti",
            binary(" compressor='vtkZLibDataCompressor'", &counts(&[u32::MAX, 4, 4])),
            "blocks.vti: DataArray “v”: claims 4294967295 blocks of 4 bytes, the last of 4, where \
             4 bytes were expected",
        ),
        (
            "lie.vti",
            binary(" compressor='vtkZLibDataCompressor'", &counts(&[1, 4, 0, u32::MAX])),
            "lie.vti: DataArray “v”: block 0 claims 4294967295 bytes, but 0 are left",
        ),
        (
            "bomb.vti",
            binary(" compressor='vtkZLibDataCompressor'", &{
                let b = zlib(&vec![0; 1 << 24]);
                [counts(&[1, 4, 0, b.len() as u32]), b].concat()
            }),
            "bomb.vti: DataArray “v”: block 0 unpacks to more than its 4 bytes",
        ),
        (
            "base64.vti",
            vtk_xml("ImageData", "", &vti_piece(&array("format='binary'", "????"))).into(),
            "base64.vti: DataArray “v”: is not valid base64 (after 3 bytes): Invalid symbol 63, \
             offset 0.",
        ),
        (
            "laughs.vti",
            format!("{laughs}{}", String::from_utf8_lossy(&vti("&l29;"))).into(),
            "laughs.vti: DataArray “v”: there are 0 numbers where 4 were expected",
        ),
        (
            "laughname.vti",
            format!(
                "{laughs}{}",
                String::from_utf8_lossy(&vti("1 2 3 4")).replace("Name='v'", "Name='&l29;'")
            )
            .into(),
            "laughname.vti: byte 1998: has an invalid attribute: at 1..4: unrecognized entity \
             `l29`",
        ),
        (
            "deep.vti",
            vtk_xml("ImageData", "", &format!("{}{}", "<a>".repeat(100), "</a>".repeat(100)))
                .into(),
            "deep.vti: byte 296: the nesting depth is 65, over the limit of 64",
        ),
        (
            "lz4.vti",
            binary(" compressor='vtkLZ4DataCompressor'", &[]),
            "lz4.vti: DataArray “v”: ends inside the sizes of its blocks",
        ),
        (
            "other.vti",
            binary(" compressor='vtkOtherDataCompressor'", &[]),
            "other.vti: VTKFile: compressor=“vtkOtherDataCompressor” is not supported",
        ),
        (
            "lzma.vti",
            binary(" compressor='vtkLZMADataCompressor'", &counts(&[1, 4, 0, 4, 7])),
            "lzma.vti: DataArray “v”: block 0 cannot be unpacked: failed to fill whole buffer",
        ),
        (
            "ids.vti",
            vtk_xml("ImageData", "", &vti_piece("").replace("</Po", &format!("{}</Po", {
                array("format='ascii'", "1 2 3 4").replace("Name='v'", "Name='PointIds'")
            })))
            .into(),
            "ids.vti: file: contains only identifiers and values that are not numbers",
        ),
        (
            "above.pvti",
            vtk_xml("PImageData", "", "<Piece Extent='0 1 0 1 0 0' Source='../a.vti'/>").into(),
            "above.pvti: reference: refers to “../a.vti”, which leads out of the file's own folder",
        ),
        (
            "none.vtm",
            vtk_xml("vtkMultiBlockDataSet", "", "<DataSet index='0'/>").into(),
            "none.vtm: XML: refers to no files with data",
        ),
        (
            "table.vtu",
            vtk_xml("Table", "", "<Piece NumberOfRows='1'/>").into(),
            "table.vtu: VTKFile: type=“Table” is not supported",
        ),
        (
            "corner.vtu",
            vtu("0 1 3").into(),
            "corner.vtu: Cells: a cell refers to point 3, but there are 3 points",
        ),
        (
            "minus.vtu",
            vtu("0 1 -1").into(),
            "minus.vtu: Cells: a cell refers to point -1, but there are 3 points",
        ),
        (
            "points.vtu",
            vtu("0 1 2")
                .replace("NumberOfPoints='3'", "NumberOfPoints='18446744073709551615'")
                .into(),
            "points.vtu: the number of points is 18446744073709551615, over the limit of \
             2147483648",
        ),
        (
            "cells.vtu",
            vtu("0 1 2").replace("NumberOfCells='1'", "NumberOfCells='4000000000'").into(),
            "cells.vtu: the number of cells is 4000000000, over the limit of 2147483648",
        ),
        (
            "count.vtk",
            vtk().replace("POINT_DATA 4", "POINT_DATA 18446744073709551615").into(),
            "count.vtk: a count of points or cells is 18446744073709551615, over the limit of \
             2147483648",
        ),
        (
            "million.vtk",
            vtk().replace("POINT_DATA 4", "POINT_DATA 1000000").into(),
            "million.vtk: byte 128: there are 4 numbers where 1000000 were expected: the file ends",
        ),
        (
            "twice.vtk",
            "# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 2 float\n\
             0 0 0 1 0 0\nCELLS 1 3\n2 0 1\nPOINTS 1 float\n0 0 0\nCELL_DATA 1\nSCALARS c float\n\
             LOOKUP_TABLE d\n5\n"
                .into(),
            "twice.vtk: byte 104: POINTS are given twice",
        ),
        (
            "dims.vtk",
            vtk().replace("DIMENSIONS 2 2 1", "DIMENSIONS 4294967296 4294967296 4294967296").into(),
            "dims.vtk: the number of points is 18446744073709551615, over the limit of 34359738368",
        ),
        (
            "minus.vtk",
            vtk().replace("DIMENSIONS 2 2 1", "DIMENSIONS -2 2 1").into(),
            "minus.vtk: extent: 0 to -3 is not a valid range of indices",
        ),
        (
            "spacing.vtk",
            vtk().replace("SPACING 1 1 1", "SPACING 0 1 1").into(),
            "spacing.vtk: ImageData: the spacing is 0 × 1 × 1, but every step needs a length",
        ),
        ("crlf.vtk", vtk().replace('\n', "\r\n").into(), "volume [2, 2, 1] [1.0, 4.0]"),
        // Raw volumes of 4 × 4 × 4 bytes.
        (
            "short.raw",
            vec![1; 63],
            "short.raw: size: has 63 bytes after the header, but 4 × 4 × 4 samples of type u8 need \
             64",
        ),
        (
            "long.raw",
            vec![1; 125],
            "long.raw: size: has 125 bytes after the header, but 4 × 4 × 4 samples of type u8 need \
             64",
        ),
        ("same.raw", vec![7; 64], "volume [4, 4, 4] [7.0, 7.0]"),
        (
            "bomb.gz",
            gzip(&vec![0; 1 << 24]),
            "bomb.gz: gzip stream: unpacks to too many bytes where 64 were expected",
        ),
        // Hierarchies and bricks.
        (
            "future.splk",
            at(splk(true), 8, &99u32.to_le_bytes()),
            "future.splk: header: has version 99; version 3 can be read",
        ),
        (
            "future.splv",
            at(bricks(), 8, &99u32.to_le_bytes()),
            "future.splv: header: has version 99; version 2 can be read",
        ),
        (
            "tail.splk",
            [splk(true), vec![0]].concat(),
            "tail.splk: byte 569: the file has 1 bytes after its end",
        ),
        (
            "tail.splv",
            [bricks(), vec![0]].concat(),
            "tail.splv: byte 501: 1 bytes follow the end",
        ),
        // Hierarchies and bricks with correct checksums.
        (
            "bomb.splk",
            crafted::page_of_zeros(64 << 20),
            "bomb.splk: page 0 (byte 237): it cannot be unpacked: Destination buffer is too small: \
             67108864 bytes needed, 960 given",
        ),
        (
            "shortpage.splk",
            crafted::page_of_zeros(8),
            "shortpage.splk: page 0 (byte 237): it unpacks to 8 bytes where 960 were expected",
        ),
        (
            "code.splk",
            crafted::page_of_code(7),
            "code.splk: page 0 (byte 237): it has the unknown code 7",
        ),
        (
            "nanpage.splk",
            crafted::with_node_bytes(0, &f32::NAN.to_le_bytes()),
            "nanpage.splk: page 0 (byte 237): its node 0 has a value that is not finite",
        ),
        (
            "infradius.splk",
            crafted::with_node_bytes(60, &f32::INFINITY.to_le_bytes()),
            "infradius.splk: page 0 (byte 237): its node 0 has a value that is not finite",
        ),
        (
            "cycle.splk",
            crafted::with_node_bytes(72, &0u32.to_le_bytes()),
            "cycle.splk: page 0 (byte 237): the children of its node 0 begin at 0, not at 1",
        ),
        (
            "beyond.splk",
            crafted::with_node_bytes(72, &u32::MAX.to_le_bytes()),
            "beyond.splk: page 0 (byte 237): the children of its node 0 begin at 4294967295, not \
             at 1",
        ),
        (
            "children.splk",
            crafted::with_node_bytes(76, &u32::MAX.to_le_bytes()),
            "children.splk: page 0 (byte 237): its node 0 has 4294967295 children; at most 8 are \
             allowed",
        ),
        (
            "swapped.splk",
            crafted::swapped(false),
            "swapped.splk: page 12 (byte 254583): its checksum does not match",
        ),
        (
            "swappedtold.splk",
            crafted::swapped(true),
            "swappedtold.splk: page 12 (byte 254583): it unpacks to 48880 bytes where 81840 were \
             expected",
        ),
        (
            "far.splk",
            crafted::far_page(),
            "far.splk: directory: page 0: it begins at byte 4294967533 and has 300 bytes, but the \
             pages are from byte 237 to 537",
        ),
        (
            "bomb.splv",
            crafted::brick_of_zeros(64 << 20),
            "bomb.splv: level 0, brick 1 (byte 444): it cannot be unpacked: Destination buffer is \
             too small: 67108864 bytes needed, 33792 given",
        ),
        (
            "shortbrick.splv",
            crafted::brick_of_zeros(8),
            "shortbrick.splv: level 0, brick 1 (byte 444): it has 8 bytes where 33792 were \
             expected",
        ),
        (
            "manybricks.splv",
            crafted::with_dims([1 << 60, 1 << 60, 1 << 60]),
            "manybricks.splv: header: 1152921504606846976 × 1152921504606846976 × \
             1152921504606846976 samples are more than memory can hold",
        ),
        (
            "endless.splv",
            crafted::with_dims([1 << 36, 1, 1]),
            "endless.splv: directory: the file is too short for the 4294967295 bricks of its \
             header",
        ),
        (
            "foreign.splk",
            b"PK\x03\x04 and so on".to_vec(),
            "foreign.splk: header: is not a hierarchy of splats",
        ),
        (
            "foreign.splv",
            b"PK\x03\x04 and so on".to_vec(),
            "foreign.splv: header: is not a volume in bricks",
        ),
        // Transfer functions.
        (
            "clear.json",
            br#"{"color": [[0, 1, 1, 1]], "opacity": [[0, 0]]}"#.to_vec(),
            "clear.json: transfer function: a transfer function without opacity shows nothing: \
             every opacity is 0",
        ),
        (
            "missing.json",
            br#"{"color": [[0, 1, 1, 1]]}"#.to_vec(),
            "missing.json: transfer function: missing field `opacity` at line 1 column 25",
        ),
        (
            "none.json",
            br#"{"color": [], "opacity": []}"#.to_vec(),
            "none.json: transfer function: there are no color points",
        ),
        (
            "lists.json",
            lists(100_000).into(),
            "lists.json: transfer function: invalid type: sequence, expected f64 at line 1 column \
             3",
        ),
        (
            "colors.json",
            format!(r#"{{"color": {}"#, lists(100_000)).into(),
            "colors.json: transfer function: invalid type: sequence, expected f64 at line 1 column \
             12",
        ),
        (
            "huge.json",
            br#"{"color": [[1e999, 1, 1, 1]], "opacity": [[0, 1]]}"#.to_vec(),
            "huge.json: transfer function: number out of range at line 1 column 17",
        ),
        ("latin.json", b"{\"color\": \"\xe9\"}".to_vec(), "latin.json: byte 11: is not UTF-8 text"),
        (
            "long.json",
            vec![b' '; 2 << 20],
            "long.json: file: has 2097152 bytes, but a transfer function may have at most 1048576",
        ),
        // Trained Gaussians.
        (
            "scale.ply",
            trainer("opacity scale_0 rot_0 rot_1 rot_2 rot_3 f_dc_0"),
            "scale.ply: header: the element “vertex” has no scalar property “scale_1”",
        ),
        (
            "rest.ply",
            trainer(
                "opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 f_dc_0 f_dc_1 f_dc_2 \
                 f_rest_0",
            ),
            "rest.ply: header: the element “vertex” has 1 properties “f_rest_…”, but only 0, 9, 24 \
             or 45 can be read, for harmonics of degree 0 to 3",
        ),
        (
            "chunks.ply",
            ply(
                "element chunk 2\nproperty float min_x\nelement vertex 1\nproperty uint \
                 packed_position\n",
                "0\n0\n0\n",
            ),
            "chunks.ply: header: the element “chunk” has 2 rows, but 1 Gaussians need 1",
        ),
        ("empty.splat", Vec::new(), "empty.splat: file: is empty"),
        (
            "short.splat",
            vec![0; 40],
            "short.splat: byte 32: the file ends after 8 of the 32 bytes of Gaussian 1",
        ),
        (
            "nan.splat",
            vec![255; 32],
            "nan.splat: file: none of the 1 Gaussians has finite numbers and a rotation",
        ),
        (
            "version.spz",
            spz(9, 1, 0, 16),
            "version.spz: header: has the version 9, but the versions 1 to 4 are read",
        ),
        (
            "degree.spz",
            spz(2, 1, 4, 99),
            "degree.spz: header: has harmonics of the degree 4, but at most 3 is drawn",
        ),
        (
            "count.spz",
            spz(2, u32::MAX, 3, 99),
            "count.spz: the number of Gaussians is 4294967295, over the limit of 2147483648",
        ),
        (
            "many.spz",
            spz(2, 1 << 24, 0, 20),
            "many.spz: positions: unpacks to 20 bytes where 150994944 were expected",
        ),
        (
            "spz.bin",
            written(|path| splatkit::formats::spz::write(&trained(), path)),
            "Gaussians 2 of degree 1",
        ),
        (
            "version.sog",
            br#"{"version": 3}"#.to_vec(),
            "version.sog: meta.json: has the version 3, but only 1 and 2 are supported",
        ),
        (
            "streamed.sog",
            br#"{"lodLevels": 2}"#.to_vec(),
            "streamed.sog: file: is the index of a streamed SOG scene (lod-meta.json), which is \
             not supported",
        ),
        (
            "kernel.gltf",
            br#"{"asset": {"version": "2.0"}, "extensionsUsed": ["KHR_gaussian_splatting"],
                "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": [
                {"attributes": {"POSITION": 0}, "mode": 0,
                "extensions": {"KHR_gaussian_splatting": {"kernel": "cube"}}}]}],
                "accessors": [{"componentType": 5126, "count": 1, "type": "VEC3"}]}"#
                .to_vec(),
            "kernel.gltf: mesh 0, primitive 0: the kernel “cube” is not supported, only “ellipse”",
        ),
        // NIfTI.
        (
            "analyze.nii",
            medical::nifti(|header| header[344..].fill(0)),
            "analyze.nii: pair: refers to “analyze.img”: No such file or directory (os error 2)",
        ),
        (
            "axes.nii",
            medical::nifti(|header| header[40] = 9),
            "axes.nii: header, dim[0]: the number of axes is 9, but 1 to 7 are possible",
        ),
        (
            "huge.nii",
            medical::nifti(|header| header[42..48].copy_from_slice(&[255, 127].repeat(3))),
            "huge.nii: the size of the samples in bytes is 35181150961663, over the limit of \
             34359738368",
        ),
        (
            "bits.nii",
            medical::nifti(|header| header[70] = 1),
            "bits.nii: header, datatype: 1 (bits) is not a type that can be read",
        ),
        (
            "bomb.nii.gz",
            gzip(&[medical::nifti(|_| {}), vec![0; 1 << 24]].concat()),
            "volume [2, 2, 1] [1.0, 4.0]",
        ),
        ("named.bin", medical::nifti(|_| {}), "volume [2, 2, 1] [1.0, 4.0]"),
        // DICOM.
        (
            "foreign.dcm",
            b"hello".to_vec(),
            "foreign.dcm: header: is not DICOM: it has no “DICM” at byte 128, and does not begin \
             with an element of group 0008",
        ),
        (
            "video.dcm",
            medical::dicom(".4.102", &[1, 2, 3, 4]),
            "video.dcm: pixel data: the pixels are packed by MPEG-4 AVC (transfer syntax \
             1.2.840.10008.1.2.4.102), which is not read",
        ),
        (
            "few.dcm",
            medical::dicom(".1", &[1, 2]),
            "few.dcm: pixel data: a frame of 2 × 2 pixels needs 4 bytes, but the pixels of all \
             frames have 2",
        ),
        (
            "typeless.dcm",
            [medical::dicom(".1", &[1, 2, 3, 4]), vec![0; 512]].concat(),
            "volume [2, 2, 1] [1.0, 4.0]",
        ),
        ("dicom.bin", medical::dicom(".1", &[1, 2, 3, 4]), "volume [2, 2, 1] [1.0, 4.0]"),
        // Files of no format.
        ("nothing.bin", Vec::new(), "nothing.bin: file: is of no kind"),
        ("zeros.bin", vec![0; 4096], "zeros.bin: file: is of no kind"),
        ("text.bin", b"hello".to_vec(), "text.bin: file: is of no kind"),
    ]
}
