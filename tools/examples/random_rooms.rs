//! Compares late sound with particles in random rooms and prints by how much the figures of law *late/slopes* are off.
//!
//! `cargo run --release -p foresound-tools --example random_rooms [first [end [seeds]]]`: rooms 0 to 40 and one seed of the rays
//! unless said otherwise, two minutes of two cores. Each room has a line of signed errors in the worst octave, each kind of rooms one
//! of root mean squares and of figures beyond 10 % or 1 dB.

#![expect(clippy::print_stdout, reason = "the result")]

use foresound_tools::validate::random_late::{FIGURES, of_room, summary};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers = std::env::args().skip(1).map(|argument| argument.parse());
    let numbers: Vec<u64> = numbers.collect::<Result<_, _>>()?;
    let number = |index: usize, or| numbers.get(index).copied().unwrap_or(or);
    let (first, end, seeds) = (number(0, 0), number(1, 40), number(2, 1));
    println!("room, kind, {}", FIGURES.join(", "));
    let mut all = Vec::new();
    for room in first..end {
        for errors in of_room(room, seeds)? {
            let worst = errors.worst.map(|off| format!("{off:.2}"));
            println!("{room}, {}, {}", errors.kind, worst.join(", "));
            all.push(errors);
        }
    }
    for (kind, figures) in summary(&all) {
        let figures = figures.map(|(rms, out)| format!("{rms:.2} ({out})"));
        println!("rms of {kind}: {}", figures.join(", "));
    }
    Ok(())
}
