//! Where the nodes of a glTF scene are, and the instances of a node.

use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::accessors::Accessors;
use super::buffers::missing;
use super::document::{Document, Instancing, Node};
use crate::error::Result;
use crate::scene::io::mesh_file::Position;

/// Calls `place` with every node of the default scene and its transform to the world, parents first. A file without scenes
/// shows all nodes.
pub(super) fn visit<'d>(
    position: Position,
    document: &'d Document,
    root: DAffine3,
    place: &mut dyn FnMut(&'d Node, &DAffine3) -> Result<()>,
) -> Result<()> {
    let nodes = &document.nodes;
    let roots: Vec<usize> = match document.scenes.len() {
        0 => {
            let mut is_child = vec![false; nodes.len()];
            for &child in nodes.iter().flat_map(|node| &node.children) {
                if let Some(flag) = is_child.get_mut(child) {
                    *flag = true;
                }
            }
            (0..nodes.len()).filter(|&node| !is_child[node]).collect()
        }
        count => {
            let index = document.scene.unwrap_or(0);
            let scene = document.scenes.get(index);
            scene
                .ok_or_else(|| missing(position, "scene", index, count))?
                .nodes
                .clone()
        }
    };
    let mut visited = vec![false; nodes.len()];
    let mut stack: Vec<(usize, DAffine3)> = roots.iter().rev().map(|&node| (node, root)).collect();
    while let Some((index, parent)) = stack.pop() {
        let Some((node, visited)) = nodes.get(index).zip(visited.get_mut(index)) else {
            return Err(missing(position, "node", index, nodes.len()));
        };
        if std::mem::replace(visited, true) {
            let problem = format!("glTF node {index} has two parents or is its own ancestor");
            return Err(position.error(problem, super::ADVICE));
        }
        let placement = parent * local(node);
        place(node, &placement)?;
        stack.extend(node.children.iter().rev().map(|&child| (child, placement)));
    }
    Ok(())
}

/// A node's transform to its parent.
fn local(node: &Node) -> DAffine3 {
    match &node.matrix {
        Some(matrix) => DAffine3::from_mat4(DMat4::from_cols_array(matrix)),
        None => composed(
            node.translation.unwrap_or([0.0; 3]).into(),
            DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0])),
            node.scale.unwrap_or([1.0; 3]).into(),
        ),
    }
}

fn composed(translation: DVec3, rotation: DQuat, scale: DVec3) -> DAffine3 {
    // Exporters round rotations to single precision or coarser.
    let rotation = match rotation.length() {
        length if length > 0.0 && length.is_finite() => rotation / length,
        _ => DQuat::IDENTITY,
    };
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}

/// Transforms of the instances of a node (`EXT_mesh_gpu_instancing`).
pub(super) fn instances(
    position: Position,
    instancing: &Instancing,
    accessors: &mut Accessors,
) -> Result<Vec<DAffine3>> {
    let index = |name: &str| instancing.attributes.get(name).copied();
    let vector = |accessors: &mut Accessors, name: &str| {
        let items = |index| accessors.items(index, "VEC3", |[x, y, z, _]| DVec3::new(x, y, z));
        index(name).map(items).transpose()
    };
    let translations = vector(accessors, "TRANSLATION")?;
    let scales = vector(accessors, "SCALE")?;
    let turns = |index| accessors.items(index, "VEC4", DQuat::from_array);
    let rotations = index("ROTATION").map(turns).transpose()?;
    let counts = [
        translations.as_ref().map(Vec::len),
        scales.as_ref().map(Vec::len),
        rotations.as_ref().map(Vec::len),
    ];
    let count = counts.iter().flatten().copied().max().unwrap_or(0);
    if counts.iter().flatten().any(|&other| other != count) {
        let problem = "glTF instances with attributes of different length";
        return Err(position.error(problem, super::ADVICE));
    }
    let placement = |i: usize| {
        composed(
            translations.as_ref().map_or(DVec3::ZERO, |list| list[i]),
            rotations.as_ref().map_or(DQuat::IDENTITY, |list| list[i]),
            scales.as_ref().map_or(DVec3::ONE, |list| list[i]),
        )
    };
    Ok((0..count).map(placement).collect())
}
