//! Linking of the shared library for Android; nothing for any other target.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("android") {
        return;
    }
    // Devices with pages of 16 KiB refuse anything less; NDKs before r28 do not do it by themselves.
    println!("cargo:rustc-link-arg=-Wl,-z,max-page-size=16384");
    // A name that nobody has fails here and not on somebody's phone.
    println!("cargo:rustc-link-arg=-Wl,-z,defs");
    // 14 kB of relocations instead of 110; Android reads them since version 6.
    println!("cargo:rustc-link-arg=-Wl,--pack-dyn-relocs=android");
    // oboe-sys links c++_static alone, where operators new and delete are not.
    if std::env::var_os("CARGO_FEATURE_OBOE").is_some() {
        println!("cargo:rustc-link-lib=c++abi");
    }
}
