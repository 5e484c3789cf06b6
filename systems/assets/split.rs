//! Meshes cut into pieces by the planes of a grid, so that each piece can choose its own lights.
//!
//! [`Grid::new`] decides how many cells the mesh's box has along each axis; [`split`] cuts the triangles at the planes
//! between them and gives every cell that holds any a mesh of its own. [`crate::draw::pieces`] puts them into the
//! world.
//!
//! Nothing may gape. A triangle is cut only where an edge crosses a plane, and where that is depends on nothing but the
//! edge's two positions, taken in a fixed order: all triangles at an edge are cut at the same points, to the bit, be it
//! that they share its vertices or, at a seam of the UVs, only their places. Each axis is cut by bisection, the middle
//! plane first, the same planes for the whole mesh; so an edge meets its planes in one order on all sides.

use super::mesh::Mesh;
use crate::space::bounds::Aabb;
use glam::{DVec3, UVec3, Vec2, Vec3};
use std::cmp::Ordering;
use std::collections::HashMap;

/// Pieces of one mesh, at most: each is a draw.
pub const MOST_PIECES: u32 = 16_384;

/// Triangles that cutting may make of a small mesh; a large one may become four times as many.
const MOST_TRIANGLES: f64 = 1e6;

/// By so much of its length a cell may be too long, so that 12 m in cells of 3 m are four in spite of rounding.
const SLACK: f64 = 1e-4;

/// Division of a mesh's box: evenly, into this many cells along each axis.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Grid {
    /// Cells along x, y and z; at least 1.
    pub counts: UVec3,
}

impl Grid {
    /// The fewest cells that are at most this long (object space). A length that is not above 0, or infinite, divides
    /// nothing along its axis.
    ///
    /// Cells are longer than asked where they would be more than [`MOST_PIECES`], or give far more triangles than the
    /// mesh has; see [`Grid::cell`].
    pub fn new(mesh: &Mesh, longest: Vec3) -> Self {
        let whole = Self { counts: UVec3::ONE };
        let Aabb { min, max } = mesh.aabb();
        let extent = max.as_dvec3() - min.as_dvec3();
        if !mesh.positions.iter().all(|p| p.is_finite()) {
            return whole;
        }
        let mut longest = longest.as_dvec3();
        let ends = longest.is_finite_mask() & longest.cmpgt(DVec3::ZERO);
        longest = DVec3::select(ends, longest, DVec3::INFINITY);
        loop {
            let counts = (extent / longest - SLACK).ceil().max(DVec3::ONE);
            if counts == DVec3::ONE || is_bounded(mesh, extent / counts, counts) {
                return Self { counts: counts.as_uvec3() };
            }
            longest *= 1.25;
        }
    }

    /// Tells if there is only one cell.
    pub fn is_whole(self) -> bool {
        self.counts == UVec3::ONE
    }

    /// The size of a cell of a box of this size.
    pub fn cell(self, extent: Vec3) -> Vec3 {
        extent / self.counts.as_vec3()
    }

    /// Places of the planes between the cells along an axis, object space, ascending.
    fn planes(self, aabb: Aabb, axis: usize) -> Vec<f32> {
        let (min, max) = (f64::from(aabb.min[axis]), f64::from(aabb.max[axis]));
        let count = self.counts[axis];
        (1..count).map(|i| (min + (max - min) * f64::from(i) / f64::from(count)) as f32).collect()
    }
}

/// Tells if cutting makes a sensible number of pieces and triangles, judged by the mesh's triangles. A flat one meets
/// about as many cells as its three shadows, on the sides of a cell, have area, and one more for each plane that its
/// box spans.
fn is_bounded(mesh: &Mesh, cell: DVec3, counts: DVec3) -> bool {
    let cell = DVec3::select(cell.cmpgt(DVec3::ZERO), cell, DVec3::INFINITY);
    let most = MOST_TRIANGLES.max(mesh.triangle_count() as f64 * 4.0);
    let mut met = 0.0;
    for triangle in mesh.indices.as_chunks::<3>().0 {
        let [Some(a), Some(b), Some(c)] = triangle.map(|i| mesh.positions.get(i as usize)) else { continue };
        let [a, b, c] = [a, b, c].map(|p| p.as_dvec3() / cell);
        let shadows = (b - a).cross(c - a).abs().element_sum() * 0.5;
        met += 1.0 + shadows + (a.max(b).max(c) - a.min(b).min(c)).element_sum();
    }
    met <= most && met.min(counts.element_product()) <= f64::from(MOST_PIECES)
}

/// Cuts a mesh into the cells of a grid; each piece is one cell's, and cells without triangles have none. The pieces
/// cover what the mesh covered, with its attributes: on the cuts they are interpolated, normals and tangents to unit
/// length. Triangles that index beyond the vertices are left out.
///
/// Tangents have to be there already ([`crate::assets::tangents::compute_tangents`]): those of a piece by itself would
/// be others.
pub fn split(mesh: &Mesh, grid: Grid) -> Vec<Mesh> {
    let aabb = mesh.aabb();
    let count = mesh.positions.len();
    let mut whole = Polygons::default();
    let is_valid = |triangle: &&[u32; 3]| triangle.iter().all(|&index| (index as usize) < count);
    mesh.indices.as_chunks::<3>().0.iter().filter(is_valid).for_each(|triangle| whole.push(triangle));
    let mut groups = vec![whole];
    let mut cutter = Cutter { mesh: Mesh { indices: Vec::new(), ..mesh.clone() }, cuts: HashMap::new() };
    for axis in 0..3 {
        let planes = grid.planes(aabb, axis);
        let mut parts = Vec::with_capacity(groups.len());
        groups.into_iter().for_each(|group| cutter.divide(group, axis, &planes, &mut parts));
        groups = parts;
    }
    cutter.normalize_after(count);
    let mut local = vec![u32::MAX; cutter.mesh.positions.len()];
    let pieces = groups.iter().enumerate();
    pieces.map(|(i, group)| piece(&cutter.mesh, format!("{} piece {i}", mesh.name), group, &mut local)).collect()
}

/// Convex polygons, one after another. Triangles are cut as such and made triangles again at the end: their diagonals
/// would be cut, too.
#[derive(Default)]
struct Polygons {
    /// Vertices.
    corners: Vec<u32>,
    /// End of each polygon in `corners`.
    ends: Vec<usize>,
}

impl Polygons {
    fn push(&mut self, corners: &[u32]) {
        self.corners.extend_from_slice(corners);
        self.ends.push(self.corners.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        let starts = std::iter::once(&0).chain(&self.ends);
        starts.zip(&self.ends).map(|(&start, &end)| &self.corners[start..end])
    }
}

/// The triangles of a convex polygon.
fn fan(polygon: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let rest = polygon.get(1..).unwrap_or_default();
    rest.windows(2).map(|pair| [polygon[0], pair[0], pair[1]])
}

/// A mesh of some of the polygons, with the vertices that they use. `local` is `u32::MAX` throughout, before and after.
fn piece(mesh: &Mesh, name: String, polygons: &Polygons, local: &mut [u32]) -> Mesh {
    let mut used: Vec<usize> = Vec::new();
    let mut indices = Vec::with_capacity(polygons.corners.len() * 3);
    for vertex in polygons.iter().flat_map(fan).flatten() {
        let local = &mut local[vertex as usize];
        if *local == u32::MAX {
            *local = used.len() as u32;
            used.push(vertex as usize);
        }
        indices.push(*local);
    }
    used.iter().for_each(|&vertex| local[vertex] = u32::MAX);
    fn gather<T: Copy>(values: &[T], used: &[usize]) -> Vec<T> {
        used.iter().filter_map(|&vertex| values.get(vertex).copied()).collect()
    }
    Mesh {
        name,
        positions: gather(&mesh.positions, &used),
        normals: gather(&mesh.normals, &used),
        tangents: gather(&mesh.tangents, &used),
        uvs: [gather(&mesh.uvs[0], &used), gather(&mesh.uvs[1], &used)],
        tangent_uv_set: mesh.tangent_uv_set,
        colors: gather(&mesh.colors, &used),
        indices,
    }
}

/// The mesh's vertices, with those that cutting adds.
struct Cutter {
    mesh: Mesh,
    /// The vertex on each edge that was cut, by the edge's vertices, lower first. An edge is cut once: after that it is
    /// two others.
    cuts: HashMap<[u32; 2], u32>,
}

impl Cutter {
    /// Shares polygons out between the planes, in order; what lies in a plane goes below it. Parts without any are left
    /// out.
    fn divide(&mut self, polygons: Polygons, axis: usize, planes: &[f32], out: &mut Vec<Polygons>) {
        if polygons.ends.is_empty() {
            return;
        }
        let (lower, upper) = planes.split_at(planes.len() / 2);
        let Some((&middle, upper)) = upper.split_first() else { return out.push(polygons) };
        let (mut below, mut above) = (Polygons::default(), Polygons::default());
        polygons.iter().for_each(|polygon| self.cut(polygon, axis, middle, &mut below, &mut above));
        drop(polygons);
        self.divide(below, axis, lower, out);
        self.divide(above, axis, upper, out);
    }

    fn cut(&mut self, polygon: &[u32], axis: usize, plane: f32, below: &mut Polygons, above: &mut Polygons) {
        let side = |mesh: &Mesh, vertex: u32| {
            mesh.positions[vertex as usize][axis].partial_cmp(&plane).unwrap_or(Ordering::Equal)
        };
        let is_below = polygon.iter().any(|&vertex| side(&self.mesh, vertex) == Ordering::Less);
        let is_above = polygon.iter().any(|&vertex| side(&self.mesh, vertex) == Ordering::Greater);
        if !(is_below && is_above) {
            return if is_above { above.push(polygon) } else { below.push(polygon) };
        }
        let (mut lower, mut upper, mut crossings) = (Vec::new(), Vec::new(), 0);
        for (i, &from) in polygon.iter().enumerate() {
            let to = polygon[(i + 1) % polygon.len()];
            let (here, next) = (side(&self.mesh, from), side(&self.mesh, to));
            if here != Ordering::Greater {
                lower.push(from);
            }
            if here != Ordering::Less {
                upper.push(from);
            }
            if here != Ordering::Equal && next == here.reverse() {
                let between = self.cut_edge(from, to, axis, plane);
                lower.push(between);
                upper.push(between);
            }
            crossings += usize::from(here == Ordering::Equal || next == here.reverse());
        }
        // A sliver that rounding has bent may cross more than twice; triangles cannot.
        if crossings > 2 {
            return fan(polygon).for_each(|triangle| self.cut(&triangle, axis, plane, below, above));
        }
        below.push(&lower);
        above.push(&upper);
    }

    /// The vertex where an edge crosses the plane.
    fn cut_edge(&mut self, from: u32, to: u32, axis: usize, plane: f32) -> u32 {
        let key = [from.min(to), from.max(to)];
        if let Some(&vertex) = self.cuts.get(&key) {
            return vertex;
        }
        let position = |vertex: u32| self.mesh.positions[vertex as usize];
        // By place, not by index: a seam has two pairs of vertices at the same two places.
        let order = position(from).to_array().partial_cmp(&position(to).to_array());
        let (from, to) = if order == Some(Ordering::Greater) { (to, from) } else { (from, to) };
        let (start, end) = (f64::from(position(from)[axis]), f64::from(position(to)[axis]));
        let vertex = self.add_between(from as usize, to as usize, (f64::from(plane) - start) / (end - start));
        // Exactly, so that the next cut and the piece's box know.
        self.mesh.positions[vertex as usize][axis] = plane;
        self.cuts.insert(key, vertex);
        vertex
    }

    /// Gives the normals and tangents of new vertices unit length: not before, as what is between two of them is to be
    /// between the old ones, too.
    fn normalize_after(&mut self, count: usize) {
        for normal in self.mesh.normals.iter_mut().skip(count) {
            *normal = normal.try_normalize().unwrap_or(Vec3::Y);
        }
        for tangent in self.mesh.tangents.iter_mut().skip(count) {
            // What is zero here gets a tangent from the normal where tangents are checked.
            *tangent = tangent.truncate().normalize_or_zero().extend(tangent.w);
        }
    }

    /// Adds the vertex at a part of the way between two.
    fn add_between(&mut self, from: usize, to: usize, part: f64) -> u32 {
        let mesh = &mut self.mesh;
        let vertex = mesh.positions.len() as u32;
        let mix = |a: f32, b: f32| (f64::from(a) + (f64::from(b) - f64::from(a)) * part) as f32;
        let mix2 = |a: Vec2, b: Vec2| Vec2::new(mix(a.x, b.x), mix(a.y, b.y));
        let mix3 = |a: Vec3, b: Vec3| Vec3::new(mix(a.x, b.x), mix(a.y, b.y), mix(a.z, b.z));
        add(&mut mesh.positions, from, to, mix3);
        add(&mut mesh.normals, from, to, mix3);
        // The signs of a triangle's corners are the same.
        add(&mut mesh.tangents, from, to, |a, b| mix3(a.truncate(), b.truncate()).extend(a.w));
        mesh.uvs.iter_mut().for_each(|uvs| add(uvs, from, to, mix2));
        add(&mut mesh.colors, from, to, |a, b| mix3(a.truncate(), b.truncate()).extend(mix(a.w, b.w)));
        vertex
    }
}

/// Appends what lies between two elements; an attribute that the mesh does not have stays empty.
fn add<T: Copy>(values: &mut Vec<T>, from: usize, to: usize, mix: impl Fn(T, T) -> T) {
    if let (Some(&a), Some(&b)) = (values.get(from), values.get(to)) {
        values.push(mix(a, b));
    }
}
