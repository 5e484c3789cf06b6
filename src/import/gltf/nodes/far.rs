//! Models that reach far from their own origin, as those made of maps do: glTF keeps its places in 32 bits.

use crate::import::gltf::report::Report;
use crate::import::model::{Model, Node};
use glam::{Affine3A, Vec3};
use systems::assets::Mesh;
use systems::space::FARTHEST;
use systems::space::origin::{PRECISE, spacing};

/// Refuses what lies beyond [`FARTHEST`], and warns of the node that reaches farthest, where that is too far to be
/// precise. `meshes`: those that parts name.
pub fn check(model: &Model, meshes: &[Mesh], report: &mut Report) {
    let mut farthest: Option<(usize, f64)> = None;
    for (index, model_from_node) in model.placed() {
        let node = &model.nodes[index];
        let metres = size(reach(node, &model_from_node, meshes));
        if metres > FARTHEST
            && let Some(told) = beyond(node, &model_from_node, meshes)
        {
            report.invalid(
                format!("nodes[{index}]"),
                format!("{told} from the model's origin: expected at most {:.0} km on each axis", FARTHEST / 1e3),
            );
        }
        if farthest.is_none_or(|(_, most)| metres > most) {
            farthest = Some((index, metres));
        }
    }
    let Some((index, metres)) = farthest.filter(|(_, metres)| *metres > PRECISE) else { return };
    report.warn(
        format!("nodes[{index}]"),
        format!(
            "reaches {:.1} km from the model's origin, where places in 32 bits, which glTF has, are kept to {:.1e} m; \
             expected a model near its origin, whose place the scene says",
            metres / 1e3,
            spacing(metres)
        ),
    );
}

/// Metres, along the axis where that is most; what is no number is without end.
fn size(place: Vec3) -> f64 {
    if place.is_finite() { place.abs().max_element().into() } else { f64::INFINITY }
}

/// The place of a node and the boxes of its parts: as far as they reach from the model's origin along each axis.
fn reach(node: &Node, model_from_node: &Affine3A, meshes: &[Mesh]) -> Vec3 {
    let corners = parts(node, model_from_node, meshes).flat_map(|(model_from_part, mesh)| {
        let aabb = mesh.aabb().transformed(&model_from_part);
        [aabb.min, aabb.max]
    });
    // Added, what is no number stays that.
    let further = |reach: Vec3, place: Vec3| Vec3::select(place.abs().cmple(reach), reach, place.abs());
    corners.fold(Vec3::from(model_from_node.translation).abs(), further)
}

/// The meshes of a node where it draws them.
fn parts<'a>(
    node: &'a Node,
    model_from_node: &'a Affine3A,
    meshes: &'a [Mesh],
) -> impl Iterator<Item = (Affine3A, &'a Mesh)> {
    node.part_transforms().iter().flat_map(move |node_from_part| {
        let model_from_part = *model_from_node * node_from_part.compute_affine();
        let drawn = node.parts.iter().filter_map(|(mesh, _)| meshes.get(mesh.slot() as usize));
        drawn.map(move |mesh| (model_from_part, mesh))
    })
}

/// The part of a node that is too far away, and its distance; `None` where only its boxes are.
fn beyond(node: &Node, model_from_node: &Affine3A, meshes: &[Mesh]) -> Option<String> {
    let distance = size(model_from_node.translation.into());
    if distance > FARTHEST {
        return Some(format!("is {distance:.1e} m"));
    }
    parts(node, model_from_node, meshes).find_map(|(model_from_part, mesh)| {
        let distance = |position: &Vec3| size(model_from_part.transform_point3(*position));
        let far = mesh.positions.iter().find(|position| distance(position) > FARTHEST)?;
        Some(format!("in mesh {:?}, the vertex at {far} is {:.1e} m", mesh.name, distance(far)))
    })
}
