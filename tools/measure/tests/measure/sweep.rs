//! The sweep.

use crate::common::*;

#[test]
fn the_sweep_compares_neighbours() {
    let folder = Folder::new();
    let page = "a\n<!-- sweep: written by `splatkit-measure sweep --write` -->\n\
        <!-- end of sweep -->\nb\n";
    folder.put("page.md", page);
    let report = folder.json(
        "sweep --engine cpu --effort quick --axes size,kernel --frames 1 --json \
         --write page.md",
    );
    let [size, kernel] = &report["axes"].as_array().unwrap()[..] else { panic!("{report}") };
    assert_eq!((size["name"].as_str(), kernel["name"].as_str()), (Some("size"), Some("kernel")));
    let steps = size["steps"].as_array().unwrap();
    assert!(steps.len() > 4 && steps[0]["beside"].is_null(), "{size}");
    for (before, step) in steps.iter().zip(&steps[1..]) {
        // Each step is compared with the one before it and has four times as many pixels.
        assert_eq!(step["beside"], before["name"]);
        let ratio = step["pixels"].as_f64().unwrap() / before["pixels"].as_f64().unwrap();
        assert!((3.0..5.0).contains(&ratio), "{step}");
        assert!(
            step["frame_ms"]["min"].as_f64() > Some(0.0) && step["beyond"].as_f64() > Some(0.0),
            "{step}"
        );
    }
    for step in &kernel["steps"].as_array().unwrap()[1..] {
        assert_eq!(step["beside"], "gaussian");
    }
    let written = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(
        written.starts_with("a\n<!--")
            && written.contains("**Kernel.**")
            && written.contains("**Cliffs.**"),
        "{written}"
    );
    folder.run("sweep --axes size a.vti").fails(2, &["unexpected argument 'a.vti'"]);
}
