//! Models that reach far from their own origin, as those made of maps do: glTF keeps its places in 32 bits.

use super::report::Report;
use crate::import::Model;
use glam::Vec3;
use systems::assets::Mesh;
use systems::space::origin::{PRECISE, spacing};

/// Warns of the node that reaches farthest, where that is too far to be precise. `meshes`: those that parts name.
pub fn check(model: &Model, meshes: &[Mesh], report: &mut Report) {
    let reach = |index: usize, model_from_node: glam::Affine3A| {
        let node = &model.nodes[index];
        let corners = node.part_transforms().iter().flat_map(|part_from| {
            let model_from_part = model_from_node * part_from.compute_affine();
            let meshes = node.parts.iter().filter_map(|(mesh, _)| meshes.get(mesh.slot() as usize));
            meshes.flat_map(move |mesh| {
                let aabb = mesh.aabb().transformed(&model_from_part);
                [aabb.min, aabb.max]
            })
        });
        let corners = corners.chain([Vec3::from(model_from_node.translation)]);
        f64::from(corners.map(|corner| corner.abs().max_element()).fold(0.0, f32::max))
    };
    let all = model.placed().into_iter().map(|(index, model_from_node)| (index, reach(index, model_from_node)));
    let farthest = all.filter(|(_, metres)| metres.is_finite()).max_by(|a, b| a.1.total_cmp(&b.1));
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
