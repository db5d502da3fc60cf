//! Makes the records of the shipped studies: `cargo run --example make_data`.
//!
//! Each study's records hide one effect that its text does not know; see `studies/README.md`.

#[path = "../tests/truth/mod.rs"]
mod truth;

use std::path::Path;

fn main() -> std::io::Result<()> {
    for shipped in truth::shipped::records() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("studies").join(shipped.study).join("data");
        std::fs::create_dir_all(&folder)?;
        shipped.record.write(&folder.join(shipped.file))?;
        println!("{}/data/{}: {} samples", shipped.study, shipped.file, shipped.record.columns[0].len());
    }
    for (path, text) in truth::shipped::further() {
        std::fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("studies").join(path), text)?;
        println!("{path}");
    }
    Ok(())
}
