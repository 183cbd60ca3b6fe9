//! `splatkit convert --plan`, `--part` and `--join`.

use crate::common::*;
use std::process::{Command, Stdio};

/// A binary PLY file of points on a bumpy sphere.
fn points(count: u32) -> Vec<u8> {
    let mut out = format!("ply\nformat binary_little_endian 1.0\nelement vertex {count}\n");
    ["x", "y", "z"].iter().for_each(|axis| out += &format!("property float {axis}\n"));
    let mut out = (out + "end_header\n").into_bytes();
    for i in 0..count {
        let z = (i as f32 + 0.5) / count as f32 * 2.0 - 1.0;
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let radius = (1.0 - z * z).sqrt();
        let bump = 1.0 + 0.05 * (9.0 * z).sin();
        let place = [radius * cos * bump, radius * sin * bump, z * bump];
        place.iter().for_each(|value| out.extend(value.to_le_bytes()));
    }
    out
}

fn same(folder: &Folder, a: &str, b: &str) -> bool {
    let [a, b] = [a, b].map(|name| std::fs::read(folder.path(name)).unwrap());
    a == b
}

#[test]
fn parts_are_planned_made_and_joined() {
    let folder = Folder::new();
    folder.put("cloud.ply", points(9000));
    folder.put("mesh.ply", sheet(90));
    for input in ["cloud.ply", "mesh.ply"] {
        folder.run(&format!("convert {input} -o one.splk --parts 3 --overwrite")).ok();
        let plan = folder.json(&format!(
            "convert {input} -o all.splk --plan parts --parts 3 --overwrite --json"
        ));
        assert_eq!(
            (plan["parts"].as_u64(), plan["points"].as_u64()),
            (Some(3), Some(if input == "cloud.ply" { 9000 } else { 8100 }))
        );
        let mut points = 0;
        for index in [2, 0, 1] {
            let part = format!("convert --part parts/plan.json --index {index} --json");
            let made = folder.json(&part);
            assert_eq!(made["was_finished"].as_bool(), Some(false), "{made}");
            points += made["points"].as_u64().unwrap();
            assert_eq!(folder.json(&part)["was_finished"].as_bool(), Some(true));
        }
        assert_eq!(Some(points), plan["points"].as_u64());
        let run = folder.run("convert --part parts/plan.json --index 1").ok();
        assert!(
            String::from_utf8_lossy(&run.stdout).contains("part 1 of 3 is finished and intact")
        );
        folder.run("convert --join parts/plan.json -o all.splk --overwrite").ok();
        assert!(same(&folder, "one.splk", "all.splk"), "{input}");
        folder.run("check all.splk").ok();
    }
}

#[test]
fn what_is_wrong_names_what_to_do() {
    let folder = Folder::new();
    folder.put("cloud.ply", points(5000));
    folder.put("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.run("convert cloud.ply --plan parts --parts 2").ok();
    folder.run("convert cloud.ply --plan parts --parts 2").fails(1, &["exists already"]);
    folder.run("convert --join parts/plan.json -o out.splk").fails(
        3,
        &[
            "part 0 of 2: is missing, and 1 more",
            "splatkit convert --part parts/plan.json --index 0",
            "--index 1",
        ],
    );
    folder.run("convert --part parts/plan.json").fails(2, &["--index"]);
    folder.run("convert --part parts/plan.json --index 2").fails(2, &["numbered from 0"]);
    folder
        .run("convert --part parts/plan.json --index 0 --preset best")
        .fails(2, &["--preset has no effect with --part", "give it with --plan"]);
    folder.run("convert --part none/plan.json --index 0").fails(3, &["none/plan.json"]);
    folder.run("convert cloud.ply -o a.ply --plan more").fails(2, &["--plan is for .splk files"]);
    folder
        .run("convert mesh.obj --plan more")
        .fails(2, &["mesh.obj: only binary PLY", "are converted in parts"]);
    folder.run("convert --join parts/plan.json -o parts/plan.json").fails(2, &["plan.json"]);
    folder.put("cloud.ply", points(5001));
    folder
        .run("convert --part parts/plan.json --index 0")
        .fails(3, &["cloud.ply", "when the plan was made", "make the plan again"]);
    assert!(!folder.path("out.splk").exists() && !folder.path("more").exists());
}

/// A worker is killed at different moments. What it leaves is not taken for a part, and the next
/// one makes the same bytes.
#[cfg(unix)]
#[test]
fn killed_workers_cost_their_part_alone() {
    let folder = Folder::new();
    folder.put("cloud.ply", points(20_000));
    folder.run("convert cloud.ply -o one.splk --parts 3").ok();
    folder.run("convert cloud.ply --plan parts --parts 3").ok();
    let part = |index: u32| {
        ["convert", "--part", "parts/plan.json", "--index"]
            .map(str::to_owned)
            .into_iter()
            .chain([index.to_string()])
            .collect::<Vec<_>>()
    };
    folder.run_with(&part(0)).ok();
    let mut killed = 0;
    for step in 0..8 {
        let mut worker = folder.command();
        worker.args(part(1)).stdout(Stdio::null()).stderr(Stdio::null());
        let mut worker = worker.spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(20 * step));
        worker.kill().unwrap();
        killed += u32::from(!worker.wait().unwrap().success());
    }
    assert!(killed > 0);
    folder.run_with(&part(1)).ok();
    folder.run_with(&part(2)).ok();
    folder.run("convert --join parts/plan.json -o all.splk").ok();
    assert!(same(&folder, "one.splk", "all.splk"));
    let names = std::fs::read_dir(folder.path("parts")).unwrap();
    let names: Vec<String> =
        names.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    assert!(names.iter().all(|name| !name.starts_with('.')), "{names:?}");
}

/// Several tiles: a part opens only those that it needs.
#[test]
fn parts_do_not_open_other_tiles() {
    let folder = Folder::new();
    let names: Vec<String> = (0..4).map(|tile| format!("tile-{tile}.ply")).collect();
    for name in &names {
        folder.put(name, points(4000));
    }
    let files = names.join(" ");
    folder.run(&format!("convert {files} -o one.splk --parts 4")).ok();
    folder.run(&format!("convert {files} --plan parts --parts 4")).ok();
    for index in 0..4 {
        for (other, name) in names.iter().enumerate().filter(|(other, _)| *other != index) {
            std::fs::rename(folder.path(name), folder.path(format!("away-{other}"))).unwrap();
        }
        folder.run(&format!("convert --part parts/plan.json --index {index}")).ok();
        for (other, name) in names.iter().enumerate().filter(|(other, _)| *other != index) {
            std::fs::rename(folder.path(format!("away-{other}")), folder.path(name)).unwrap();
        }
    }
    folder.run("convert --join parts/plan.json -o all.splk").ok();
    assert!(same(&folder, "one.splk", "all.splk"));
}

/// Returns a shell in the folder that finds the command, and what is in the folder, by name.
#[cfg(unix)]
fn shell(folder: &Folder) -> Command {
    let command = std::path::Path::new(env!("CARGO_BIN_EXE_splatkit")).parent().unwrap();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = [folder.path(""), command.to_owned()].into_iter();
    let path = std::env::join_paths(folders.chain(std::env::split_paths(&path))).unwrap();
    let mut shell = Command::new("sh");
    shell.current_dir(folder.path("")).env("PATH", path);
    shell
}

#[cfg(unix)]
fn example(name: &str) -> String {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/scale/");
    std::fs::read_to_string(format!("{folder}{name}")).unwrap()
}

/// The script for Slurm, with a stand-in that runs what is submitted at once.
#[cfg(unix)]
#[test]
fn slurm_arrays_convert_in_parts() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    folder.put("a b.ply", points(6000));
    folder.put("slurm.sh", example("slurm.sh"));
    let stand_in = "#!/bin/sh\nset -e\narray=none\nwhile [ $# -gt 0 ]; do case $1 in\n\
        --array=*) array=${1#--array=};;\n--wrap) shift; wrap=$1;;\n\
        --dependency=afterok:7) ran=yes;;\n--dependency=*) exit 9;;\nesac; shift; done\n\
        if [ $array = none ]; then sh -c \"$wrap\"; exit; fi\n\
        i=${array%-*}; while [ $i -le ${array#*-} ]; do\n\
        SLURM_ARRAY_TASK_ID=$i sh -c \"$wrap\" >&2; i=$((i + 1)); done; echo 7\n";
    folder.put("sbatch", stand_in);
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(folder.path("sbatch"), executable).unwrap();
    let done = shell(&folder).args(["slurm.sh", "all.splk", "3", "a b.ply"]).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    folder.run_with(&["convert", "a b.ply", "-o", "one.splk", "--parts", "3"]).ok();
    assert!(same(&folder, "one.splk", "all.splk"));
}

/// The commands of the jobs for Kubernetes, one after the other.
#[cfg(unix)]
#[test]
fn kubernetes_jobs_convert_in_parts() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("tiles")).unwrap();
    folder.put("tiles/a.ply", points(6000));
    let jobs = example("kubernetes.yaml").replace("/data", ".").replace("--parts 64", "--parts 3");
    let commands: Vec<&str> =
        jobs.lines().filter_map(|line| line.trim().strip_prefix("- splatkit ")).collect();
    assert_eq!(commands.len(), 3);
    for command in commands {
        let indices = if command.contains("--part ") { 0..3 } else { 0..1 };
        for index in indices {
            let mut shell = shell(&folder);
            shell.env("JOB_COMPLETION_INDEX", index.to_string());
            let done = shell.args(["-ec", &format!("splatkit {command}")]).output().unwrap();
            assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        }
    }
    folder.run("convert tiles/a.ply -o one.splk --parts 3").ok();
    assert!(same(&folder, "one.splk", "scan.splk"));
}
