//! Has the particles fly through the rooms of the laws *late* and writes what they give to
//! `tools/src/validate/late_particles.csv`.
//!
//! `cargo run --release -p foresound-tools --example late_particles [all]`. Lines of rooms that have not changed stay; with the word
//! `all` every line is made again, in eight minutes of one core.

use foresound_tools::validate::late_reference::table;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let is_made_again = std::env::args().nth(1).is_some_and(|word| word == "all");
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/src/validate/late_particles.csv"
    );
    std::fs::write(path, table(is_made_again)?)?;
    Ok(())
}
