//! Acoustic properties in `extras`, which modellers write as custom properties of materials, meshes and objects.
//!
//! Control side. `acoustic_material` names a material of a table. `acoustic_absorption` defines one, with
//! `acoustic_scattering`, `acoustic_transmission` or `acoustic_transmission_loss_db`: one number or eight.

use serde::Deserialize;
use serde_json::{Map, Value};

use crate::acoustics::Material;
use crate::error::Result;
use crate::scene::io::material_file::Figures;
use crate::scene::io::mesh_file::{Position, shortened};
use crate::scene::io::toml_file::PerBand;
use crate::scene::materials::MaterialTable;

/// What all keys begin with.
const PREFIX: &str = "acoustic_";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    acoustic_material: Option<String>,
    acoustic_absorption: Option<PerBand<0, 1>>,
    acoustic_scattering: Option<PerBand<0, 1>>,
    acoustic_transmission: Option<PerBand<0, 1>>,
    acoustic_transmission_loss_db: Option<PerBand<0, 200>>,
}

/// The material's name in the extras of a thing called `name`, if they give one; a material that they define is added to
/// the table.
pub(super) fn material_name(
    position: Position,
    extras: Option<&Value>,
    name: &str,
    table: &mut MaterialTable,
) -> Result<Option<String>> {
    let Some(Value::Object(extras)) = extras else {
        return Ok(None);
    };
    let ours = extras.iter().filter(|(key, _)| key.starts_with(PREFIX));
    let ours: Map<String, Value> = ours.map(|(k, v)| (k.clone(), v.clone())).collect();
    if ours.is_empty() {
        return Ok(None);
    }
    let what = shortened(name);
    let fields: Fields = serde_json::from_value(ours.into()).map_err(|error| {
        let text = error.to_string().replace(char::is_control, " ");
        let (problem, advice) = text
            .split_once("; ")
            .unwrap_or((&text, "correct the key or its value"));
        position.error(format!("extras of `{what}`: {problem}"), advice)
    })?;
    let name = fields.acoustic_material.unwrap_or_else(|| name.to_owned());
    let Some(absorption) = fields.acoustic_absorption else {
        let others = [fields.acoustic_scattering, fields.acoustic_transmission];
        if others.iter().any(Option::is_some) || fields.acoustic_transmission_loss_db.is_some() {
            let problem = format!("extras of `{what}` have no `acoustic_absorption`");
            let advice =
                "give it too, one number or eight, or name a material by `acoustic_material` alone";
            return Err(position.error(problem, advice));
        }
        return Ok(Some(name));
    };
    let figures = Figures {
        absorption: absorption.0,
        scattering: fields.acoustic_scattering.map(|s| s.0),
        transmission: fields.acoustic_transmission.map(|t| t.0),
        transmission_loss_db: fields.acoustic_transmission_loss_db.map(|t| t.0),
    };
    let material = figures
        .material(name.clone())
        .map_err(|(problem, advice)| {
            position.error(problem.replace(char::is_control, "?"), advice)
        })?;
    define(position, material, table)?;
    Ok(Some(name))
}

/// Adds a material; two of one name must be the same.
fn define(position: Position, material: Material, table: &mut MaterialTable) -> Result<()> {
    let mut known = table.entries().iter().map(|entry| &entry.material);
    match known.find(|known| known.name == material.name) {
        None => table.extend(MaterialTable::from_materials(vec![material])),
        Some(known) if *known == material => {}
        Some(_) => {
            let problem = format!(
                "two acoustic materials named `{}`",
                shortened(&material.name)
            );
            return Err(position.error(
                problem,
                "give each a name of its own, by `acoustic_material`",
            ));
        }
    }
    Ok(())
}
