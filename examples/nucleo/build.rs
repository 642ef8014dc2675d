//! Tells the linker which program is the boot loader, and leaves room in the image's file for what the tools fill in.

fn main() {
    println!("cargo:rerun-if-changed=image.x");
    println!("cargo:rustc-link-arg-bin=boot=--defsym=_boot=1");
    println!("cargo:rustc-link-arg-bin={}=-Timage.x", env!("CARGO_PKG_NAME"));
}
