//! Gives the linker the memory map of the board whose binary is built, and the scripts that all boards need.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// A board's own linker script, seen from this folder, and the script that the linker begins with.
struct Scripts {
    of_board: &'static str,
    first: &'static str,
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let Some(Scripts { of_board, first }) = scripts()? else {
        return Ok(());
    };
    println!("cargo:rerun-if-changed={of_board}");

    let out_dir = PathBuf::from(env::var("OUT_DIR")?);
    let name = Path::new(of_board).file_name().unwrap_or_default();
    fs::copy(of_board, out_dir.join(name)).map_err(|e| format!("{of_board}: {e}"))?;
    println!("cargo:rustc-link-search={}", out_dir.display());
    // The pages that the linker would align sections to mean nothing to a microcontroller and move its addresses: hence --nmagic.
    for argument in ["--nmagic", &format!("-T{first}"), "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
    Ok(())
}

/// None when the library is built by itself or for a machine with a system.
fn scripts() -> Result<Option<Scripts>, Box<dyn Error>> {
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(None);
    }
    let chosen = |feature: &str| env::var_os(feature).is_some();
    match (chosen("CARGO_FEATURE_F405"), chosen("CARGO_FEATURE_AN386")) {
        (true, true) => Err("features f405 and an386: a build is for one board".into()),
        // cortex-m-rt's script includes the board's.
        (true, false) => Ok(Some(Scripts { of_board: "memory.x", first: "link.x" })),
        (false, true) => Ok(Some(Scripts { of_board: "src/bin/an386/an386.x", first: "an386.x" })),
        (false, false) => Ok(None),
    }
}
