// Part of ../cases.rs.
vec![
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
]
