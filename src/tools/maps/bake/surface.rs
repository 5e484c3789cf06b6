//! The triangles of a file, in one space, with what a bake needs at their corners.

use crate::import::{self, Model};
use crate::name;
use crate::tools::maps::MapError;
use glam::{Affine3A, Vec2, Vec3, Vec4};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use systems::assets::tangents::compute_tangents;
use systems::assets::{Library, Mesh};
use systems::space::Aabb;

/// Triangles that a bake takes at the most: repeated nodes and instances could ask for any number.
const MAX_TRIANGLES: usize = 1 << 26;

/// Purpose of a file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Role {
    /// The coarse mesh whose maps are made: needs UVs, of this set.
    Low {
        /// 0 or 1.
        uv_set: usize,
    },
    /// The fine mesh: normals alone.
    High,
}

/// All triangles of a model or of some of its nodes, model space, metres.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// The file it comes from, or the mesh's name: what an error names.
    pub source: PathBuf,
    /// One for each vertex.
    pub positions: Vec<Vec3>,
    /// One for each vertex, unit.
    pub normals: Vec<Vec3>,
    /// One for each vertex, unit, with the sign of the bitangent; empty for [`Role::High`].
    pub tangents: Vec<Vec4>,
    /// One for each vertex; empty for [`Role::High`].
    pub uvs: Vec<Vec2>,
    /// Vertices, counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Runs of triangles whose back counts as a surface too, in order.
    pub two_sided: Vec<std::ops::Range<u32>>,
}

impl Surface {
    /// Reads a glTF file: all nodes of its scene, or those named with what is below them.
    ///
    /// # Errors
    /// [`MapError`]: what is wrong with the file, and what was expected.
    pub fn load(path: &Path, nodes: &[String], role: Role) -> Result<Self, MapError> {
        let mut library = Library::default();
        let model = import::load_model(path, &mut library)?;
        let chosen = chosen_nodes(&model, nodes).map_err(|message| MapError::refused(path, message))?;
        let mut surface = Self { source: path.to_owned(), ..Self::default() };
        for (index, model_from_node) in model.placed().into_iter().filter(|(index, _)| chosen.contains(index)) {
            let node = &model.nodes[index];
            for &(mesh, material) in &node.parts {
                let Some(entry) = library.mesh(mesh) else { continue };
                let two_sided = library.material(material).is_some_and(|material| material.double_sided);
                let mesh = prepared(&entry.mesh, role).map_err(|message| MapError::refused(path, message))?;
                for part_from in node.part_transforms() {
                    let model_from_mesh = model_from_node * part_from.compute_affine();
                    surface.add(&mesh, &model_from_mesh, two_sided);
                    if surface.triangles.len() > MAX_TRIANGLES {
                        let message = format!("has more than {MAX_TRIANGLES} triangles, counting every instance");
                        return Err(MapError::refused(path, message));
                    }
                }
            }
        }
        if surface.triangles.is_empty() {
            return Err(MapError::refused(path, "has no triangles in its scene: nothing to bake; expected a mesh"));
        }
        if let Some(place) = surface.positions.iter().find(|p| !p.is_finite()) {
            return Err(MapError::refused(path, format!("expected finite positions, found a vertex at {place}")));
        }
        Ok(surface)
    }

    /// A mesh alone, as [`Self::load`] would take it from a file.
    ///
    /// # Errors
    /// It has no UVs, which [`Role::Low`] needs.
    pub fn of_mesh(mesh: &Mesh, model_from_mesh: &Affine3A, role: Role) -> Result<Self, String> {
        let mut surface = Self { source: mesh.name.clone().into(), ..Self::default() };
        surface.add(&prepared(mesh, role)?, model_from_mesh, false);
        Ok(surface)
    }

    /// Adds a mesh as `vs_main` in `forward.wgsl` places it: normals by the cofactor matrix, both vectors unit at each
    /// vertex, and where the transform mirrors, the other side in front and the other sign.
    fn add(&mut self, mesh: &Mesh, model_from_mesh: &Affine3A, two_sided: bool) {
        let (first_vertex, first_triangle) = (self.positions.len() as u32, self.triangles.len() as u32);
        let linear = model_from_mesh.matrix3;
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::from);
        let handedness = if x.dot(y.cross(z)) < 0.0 { -1.0 } else { 1.0 };
        let (y_z, z_x, x_y) = (y.cross(z), z.cross(x), x.cross(y));
        self.positions.extend(mesh.positions.iter().map(|&p| model_from_mesh.transform_point3(p)));
        self.normals.extend(mesh.normals.iter().map(|n| {
            let normal = handedness * (y_z * n.x + z_x * n.y + x_y * n.z);
            normal.try_normalize().unwrap_or(Vec3::Y)
        }));
        self.tangents.extend(mesh.tangents.iter().map(|t| {
            let tangent = x * t.x + y * t.y + z * t.z;
            tangent.try_normalize().unwrap_or(Vec3::X).extend(t.w * handedness)
        }));
        self.uvs.extend_from_slice(mesh.tangent_uvs());
        let corners = mesh.indices.as_chunks::<3>().0;
        self.triangles.extend(corners.iter().map(|&[a, b, c]| {
            let [b, c] = if handedness < 0.0 { [c, b] } else { [b, c] };
            [a, b, c].map(|vertex| vertex + first_vertex)
        }));
        if two_sided {
            self.two_sided.push(first_triangle..self.triangles.len() as u32);
        }
    }

    /// Tells if the back of a triangle counts as a surface too.
    pub fn is_two_sided(&self, triangle: u32) -> bool {
        let after = self.two_sided.partition_point(|range| range.end <= triangle);
        self.two_sided.get(after).is_some_and(|range| range.contains(&triangle))
    }

    /// The box around it.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(&self.positions)
    }

    /// The corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// The normal at a place on a triangle, unit: the vertices' blended by weights.
    pub fn normal(&self, triangle: u32, weights: Vec3) -> Vec3 {
        let [a, b, c] = self.triangles[triangle as usize].map(|vertex| self.normals[vertex as usize]);
        let face = || self.face_normal(triangle);
        (a * weights.x + b * weights.y + c * weights.z).try_normalize().unwrap_or_else(face)
    }

    /// Across the triangle itself, unit; +Y where it has no area.
    pub fn face_normal(&self, triangle: u32) -> Vec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).try_normalize().unwrap_or(Vec3::Y)
    }
}

/// A mesh with all that its role needs and nothing more.
fn prepared(mesh: &Mesh, role: Role) -> Result<Mesh, String> {
    let mut mesh = mesh.clone();
    mesh.colors.clear();
    match role {
        Role::Low { uv_set } => {
            if mesh.uvs[uv_set.min(1)].is_empty() {
                return Err(format!("mesh \"{}\" has no UVs to bake to: expected TEXCOORD_{uv_set}", mesh.name));
            }
            mesh.tangent_uv_set = uv_set.min(1);
            compute_tangents(&mut mesh);
        }
        Role::High => {
            (mesh.uvs, mesh.tangents) = Default::default();
        }
    }
    Ok(mesh)
}

/// All nodes, or those with one of the names and everything below them.
fn chosen_nodes(model: &Model, names: &[String]) -> Result<BTreeSet<usize>, String> {
    let placed = model.placed();
    if names.is_empty() {
        return Ok(placed.into_iter().map(|(index, _)| index).collect());
    }
    let known: Vec<(&str, usize)> = placed.iter().map(|&(i, _)| (model.nodes[i].name.as_str(), i)).collect();
    let mut open = Vec::new();
    for wanted in names {
        name::find("node", &known, wanted)?;
        open.extend(known.iter().filter(|(name, _)| name == wanted).map(|&(_, index)| index));
    }
    let mut chosen = BTreeSet::new();
    while let Some(index) = open.pop() {
        if chosen.insert(index) {
            open.extend(&model.nodes[index].children);
        }
    }
    Ok(chosen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, UVec2};
    use systems::assets::shapes;

    const LOW: Role = Role::Low { uv_set: 0 };

    #[test]
    fn a_mirrored_surface_keeps_its_front_outside() {
        let ball = shapes::sphere(1.0, 12, 6);
        for scale in [Vec3::ONE, Vec3::new(-1.0, 2.0, 0.5), Vec3::new(-1.0, -2.0, -0.5)] {
            let place = Affine3A::from_scale_rotation_translation(scale, Quat::from_rotation_x(0.4), Vec3::X);
            let surface = Surface::of_mesh(&ball, &place, LOW).expect("UVs");
            for triangle in 0..surface.triangles.len() as u32 {
                let [a, b, c] = surface.corners(triangle);
                let outward = (a + b + c) / 3.0 - Vec3::X;
                let weights = Vec3::splat(1.0 / 3.0);
                assert!(surface.face_normal(triangle).dot(outward) > 0.0, "{scale}");
                assert!(surface.normal(triangle, weights).dot(surface.face_normal(triangle)) > 0.7, "{scale}");
            }
            let mirrored = scale.x * scale.y * scale.z < 0.0;
            assert!(surface.tangents.iter().all(|t| t.w == if mirrored { -1.0 } else { 1.0 }));
        }
    }

    #[test]
    fn the_chosen_uv_set_must_be_there() {
        let mut mesh = shapes::plane(Vec2::ONE, UVec2::ONE);
        assert!(Surface::of_mesh(&mesh, &Affine3A::IDENTITY, LOW).is_ok());
        let error = Surface::of_mesh(&mesh, &Affine3A::IDENTITY, Role::Low { uv_set: 1 }).expect_err("one set only");
        assert!(error.contains("TEXCOORD_1"), "{error}");
        mesh.uvs[1] = mesh.uvs[0].iter().map(|uv| uv * 0.5).collect();
        let second = Surface::of_mesh(&mesh, &Affine3A::IDENTITY, Role::Low { uv_set: 1 }).expect("two sets");
        assert!(second.uvs.iter().all(|uv| uv.max_element() <= 0.5));
    }
}
