//! Gives the linker the memory map of the board whose binary is built, and the scripts that all boards need.

use std::error::Error;
use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let Some(memory_map) = memory_map()? else {
        return Ok(());
    };
    println!("cargo:rerun-if-changed={memory_map}");

    let out_dir = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(memory_map, out_dir.join("memory.x")).map_err(|e| format!("{memory_map}: {e}"))?;
    println!("cargo:rustc-link-search={}", out_dir.display());
    // The pages that the linker would align sections to mean nothing to a microcontroller and move its addresses: hence --nmagic.
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}

/// The board's linker script, seen from this folder; none when the library is built by itself or for a machine with a system.
fn memory_map() -> Result<Option<&'static str>, Box<dyn Error>> {
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(None);
    }
    let chosen = |feature: &str| env::var_os(feature).is_some();
    match (chosen("CARGO_FEATURE_F405"), chosen("CARGO_FEATURE_AN386")) {
        (true, true) => Err("features f405 and an386: a build is for one board".into()),
        (true, false) => Ok(Some("../memory.x")),
        (false, true) => Ok(Some("src/bin/an386/memory.x")),
        (false, false) => Ok(None),
    }
}
