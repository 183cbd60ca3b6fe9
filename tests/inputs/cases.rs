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
    // Each part uses the values above.
    [
        include!("cases/ply.rs"),
        include!("cases/obj_stl.rs"),
        include!("cases/gltf.rs"),
        include!("cases/scans.rs"),
        include!("cases/volumes.rs"),
        include!("cases/vtk.rs"),
        include!("cases/hierarchies.rs"),
        include!("cases/transfer.rs"),
        include!("cases/trained.rs"),
        include!("cases/medical.rs"),
        include!("cases/other.rs"),
    ]
    .concat()
}
