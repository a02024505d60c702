//! Prints the XML Schema of FYSL: `cargo run -p cloth-scene --example fysl_xsd > fysl.xsd`.

use std::io::Write;

fn main() -> std::io::Result<()> {
    std::io::stdout().write_all(cloth_scene::fysl::fysl_xsd().as_bytes())
}
