//! Addresses in the place of files: the same output as of the local file, the flags of the cache,
//! and S3 if `moto` is installed.

#[allow(dead_code, reason = "the tests of the library use the rest")]
#[path = "../../../tests/testing/server.rs"]
mod server;

use crate::common::{self, Folder};
use server::{Fault, Server};
use std::{
    f64::consts::PI,
    process::{Command, Stdio},
};

/// A sphere of triangles, as OBJ.
fn ball() -> String {
    let (around, along) = (60, 30);
    let mut text = String::new();
    for i in 0..=along {
        for j in 0..around {
            let (a, b) = (f64::from(i) / 30.0 * PI, f64::from(j) / 30.0 * PI);
            text += &format!("v {} {} {}\n", a.sin() * b.cos(), a.sin() * b.sin(), a.cos());
        }
    }
    for i in 0..along {
        for j in 0..around {
            let at = |i: i32, j: i32| i * around + j % around + 1;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            text += &format!("f {a} {b} {c} {d}\n");
        }
    }
    text
}

const DRAWN: &str = "--engine cpu --size 64x64 -q";

#[test]
fn addresses_are_inputs() {
    let folder = Folder::new();
    folder.put("a.obj", ball());
    folder.run("convert a.obj -o a.splk").ok();
    let server = Server::of(std::fs::read(folder.path("a.splk")).unwrap());
    let address = server.address("a.splk?signature=secret");
    folder.run(&format!("render a.splk -o local.png {DRAWN}")).ok();
    let printed = folder.run(&format!("render {address} -o far.png {DRAWN} --cache kept --json"));
    let printed = printed.printed();
    assert!(!printed.contains("secret"), "{printed}");
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert!(read("local.png") == read("far.png") && folder.path("kept/objects").is_dir());
    let [local, far] = ["a.splk", &address].map(|path| folder.json(&format!("info {path} --json")));
    assert_eq!((&local["count"], &local["bytes"]), (&far["count"], &far["bytes"]));
    assert!(far["file"].as_str().unwrap().ends_with("/a.splk"));
    folder.run(&format!("check {address} --cache-size 0")).ok();
    folder.run(&format!("convert {address} -o far.ply")).ok();
    folder.run("convert a.splk -o local.ply").ok();
    assert!(read("local.ply") == read("far.ply"));
    // Beside an address nothing can be written.
    folder.run(&format!("{address} --engine cpu --size 32x32 -q --cache kept")).ok();
    assert!(folder.path("a.png").is_file());
    server.fail(|_, _| Fault::Whole);
    folder.run(&format!("info {address}")).fails(3, &["does not support ranges", "a.splk: bytes"]);
}

#[test]
fn other_files_are_fetched_as_a_whole() {
    let folder = Folder::new();
    folder.put("a.obj", ball());
    let server = Server::of(ball().into_bytes());
    let address = server.address("a.obj");
    let [local, far] =
        ["a.obj", &address].map(|path| folder.json(&format!("info {path} --json --cache kept")));
    assert_eq!((&local["count"], &local["bounds"]), (&far["count"], &far["bounds"]));
    // Too small a cache, one that cannot be written, and none: temporary files.
    folder.put("file", "in the place of a folder");
    for (flags, words) in [
        ("--cache other --cache-size 1KiB", "--cache-size"),
        ("--cache file", "the cache file cannot be written"),
        ("--cache-size 0", ""),
    ] {
        let run = folder.run(&format!("info {address} --json {flags}"));
        let stderr = run.stderr();
        assert!(
            stderr.contains(words) && !(words.is_empty() && stderr.contains("cache")),
            "{stderr}"
        );
        let again: serde_json::Value = serde_json::from_str(&run.stdout()).unwrap();
        assert_eq!(again["bounds"], local["bounds"], "{flags}");
    }
}

/// Stops the server of S3.
struct Moto(std::process::Child);

impl Drop for Moto {
    fn drop(&mut self) {
        self.0.kill().ok();
        self.0.wait().ok();
    }
}

const MOTO: &str = "
import sys, boto3
from moto.server import ThreadedMotoServer
server = ThreadedMotoServer(ip_address='127.0.0.1', port=0)
server.start()
port = server._server.socket.getsockname()[1]
client = boto3.client('s3', endpoint_url=f'http://127.0.0.1:{port}', aws_access_key_id='a',
                      aws_secret_access_key='b', region_name='us-east-1')
client.create_bucket(Bucket='bucket')
client.put_object(Bucket='bucket', Key='some place/a.splk', Body=open('a.splk', 'rb').read())
print('port', port, flush=True)
sys.stdin.read()
";

#[test]
fn buckets_of_s3_are_inputs() {
    let is_there = Command::new("python3").args(["-c", "import boto3, moto.server"]).output();
    if !is_there.is_ok_and(|run| run.status.success()) {
        eprintln!("skipped: python3 with moto is not installed (pip install \"moto[server]\")");
        return;
    }
    let folder = Folder::new();
    folder.put("a.obj", ball());
    folder.run("convert a.obj -o a.splk").ok();
    let mut python = Command::new("python3");
    python.args(["-c", MOTO]).current_dir(&folder);
    python.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut moto = Moto(python.spawn().unwrap());
    let out = std::io::BufReader::new(moto.0.stdout.take().unwrap());
    let port = std::io::BufRead::lines(out)
        .map_while(Result::ok)
        .find_map(|line| line.strip_prefix("port ").map(str::to_owned))
        .expect("a port");
    let run = |arguments: &[&str]| {
        let mut command = folder.command();
        command.env("AWS_ENDPOINT_URL", format!("http://127.0.0.1:{port}"));
        command.env("AWS_ALLOW_HTTP", "true").env("AWS_REGION", "us-east-1");
        command.env("AWS_ACCESS_KEY_ID", "a").env("AWS_SECRET_ACCESS_KEY", "b");
        common::Run::of(&mut command, arguments)
    };
    let address = "s3://bucket/some place/a.splk";
    let drawn = ["--engine", "cpu", "--size", "64x64", "-q", "--cache", "kept"];
    run(&[&["render", address, "-o", "far.png"], &drawn[..]].concat()).ok();
    folder.run(&format!("render a.splk -o local.png {DRAWN}")).ok();
    let read = |name: &str| std::fs::read(folder.path(name)).unwrap();
    assert!(read("local.png") == read("far.png"));
    run(&["check", address, "--cache", "kept"]).ok();
    run(&["info", "s3://bucket/none.splk"]).fails(3, &["no such object (404)"]);
}
