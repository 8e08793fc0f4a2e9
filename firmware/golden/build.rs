//! Hands the linker the memory of the machine that the target stands for.

use std::{env, fs, path::PathBuf};

fn main() {
    let target = env::var("TARGET").unwrap_or_default();
    let machine = target.split(['-', '.']).next().unwrap_or_default();
    let file = format!("memory/{machine}.x");
    let out = PathBuf::from(env::var("OUT_DIR").unwrap_or_default());
    if let Err(error) = fs::copy(&file, out.join("memory.x")) {
        println!("cargo:warning={file}: {error}; golden knows no machine for {target}");
    }
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rerun-if-changed={file}");
    for argument in ["--nmagic", "-Tlink.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
