{
    let vertices = |count: &str, rows: &str| ply(&format!("element vertex {count}\n{FLOATS}"), rows);
    let faces = |list: &str, rows: &str| {
        let head = format!("element vertex 3\n{FLOATS}element face 1\nproperty list {list} vertex_indices\n");
        ply(&head, &format!("0 0 0\n1 0 0\n0 1 0\n{rows}"))
    };
    let after_header = |text: &str, insert: &str| -> Vec<u8> {
        String::from_utf8_lossy(&vertices("1", "1 2 3\n")).replacen(text, insert, 1).into_bytes()
    };
    let obj = |text: &str| -> Vec<u8> { format!("{text}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").into_bytes() };
    let buffer = |uri: &str| -> Vec<u8> { gltf_with(uri, r#"{"mesh":0}"#).into_bytes() };
    let scene = |nodes: &str| -> Vec<u8> { gltf().replace(r#""nodes":[{"mesh":0}]"#, &format!(r#""nodes":[{nodes}]"#)).into_bytes() };
    let changed = |from: &str, to: &str| -> Vec<u8> { assert!(gltf().contains(from)); gltf().replacen(from, to, 1).into_bytes() };
    let at = |mut bytes: Vec<u8>, place: usize, new: &[u8]| -> Vec<u8> { bytes[place..place + new.len()].copy_from_slice(new); bytes };
    let vti = |content: &str| -> Vec<u8> { vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", content))).into_bytes() };
    let binary = |attributes: &str, bytes: &[u8]| -> Vec<u8> {
        use ::base64::Engine;
        let text = ::base64::engine::general_purpose::STANDARD.encode(bytes);
        vtk_xml("ImageData", attributes, &vti_piece(&array("format='binary'", &text))).into_bytes()
    };
    let counts = |numbers: &[u32]| -> Vec<u8> { numbers.iter().flat_map(|n| n.to_le_bytes()).collect() };
    let chain = |count: usize| -> Vec<u8> {
        let nodes: Vec<String> = (1..count).map(|child| format!(r#"{{"children":[{child}]}}"#)).collect();
        gltf().replace(r#"{"mesh":0}"#, &format!(r#"{},{{"mesh":0}}"#, nodes.join(","))).into_bytes()
    };
    // A PNG that claims a size: only its header is true.
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
            r#""materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],"textures":[{{"source":0}}],"images":[{{"uri":"data:image/png;base64,{text}"}}],"meshes""#
        );
        gltf().replacen(r#""meshes""#, &material, 1).replacen(r#""indices":1"#, r#""indices":1,"material":0"#, 1).into_bytes()
    };
    let mut laughs = String::from("<!DOCTYPE a [<!ENTITY l0 \"ha\">");
    for level in 1..30 {
        laughs += &format!("<!ENTITY l{level} \"&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};&l{0};\">", level - 1);
    }
    laughs += "]>";
    let lists = |count: usize| "[".repeat(count);
    let bricks = || splv(&Folder::new());
    vec![
        // PLY: counts that lie.
        ("count0.ply", vertices("0", ""), "?"),
        ("count32.ply", vertices("4294967296", "1 2 3\n"), "?"),
        ("count31.ply", vertices("2147483647", "1 2 3\n"), "?"),
        ("count63.ply", vertices("18446744073709551615", "1 2 3\n"), "?"),
        ("count64.ply", vertices("18446744073709551616", "1 2 3\n"), "?"),
        ("countminus.ply", vertices("-1", "1 2 3\n"), "?"),
        ("bare.ply", ply(&format!("element nothing 40000000000\nelement vertex 1\n{FLOATS}"), "1 2 3\n"), "?"),
        ("barevertex.ply", ply("element vertex 40000000000\n", ""), "?"),
        ("bareface.ply", ply(&format!("element vertex 1\n{FLOATS}element face 40000000000\n"), "1 2 3\n"), "?"),
        ("list32.ply", faces("uint int", "4294967295 0 1 2\n"), "?"),
        ("listminus.ply", faces("int int", "-1\n"), "?"),
        ("listhalf.ply", faces("float int", "2.5 0 1 2\n"), "?"),
        ("index.ply", faces("uchar int", "3 0 1 3\n"), "?"),
        ("indexminus.ply", faces("uchar int", "3 0 1 -1\n"), "?"),
        ("columns.ply", ply(&format!("element vertex 1\n{}", "property float x\n".repeat(5000)), ""), "?"),
        ("endless.ply", format!("ply\nformat ascii 1.0\n{}", "comment\n".repeat(200_000)).into(), "?"),
        // PLY: numbers that are none.
        ("nan.ply", vertices("2", "1 2 3\n1 nan 3\n"), "?"),
        ("inf.ply", vertices("1", "1 2 inf\n"), "?"),
        ("minusinf.ply", vertices("1", "-Infinity 2 3\n"), "?"),
        ("far.ply", vertices("2", "0 0 0\n1e30 0 0\n"), "?"),
        ("comma.ply", vertices("1", "1,5 2,5 3,5\n"), "?"),
        ("words.ply", vertices("1", "one two three\n"), "?"),
        ("more.ply", vertices("1", "1 2 3 4\n"), "?"),
        ("fewer.ply", vertices("1", "1 2\n"), "?"),
        // PLY: what strict parsers refuse, and real files have.
        ("crlf.ply", String::from_utf8_lossy(&vertices("2", "1 2 3\n4 5 6\n")).replace('\n', "\r\n").into(), "?"),
        ("mac.ply", String::from_utf8_lossy(&vertices("2", "1 2 3\n4 5 6\n")).replace('\n', "\r").into(), "?"),
        ("blank.ply", vertices("2", "1 2 3\n\n\n4 5 6\n"), "?"),
        ("latin.ply", [&b"ply\nformat ascii 1.0\ncomment caf\xe9 \xff\n"[..], &after_header("ply\nformat ascii 1.0\n", "")].concat(), "?"),
        ("scalar.ply", ply(&format!("element vertex 1\n{FLOATS}property float scalar.x\n"), "1 2 3 4\n"), "?"),
        ("nannormal.ply", ply(&format!("element vertex 1\n{FLOATS}property float nx\nproperty float ny\nproperty float nz\n"), "1 2 3 nan NaN -nan\n"), "?"),
        ("double.ply", vertices("2", "4500000.001 5400000.002 100.003\n4500000.004 5400000.009 100\n"), "?"),
        ("grid.ply", ply(&format!("obj_info num_cols 2\nobj_info num_rows 1\nelement vertex 1\n{FLOATS}element range_grid 2\nproperty list uchar int vertex_indices\n"), "1 2 3\n1 0\n0\n"), "?"),
        ("one.ply", vertices("1", "1 2 3\n"), "?"),
        ("same.ply", vertices("3", "1 2 3\n1 2 3\n1 2 3\n"), "?"),
        ("flat.ply", faces("uchar int", "3 0 0 1\n"), "?"),
        ("nofaces.ply", ply(&format!("element vertex 1\n{FLOATS}element face 0\nproperty list uchar int vertex_indices\n"), "1 2 3\n"), "?"),
        ("empty.ply", Vec::new(), "?"),
        ("zeros.ply", vec![0; 100], "?"),
        // OBJ and what it refers to.
        ("zero.obj", "v 0 0 0\nf 0 1 1\n".into(), "?"),
        ("beyond.obj", "v 0 0 0\nf 1 1 2\n".into(), "?"),
        ("minus.obj", "v 0 0 0\nf 1 1 -2\n".into(), "?"),
        ("huge.obj", "v 0 0 0\nf 1 1 99999999999999999999\n".into(), "?"),
        ("nan.obj", "v 0 nan 0\nf 1 1 1\n".into(), "?"),
        ("inf.obj", "v 1 2 3\nv 0 1e999 0\nf 1 2 1\n".into(), "?"),
        ("comma.obj", "v 1,5 2,5 3,5\nf 1 1 1\n".into(), "?"),
        ("commas.obj", "v 1,5 2,5 3,5\n".into(), "?"),
        ("crlf.obj", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nf 1 2 3\r\n".into(), "?"),
        ("latin.obj", [&b"# caf\xe9\n"[..], &obj("")].concat(), "?"),
        ("flat.obj", "v 0 0 0\nf 1 1 1\n".into(), "?"),
        ("corner.obj", "v 0 0 0\nf 1\n".into(), "?"),
        ("slashes.obj", "v 0 0 0\nf //// 1 1\n".into(), "?"),
        ("none.obj", "vn 0 0 1\n".into(), "?"),
        ("up.obj", obj("mtllib ../up.mtl"), "?"),
        ("absolute.obj", obj("mtllib /etc/hostname"), "?"),
        ("address.obj", obj("mtllib file:///etc/hostname"), "?"),
        ("drive.obj", obj("mtllib C:\\up.mtl"), "?"),
        ("share.obj", obj("mtllib \\\\server\\share\\up.mtl"), "?"),
        ("back.obj", obj("mtllib ..\\..\\up.mtl"), "?"),
        ("self.obj", obj("mtllib self.obj"), "?"),
        ("folder.obj", obj("mtllib folder"), "?"),
        ("chain.obj", obj("mtllib chain.mtl\nusemtl m"), "?"),
        ("missing.obj", obj("mtllib missing.mtl"), "?"),
        // STL.
        ("count.stl", at(stl(), 80, &u32::MAX.to_le_bytes()), "?"),
        ("none.stl", stl()[..80].iter().copied().chain([0; 4]).collect(), "?"),
        ("nan.stl", at(stl(), 96, &f32::NAN.to_le_bytes()), "?"),
        ("flat.stl", at(stl(), 96, &[0; 36]), "?"),
        ("comma.stl", STL_TEXT.replace("1 0 0", "1,5 0 0").into(), "?"),
        // glTF: references.
        ("up.gltf", buffer("../up.bin"), "?"),
        ("coded.gltf", buffer("%2e%2e%2fup.bin"), "?"),
        ("bytes.gltf", buffer("%ff%fe.bin"), "?"),
        ("percent.gltf", buffer("100%.bin"), "?"),
        ("absolute.gltf", buffer("/etc/hostname"), "?"),
        ("address.gltf", buffer("file:///etc/hostname"), "?"),
        ("net.gltf", buffer("http://example.org/a.bin"), "?"),
        ("drive.gltf", buffer("C:\\\\a.bin"), "?"),
        ("share.gltf", buffer("\\\\\\\\server\\\\share\\\\a.bin"), "?"),
        ("self.gltf", buffer("self.gltf"), "?"),
        ("folder.gltf", buffer("folder"), "?"),
        ("missing.gltf", buffer("missing.bin"), "?"),
        ("zero.gltf", buffer("a%00.bin"), "?"),
        ("base64.gltf", buffer("data:;base64,????"), "?"),
        ("short.gltf", buffer("data:;base64,AAAA"), "?"),
        ("comma.gltf", buffer("data:;base64"), "?"),
        // glTF: counts and nodes.
        ("cycle.gltf", scene(r#"{"children":[1]},{"children":[0],"mesh":0}"#), "?"),
        ("self.node.gltf", scene(r#"{"children":[0],"mesh":0}"#), "?"),
        ("twice.gltf", scene(r#"{"children":[1,1]},{"mesh":0}"#), "?"),
        ("node.gltf", scene(r#"{"children":[9]}"#), "?"),
        ("mesh.gltf", scene(r#"{"mesh":9}"#), "?"),
        ("deep.gltf", chain(65), "?"),
        ("deepest.gltf", chain(64), "?"),
        ("count.gltf", changed(r#""count":3,"type":"VEC3""#, r#""count":4294967296,"type":"VEC3""#), "?"),
        ("count64.gltf", changed(r#""count":3,"type":"VEC3""#, r#""count":18446744073709551616,"type":"VEC3""#), "?"),
        ("more.gltf", changed(r#""count":3,"type":"VEC3""#, r#""count":4,"type":"VEC3""#), "?"),
        ("index.gltf", changed(r#""count":3,"type":"VEC3""#, r#""count":2,"type":"VEC3""#), "?"),
        ("nothing.gltf", changed(r#""count":3,"type":"VEC3""#, r#""count":0,"type":"VEC3""#), "?"),
        (
            "sparse.gltf",
            changed(
                r#""bufferView":0,"componentType":5126,"count":3,"type":"VEC3""#,
                r#""componentType":5126,"count":2000000000,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5123},"values":{"bufferView":0}}"#,
            ),
            "?",
        ),
        ("view.gltf", changed(r#""byteLength":36"#, r#""byteLength":99999"#), "?"),
        ("offset.gltf", changed(r#""byteOffset":36"#, r#""byteOffset":18446744073709551615"#), "?"),
        ("buffer.gltf", changed(r#""byteLength":42"#, r#""byteLength":9007199254740992"#), "?"),
        ("stride.gltf", changed(r#""byteLength":36"#, r#""byteLength":36,"byteStride":0"#), "?"),
        ("nan.gltf", scene(r#"{"mesh":0,"translation":[1e39,0,0]}"#), "?"),
        ("far.gltf", scene(r#"{"mesh":0,"scale":[1e30,1,1]}"#), "?"),
        ("lists.gltf", lists(100_000).into(), "?"),
        ("extras.gltf", changed(r#""scene":0"#, &format!(r#""scene":0,"extras":{}{}"#, lists(1000), "]".repeat(1000))), "?"),
        ("extra.gltf", changed(r#""scene":0"#, r#""scene":0,"extras":{"a":{"b":[1]}}"#), "?"),
        ("extras5.gltf", scene(r#"{"mesh":0,"extras":5}"#), "?"),
        ("draco.gltf", changed(r#""scene":0"#, r#""scene":0,"extensionsRequired":["KHR_draco_mesh_compression"]"#), "?"),
        ("chunk.glb", at(glb(), 12, &u32::MAX.to_le_bytes()), "?"),
        ("version.glb", at(glb(), 4, &[9]), "?"),
        // Pictures.
        ("png.gltf", picture(&claim), "?"),
        ("large.gltf", picture(&large), "?"),
        ("notpng.gltf", picture(b"not a picture"), "?"),
        // LAS, LAZ, E57.
        ("count.las", at(las(), 107, &u32::MAX.to_le_bytes()), "?"),
        ("million.las", at(las(), 107, &1_000_000u32.to_le_bytes()), "?"),
        ("none.las", at(las(), 107, &[0; 4]), "?"),
        ("scale.las", at(las(), 131, &f64::NAN.to_le_bytes()), "?"),
        ("flat.las", at(las(), 131, &0f64.to_le_bytes()), "?"),
        ("far.las", at(las(), 131, &1e300f64.to_le_bytes()), "?"),
        ("start.las", at(las(), 96, &u32::MAX.to_le_bytes()), "?"),
        ("size.las", at(las(), 105, &[1, 0]), "?"),
        ("format.las", at(las(), 104, &[63]), "?"),
        ("count.laz", at(laz(), 107, &1_000_000u32.to_le_bytes()), "?"),
        ("records.laz", at(laz(), 100, &u32::MAX.to_le_bytes()), "?"),
        ("laughs.e57", e57(|xml| xml.replacen("?>", &format!("?>{laughs}"), 1).replacen("file", "&l29;", 1)), "?"),
        ("count.e57", e57(|xml| xml.replace("recordCount=\"2\"", "recordCount=\"18446744073709551615\"")), "?"),
        ("more.e57", e57(|xml| xml.replace("recordCount=\"2\"", "recordCount=\"2000000000\"")), "?"),
        ("none.e57", e57(|xml| xml.replace("recordCount=\"2\"", "recordCount=\"0\"")), "?"),
        // Tables of text.
        ("comma.xyz", "1,5 2,5 3,5\n".into(), "?"),
        ("comma.csv", "x;y;z;value\n1,5;2,5;3,5;4,5\n".into(), "?"),
        ("nan.xyz", "1 2 3\n1 nan 3\n".into(), "?"),
        ("inf.xyz", "1 2 -inf\n".into(), "?"),
        ("one.xyz", "1 2 3\n".into(), "?"),
        ("same.xyz", "1 2 3\n1 2 3\n".into(), "?"),
        ("count.pts", "18446744073709551615\n1 2 3\n".into(), "?"),
        ("none.pts", "0\n".into(), "?"),
        ("wide.csv", vec!["1"; 5000].join(",").into(), "?"),
        ("mark.csv", "\u{feff}x,y,z,value\r\n1,2,3,4\r\n".into(), "?"),
        ("latin.csv", b"# caf\xe9\nx,y,z,value,n\xe9\n1,2,3,4,5\n".to_vec(), "?"),
        ("radius0.csv", "x,y,z,value,radius\n1,2,3,4,0\n".into(), "?"),
        ("radius.csv", "x,y,z,value,radius\n1,2,3,4,1e38\n".into(), "?"),
        ("radiusinf.csv", "x,y,z,value,radius\n1,2,3,4,1e39\n".into(), "?"),
        ("far.csv", "x,y,z,value\n0,0,0,1\n1e30,0,0,1\n".into(), "?"),
        ("zeros.csv", vec![0; 1000], "?"),
        // PCD.
        ("count.pcd", pcd("18446744073709551615", b"DATA binary\n"), "?"),
        ("million.pcd", pcd("1000000", b"DATA binary\n0123456789"), "?"),
        ("rows.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 4294967296\nHEIGHT 4294967296\nDATA ascii\n".to_vec(), "?"),
        ("fields.pcd", b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 18446744073709551615\nPOINTS 1\nDATA ascii\n".to_vec(), "?"),
        ("bomb.pcd", pcd("2", &[b"DATA binary_compressed\n".as_slice(), &counts(&[4, 24]), &[0, 0, 0xff, 0xff]].concat()), "?"),
        ("nan.pcd", pcd("2", b"DATA ascii\nnan nan nan\n1 2 3\n"), "?"),
        ("comma.pcd", pcd("1", b"DATA ascii\n1,5 2,5 3,5\n"), "?"),
        ("endless.pcd", "# comment\n".repeat(200_000).into(), "?"),
        // NPY.
        ("rows.npy", npy("(18446744073709551615, 4)", &[]), "?"),
        ("million.npy", npy("(1000000, 4)", &[1.0]), "?"),
        ("none.npy", npy("(0, 4)", &[]), "?"),
        ("nan.npy", npy("(1, 4)", &[f32::NAN, 2.0, 3.0, 4.0]), "?"),
        ("shape.npy", npy("((((((", &[]), "?"),
        // NRRD.
        ("size.nrrd", nrrd("4294967296 4294967296 4294967296", "encoding: raw", b""), "?"),
        ("large.nrrd", nrrd("1000 1000 1000", "encoding: raw", b"1234"), "?"),
        ("none.nrrd", nrrd("0 4 4", "encoding: raw", b""), "?"),
        ("minus.nrrd", nrrd("-4 4 4", "encoding: raw", b""), "?"),
        ("four.nrrd", nrrd("4 4 4 4", "encoding: raw", b""), "?"),
        ("lie.nrrd", nrrd("1000 1000 1000", "encoding: gzip", &gzip(&[0; 1000])), "?"),
        ("bomb.nrrd", nrrd("1 1 1", "encoding: gzip", &gzip(&vec![0; 1 << 24])), "?"),
        ("notgzip.nrrd", nrrd("1 1 1", "encoding: gzip", b"not packed"), "?"),
        ("bzip.nrrd", nrrd("1 1 1", "encoding: bzip2", b""), "?"),
        ("same.nrrd", nrrd("2 2 1", "encoding: raw", &[7; 4]), "?"),
        ("spacing.nrrd", nrrd("2 2 1", "spacings: 0 1 1\nencoding: raw", &[7; 4]), "?"),
        ("origin.nrrd", nrrd("2 2 1", "space origin: (nan,0,0)\nencoding: raw", &[7; 4]), "?"),
        ("skip.nrrd", nrrd("2 2 1", "byte skip: 99\nencoding: raw", &[7; 4]), "?"),
        ("skips.nrrd", nrrd("2 2 1", "byte skip: 9223372036854775807\nencoding: gzip", &gzip(&[7; 4])), "?"),
        ("commas.nrrd", nrrd("2 2 1", "encoding: ascii", b"1,5 2,5"), "?"),
        ("missing.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: missing.raw", b""), "?"),
        ("up.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: ../up.raw", b""), "?"),
        ("absolute.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: /etc/hostname", b""), "?"),
        ("drive.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: C:\\up.raw", b""), "?"),
        ("address.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: file:///etc/hostname", b""), "?"),
        ("self.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: self.nhdr", b""), "?"),
        ("folder.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: folder", b""), "?"),
        ("list.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: LIST\n../a.raw\n/etc/hostname", b""), "?"),
        ("pattern.nhdr", nrrd("2 2 1", "encoding: raw\ndata file: ../a%03d.raw 1 2 1", b""), "?"),
        // VTK.
        ("extent.vti", vtk_xml("ImageData", "", &vti_piece("")).replace("0 1 0 1 0 0", "0 9223372036854775807 0 1 0 0").into(), "?"),
        ("wrap.vti", vtk_xml("ImageData", "", &vti_piece("")).replace("0 1 0 1 0 0", "-9223372036854775808 9223372036854775807 0 1 0 0").into(), "?"),
        ("backwards.vti", vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", "1"))).replace("0 1 0 1 0 0", "1 0 0 1 0 0").into(), "?"),
        ("large.vti", vtk_xml("ImageData", "", &vti_piece(&array("format='ascii'", "1"))).replace("0 1 0 1 0 0", "0 999 0 999 0 999").into(), "?"),
        ("fewer.vti", vti("1 2 3"), "?"),
        ("more.vti", vti("1 2 3 4 5"), "?"),
        ("words.vti", vti("1 2 three 4"), "?"),
        ("comma.vti", vti("1,5 2,5"), "?"),
        ("count.vti", binary("", &counts(&[u32::MAX, 1])), "?"),
        ("blocks.vti", binary(" compressor='vtkZLibDataCompressor'", &counts(&[u32::MAX, 4, 4])), "?"),
        ("lie.vti", binary(" compressor='vtkZLibDataCompressor'", &counts(&[1, 4, 0, u32::MAX])), "?"),
        ("bomb.vti", binary(" compressor='vtkZLibDataCompressor'", &{ let b = zlib(&vec![0; 1 << 24]); [counts(&[1, 4, 0, b.len() as u32]), b].concat() }), "?"),
        ("base64.vti", vtk_xml("ImageData", "", &vti_piece(&array("format='binary'", "????"))).into(), "?"),
        ("laughs.vti", format!("{laughs}{}", String::from_utf8_lossy(&vti("&l29;"))).into(), "?"),
        ("laughname.vti", format!("{laughs}{}", String::from_utf8_lossy(&vti("1 2 3 4")).replace("Name='v'", "Name='&l29;'")).into(), "?"),
        ("deep.vti", vtk_xml("ImageData", "", &format!("{}{}", "<a>".repeat(100), "</a>".repeat(100))).into(), "?"),
        ("lz4.vti", binary(" compressor='vtkLZ4DataCompressor'", &[]), "?"),
        ("corner.vtu", vtu("0 1 3").into(), "?"),
        ("minus.vtu", vtu("0 1 -1").into(), "?"),
        ("points.vtu", vtu("0 1 2").replace("NumberOfPoints='3'", "NumberOfPoints='18446744073709551615'").into(), "?"),
        ("cells.vtu", vtu("0 1 2").replace("NumberOfCells='1'", "NumberOfCells='4000000000'").into(), "?"),
        ("count.vtk", vtk().replace("POINT_DATA 4", "POINT_DATA 18446744073709551615").into(), "?"),
        ("million.vtk", vtk().replace("POINT_DATA 4", "POINT_DATA 1000000").into(), "?"),
        ("dims.vtk", vtk().replace("DIMENSIONS 2 2 1", "DIMENSIONS 4294967296 4294967296 4294967296").into(), "?"),
        ("minus.vtk", vtk().replace("DIMENSIONS 2 2 1", "DIMENSIONS -2 2 1").into(), "?"),
        ("spacing.vtk", vtk().replace("SPACING 1 1 1", "SPACING 0 1 1").into(), "?"),
        ("crlf.vtk", vtk().replace('\n', "\r\n").into(), "?"),
        // Raw volumes, of 4 × 4 × 4 bytes.
        ("short.raw", vec![1; 63], "?"),
        ("long.raw", vec![1; 125], "?"),
        ("same.raw", vec![7; 64], "?"),
        ("bomb.gz", gzip(&vec![0; 1 << 24]), "?"),
        // Hierarchies and bricks.
        ("future.splk", at(splk(true), 8, &99u32.to_le_bytes()), "?"),
        ("future.splv", at(bricks(), 8, &99u32.to_le_bytes()), "?"),
        ("tail.splk", [splk(true), vec![0]].concat(), "?"),
        ("tail.splv", [bricks(), vec![0]].concat(), "?"),
        ("foreign.splk", b"PK\x03\x04 and so on".to_vec(), "?"),
        ("foreign.splv", b"PK\x03\x04 and so on".to_vec(), "?"),
        // Transfer functions.
        ("clear.json", br#"{"color": [[0, 1, 1, 1]], "opacity": [[0, 0]]}"#.to_vec(), "?"),
        ("missing.json", br#"{"color": [[0, 1, 1, 1]]}"#.to_vec(), "?"),
        ("none.json", br#"{"color": [], "opacity": []}"#.to_vec(), "?"),
        ("lists.json", lists(100_000).into(), "?"),
        ("colors.json", format!(r#"{{"color": {}"#, lists(100_000)).into(), "?"),
        ("huge.json", br#"{"color": [[1e999, 1, 1, 1]], "opacity": [[0, 1]]}"#.to_vec(), "?"),
        ("latin.json", b"{\"color\": \"\xe9\"}".to_vec(), "?"),
        ("long.json", vec![b' '; 2 << 20], "?"),
        // Nothing.
        ("nothing.bin", Vec::new(), "?"),
        ("zeros.bin", vec![0; 4096], "?"),
        ("text.bin", b"hello".to_vec(), "?"),
    ]
}
