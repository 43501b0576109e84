//! `materials`: the built-in materials, and names near to a misspelt one.

use std::path::PathBuf;

use foresound::acoustics::bands::NOMINAL_HZ;
use foresound::scene::MaterialTable;
use foresound::{Error, Result};
use serde_json::json;

#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Only this material.
    name: Option<String>,
    /// Materials by name (TOML), in addition to the built-in table.
    #[arg(long, value_name = "FILE")]
    materials: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut table = MaterialTable::built_in();
    if let Some(file) = &arguments.materials {
        table.extend(MaterialTable::load(file)?);
    }
    let entries = table.entries().iter();
    let shown: Vec<_> = match &arguments.name {
        None => entries.collect(),
        Some(name) => vec![table.get(name).ok_or_else(|| unknown(name, &table))?],
    };
    if arguments.json {
        let rows: Vec<_> = shown
            .iter()
            .map(|entry| {
                let material = &entry.material;
                json!({
                    "name": material.name,
                    "absorption": material.absorption,
                    "scattering": material.scattering,
                    "transmission": material.transmission,
                    "source": entry.source,
                })
            })
            .collect();
        outln!("{}", json!({ "bands_hz": NOMINAL_HZ, "materials": rows }));
        return Ok(());
    }
    let bands = NOMINAL_HZ.map(|hz| format!("{hz:>5}")).concat();
    outln!("{:<26}absorption at{bands} Hz", "");
    for entry in shown {
        let material = &entry.material;
        let cells = material
            .absorption
            .map(|share| format!("{share:>5.2}"))
            .concat();
        outln!("{:<26}             {cells}", material.name);
        if arguments.name.is_some() {
            let cells = material
                .scattering
                .map(|share| format!("{share:>5.2}"))
                .concat();
            outln!("{:<26}scattering   {cells}", "");
            let loss = material
                .transmission
                .map(|share| format!("{:>5.0}", -10.0 * share.log10()));
            outln!("{:<26}insulation dB{}", "", loss.concat());
            if !entry.source.is_empty() {
                outln!("{}", entry.source);
            }
        }
    }
    Ok(())
}

fn unknown(name: &str, table: &MaterialTable) -> Error {
    let advice = near(name, table).map_or_else(
        || "list the names with `foresound materials`".to_owned(),
        |near| format!("{near} is near; `foresound materials` lists the names"),
    );
    Error::setting("material", format!("none is called {name:?}"), &advice)
}

/// The name of the table that a misspelt one most likely means: the same words in another form, else at most two letters in
/// another way, or one of its words.
pub(crate) fn near<'a>(name: &str, table: &'a MaterialTable) -> Option<&'a str> {
    let wanted = words(name);
    let joined = wanted.concat();
    let names = table
        .entries()
        .iter()
        .map(|entry| entry.material.name.as_str());
    let most = 2.min(joined.len() / 4);
    let closest = names
        .clone()
        .map(|name| (distance(&joined, &words(name).concat()), name))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, _)| *distance <= most);
    let shares_word = |name: &&str| {
        let own = words(name);
        wanted
            .iter()
            .any(|word| word.len() > 3 && own.contains(word))
    };
    closest
        .map(|(_, name)| name)
        .or_else(|| names.clone().find(shares_word))
}

/// A name's words in small letters: `WoodPanel`, `wood-panel` and `wood_panel` have the same.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for letter in name.chars() {
        let starts = !letter.is_alphanumeric() || (letter.is_uppercase() && was_small);
        if starts {
            words.push(String::new());
        }
        was_small = letter.is_lowercase();
        if letter.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(letter.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Letters to insert, remove or replace (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_forms_of_a_name_are_near() {
        let table = MaterialTable::built_in();
        let first = table.entries()[0].material.name.clone();
        assert_eq!(near(&first.to_uppercase(), &table), Some(first.as_str()));
        for name in ["WoodPanel", "wood-panel", "Wood Panel", "wood_pannel"] {
            assert_eq!(near(name, &table), Some("wood_panel"), "{name}");
        }
        assert_eq!(near("xyzzy", &table), None);
        assert_eq!(near("", &table), None);
    }

    #[test]
    fn distances_count_letters() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "ab"), 2);
    }
}
