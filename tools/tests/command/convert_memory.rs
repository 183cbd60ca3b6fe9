//! `splatkit convert --memory`.

use crate::common::*;

#[test]
fn what_is_larger_than_the_memory_is_converted_in_regions() {
    let folder = Folder::new();
    folder.put("a.ply", sheet(150));
    let whole = folder.json("convert a.ply -o whole.splk --json");
    let parts = folder.json("convert a.ply -o parts.splk --memory 8MiB --json");
    assert!(parts["regions"].as_u64().is_some_and(|regions| regions > 1), "{parts}");
    assert_eq!((&whole["splats"], &whole["closed"]), (&parts["splats"], &parts["closed"]));
    folder.run("check parts.splk").ok();
    let expected = folder.json("convert a.ply -o b.splk --memory 8MiB --dry-run --json");
    assert_eq!(expected["in_regions"].as_bool(), Some(true));
    let expected = folder.json("convert a.ply -o b.splk --dry-run --json");
    assert!(expected["expected_memory"].as_u64().is_some_and(|bytes| bytes > 1 << 20));
}

#[test]
fn what_can_only_be_read_as_a_whole_is_told() {
    let folder = Folder::new();
    folder.put("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.run("convert a.obj -o a.splk --memory 100").fails(2, &["--memory allows more"]);
    folder.run("convert a.obj -o a.splk --memory much").fails(2, &["the units are KiB"]);
    // Truncated among its faces.
    let whole = sheet(150);
    folder.put("cut.ply", &whole[..whole.len() - 100]);
    folder.run("convert cut.ply -o a.splk --memory 1MiB").fails(3, &["cut.ply", "the file ends"]);
    let mut lost = whole;
    let last = lost.len() - 1;
    lost[last] = 77;
    folder.put("lost.ply", lost);
    folder
        .run("convert lost.ply -o a.splk --memory 1MiB")
        .fails(3, &["lost.ply", "refers to vertex"]);
    assert_eq!(folder.names(), ["a.obj", "cut.ply", "lost.ply"]);
}

/// Returns `count` large triangles, one above the other, as PLY and as OBJ.
fn long(count: u32) -> (Vec<u8>, String) {
    let corners: Vec<[f32; 3]> = (0..count)
        .map(|i| i as f32 * 0.4)
        .flat_map(|z| [[0.0, 0.0, z], [100.0, 0.0, z], [0.0, 100.0, z]])
        .collect();
    let mut ply = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\n\
         property float y\nproperty float z\nelement face {count}\n\
         property list uchar int vertex_indices\nend_header\n",
        corners.len()
    )
    .into_bytes();
    ply.extend(corners.iter().flatten().flat_map(|value| value.to_le_bytes()));
    let mut obj: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    for i in 0..count {
        ply.push(3);
        ply.extend((3 * i..3 * i + 3).flat_map(u32::to_le_bytes));
        obj += &format!("f {} {} {}\n", 3 * i + 1, 3 * i + 2, 3 * i + 3);
    }
    (ply, obj)
}

/// Few triangles become many when they are subdivided. The memory for that counts, and is reported
/// before.
#[test]
fn cutting_keeps_to_the_memory() {
    let folder = Folder::new();
    let (ply, obj) = long(150);
    folder.put("a.ply", ply);
    folder.put("a.obj", obj);
    folder
        .run("convert a.obj -o a.splk --memory 40MiB")
        .fails(2, &["a.obj: this takes about", "--memory allows more"]);
    // A dry run reports the same.
    for arguments in ["--memory 40MiB", "--memory 40MiB --dry-run", "--memory 100 --dry-run --json"]
    {
        folder.run(&format!("convert a.ply -o a.splk {arguments}")).fails(
            3,
            &["a.ply: triangles: 150 of them have edges longer than", "allow more memory"],
        );
    }
    assert!(!folder.path("a.splk").exists());
}

/// An input that fits by itself need not fit beside others.
#[test]
fn inputs_keep_to_the_memory_together() {
    let folder = Folder::new();
    let (ply, obj) = long(10);
    for name in ["a", "b", "c"] {
        folder.put(&format!("{name}.ply"), &ply);
        folder.put(&format!("{name}.obj"), &obj);
    }
    let in_regions = |arguments: &str| {
        let report =
            folder.json(&format!("convert {arguments} -o a.splk --memory 260MiB --dry-run --json"));
        report["in_regions"].as_bool() == Some(true)
    };
    assert!(!in_regions("a.ply b.ply") && in_regions("a.ply b.ply c.ply"));
    folder.run("convert a.obj -o a.splk --memory 34MiB --dry-run").ok();
    folder.run("convert a.obj b.obj c.obj -o a.splk --memory 34MiB").fails(
        2,
        &["c.obj: this takes about", "MiB for the inputs before", "--memory allows more"],
    );
}

#[test]
fn volumes_keep_to_the_memory() {
    let folder = Folder::new();
    folder.put("a.nrrd", nrrd("uint8", &ball()));
    folder.run("convert a.nrrd -o packed.nrrd --memory 5000").ok();
    // The samples alone, and with the values that they are resampled from.
    folder
        .run("convert a.nrrd -o b.nrrd --memory 4000")
        .fails(2, &["a.nrrd: this takes", "--memory allows more"]);
    folder
        .run("convert a.nrrd -o b.nrrd --memory 5000 --lattice bcc")
        .fails(2, &["--memory allows more"]);
    folder.run("convert a.nrrd -o b.nrrd --memory 50000 --lattice bcc").ok();
    let packed = std::fs::metadata(folder.path("packed.nrrd")).unwrap().len();
    assert!(packed < 4000, "{packed} bytes");
    let most = packed + 100;
    folder
        .run(&format!("convert packed.nrrd -o c.nrrd --memory {most}"))
        .fails(3, &["over the limit", "--limit-bytes"]);
    folder
        .run(&format!("convert packed.nrrd -o c.splv --memory {most}"))
        .fails(3, &["over the limit", "--limit-bytes"]);
    folder
        .run("render a.nrrd -o a.png --size 32x32 --gpu-memory 1KiB")
        .fails(4, &["may be taken", "--gpu-memory"]);
}
