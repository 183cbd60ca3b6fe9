// Part of ../cases.rs.
vec![
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
]
