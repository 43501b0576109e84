//! Tells where the sounds are that the program brings along: in the repository they are those of `assets`, in a package its
//! own copies. `bundled` holds symbolic links, of which `cargo package` makes files. A checkout without links (Windows, an
//! unpacked archive of the hosting site) has a line of text in place of each: nothing is compiled from them.

use std::path::Path;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let package = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    let assets = Path::new(&package).join("../assets");
    let provenance = assets.join("PROVENANCE.md");
    let folder = if provenance.is_file() {
        println!("cargo:rerun-if-changed={}", provenance.display());
        assets
    } else {
        Path::new(&package).join("bundled")
    };
    println!("cargo:rustc-env=FORESOUND_BUNDLED={}", folder.display());
}
