//! Tangents and levels of detail, from the [`Cache`] where a mesh has been loaded before.
//!
//! The systems make both in the first frame: three to five microseconds of processor time per triangle, seconds for
//! scanned models. Here they are made before it, with the same functions, and kept, under the hash of the mesh and of
//! all that works them out, so that no other version of Relief takes them for its own.

use super::cache::{Cache, Key};
use bytemuck::{Pod, pod_collect_to_vec};
use std::collections::BTreeMap;
use systems::assets::{Level, Library, Mesh, MeshEntry};
use systems::ecs::parallel::{in_parallel, map_in_parallel};

/// Triangles of the smallest meshes that are worth a file: one is worked out in some milliseconds.
const FEWEST_TRIANGLES: usize = 2048;

/// Sources that results depend on, and their format: part of every key.
const MADE_BY: [&str; 5] = [
    include_str!("../../systems/assets/tangents.rs"),
    include_str!("../../systems/assets/levels.rs"),
    include_str!("meshes.rs"),
    include_str!("../../Cargo.lock"),
    std::env::consts::ARCH,
];

/// Parts of a result: positions, normals, tangents, two sets of UVs, colours, indices; levels and their indices.
const PARTS: usize = 9;

/// Gives the large meshes of a library their tangents and levels, in parallel. The others are left to the systems.
pub fn finish_meshes(library: &mut Library, cache: &Cache) {
    systems::set_threads(None);
    let is_large = |entry: &&mut MeshEntry| entry.mesh.triangle_count() >= FEWEST_TRIANGLES;
    let pending: Vec<_> = library.unfinished_meshes().filter(is_large).collect();
    let mut made_by = blake3::Hasher::new();
    MADE_BY.iter().for_each(|part| add(&mut made_by, part.as_bytes()));
    // Equal ones together, to be worked out once.
    let mut equal: BTreeMap<[u8; blake3::OUT_LEN], Vec<&mut MeshEntry>> = BTreeMap::new();
    for (key, entry) in map_in_parallel(pending.into_iter(), |entry| (key(made_by.clone(), entry), entry)) {
        equal.entry(*key.as_bytes()).or_default().push(entry);
    }
    in_parallel(equal.into_iter(), |(key, mut entries)| {
        if let Some((first, others)) = entries.split_first_mut() {
            finish(first, &Key::from_bytes(key), cache);
            others.iter_mut().for_each(|other| copy(first, other));
        }
    });
}

fn finish(entry: &mut MeshEntry, key: &Key, cache: &Cache) {
    if let Some((mesh, levels, level_indices)) = cache.read(key, |bytes| unpack(&entry.mesh, bytes)) {
        (entry.mesh, entry.levels, entry.level_indices) = (mesh, levels, level_indices);
        entry.tangents_ready = true;
    } else {
        entry.finish();
        cache.write(key, &pack(entry));
    }
}

/// All but the name.
fn copy(from: &MeshEntry, to: &mut MeshEntry) {
    let name = std::mem::take(&mut to.mesh.name);
    *to = MeshEntry { mesh: Mesh { name, ..from.mesh.clone() }, ..from.clone() };
}

/// Makes a key from the data hashed so far, and all of an entry that tangents and levels depend on. Its levels are not
/// yet there, or it would be finished, unless it is one that is to have none.
fn key(mut hasher: blake3::Hasher, entry: &MeshEntry) -> Key {
    let end = entry.ends_at.map_or(u64::MAX, |error| error.to_bits().into());
    let state = [entry.mesh.tangent_uv_set as u64, entry.tangents_ready.into(), entry.levels.len() as u64, end];
    add(&mut hasher, bytemuck::cast_slice(&state));
    parts(entry).into_iter().for_each(|part| add(&mut hasher, part));
    hasher.finalize()
}

/// With its length, so that parts cannot run into each other.
fn add(hasher: &mut blake3::Hasher, part: &[u8]) {
    hasher.update(&(part.len() as u64).to_le_bytes()).update(part);
}

fn parts(entry: &MeshEntry) -> [&[u8]; PARTS] {
    let MeshEntry { mesh, levels, level_indices, .. } = entry;
    [
        bytemuck::cast_slice(&mesh.positions),
        bytemuck::cast_slice(&mesh.normals),
        bytemuck::cast_slice(&mesh.tangents),
        bytemuck::cast_slice(&mesh.uvs[0]),
        bytemuck::cast_slice(&mesh.uvs[1]),
        bytemuck::cast_slice(&mesh.colors),
        bytemuck::cast_slice(&mesh.indices),
        bytemuck::cast_slice(levels),
        bytemuck::cast_slice(level_indices),
    ]
}

/// Packs the sizes of the parts in bytes, then the parts.
fn pack(entry: &MeshEntry) -> Vec<u8> {
    let parts = parts(entry);
    [parts.map(|part| (part.len() as u64).to_ne_bytes()).as_flattened(), &parts.concat()].concat()
}

/// The mesh that `raw` becomes; `None` for anything that [`pack`] has not written.
fn unpack(raw: &Mesh, bytes: &[u8]) -> Option<(Mesh, Vec<Level>, Vec<u32>)> {
    let (sizes, mut rest) = bytes.split_at_checked(PARTS * size_of::<u64>())?;
    let mut sizes = pod_collect_to_vec::<u8, u64>(sizes).into_iter();
    let mut part = || {
        let (part, others) = rest.split_at_checked(usize::try_from(sizes.next()?).ok()?)?;
        rest = others;
        Some(part)
    };
    let mesh = Mesh {
        name: raw.name.clone(),
        tangent_uv_set: raw.tangent_uv_set,
        positions: items(part()?)?,
        normals: items(part()?)?,
        tangents: items(part()?)?,
        uvs: [items(part()?)?, items(part()?)?],
        colors: items(part()?)?,
        indices: items(part()?)?,
    };
    let (levels, level_indices) = (items(part()?)?, items(part()?)?);
    (rest.is_empty() && is_whole(&mesh, &levels, &level_indices)).then_some((mesh, levels, level_indices))
}

/// Tells if all indices point inside the data.
fn is_whole(mesh: &Mesh, levels: &[Level], level_indices: &[u32]) -> bool {
    let vertices = mesh.positions.len();
    let all = mesh.indices.len() + level_indices.len();
    let is_inside = |level: &Level| (level.first_index as usize).saturating_add(level.index_count as usize) <= all;
    [mesh.normals.len(), mesh.tangents.len()] == [vertices; 2]
        && [mesh.uvs[0].len(), mesh.uvs[1].len(), mesh.colors.len()]
            .iter()
            .all(|&count| count == 0 || count == vertices)
        && mesh.indices.iter().chain(level_indices).all(|&index| (index as usize) < vertices)
        && !levels.is_empty()
        && levels.iter().all(is_inside)
}

fn items<T: Pod>(bytes: &[u8]) -> Option<Vec<T>> {
    bytes.len().is_multiple_of(size_of::<T>()).then(|| pod_collect_to_vec(bytes))
}
