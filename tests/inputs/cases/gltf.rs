// Part of ../cases.rs.
vec![
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
]
