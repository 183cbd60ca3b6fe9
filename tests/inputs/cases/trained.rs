// Part of ../cases.rs.
vec![
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
        "empty.ksplat",
        Vec::new(),
        "empty.ksplat: byte 0: the file ends inside its header of 4096 bytes",
    ),
    (
        "version.ksplat",
        vec![1; 4096],
        "version.ksplat: header: has the version 1.1, but only 0.1 is read",
    ),
    (
        "sections.ksplat",
        [&[0, 1, 0, 0, 9, 0, 0, 0][..], &[1; 12], &[0; 5000]].concat(),
        "sections.ksplat: header: counts 9 sections, whose headers end at byte 13312, but the file \
         has 5020 bytes",
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
        "streamed.sog: lod-meta.json: missing field `filenames` at line 1 column 16",
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
]
