//! Primitives into meshes: triangle lists with only the vertices that they use, normals always there.

use super::pose::{Pose, Posed};
use super::triangles::{compact, flat_normals, triangles, unit, unit_normals};
use crate::import::gltf::document::accessors::Accessor;
use crate::import::gltf::document::data::{Document, name_or};
use crate::import::gltf::report::{Fault, Read, Report};
use glam::{Vec2, Vec3, Vec4};
use gltf::accessor::DataType;
use gltf::json::validation::Checked;
use gltf::mesh::{Mode, Semantic};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use systems::assets::Mesh;
use systems::space::FARTHEST;

/// Tolerance of a normal's length around 1: that of the reference validator.
const UNIT_TOLERANCE: f32 = 0.00674;
/// Coordinates of a vertex, in whatever unit its mesh has: micrometres at the least, as far as anything may be
/// ([`FARTHEST`]). Squares and products of such lengths are finite.
const LARGEST: f32 = 1e6 * FARTHEST as f32;
/// Memory of a vertex and of a triangle while it is made, for the file's budget.
const VERTEX_BYTES: usize = 80;
const TRIANGLE_BYTES: usize = 24;

type Floats = (usize, Rc<Vec<f32>>);

/// Reads primitives; accessors that several of them share are decoded once.
pub struct Meshes<'a> {
    pub document: &'a Document,
    decoded: RefCell<HashMap<usize, Floats>>,
}

/// One primitive while it is read.
struct Primitive<'a> {
    meshes: &'a Meshes<'a>,
    gltf: gltf::Primitive<'a>,
    place: String,
    vertices: usize,
}

impl<'a> Meshes<'a> {
    pub fn new(document: &'a Document) -> Self {
        Self { document, decoded: RefCell::default() }
    }

    /// The primitives of a mesh in a pose; `None` for one that draws nothing.
    pub fn read(&self, mesh: &gltf::Mesh, pose: &Pose, report: &mut Report) -> Vec<Read<Option<Mesh>>> {
        let id = mesh.index();
        let name = name_or(mesh.name(), || format!("mesh {id}"));
        let count = mesh.primitives().len();
        let read = |gltf: gltf::Primitive| {
            let p = gltf.index();
            let place = format!("meshes[{id}].primitives[{p}]");
            let name = if count > 1 { format!("{name} {p}") } else { name.clone() };
            // The crate's own `mode` panics on one that it does not know.
            let mode = self.document.json().meshes[id].primitives[p].mode;
            Primitive { meshes: self, gltf, place, vertices: 0 }.read(mode, name, pose, report)
        };
        mesh.primitives().map(read).collect()
    }

    /// All components of an accessor with its width.
    fn floats(&self, id: usize) -> Read<Floats> {
        if let Some(known) = self.decoded.borrow().get(&id) {
            return Ok(known.clone());
        }
        let accessor = Accessor::new(self.document, id)?;
        let flat = match accessor.width {
            1 => accessor.elements::<1, f32>(|v| v as f32)?.into_flattened(),
            2 => accessor.elements::<2, f32>(|v| v as f32)?.into_flattened(),
            3 => accessor.elements::<3, f32>(|v| v as f32)?.into_flattened(),
            4 => accessor.elements::<4, f32>(|v| v as f32)?.into_flattened(),
            _ => return Err(Fault::invalid(format!("{}.type", accessor.place), "expected SCALAR to VEC4")),
        };
        let floats = (accessor.width, Rc::new(flat));
        self.decoded.borrow_mut().insert(id, floats.clone());
        Ok(floats)
    }
}

impl Primitive<'_> {
    fn read(mut self, mode: Checked<Mode>, name: String, pose: &Pose, report: &mut Report) -> Read<Option<Mesh>> {
        let Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) = mode else {
            report.warn(&*self.place, "points and lines are not drawn");
            return Ok(None);
        };
        let Some(positions) = self.attribute::<3>(Semantic::Positions, report)? else {
            report.warn(format!("{}.attributes.POSITION", self.place), "missing: nothing is drawn");
            return Ok(None);
        };
        self.vertices = positions.len();
        let indices = self.indices()?;
        let triangles = triangles(mode, indices.as_deref(), self.vertices, &self.place, report);
        if triangles.is_empty() {
            report.warn(self.place, "has no triangles: nothing is drawn");
            return Ok(None);
        }
        self.meshes.document.spend(triangles.len() / 3 * TRIANGLE_BYTES, &self.place)?;
        self.finite(&positions)?;
        let (used, indices) = compact(&triangles, self.vertices);
        self.meshes.document.spend(used.len() * VERTEX_BYTES, &self.place)?;
        let mut mesh = Mesh { name, indices, ..Mesh::default() };
        let mut posed = Posed {
            positions: pick(&positions, &used, Vec3::from_array),
            normals: self.picked::<3, _>(Semantic::Normals, &used, Vec3::from_array, report)?,
            tangents: self.picked::<4, _>(Semantic::Tangents, &used, Vec4::from_array, report)?,
        };
        self.morph(pose, &used, &mut posed, report)?;
        self.skin(pose, &used, &mut posed, report)?;
        if let Some(i) = posed.positions.iter().position(|p| !p.is_finite()) {
            let message = format!("element {} is not finite in its rest pose", used[i]);
            return Err(Fault::invalid(format!("{}.attributes.POSITION", self.place), message));
        }
        if let Some(i) = posed.positions.iter().position(|p| p.abs().max_element() > LARGEST) {
            let (vertex, place) = (used[i], posed.positions[i]);
            let message = format!("vertex {vertex} is at {place}: expected at most {LARGEST:.0e} on each axis");
            return Err(Fault::invalid(format!("{}.attributes.POSITION", self.place), message));
        }
        (mesh.positions, mesh.normals, mesh.tangents) = (posed.positions, posed.normals, posed.tangents);
        mesh.uvs = self.uvs(&used, report)?;
        mesh.colors = self.colors(&used, report)?;
        self.shading_frame(&mut mesh, report)?;
        Ok(Some(mesh))
    }

    /// Makes normals and tangents unit, or computes what is missing or unusable.
    fn shading_frame(&self, mesh: &mut Mesh, report: &mut Report) -> Read<()> {
        if mesh.normals.is_empty() {
            self.meshes.document.spend(mesh.indices.len() * VERTEX_BYTES, &self.place)?;
            if !mesh.tangents.is_empty() {
                report.warn(format!("{}.attributes.TANGENT", self.place), "ignored: tangents need normals");
            }
            flat_normals(mesh);
            return Ok(());
        }
        let off = |v: Vec3| v.is_nan() || (v.length() - 1.0).abs() > UNIT_TOLERANCE;
        if let Some(i) = mesh.normals.iter().position(|&n| off(n)) {
            let message = format!("expected unit length, a normal of vertex {i} has {}", mesh.normals[i].length());
            report.warn(format!("{}.attributes.NORMAL", self.place), message);
        }
        unit_normals(mesh);
        if let Some(i) = mesh.tangents.iter().position(|t| off(t.truncate()) || t.w.abs() != 1.0) {
            let message = format!("expected unit length and w = ±1, vertex {i} has {}", mesh.tangents[i]);
            report.warn(format!("{}.attributes.TANGENT", self.place), message);
        }
        let unit_tangent = |t: &Vec4| Some(unit(t.truncate().as_dvec3())?.extend(if t.w < 0.0 { -1.0 } else { 1.0 }));
        // A single unusable tangent: better all computed than one lacking.
        mesh.tangents = mesh.tangents.iter().map(unit_tangent).collect::<Option<_>>().unwrap_or_default();
        Ok(())
    }

    fn uvs(&self, used: &[u32], report: &mut Report) -> Read<[Vec<Vec2>; 2]> {
        let [mut first, mut second] = [Vec::new(), Vec::new()];
        for (set, uvs) in [(0, &mut first), (1, &mut second)] {
            *uvs = self.picked::<2, _>(Semantic::TexCoords(set), used, Vec2::from_array, report)?;
            if uvs.iter().any(|uv| !uv.is_finite()) {
                report.warn(
                    format!("{}.attributes.TEXCOORD_{set}", self.place),
                    "expected finite numbers: some read as 0",
                );
                uvs.iter_mut().filter(|uv| !uv.is_finite()).for_each(|uv| *uv = Vec2::ZERO);
            }
        }
        if first.is_empty() {
            first.clone_from(&second);
        }
        Ok([first, second])
    }

    fn colors(&self, used: &[u32], report: &mut Report) -> Read<Vec<Vec4>> {
        let semantic = Semantic::Colors(0);
        let Some(accessor) = self.gltf.get(&semantic) else { return Ok(Vec::new()) };
        let colors: Vec<Vec4> = if self.meshes.floats(accessor.index())?.0 == 3 {
            self.picked::<3, _>(semantic, used, |c| Vec3::from_array(c).extend(1.0), report)?
        } else {
            self.picked::<4, _>(semantic, used, Vec4::from_array, report)?
        };
        let inside = |c: &Vec4| c.cmpge(Vec4::ZERO).all() && c.cmple(Vec4::ONE).all();
        if !colors.iter().all(inside) {
            report.warn(format!("{}.attributes.COLOR_0", self.place), "expected 0 to 1: clamped");
        }
        // `max` first: it turns NaN into 0.
        Ok(colors.into_iter().map(|c| c.max(Vec4::ZERO).min(Vec4::ONE)).collect())
    }

    /// Default or node weights times the morph targets' deltas.
    fn morph(&self, pose: &Pose, used: &[u32], posed: &mut Posed, report: &mut Report) -> Read<()> {
        let count = self.gltf.morph_targets().len();
        if !pose.weights.is_empty() && pose.weights.len() != count {
            let message = format!("expected one weight for each of {count} targets, found {}", pose.weights.len());
            report.warn(format!("{}.targets", self.place), message);
        }
        for (t, target) in self.gltf.morph_targets().enumerate() {
            let weight = pose.weights.get(t).copied().unwrap_or(0.0);
            for (semantic, accessor) in [
                (Semantic::Positions, target.positions()),
                (Semantic::Normals, target.normals()),
                (Semantic::Tangents, target.tangents()),
            ] {
                let Some(id) = accessor.map(|accessor| accessor.index()) else { continue };
                let place = format!("{}.targets[{t}].{}", self.place, semantic.to_string());
                if self.gltf.get(&semantic).is_none() {
                    report.warn(&*place, "ignored: the primitive has no such attribute itself");
                    continue;
                }
                let accessor = Accessor::new(self.meshes.document, id)?;
                self.expect_count(accessor.count, &place)?;
                if weight == 0.0 {
                    continue;
                }
                let (3, deltas) = self.meshes.floats(id)? else {
                    return Err(Fault::invalid(place, "expected VEC3"));
                };
                posed.add(&semantic, weight, used.iter().map(|&v| vec3_at(&deltas, v)));
            }
        }
        Ok(())
    }

    fn skin(&self, pose: &Pose, used: &[u32], posed: &mut Posed, report: &mut Report) -> Read<()> {
        let Some(joints) = &pose.node_from_bind else { return Ok(()) };
        let mut sets = Vec::new();
        for set in 0.. {
            let joints = self.attribute::<4>(Semantic::Joints(set), report)?;
            let (Some(joints), Some(weights)) = (joints, self.attribute::<4>(Semantic::Weights(set), report)?) else {
                break;
            };
            sets.push((joints, weights));
        }
        if sets.is_empty() {
            return Ok(());
        }
        let influences = |v: u32| {
            let of =
                move |floats: &Rc<Vec<f32>>| floats.as_chunks::<4>().0.get(v as usize).copied().unwrap_or_default();
            sets.iter().flat_map(move |(joints, weights)| {
                let (joints, weights) = (of(&joints.0), of(&weights.0));
                (0..4).map(move |i| (joints[i] as usize, weights[i]))
            })
        };
        let mut faults = (None, None);
        for (i, &v) in used.iter().enumerate() {
            if let Some((joint, _)) = influences(v).find(|&(joint, _)| joint >= joints.len()) {
                faults.0 = faults.0.or(Some((v, joint)));
            }
            if influences(v).any(|(_, w)| !(w >= 0.0 && w.is_finite())) {
                faults.1 = faults.1.or(Some(v));
            }
            posed.skin(i, influences(v).filter_map(|(j, w)| Some((*joints.get(j)?, w))));
        }
        if let Some((v, joint)) = faults.0 {
            let message = format!("vertex {v} names joint {joint} of {}: ignored", joints.len());
            report.warn(format!("{}.attributes.JOINTS_0", self.place), message);
        }
        if let Some(v) = faults.1 {
            report.warn(format!("{}.attributes.WEIGHTS_0", self.place), format!("vertex {v} has a weight below 0"));
        }
        Ok(())
    }

    /// Validated indices; `None`: the vertices in order.
    fn indices(&self) -> Read<Option<Vec<u32>>> {
        let Some(id) = self.gltf.indices().map(|accessor| accessor.index()) else { return Ok(None) };
        let place = format!("{}.indices", self.place);
        let accessor = Accessor::new(self.meshes.document, id)?;
        if !matches!(accessor.component, DataType::U8 | DataType::U16 | DataType::U32) || accessor.normalized {
            return Err(Fault::invalid(place, format!("expected unsigned integers, accessors[{id}] is not")));
        }
        let indices = accessor.elements::<1, u32>(|v| v as u32)?.into_flattened();
        match indices.iter().position(|&i| i as usize >= self.vertices) {
            None => Ok(Some(indices)),
            Some(i) => {
                let message = format!("element {i} is {}, there are {} vertices", indices[i], self.vertices);
                Err(Fault::invalid(place, message))
            }
        }
    }

    /// All elements of an attribute; `None` where the primitive lacks it.
    fn attribute<const N: usize>(&self, semantic: Semantic, report: &mut Report) -> Read<Option<Chunks<N>>> {
        let Some(id) = self.gltf.get(&semantic).map(|accessor| accessor.index()) else { return Ok(None) };
        let place = format!("{}.attributes.{}", self.place, semantic.to_string());
        let accessor = Accessor::new(self.meshes.document, id)?;
        if semantic != Semantic::Positions {
            self.expect_count(accessor.count, &place)?;
        }
        self.check_format(semantic, &accessor, &place, report);
        let (width, floats) = self.meshes.floats(id)?;
        if width != N {
            return Err(Fault::invalid(place, format!("expected {N} components, accessors[{id}] has {width}")));
        }
        Ok(Some(Chunks(floats)))
    }

    fn picked<const N: usize, T>(
        &self,
        semantic: Semantic,
        used: &[u32],
        make: impl Fn([f32; N]) -> T,
        report: &mut Report,
    ) -> Read<Vec<T>> {
        Ok(self.attribute::<N>(semantic, report)?.map_or(Vec::new(), |elements| pick(&elements, used, make)))
    }

    fn expect_count(&self, count: usize, place: &str) -> Read<()> {
        if count == self.vertices {
            return Ok(());
        }
        Err(Fault::invalid(place, format!("expected {} elements as POSITION has, found {count}", self.vertices)))
    }

    fn finite(&self, positions: &Chunks<3>) -> Read<()> {
        let Some(i) = positions.get().iter().position(|p| p.iter().any(|v| !v.is_finite())) else { return Ok(()) };
        let message = format!("expected finite numbers, element {i} is {:?}", positions.get()[i]);
        Err(Fault::invalid(format!("{}.attributes.POSITION", self.place), message))
    }

    /// Warns of component types that glTF does not allow there; they are read all the same.
    fn check_format(&self, semantic: Semantic, accessor: &Accessor, place: &str, report: &mut Report) {
        let quantized = self.meshes.document.quantized;
        let (component, normalized) = (accessor.component, accessor.normalized);
        let unsigned = matches!(component, DataType::U8 | DataType::U16);
        let signed = matches!(component, DataType::I8 | DataType::I16);
        let float = component == DataType::F32;
        let allowed = match semantic {
            Semantic::Positions => float || quantized && (signed || unsigned),
            Semantic::Normals | Semantic::Tangents => float || quantized && signed && normalized,
            Semantic::TexCoords(_) => float || unsigned && normalized || quantized && (signed || unsigned),
            Semantic::Colors(_) | Semantic::Weights(_) => float || unsigned && normalized,
            Semantic::Joints(_) => unsigned && !normalized,
        };
        if !allowed {
            report.warn(place, format!("glTF does not allow {component:?} here (normalized: {normalized})"));
        }
    }
}

/// The elements of an accessor, `N` components each.
struct Chunks<const N: usize>(Rc<Vec<f32>>);

impl<const N: usize> Chunks<N> {
    fn get(&self) -> &[[f32; N]] {
        self.0.as_chunks::<N>().0
    }

    fn len(&self) -> usize {
        self.get().len()
    }
}

fn pick<const N: usize, T>(elements: &Chunks<N>, used: &[u32], make: impl Fn([f32; N]) -> T) -> Vec<T> {
    let elements = elements.get();
    used.iter().filter_map(|&v| elements.get(v as usize)).map(|&e| make(e)).collect()
}

fn vec3_at(floats: &[f32], vertex: u32) -> Vec3 {
    floats.as_chunks::<3>().0.get(vertex as usize).map_or(Vec3::ZERO, |&v| Vec3::from_array(v))
}
