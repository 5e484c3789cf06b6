//! Openness of a world: which of its objects hide the sky, and when corners have to be asked anew.
//!
//! Objects that stand hide the sky: drawn and solid, larger than [`LEAST`], with nothing [`Interpolated`] on them or
//! above them, nor anything that an input has [`Moved`]. So a car that drives by costs nothing here.

use super::movers::{Mover, Movers};
use crate::assets::library::Library;
use crate::assets::material::AlphaMode;
use crate::assets::mesh::MeshId;
use crate::cells::cells::{Cell, Cells};
use crate::draw::instance_records::InstanceRecords;
use crate::draw::list::{DrawList, PipelineKey};
use crate::draw::pieces::PieceOf;
use crate::ecs::tables::Records;
use crate::lights::components::NoShadow;
use crate::space::bounds::Aabb;
use crate::space::interpolation::{Interpolated, Moved};
use crate::space::transform::GlobalTransform;
use crate::weather::openness::bricks::Openness;
use crate::weather::openness::corners::{Occluder, Occluders};
use crate::weather::openness::lattice::{Lattice, TooLarge};
use crate::weather::openness::rooms::Room;
use crate::weather::sky::{Sky, shared};
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;
use glam::{Affine3A, Mat3A, Vec3};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Size from which on an object hides the sky, metres.
const LEAST: f32 = 1.0;
/// Size from which on things may move on an object, metres.
const LARGE: f32 = 10.0;

/// Object of a slot, as it was when corners were asked.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Known {
    object: EntityIndex,
    /// Its place, if it hides something.
    stands: Option<[[f32; 4]; 3]>,
    /// It is a part of a mover.
    moves: bool,
}

/// Object that hides the sky.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Standing {
    mesh: MeshId,
    world_from_object: [[f32; 4]; 3],
    double_sided: bool,
    mirrored: bool,
    /// Things may move on it.
    is_large: bool,
}

/// Objects that hide the sky, and what corners see of it.
#[derive(Resource, Default, Debug)]
pub struct OpennessState {
    /// By slot.
    known: Vec<Option<Known>>,
    /// Boxes of movers by their topmost entity, in its own space: around all that is drawn of them.
    boxes: BTreeMap<Entity, Aabb>,
    standing: Vec<Standing>,
    /// Boxes of rooms, when corners were asked.
    cells: Vec<Aabb>,
    /// Number by which equal sets of triangles are known.
    hash: u128,
    lattice: Option<Arc<Lattice>>,
    openness: Option<Arc<Openness>>,
    /// Movers of the last frame, and the same as shaders read them.
    placed: Vec<Mover>,
    listed: Arc<Movers>,
    /// The world has more corners than there may be, which nobody has been told yet.
    is_too_large: bool,
}

/// Place where lattices are kept from run to run.
pub trait LatticeStore: Send + Sync {
    /// The bytes that were written for a hash of triangles.
    fn read(&self, hash: u128) -> Option<Vec<u8>>;

    /// Keeps bytes. Where that fails, they are made anew.
    fn write(&self, hash: u128, bytes: &[u8]);
}

/// Store of a world. Worlds without one ask all corners anew.
#[derive(Resource, Clone)]
pub struct KeptLattices(pub Arc<dyn LatticeStore>);

/// Lattices that some world has, and their openness under skies: shared by the worlds of a process.
static LATTICES: Mutex<Vec<(u128, Weak<Lattice>)>> = Mutex::new(Vec::new());
static WEIGHED: Mutex<Vec<(Weighed, Weak<Openness>)>> = Mutex::new(Vec::new());

/// A lattice, by its triangles, under a sky.
struct Weighed {
    hash: u128,
    sky: Weak<Sky>,
}

impl PartialEq for Weighed {
    fn eq(&self, other: &Self) -> bool {
        self.hash == other.hash && self.sky.ptr_eq(&other.sky)
    }
}

/// Brings the openness of a frame up to date. Nothing is done under a gradient.
pub(crate) fn update_openness(world: &mut World) {
    let Some(sky) = world.resource::<DrawList>().sky.as_ref().map(|drawn| drawn.sky.clone()) else {
        // What changes from now on is not seen.
        world.resource_mut::<OpennessState>().bypass_change_detection().known.clear();
        return;
    };
    world.resource_scope(|world, mut state: Mut<OpennessState>| {
        if state.has_changed(world) {
            state.ask(world);
        }
        let (hash, lattice) = (state.hash, state.lattice.clone());
        state.openness = lattice.map(|lattice| {
            let key = Weighed { hash, sky: Arc::downgrade(&sky) };
            shared(&WEIGHED, key, |_| Openness::new(&lattice, &sky))
        });
        let openness = state.openness.clone();
        let movers = state.movers(world);
        let mut list = world.resource_mut::<DrawList>();
        let list = list.bypass_change_detection();
        list.light_features.openness = openness.is_some();
        if let Some(drawn) = &mut list.sky {
            drawn.set_openness(openness, movers);
        }
    });
}

impl OpennessState {
    /// Takes the warning that nothing hides the sky, if that is so.
    pub fn take_warning(&mut self) -> Option<&'static str> {
        let warning = "the scene is too large or too rough to find what hides the sky: its light reaches all places";
        std::mem::take(&mut self.is_too_large).then_some(warning)
    }

    /// Movers where they are now, as shaders read them; those of the frame before if none has moved.
    fn movers(&mut self, world: &World) -> Arc<Movers> {
        let place = |entity: Entity| world.get::<GlobalTransform>(entity).map(GlobalTransform::affine);
        let boxes = self.boxes.iter();
        let all: Vec<_> =
            boxes.filter_map(|(entity, aabb)| Some(Mover { place: place(*entity)?, aabb: *aabb })).collect();
        let rooms = self.openness.as_ref().map_or(&[][..], |openness| &openness.rooms);
        if self.placed != all || self.listed.rooms() != rooms {
            self.listed = Arc::new(Movers::new(rooms, &all));
            self.placed = all;
        }
        self.listed.clone()
    }

    /// Tells if something that stands has come, gone or moved since corners were asked.
    fn has_changed(&mut self, world: &World) -> bool {
        let list = world.resource::<DrawList>();
        if self.known.is_empty() {
            return true;
        }
        let (mut has_changed, mut room) = (false, Vec::new());
        let ranges = list.instances.dirty.ranges(0);
        let records = InstanceRecords::new(world, &list.instances);
        let records = records.read(&ranges, &mut room);
        for (slot, record) in ranges.into_iter().flatten().zip(records) {
            let object = list.instances.objects.get(slot as usize).copied().flatten();
            let known = self.known.get(slot as usize).copied().flatten();
            match (object, known) {
                (Some(object), Some(known)) if known.object == object => {
                    has_changed |= known.stands.is_some_and(|stood| stood != record.world_from_object);
                }
                (None, None) => {}
                (None, Some(known)) => has_changed |= known.stands.is_some() || known.moves,
                (Some(_), _) => has_changed = true,
            }
        }
        has_changed
    }

    /// Finds what stands, and asks the corners if that is another set than before.
    fn ask(&mut self, world: &World) {
        let list = world.resource::<DrawList>();
        let mut room = Vec::new();
        let records = InstanceRecords::new(world, &list.instances);
        let records = records.read(std::slice::from_ref(&(0..records.slot_count())), &mut room);
        self.known.clear();
        self.known.resize(records.len().max(1), None);
        let library = world.resource::<Library>();
        let mut drawn: Vec<_> = list.drawn().collect();
        drawn.sort_unstable_by_key(|(slot, _)| *slot);
        let mut standing = Vec::new();
        self.boxes.clear();
        for (slot, key) in drawn {
            let Some(object) = list.instances.objects[slot as usize] else { continue };
            let world_from_object = records[slot as usize].world_from_object;
            let entity = world.entities().resolve_from_index(object);
            let is_solid = key.pipeline.alpha != AlphaMode::Blend && world.get::<NoShadow>(entity).is_none();
            let entry = library.mesh(key.mesh).filter(|_| is_solid);
            let mover = mover_of(world, entity);
            if let (Some(mover), Some(entry)) = (mover, entry) {
                let own = world.get::<GlobalTransform>(mover).map_or(Affine3A::IDENTITY, GlobalTransform::affine);
                let within = entry.aabb.transformed(&(own.inverse() * place_of(&world_from_object)));
                let known = self.boxes.entry(mover).or_insert(within);
                *known = Aabb { min: known.min.min(within.min), max: known.max.max(within.max) };
            }
            let entry = entry.filter(|_| mover.is_none());
            // A piece is of something larger.
            let least = if world.get::<PieceOf>(entity).is_some() { LARGE } else { 0.0 };
            let size =
                entry.map_or(0.0, |entry| size(&entry.aabb.transformed(&place_of(&world_from_object))).max(least));
            let stands = (size >= LEAST).then_some(world_from_object);
            self.known[slot as usize] = Some(Known { object, stands, moves: mover.is_some() });
            if stands.is_some() {
                let PipelineKey { double_sided, mirrored, .. } = key.pipeline;
                let is_large = size >= LARGE;
                standing.push(Standing { mesh: key.mesh, world_from_object, double_sided, mirrored, is_large });
            }
        }
        let cells: Vec<Aabb> = world.resource::<Cells>().cells().iter().map(Cell::aabb).collect();
        if standing == self.standing && cells == self.cells {
            return;
        }
        let triangles: Vec<Occluder> =
            standing.iter().flat_map(|standing| standing.triangles(library).into_iter().flatten()).collect();
        (self.standing, self.cells) = (standing, cells.clone());
        let rooms: Vec<Room> = cells.iter().filter_map(Room::within).collect();
        let hash = Occluders::hash(&triangles, &rooms);
        self.hash = hash;
        let lock = || LATTICES.lock().unwrap_or_else(PoisonError::into_inner);
        let known = lock().iter().find(|(own, _)| *own == hash).and_then(|(_, lattice)| lattice.upgrade());
        let made = match known {
            Some(lattice) => Ok(Some(lattice)),
            None => kept(world.get_resource::<KeptLattices>(), hash, triangles, rooms).map(|made| made.map(Arc::new)),
        };
        self.is_too_large = made.is_err();
        self.lattice = made.unwrap_or_default();
        if let Some(lattice) = &self.lattice {
            let mut all = lock();
            all.retain(|(own, lattice)| *own != hash && lattice.strong_count() > 0);
            all.push((hash, Arc::downgrade(lattice)));
        }
    }
}

/// The lattice of some triangles: from the store, or made and left there.
fn kept(
    store: Option<&KeptLattices>,
    hash: u128,
    triangles: Vec<Occluder>,
    rooms: Vec<Room>,
) -> Result<Option<Lattice>, TooLarge> {
    if let Some(known) = store.and_then(|store| Lattice::from_bytes(&store.0.read(hash)?)) {
        return Ok(Some(known));
    }
    let made = Lattice::new(triangles, rooms)?;
    if let (Some(store), Some(lattice)) = (store, &made) {
        store.0.write(hash, &lattice.to_bytes());
    }
    Ok(made)
}

impl Standing {
    /// Its triangles, if the mesh is there.
    fn triangles<'a>(&self, library: &'a Library) -> Option<impl Iterator<Item = Occluder> + use<'a>> {
        let mesh = &library.mesh(self.mesh)?.mesh;
        let (place, mirrored) = (place_of(&self.world_from_object), self.mirrored);
        let (is_double_sided, is_large) = (self.double_sided, self.is_large);
        let corner = move |index: u32| place.transform_point3(mesh.positions[index as usize]);
        Some(mesh.indices.as_chunks::<3>().0.iter().map(move |indices| {
            let [a, b, c] = indices.map(corner);
            Occluder { corners: if mirrored { [a, c, b] } else { [a, b, c] }, is_double_sided, is_large }
        }))
    }
}

fn size(aabb: &Aabb) -> f32 {
    (aabb.max - aabb.min).max_element()
}

/// The topmost of what moves by itself among an object and what is above it.
fn mover_of(world: &World, object: Entity) -> Option<Entity> {
    let above = std::iter::successors(Some(object), |entity| world.get::<ChildOf>(*entity).map(ChildOf::parent));
    let moves = |entity: &Entity| world.get::<Interpolated>(*entity).is_some() || world.get::<Moved>(*entity).is_some();
    above.filter(moves).last()
}

fn place_of(rows: &[[f32; 4]; 3]) -> Affine3A {
    let [x, y, z] = rows;
    let column = |i: usize| Vec3::new(x[i], y[i], z[i]);
    Affine3A {
        matrix3: Mat3A::from_cols(column(0).into(), column(1).into(), column(2).into()),
        translation: column(3).into(),
    }
}
