//! Puts the viewer for pages into the program, if `SPLATKIT_VIEWER` names the folder that
//! tools/web/build has made.

use std::{env, fs, path::Path};

const FILES: [&str; 4] =
    ["splatkit-worker.js", "splatkit-viewer.js", "splatkit.wasm.lz", "splatkit-unpack.wasm"];

fn main() {
    println!("cargo::rustc-check-cfg=cfg(splatkit_viewer)");
    println!("cargo::rerun-if-env-changed=SPLATKIT_VIEWER");
    let Some(folder) = env::var_os("SPLATKIT_VIEWER").filter(|folder| !folder.is_empty()) else {
        return;
    };
    let out = env::var_os("OUT_DIR").expect("cargo names a folder");
    for name in FILES {
        let from = Path::new(&folder).join(name);
        println!("cargo::rerun-if-changed={}", from.display());
        fs::copy(&from, Path::new(&out).join(name)).unwrap_or_else(|error| {
            panic!("SPLATKIT_VIEWER: {}: {error}; run tools/web/build", from.display())
        });
    }
    println!("cargo::rustc-cfg=splatkit_viewer");
}
