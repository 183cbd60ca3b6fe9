//! The suite of cases.

use crate::common::*;
use serde_json::Value;

/// Whether a case contains everything that it should.
fn is_whole(case: &Value) -> bool {
    let numbers = [
        "effective_splats",
        "splats",
        "entries",
        "depth_passes",
        "fps",
        "splats_per_second",
        "gpu_bytes",
    ];
    let times = ["min", "median", "max"].map(|time| case["frame_ms"][time].as_f64().unwrap_or(0.0));
    let passes = case["passes"].as_array().unwrap();
    let has_pass = |name: &str| {
        passes.iter().any(|pass| pass["name"] == name && pass["ms"].as_f64() > Some(0.0))
    };
    numbers.iter().all(|name| case[*name].as_f64().is_some_and(|number| number > 0.0))
        && 0.0 < times[0]
        && times.is_sorted()
        && ["measure", "plan", "project", "bin", "order", "march"].into_iter().all(has_pass)
        && case["drawn"].as_str().unwrap().starts_with("generated: ")
}

#[test]
fn the_suite_measures_growth() {
    let folder = Folder::new();
    folder.put(
        "page.md",
        "a\n<!-- suite: written by `splatkit-measure suite --write` -->\n### other\n\nkept\n\
         <!-- end of suite -->\nb\n",
    );
    let report = folder.json(
        "suite --engine gpu --effort quick --only growth --frames 1 --repeat 2 --json \
         --write page.md",
    );
    assert!(
        !report["machine"]["adapter"].as_str().unwrap().is_empty()
            && report["machine"]["cores"].as_u64() > Some(0)
    );
    let [growth] = &report["parts"].as_array().unwrap()[..] else { panic!("{report}") };
    let cases = growth["cases"].as_array().unwrap();
    assert_eq!((growth["name"].as_str(), cases.len()), (Some("growth"), 6));
    for case in cases {
        assert!(is_whole(case), "{case}");
        assert_eq!(case["same_bytes"], true, "{case}");
        assert!(
            cfg!(not(target_os = "linux")) || case["cpu_peak_bytes"].as_u64() > Some(1 << 20),
            "{case}"
        );
    }
    let drawn: Vec<u64> = cases.iter().map(|case| case["splats"].as_u64().unwrap()).collect();
    assert!(drawn[..3].is_sorted() && drawn[3..].is_sorted_by(|a, b| a > b), "{drawn:?}");
    let slopes = growth["slopes"].as_array().unwrap();
    assert!(
        slopes.len() == 2 && slopes.iter().all(|slope| slope["power"].is_number()),
        "{slopes:?}"
    );
    let page = std::fs::read_to_string(folder.path("page.md")).unwrap();
    assert!(
        page.starts_with("a\n<!--")
            && page.ends_with("-->\nb\n")
            && page.contains("### other\n\nkept"),
        "{page}"
    );
    assert!(page.contains("| specimen, 16³ | generated: specimen, in bricks |"), "{page}");
    // Measuring another part alone would replace this one.
    folder
        .run("suite --engine gpu --effort quick --only culling --write page.md")
        .fails(2, &["--write would remove", "“growth”", "--only"]);
    assert_eq!(std::fs::read_to_string(folder.path("page.md")).unwrap(), page);
}

#[test]
fn tables_with_failed_cases_are_not_written() {
    let folder = Folder::new();
    let page =
        "<!-- suite: written by `splatkit-measure suite --write` -->\nold\n<!-- end of suite -->\n";
    folder.put("page.md", page);
    // Every case loses its device, which is reopened for the next case.
    let run = folder.run(
        "suite --engine gpu --effort quick --only growth --frames 1 \
         --gpu-timeout 0.000000001 --write page.md",
    );
    assert_eq!(run.code(), Some(1), "{}", run.stderr());
    assert!(
        run.stderr().contains("cases could not be drawn; page.md is unchanged"),
        "{}",
        run.stderr()
    );
    assert!(run.stdout().contains("not drawn: GPU:"), "{}", run.stdout());
    assert_eq!(std::fs::read_to_string(folder.path("page.md")).unwrap(), page);
}

#[test]
fn the_classic_table_takes_files() {
    let folder = Folder::new();
    folder.put("aneurism.nrrd", nrrd("uint8", &ball()));
    folder.put("foot.nrrd", "no volume");
    let run =
        folder.run("suite --engine gpu --effort quick --only seed --data . --frames 1 --json");
    assert_eq!(run.code(), Some(1), "{}", run.stderr());
    let report: Value = serde_json::from_str(&run.stdout()).unwrap();
    let cases = report["parts"][0]["cases"].as_array().unwrap();
    let case = |name: &str| cases.iter().find(|case| case["name"] == name).unwrap();
    assert_eq!(case("Aneurism")["drawn"], "aneurism.nrrd, 16×16×16");
    assert_eq!(case("Aneurism")["seed"]["fps"], 9.1);
    // A file that cannot be read is reported, and does not keep the others from being drawn.
    assert!(case("Foot, semi")["error"].as_str().unwrap().contains("foot.nrrd"));
    assert!(is_whole(case("Bonsai, BCC")));
}

#[test]
fn the_suite_takes_no_scene() {
    let folder = Folder::new();
    folder.put("a.obj", OBJ);
    for other in ["a.obj", "--size 3x3", "--azimuth 3", "--evaluate gather"] {
        folder.run(&format!("suite --effort quick {other}")).fails(2, &["unexpected argument"]);
    }
    folder.run("suite --engine cpu --gpu 0").fails(2, &["--engine cpu cannot be used with"]);
    folder.run("suite --write none.md").fails(3, &["none.md"]);
}
