//! Drawn objects of a world for ray intersection.
//!
//! Two levels of trees: over the boxes of objects, and one for each mesh. Objects are in two trees: one of those that
//! stand, which is kept, and one of those that have changed since it was made, which is small and made anew. A ray goes
//! through both. Of what is equally near, the entity of the lower index is met, and of its pieces that in the lower
//! slot: so what is met does not depend on which object is in which tree, nor on where the search begins.
//!
//! A ray is brought into an object's own coordinates, begins where it comes near the object, and is scaled to the units
//! of the mesh's tree. Differences of places are taken in double precision, so that objects and sensors may be far from
//! the world's origin. Where a ray met something is computed once more in double precision.
//!
//! Met are the triangles of meshes without levels of detail and without displaced heights: both sides or the front, as
//! the material says. Masks are asked at the place that is met. A blended surface is met where its alpha is at least ½.

use super::meshes::{RayMaterial, RayMesh, RayMeshes};
use super::objects::{Bounds, Drawn, Exact, Meeting, Met, Objects, Placed, ROUNDING, WorldRay};
use glam::DVec3;
use std::sync::Arc;
use systems::Simulation;
use systems::assets::Library;
use systems::draw::InstanceRecord;
use systems::ecs::parallel::map_in_parallel;
use systems::ecs::tables::Records;
use systems::space::box_tree::{BoxRay, Open, Quality};

/// Objects that a thread places at a time.
const OBJECTS_PER_TASK: usize = 2048;
/// Objects that have changed may stand again in the tree that is made anew: so many, and of all that stand this share,
/// before both trees are.
const MOST_RESTING: usize = 256;
const MOST_RESTING_SHARE: usize = 16;

/// Objects that are not met as they are drawn.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct RayWarnings {
    /// Masked objects that are solid for rays: their masks have no texels on the CPU
    /// ([`Library::keep_texels`](systems::assets::Library::keep_texels)).
    pub solid_masks: usize,
    /// Other objects whose base maps have none: their albedo is that of their base colour alone.
    pub plain_maps: usize,
    /// Objects that no ray meets: their mesh has no surface, or one too large for floats.
    pub left_out: usize,
}

/// Objects that a world's last frame draws, ready for rays.
#[derive(Default)]
pub struct RayScene {
    meshes: RayMeshes,
    /// Whose they are: [`DrawList::world`](systems::draw::DrawList::world).
    world: Option<u64>,
    /// By slot; `None` where nothing is drawn.
    drawn: Vec<Option<Drawn>>,
    /// Room for the next update: what was drawn before that, and records.
    before: Vec<Option<Drawn>>,
    records: Vec<InstanceRecord>,
    /// By slot: which of the standing objects that is, or [`NOWHERE`], or [`LEFT_OUT`].
    places: Vec<u32>,
    objects: [Objects; 2],
}

/// Set of objects that have not changed since its tree was made.
const STANDING: usize = 0;
/// Set of objects that have.
const CHANGED: usize = 1;

/// Mark of a slot whose object is not among those that stand.
const NOWHERE: u32 = u32::MAX;
/// Mark of a slot whose object would be, but no ray meets it.
const LEFT_OUT: u32 = u32::MAX - 1;

/// An object in one of the trees: what a ray may meet.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Guess {
    set: usize,
    place: usize,
}

/// Meeting of a ray with an object in a tree.
#[derive(Clone, Copy)]
pub(super) struct Found {
    pub guess: Guess,
    met: Met,
}

/// Metres: what is further off than this, rays may miss by rounding at its edges.
const MOST_ROUNDED: f32 = 1e5;

impl RayScene {
    /// Takes over what the world's last frame draws. What has not changed is kept, with its trees.
    pub fn update(&mut self, simulation: &Simulation) {
        let (library, list, records) = (simulation.library(), simulation.draw_list(), simulation.instance_records());
        let is_new = self.world != Some(list.world);
        if is_new {
            *self = Self { world: Some(list.world), ..Self::default() };
        }
        let records = records.read(std::slice::from_ref(&(0..records.slot_count())), &mut self.records);
        let mut drawn = std::mem::take(&mut self.before);
        drawn.clear();
        drawn.resize(records.len().max(self.drawn.len()), None);
        for (slot, key) in list.drawn() {
            drawn[slot as usize] = Drawn::new(&records[slot as usize], &key, library);
        }
        self.drawn.resize(drawn.len(), None);
        self.places.resize(drawn.len(), NOWHERE);
        let pairs = drawn.iter().zip(&self.drawn);
        let changed: Vec<u32> = (0..).zip(pairs).filter(|(_, (now, before))| now != before).map(|(i, _)| i).collect();
        self.before = std::mem::replace(&mut self.drawn, drawn);
        for &slot in &changed {
            let place = std::mem::replace(&mut self.places[slot as usize], NOWHERE);
            if let Some(object) = self.objects[STANDING].placed.get_mut(place as usize) {
                object.is_gone = true;
                self.objects[STANDING].gone += 1;
            }
        }
        let needed = changed.iter().filter_map(|&slot| Some(self.drawn[slot as usize]?.mesh)).collect();
        if self.meshes.update(library, &needed) {
            let Objects { placed, exact, .. } = &mut self.objects[STANDING];
            for (placed, exact) in placed.iter_mut().zip(exact).filter(|(placed, _)| !placed.is_gone) {
                let drawn = self.drawn[exact.slot as usize];
                drawn.iter().for_each(|drawn| placed.material = self.meshes.material(library, drawn.material));
            }
        }
        self.share_out(library, &changed, is_new);
    }

    /// Makes the tree of what has changed, and that of what stands where it no longer serves.
    fn share_out(&mut self, library: &Library, changed: &[u32], is_new: bool) {
        let slots = || 0..self.drawn.len() as u32;
        let mut others: Vec<u32> = slots()
            .filter(|&slot| self.drawn[slot as usize].is_some() && self.places[slot as usize] == NOWHERE)
            .collect();
        let standing = &self.objects[STANDING];
        let resting = others.len() - others.iter().filter(|slot| changed.binary_search(slot).is_ok()).count();
        let count = standing.placed.len();
        if is_new || resting > MOST_RESTING + count / MOST_RESTING_SHARE || standing.gone > MOST_RESTING + count / 2 {
            let stands =
                |slot: &u32| self.drawn[*slot as usize].is_some() && (is_new || changed.binary_search(slot).is_err());
            let standing: Vec<u32> = slots().filter(stands).collect();
            others.retain(|slot| !stands(slot));
            let standing = self.make(library, &standing, Quality::Best);
            self.places.fill(NOWHERE);
            (0..).zip(&standing.exact).for_each(|(place, exact)| self.places[exact.slot as usize] = place);
            standing.left_out.iter().for_each(|&slot| self.places[slot as usize] = LEFT_OUT);
            self.objects[STANDING] = standing;
        }
        self.objects[CHANGED] = self.make(library, &others, Quality::Fast);
    }

    fn make(&mut self, library: &Library, slots: &[u32], quality: Quality) -> Objects {
        let drawn = slots.iter().filter_map(|&slot| Some((slot, self.drawn[slot as usize]?)));
        let parts = drawn.filter_map(|(slot, drawn)| {
            Some((slot, drawn, self.meshes.mesh(drawn.mesh)?.clone(), self.meshes.material(library, drawn.material)))
        });
        let parts: Vec<_> = parts.collect();
        let made = map_in_parallel(parts.chunks(OBJECTS_PER_TASK), |parts| {
            let object = |(slot, drawn, mesh, material): &(u32, Drawn, Arc<RayMesh>, Arc<RayMaterial>)| {
                let bounds = Bounds::new(drawn, &mesh.aabb);
                let placed = Placed::new(mesh.clone(), material.clone(), drawn, &bounds);
                (placed, Exact::new(drawn, *slot), bounds)
            };
            parts.iter().map(object).collect::<Vec<_>>()
        });
        Objects::new(made.into_iter().flatten(), quality)
    }

    /// Objects of the last update that are not met as they are drawn.
    pub fn warnings(&self) -> RayWarnings {
        let left_out = self.places.iter().filter(|&&place| place == LEFT_OUT).count();
        let mut warnings =
            RayWarnings { left_out: left_out + self.objects[CHANGED].left_out.len(), ..RayWarnings::default() };
        for object in self.objects.iter().flat_map(|objects| &objects.placed).filter(|object| !object.is_gone) {
            let lacks_texels = object.material.lacks_texels;
            warnings.solid_masks += usize::from(lacks_texels && object.is_mask);
            warnings.plain_maps += usize::from(lacks_texels && !object.is_mask);
        }
        warnings
    }

    /// Number of objects for rays to meet.
    pub fn objects(&self) -> usize {
        self.objects.iter().map(|objects| objects.placed.len() - objects.gone).sum()
    }

    /// The nearest thing that a ray meets from `near` to `far` metres. `origin`: world space, metres; `direction`:
    /// world space, unit.
    pub fn nearest(&self, origin: DVec3, direction: DVec3, near: f32, far: f32) -> Option<Meeting> {
        let ray = WorldRay::new(origin, direction, (near, far));
        self.find(&ray, None, &mut Open::default()).map(|found| self.meeting(&ray, &found))
    }

    /// The first of what a ray meets, whatever the guess; a good one saves time. `open`: room for the search.
    #[inline]
    pub(super) fn find(&self, ray: &WorldRay, guess: Option<Guess>, open: &mut Open) -> Option<Found> {
        let guessed = guess.and_then(|guess| {
            let met = self.objects[guess.set].placed.get(guess.place)?.nearest(ray, ray.far, open);
            met.map(|met| Found { guess, met })
        });
        let Some(guessed) = guessed.filter(|guessed| guessed.met.range <= ray.far) else {
            return self.search(ray, ray.far, None, open);
        };
        // It is met before the end. Where its box is not, for rounding, neither is the object.
        self.search(ray, guessed.met.range, Some(guessed), open).or_else(|| self.search(ray, ray.far, None, open))
    }

    #[inline]
    fn search(&self, ray: &WorldRay, far: f32, known: Option<Found>, open: &mut Open) -> Option<Found> {
        // Beside by what the differences of places round, in boxes and in objects.
        let beside = ROUNDING * (ray.origin.abs().max_element() as f32 + far.min(MOST_ROUNDED));
        let boxes = BoxRay::new(ray.origin.as_vec3a(), ray.along, beside);
        let mut nearest: Option<Found> = None;
        for (set, objects) in self.objects.iter().enumerate() {
            let end = nearest.map_or(far, |found| found.met.range);
            objects.tree.traverse(&boxes, end, open, |place, [near, far], open| {
                let guess = Guess { set, place };
                let known = known.filter(|known| known.guess == guess).map(|known| known.met);
                let Some(mut met) = known.or_else(|| objects.placed[place].nearest(ray, far, open)) else { return far };
                // Not before its box, or what is met would depend on what was looked at before.
                met.range = met.range.max(near);
                let found = Found { guess, met };
                if met.range > far || nearest.is_some_and(|nearest| !self.is_before(&found, &nearest)) {
                    return far;
                }
                nearest = Some(found);
                met.range
            });
        }
        nearest
    }

    fn is_before(&self, a: &Found, b: &Found) -> bool {
        let order = |found: &Found| {
            let exact = &self.objects[found.guess.set].exact[found.guess.place];
            (exact.entity, exact.slot)
        };
        a.met.range < b.met.range || a.met.range == b.met.range && order(a) < order(b)
    }

    /// Meeting of a ray where it was found to meet something.
    #[inline]
    pub(super) fn meeting(&self, ray: &WorldRay, found: &Found) -> Meeting {
        let (objects, place) = (&self.objects[found.guess.set], found.guess.place);
        objects.placed[place].meeting(&objects.exact[place], ray, found.met)
    }
}
