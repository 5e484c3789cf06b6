//! Proxies: a mesh of few triangles in the place of a model's many meshes, where all of them are small in the picture.
//!
//! A mesh by itself keeps some triangles in its coarsest level, and its open borders. A model has dozens of meshes, and
//! they have dozens of parts that are not connected: thousands of triangles, however far away it is. [`join`] simplifies
//! all of them as one, without regard to their maps. Their colours become colours of vertices, of which there are more
//! before ([`subdivided`]), so that a window that is only painted stays one (hierarchical levels of detail: Erikson,
//! Manocha, Baxter, "HLODs for Faster Display of Large Static and Dynamic Environments", I3D 2001).
//!
//! Nothing chooses between a proxy and its members but their levels of detail. The first level of a proxy is empty; so
//! is the last one of a member ([`MeshEntry::ends_at`]). All go by the distance to one sphere
//! ([`MeshEntry::level_bounds`]) and by the same error, so that one or the other is drawn.

use super::levels::MOST_LEVELS;
use super::mesh::{Level, Mesh, MeshEntry};
use crate::space::bounds::Sphere;
use glam::{Affine3A, Vec2, Vec3, Vec3A, Vec4};
use meshopt::{
    SimplifyOptions, SimplifyVertex, VertexDataAdapter, simplify_scale, simplify_sloppy,
    simplify_with_attributes_and_locks,
};
use std::collections::{BTreeMap, HashMap};
use std::sync::{Mutex, PoisonError};
use xxhash_rust::xxh3::Xxh3;

/// Triangles that levels of a proxy are to have.
const TARGETS: [usize; 8] = [1600, 800, 400, 200, 100, 50, 24, 12];
/// Triangles that all levels are made of. Made of all triangles of a detailed model, each level would take up to a
/// third of a second, and have much the same error: of eight vehicles' models 0.78 to 1.22 times that, with the
/// error of these included, which is a tenth to a quarter of the first level's.
const FINE: usize = 4 * TARGETS[0];
/// Triangles of all members below which a proxy is not worth its memory.
const FEWEST_TO_JOIN: usize = 256;
/// Vertices at which a mesh is not subdivided any further.
const MOST_VERTICES: usize = 1 << 16;
/// Triangles of a level at least: fewer enclose nothing.
const FEWEST: usize = 4;
/// A level that keeps more than this part of the one before is not worth its memory.
const WORTHWHILE: f64 = 0.75;
/// Error of the coarsest level, as a part of the longest side.
const MOST_ERROR: f32 = 0.25;
/// Farthest error over the mean error around a vertex, which is the one that the simplifier reports. Of models of
/// several parts the farthest point of a level was measured up to 1.7 times as far.
const FARTHEST: f32 = 2.0;
/// Weight of a difference of normals, and of colours; see [`super::levels`]. Normals weigh less than there: what a proxy
/// is drawn for is small.
const NORMAL_WEIGHT: f32 = 0.05;
const COLOR_WEIGHT: f32 = 0.4;
/// Error of colours over that of places, where vertices are joined in cells, which have one colour each.
const COLORS_OF_CELLS: f32 = 1.5;

/// A mesh that a proxy is made of.
pub struct Member {
    /// The mesh, with normals; [`subdivided`] where its maps have colours of their own.
    pub mesh: Mesh,
    /// Triangles of the mesh as it is drawn.
    pub triangles: usize,
    /// Its place at rest.
    pub proxy_from_mesh: Affine3A,
    /// Colour of each of its vertices, linear RGB in 0..1.
    pub colors: Vec<Vec3>,
    /// Number of its surface: what is drawn with the same material in the proxy.
    pub surface: usize,
}

/// Result of [`join`].
#[derive(Debug)]
pub struct Proxy {
    /// A mesh for each surface, in the proxy's space.
    pub surfaces: Vec<MeshEntry>,
    /// The sphere around all members at rest, by which levels are chosen; the proxy's space.
    pub bounds: Sphere,
    /// Error of its first level, metres: where that is allowed, it is drawn in the place of its members.
    pub error: f32,
}

/// Splits edges of a mesh in halves until none is longer, with positions, normals, UVs and colours between those of
/// their ends. Neighbours split the edge that they share, so that nothing gapes.
pub fn subdivided(mesh: &Mesh, longest: f32) -> Mesh {
    let Mesh { positions, normals, uvs, colors, tangent_uv_set, indices, .. } = mesh.clone();
    let mut fine = Mesh { positions, normals, uvs, colors, tangent_uv_set, ..Mesh::default() };
    let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
    let mut open: Vec<[u32; 3]> = indices.as_chunks::<3>().0.to_vec();
    while let Some(triangle) = open.pop() {
        let place = |corner: usize| fine.positions.get(triangle[corner % 3] as usize).copied().unwrap_or_default();
        let length = |corner: usize| place(corner).distance(place(corner + 1));
        let Some(first) = (0..3).max_by(|&a, &b| length(a).total_cmp(&length(b))) else { continue };
        // Also of edges whose length is no number.
        let is_split = longest > 0.0 && length(first) > longest && fine.positions.len() < MOST_VERTICES;
        if !is_split {
            fine.indices.extend(triangle);
            continue;
        }
        let [a, b, c] = [first, first + 1, first + 2].map(|corner| triangle[corner % 3]);
        let middle = *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| add_middle(&mut fine, a, b));
        open.extend([[a, middle, c], [middle, b, c]]);
    }
    fine
}

/// Adds the vertex half-way between two.
fn add_middle(mesh: &mut Mesh, a: u32, b: u32) -> u32 {
    let [a, b] = [a, b].map(|end| end as usize);
    let between = |of: &[Vec3]| Some((*of.get(a)? + *of.get(b)?) / 2.0);
    mesh.positions.extend(between(&mesh.positions));
    mesh.normals.extend(between(&mesh.normals).map(Vec3::normalize_or_zero));
    let color = mesh.colors.get(a).zip(mesh.colors.get(b)).map(|(a, b)| (*a + *b) / 2.0);
    mesh.colors.extend(color);
    for set in &mut mesh.uvs {
        let middle: Option<Vec2> = set.get(a).zip(set.get(b)).map(|(a, b)| (*a + *b) / 2.0);
        set.extend(middle);
    }
    mesh.positions.len() as u32 - 1
}

/// Joins meshes to a proxy of so many surfaces; `None` where that would save nothing.
pub fn join(members: &[Member], surfaces: usize) -> Option<Proxy> {
    let joined = Joined::new(members)?;
    let bounds = Sphere::around(&joined.positions);
    let levels = joined.known_levels(bounds)?;
    let error = levels.first()?.error;
    let surfaces = (0..surfaces).map(|surface| joined.surface(surface, &levels, bounds)).collect();
    Some(Proxy { surfaces, bounds, error })
}

/// All members as one mesh.
struct Joined {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    colors: Vec<Vec3>,
    /// By vertex.
    surfaces: Vec<usize>,
    indices: Vec<u32>,
    /// Triangles of all members as they are drawn.
    triangles: usize,
}

/// Vertices and triangles as the simplifier takes them.
struct Simplifiable<'a> {
    positions: &'a [Vec3],
    normals: &'a [Vec3],
    colors: &'a [Vec3],
    indices: &'a [u32],
}

impl Simplifiable<'_> {
    /// The vertices, and their extent; `None` where that is none.
    fn vertices(&self) -> Option<(VertexDataAdapter<'_>, f32)> {
        let vertices = VertexDataAdapter::new(bytemuck::cast_slice(self.positions), size_of::<Vec3>(), 0).ok()?;
        let scale = simplify_scale(&vertices);
        (scale.is_normal() && (scale * scale).is_normal()).then_some((vertices, scale))
    }

    /// Indices of so many triangles or a few more, whose edges were collapsed, and their error, metres.
    fn by_edges(&self, target: usize) -> Option<(Vec<u32>, f32)> {
        let (vertices, scale) = self.vertices()?;
        let both = self.normals.iter().zip(self.colors);
        let attributes: Vec<f32> = both.flat_map(|(n, c)| n.to_array().into_iter().chain(c.to_array())).collect();
        let weights = [NORMAL_WEIGHT, NORMAL_WEIGHT, NORMAL_WEIGHT, COLOR_WEIGHT, COLOR_WEIGHT, COLOR_WEIGHT];
        let mut error = 0.0;
        let indices = simplify_with_attributes_and_locks(
            self.indices,
            &vertices,
            &attributes,
            &weights,
            size_of_val(&weights),
            &vec![SimplifyVertex::None; self.positions.len()],
            3 * target,
            MOST_ERROR,
            SimplifyOptions::Permissive | SimplifyOptions::Prune,
            Some(&mut error),
        );
        Some((indices, error * scale * FARTHEST))
    }

    /// The same of triangles whose vertices were joined in cells.
    fn by_cells(&self, target: usize) -> Option<(Vec<u32>, f32)> {
        let (vertices, scale) = self.vertices()?;
        let mut error = 0.0;
        let indices = simplify_sloppy(self.indices, &vertices, 3 * target, MOST_ERROR, Some(&mut error));
        Some((indices, error * scale * FARTHEST * COLORS_OF_CELLS))
    }
}

/// The vertices that indices name, and the indices in terms of these.
fn used_vertices(indices: &[u32], vertices: usize) -> (Vec<u32>, Vec<u32>) {
    let (mut used, mut places) = (Vec::new(), vec![None; vertices]);
    let mut place = |&vertex: &u32| {
        *places[vertex as usize].get_or_insert_with(|| {
            used.push(vertex);
            used.len() as u32 - 1
        })
    };
    let own = indices.iter().map(&mut place).collect();
    (used, own)
}

/// A level of all surfaces.
#[derive(Clone)]
struct JoinedLevel {
    indices: Vec<u32>,
    error: f32,
    /// Its faces are flat: normals of the vertices, which are not neighbours, say nothing.
    is_flat: bool,
}

impl Joined {
    /// `None` where a mesh is not one that can be simplified.
    fn new(members: &[Member]) -> Option<Self> {
        let triangles = members.iter().map(|member| member.triangles).sum();
        let mut joined = Self {
            positions: Vec::new(),
            normals: Vec::new(),
            colors: Vec::new(),
            surfaces: Vec::new(),
            indices: Vec::new(),
            triangles,
        };
        for Member { mesh, proxy_from_mesh, colors, surface, .. } in members {
            let count = mesh.positions.len();
            let is_valid = mesh.normals.len() == count
                && colors.len() == count
                && mesh.indices.len().is_multiple_of(3)
                && mesh.indices.iter().all(|&index| (index as usize) < count);
            if !is_valid {
                return None;
            }
            let first = joined.positions.len() as u32;
            let matrix = proxy_from_mesh.matrix3;
            let normals = matrix.inverse().transpose();
            joined.positions.extend(mesh.positions.iter().map(|&at| proxy_from_mesh.transform_point3(at)));
            joined
                .normals
                .extend(mesh.normals.iter().map(|&n| Vec3::from((normals * Vec3A::from(n)).normalize_or_zero())));
            joined.colors.extend(colors);
            joined.surfaces.resize(joined.positions.len(), *surface);
            let is_mirrored = matrix.determinant() < 0.0;
            let turned = |&[a, b, c]: &[u32; 3]| if is_mirrored { [a, c, b] } else { [a, b, c] };
            let triangles = mesh.indices.as_chunks::<3>().0.iter().map(turned);
            joined.indices.extend(triangles.flatten().map(|index| index + first));
        }
        let numbers = joined.positions.iter().chain(&joined.normals).chain(&joined.colors);
        let is_finite = numbers.clone().all(|vector| vector.is_finite());
        (is_finite && triangles >= FEWEST_TO_JOIN).then_some(joined)
    }

    /// [`Self::levels`], which take seconds for detailed models: what is joined again, as for another world of the same
    /// scene, has those that were found first.
    fn known_levels(&self, bounds: Sphere) -> Option<Vec<JoinedLevel>> {
        static KNOWN: Mutex<BTreeMap<u128, Option<Vec<JoinedLevel>>>> = Mutex::new(BTreeMap::new());
        let key = self.hash();
        let known = || KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(levels) = known().get(&key) {
            return levels.clone();
        }
        let levels = self.levels(bounds);
        known().insert(key, levels.clone());
        levels
    }

    /// Hash of all that levels are made of.
    fn hash(&self) -> u128 {
        let mut hash = Xxh3::new();
        hash.update(&(self.triangles as u64).to_le_bytes());
        for vectors in [&self.positions, &self.normals, &self.colors] {
            hash.update(&(vectors.len() as u64).to_le_bytes());
            hash.update(bytemuck::cast_slice(vectors));
        }
        hash.update(bytemuck::cast_slice(&self.indices));
        hash.digest128()
    }

    /// Levels in the order of their errors, each worth its memory; at most as many as a mesh may have beside an empty
    /// one.
    fn levels(&self, bounds: Sphere) -> Option<Vec<JoinedLevel>> {
        let (positions, normals, colors) = (&self.positions, &self.normals, &self.colors);
        let whole = Simplifiable { positions, normals, colors, indices: &self.indices };
        let (indices, fine_error) = whole.by_edges(FINE)?;
        // The simplifier goes through all vertices that it is given.
        let (own, fine_indices) = used_vertices(&indices, positions.len());
        let [positions, normals, colors] =
            [positions, normals, colors].map(|of| own.iter().map(|&vertex| of[vertex as usize]).collect::<Vec<_>>());
        let fine = Simplifiable { positions: &positions, normals: &normals, colors: &colors, indices: &fine_indices };
        let level = |(indices, error): (Vec<u32>, f32), is_flat| JoinedLevel {
            indices: indices.into_iter().map(|vertex| own[vertex as usize]).collect(),
            error: fine_error + error,
            is_flat,
        };
        let targets = TARGETS.into_iter().flat_map(|target| {
            [
                fine.by_edges(target).map(|found| level(found, false)),
                fine.by_cells(target).map(|found| level(found, true)),
            ]
        });
        let mut found: Vec<JoinedLevel> = targets.flatten().collect();
        found.retain(|level| level.indices.len() >= 3 * FEWEST && level.error <= MOST_ERROR * 2.0 * bounds.radius);
        found.sort_by(|a, b| a.error.total_cmp(&b.error).then(a.indices.len().cmp(&b.indices.len())));
        let mut levels: Vec<JoinedLevel> = Vec::new();
        for level in found {
            let before = levels.last().map_or(3 * self.triangles, |finer| finer.indices.len());
            if level.indices.len() as f64 <= WORTHWHILE * before as f64 {
                levels.push(level);
            }
        }
        // The coarsest ones are worth most.
        levels.drain(..levels.len().saturating_sub(MOST_LEVELS - 1));
        Some(levels)
    }

    /// The triangles of a surface in each level, as a mesh whose first level is empty.
    fn surface(&self, surface: usize, levels: &[JoinedLevel], bounds: Sphere) -> MeshEntry {
        let mut mesh = Mesh { name: "proxy".into(), ..Mesh::default() };
        let mut placed = vec![None; self.positions.len()];
        let own: Vec<Vec3> =
            self.colors.iter().zip(&self.surfaces).filter(|(_, of)| **of == surface).map(|(color, _)| *color).collect();
        let mean = own.iter().sum::<Vec3>() / own.len().max(1) as f32;
        let color = |vertex: usize| if self.surfaces[vertex] == surface { self.colors[vertex] } else { mean };
        let (mut entry_levels, mut indices) = (vec![Level { first_index: 0, index_count: 0, error: 0.0 }], Vec::new());
        for level in levels {
            let first_index = indices.len() as u32;
            for triangle in level.indices.as_chunks::<3>().0 {
                let corners = triangle.map(|index| index as usize);
                if self.surface_of(corners) != surface {
                    continue;
                }
                let [a, b, c] = corners.map(|corner| self.positions[corner]);
                let face = (b - a).cross(c - a).normalize_or_zero();
                for corner in corners {
                    let new = mesh.positions.len() as u32;
                    let vertex = if level.is_flat { new } else { *placed[corner].get_or_insert(new) };
                    if vertex == new {
                        mesh.positions.push(self.positions[corner]);
                        mesh.normals.push(if level.is_flat { face } else { self.normals[corner] });
                        mesh.colors.push(color(corner).clamp(Vec3::ZERO, Vec3::ONE).extend(1.0));
                    }
                    indices.push(vertex);
                }
            }
            let index_count = indices.len() as u32 - first_index;
            entry_levels.push(Level { first_index, index_count, error: level.error });
        }
        // What sets tangents would look for maps.
        mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); mesh.positions.len()];
        MeshEntry::of_levels(mesh, entry_levels, indices, bounds)
    }

    /// The surface of most corners of a triangle.
    fn surface_of(&self, corners: [usize; 3]) -> usize {
        let [a, b, c] = corners.map(|corner| self.surfaces[corner]);
        if b == c { b } else { a }
    }
}
