//! Visibility of lights from the surfaces that a picture shows, found by rays: the reference for shadows.
//!
//! The triangles of all drawn objects, without levels of detail, are placed relative to the eye in double precision.
//! They lie in a bounding volume hierarchy. For each pixel:
//!
//! ```text
//! a ray from the eye through the pixel's centre    the surfaces that the pixel may show: all that is blended or
//!                                                  masked, up to the first opaque one
//! rays from each of these to each light            how much of the light is seen; opaque and masked objects are in
//!                                                  its way, masked ones as if they were solid
//! ```
//!
//! A light with a size is seen by rays to places of its disc, which lie on a spiral (Vogel, "A better way to construct
//! the sunflower head", Mathematical Biosciences, 1979): [`PLACES`], or, where a part of them agree, that part.
//!
//! The rasteriser moves vertices by a fraction of a pixel, so at outlines a pixel may show an object that the ray
//! through its centre passes by. Rays through the corners of a square of that fraction look for it then.

use crate::renderer::{TracedRow, TracedShadows};
use bevy_ecs::entity::EntityIndex;
use glam::{DMat3, DVec2, DVec3, Vec3, Vec3A, Vec4Swizzles};
use obvhs::aabb::Aabb;
use std::collections::BTreeSet;
use systems::Simulation;
use systems::assets::AlphaMode;
use systems::draw::{BatchKey, InstanceRecord, Projection, View};
use systems::ecs::parallel::map_in_parallel;
use systems::ecs::tables::Records;
use systems::lights::{Light, LightLists, LightRecord, LightTable, NO_LIGHT, NoShadow, SelectedLights};
use systems::space::box_tree::{BoxRay, BoxTree, Open, Quality};

/// Largest error of a computed place, relative to the sizes that went into it. Meshes, transforms and lights are
/// floats; each rounds by 2⁻²⁴. Sixteen of these are more than a product and sum of three takes.
const ROUNDING: f64 = 1.0 / (1 << 20) as f64;

/// Metres that the boxes of triangles are wider than these, beside [`ROUNDING`]: their test computes with floats.
const BOX_ROOM: f32 = 1e-5;

/// Margin of a triangle beyond its edges, as a part of it: no ray passes between two that share an edge.
const EDGE: f64 = 1e-9;

/// Triangles of a leaf.
const GROUP: usize = 4;

/// Places of a light's disc that rays go to.
const PLACES: usize = 256;
/// Those of them that are asked first: the rim's, and one in so many of the others. Where they agree, so do all.
const RIM: usize = 20;
const STRIDE: usize = 24;
const FIRST: usize = RIM + (PLACES - RIM).div_ceil(STRIDE);

/// Properties of a drawn object that rays need.
#[derive(Clone, Copy)]
struct Drawn {
    alpha: AlphaMode,
    /// It is in the way of light.
    casts: bool,
    /// Its back faces are drawn.
    double_sided: bool,
    /// −1 where its transform mirrors, else 1.
    handedness: f64,
}

/// A triangle of a drawn object, relative to the eye.
#[derive(Clone, Copy)]
struct PlacedTriangle {
    corners: [DVec3; 3],
    slot: u32,
}

impl PlacedTriangle {
    /// Distance along a ray at which it is hit, in units of the direction (Möller, Trumbore: "Fast, Minimum Storage
    /// Ray/Triangle Intersection", 1997).
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let [a, b, c] = self.corners;
        let (first, second) = (b - a, c - a);
        let p = direction.cross(second);
        let determinant = first.dot(p);
        let from_corner = origin - a;
        let u = from_corner.dot(p) / determinant;
        let q = from_corner.cross(first);
        let v = direction.dot(q) / determinant;
        // Not where the ray lies in the plane: nothing compares with what is no number.
        (u >= -EDGE && v >= -EDGE && u + v <= 1.0 + EDGE).then(|| second.dot(q) / determinant)
    }

    /// Its direction by its winding, and twice its area.
    fn normal(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// A box that rays of floats meet where they meet the triangle.
    fn aabb(&self) -> Aabb {
        let aabb = Aabb::from_points(&self.corners.map(|corner| corner.as_vec3a()));
        let room = Vec3A::splat(BOX_ROOM + (ROUNDING * self.reach()) as f32);
        Aabb::new(aabb.min - room, aabb.max + room)
    }

    /// The greatest distance of a corner from the eye.
    fn reach(&self) -> f64 {
        self.corners.iter().map(|corner| corner.length()).fold(0.0, f64::max)
    }
}

/// Hit of a ray from the eye on a triangle.
#[derive(Clone, Copy)]
struct Hit {
    along: f64,
    triangle: u32,
    slot: u32,
}

/// Surface that a pixel shows.
struct Surface {
    /// Relative to the eye, metres.
    place: DVec3,
    /// Normal of the triangle, unit, toward the eye.
    normal: DVec3,
    /// Metres that the place may be off.
    error: f64,
}

/// Rays from the eye through the pixels of a view, relative to the eye.
struct EyeRays {
    world_from_view: DMat3,
    /// Half the width and height of what is seen at a distance of 1, or anywhere where the projection is parallel.
    half: DVec2,
    /// Offset of the principal point from the middle, from −1 to 1 across the picture.
    aside: DVec2,
    pixels: DVec2,
    parallel: bool,
    near: f64,
    far: f64,
}

impl EyeRays {
    fn new(view: &View) -> Self {
        let clip_from_view = view.clip_from_view();
        let rotation = view.world_from_view.matrix3;
        Self {
            world_from_view: DMat3::from_cols(
                rotation.x_axis.as_dvec3(),
                rotation.y_axis.as_dvec3(),
                rotation.z_axis.as_dvec3(),
            ),
            half: DVec2::new(clip_from_view.x_axis.x.into(), clip_from_view.y_axis.y.into()).recip(),
            aside: -clip_from_view.z_axis.as_dvec4().xy(),
            pixels: DVec2::new(view.width.into(), view.height.into()),
            parallel: matches!(view.camera.projection, Projection::Orthographic { .. }),
            near: view.camera.near.into(),
            far: view.camera.far.into(),
        }
    }

    /// Origin and direction of the ray through a place of the picture. The depth grows by 1 over the direction's
    /// length.
    fn through(&self, place: DVec2) -> (DVec3, DVec3) {
        let clip = (place / self.pixels * 2.0 - 1.0) * DVec2::new(1.0, -1.0);
        let across = (clip - self.aside) * self.half;
        let (origin, direction) =
            if self.parallel { (across.extend(0.0), DVec3::NEG_Z) } else { (DVec3::ZERO, across.extend(-1.0)) };
        (self.world_from_view * origin, self.world_from_view * direction)
    }
}

/// The shadows of a picture.
pub(crate) struct Traced {
    pub shadows: TracedShadows,
    /// Pixels that show an object which no ray has met: it has no shadows there.
    pub unmet: usize,
}

/// All that is drawn, ready for rays.
pub(crate) struct TracedScene {
    triangles: Vec<PlacedTriangle>,
    tree: BoxTree,
    /// By slot.
    drawn: Vec<Option<Drawn>>,
    /// Places on a light's disc of radius 1.
    places: Vec<DVec2>,
    eye: DVec3,
    eye_rays: EyeRays,
}

impl TracedScene {
    /// Builds the scene of a world's last frame, seen by a view.
    pub fn new(simulation: &Simulation, view: &View) -> Self {
        let (list, records) = (simulation.draw_list(), simulation.instance_records());
        let mut room = Vec::new();
        let records = records.read(std::slice::from_ref(&(0..records.slot_count())), &mut room);
        let mut scene = Self {
            triangles: Vec::new(),
            tree: BoxTree::default(),
            drawn: vec![None; records.len()],
            places: disc_places(),
            eye: view.eye().as_dvec3(),
            eye_rays: EyeRays::new(view),
        };
        for (slot, key) in list.drawn() {
            scene.add(simulation, slot, key, &records[slot as usize]);
        }
        scene.tree = BoxTree::new(scene.triangles.iter().map(PlacedTriangle::aabb), GROUP, Quality::Good);
        scene
    }

    fn add(&mut self, simulation: &Simulation, slot: u32, key: BatchKey, record: &InstanceRecord) {
        let Some(entry) = simulation.library().mesh(key.mesh) else { return };
        let rows = record.world_from_object.map(|[x, y, z, _]| Vec3::new(x, y, z).as_dvec3());
        let origin = DVec3::from(record.world_from_object.map(|row| row[3].into())) - self.eye;
        let placed = |index: u32| {
            let position = entry.mesh.positions[index as usize].as_dvec3();
            DVec3::from(rows.map(|row| row.dot(position))) + origin
        };
        let triangles = entry.mesh.indices.as_chunks::<3>().0.iter();
        self.triangles.extend(triangles.map(|indices| PlacedTriangle { corners: indices.map(placed), slot }));
        let handedness = if key.pipeline.mirrored { -1.0 } else { 1.0 };
        let (alpha, double_sided) = (key.pipeline.alpha, key.pipeline.double_sided);
        let world = &simulation.world;
        let object = simulation.draw_list().instances.objects[slot as usize];
        let object = object.map(|object| world.entities().resolve_from_index(object));
        let casts_none = object.is_some_and(|object| world.get::<NoShadow>(object).is_some());
        let casts = alpha != AlphaMode::Blend && !casts_none;
        self.drawn[slot as usize] = Some(Drawn { alpha, casts, double_sided, handedness });
    }

    /// Traces the shadows of a picture, by the lists of lights of the world's last frame, in which nothing has moved
    /// since the scene was made. `shown`: the slot of the object that each pixel shows. `vertex_rounding`: pixels by
    /// which the rasteriser may move a vertex.
    pub fn shadows(&self, simulation: &Simulation, shown: &[Option<u32>], vertex_rounding: f32) -> Traced {
        let lights = ObjectLights::new(simulation);
        let width = self.eye_rays.pixels.x as usize;
        let rows = shown.chunks_exact(width.max(1)).enumerate();
        let traced = map_in_parallel(rows, |(y, shown)| {
            let (mut row, mut unmet, mut hits, mut surfaces) = (TracedRow::default(), 0, Vec::new(), Vec::new());
            let mut open = Open::default();
            for (x, &shown) in shown.iter().enumerate() {
                let place = DVec2::new(x as f64, y as f64) + 0.5;
                surfaces.clear();
                self.meet(place, None, &mut hits, &mut open);
                surfaces.extend(hits.iter().map(|hit| (hit.slot, self.seen_lights(place, hit, &lights, &mut open))));
                if let Some(slot) = shown.filter(|slot| hits.iter().all(|hit| hit.slot != *slot)) {
                    match self.meet_nearby(place, slot, vertex_rounding.into(), &mut hits, &mut open) {
                        Some((place, hit)) => surfaces.push((slot, self.seen_lights(place, &hit, &lights, &mut open))),
                        None => unmet += 1,
                    }
                }
                row.push_pixel(&surfaces);
            }
            (row, unmet)
        });
        let (rows, unmet): (Vec<TracedRow>, Vec<usize>) = traced.into_iter().unzip();
        Traced { shadows: TracedShadows::from_rows(&rows), unmet: unmet.iter().sum() }
    }

    /// Number of pairs of an object and a light that some sample of a picture shows lit by it, and that are
    /// not in these lists; of the lights in those of the world's last frame. `shown` as for [`Self::shadows`].
    pub fn left_out(&self, simulation: &Simulation, shown: &[Option<u32>], reached: &ObjectLights) -> usize {
        let lights = ObjectLights::new(simulation);
        let width = self.eye_rays.pixels.x as usize;
        let rows = shown.chunks_exact(width.max(1)).enumerate();
        let pairs = map_in_parallel(rows, |(y, shown)| {
            let (mut pairs, mut hits, mut open) = (BTreeSet::new(), Vec::new(), Open::default());
            for (x, _) in shown.iter().enumerate().filter(|(_, shown)| shown.is_some()) {
                let place = DVec2::new(x as f64, y as f64) + 0.5;
                self.meet(place, None, &mut hits, &mut open);
                for hit in &hits {
                    let known = reached.of(hit.slot);
                    let surface = self.surface(place, hit);
                    let mut is_lit = |light: u32| {
                        let light = lights.table.get(light as usize);
                        let share = light.and_then(|light| self.seen_share(&surface, light, &mut open));
                        share.is_some_and(|share| share > 0)
                    };
                    let others = lights.of(hit.slot).iter().filter(|light| !known.contains(light));
                    pairs.extend(others.filter(|&&light| is_lit(light)).map(|&light| (hit.slot, light)));
                }
            }
            pairs
        });
        pairs.into_iter().flatten().collect::<BTreeSet<(u32, u32)>>().len()
    }

    /// Light of the sky on the surfaces of a picture; `None` where a pixel shows nothing, or no ray met it. `normals`:
    /// of each pixel, world space. `light`: by the normal, and by what tells if a ray in a direction meets nothing.
    pub fn seen_sky<T: Send>(
        &self,
        shown: &[Option<u32>],
        normals: &[[f32; 3]],
        light: impl Fn(DVec3, &mut dyn FnMut(DVec3) -> bool) -> T + Sync,
    ) -> Vec<Option<T>> {
        let width = (self.eye_rays.pixels.x as usize).max(1);
        let rows = shown.chunks_exact(width).zip(normals.chunks_exact(width)).enumerate();
        let seen = map_in_parallel(rows, |(y, (shown, normals))| {
            let (mut hits, mut open) = (Vec::new(), Open::default());
            let pixels = shown.iter().zip(normals).enumerate();
            let of_pixel = |(x, (shown, normal)): (usize, (&Option<u32>, &[f32; 3]))| {
                let place = DVec2::new(x as f64, y as f64) + 0.5;
                self.meet(place, Some((*shown)?), &mut hits, &mut open);
                let surface = self.surface(place, hits.first()?);
                let from = surface.place + surface.normal * surface.error;
                let mut is_free = |toward: DVec3| {
                    surface.normal.dot(toward) > 0.0 && self.is_free(from, toward, f64::INFINITY, &mut open)
                };
                Some(light(Vec3::from(*normal).as_dvec3().normalize_or(surface.normal), &mut is_free))
            };
            pixels.map(of_pixel).collect::<Vec<_>>()
        });
        seen.into_iter().flatten().collect()
    }

    /// The object in a slot at a place of the picture, or at the corners of the square about it that is twice as wide
    /// as vertices are moved.
    fn meet_nearby(
        &self,
        place: DVec2,
        slot: u32,
        moved: f64,
        hits: &mut Vec<Hit>,
        open: &mut Open,
    ) -> Option<(DVec2, Hit)> {
        let corners = [DVec2::ZERO, DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];
        corners.iter().find_map(|corner| {
            let place = place + corner * moved;
            self.meet(place, Some(slot), hits, open);
            hits.first().map(|&hit| (place, hit))
        })
    }

    /// Finds the hits of a ray from the eye, nearest first, up to the first opaque one. Each object counts once.
    /// `only`: of one object. `open`: room for the search, as everywhere below.
    fn meet(&self, place: DVec2, only: Option<u32>, hits: &mut Vec<Hit>, open: &mut Open) {
        hits.clear();
        let (origin, direction) = self.eye_rays.through(place);
        let near = self.eye_rays.near;
        let far = self.search(origin, direction, self.eye_rays.far, open, |number, triangle, far| {
            let slot = triangle.slot;
            let drawn = self.drawn[slot as usize].filter(|_| only.is_none_or(|only| only == slot));
            let Some((drawn, along)) = drawn.zip(triangle.intersect(origin, direction)) else { return far };
            let is_drawn = drawn.double_sided || drawn.handedness * triangle.normal().dot(direction) < 0.0;
            if !is_drawn || along < near || along > far {
                return far;
            }
            hits.push(Hit { along, triangle: number, slot });
            if drawn.alpha == AlphaMode::Opaque { along } else { far }
        });
        hits.retain(|hit| hit.along <= far);
        hits.sort_by(|a, b| a.along.total_cmp(&b.along).then(a.triangle.cmp(&b.triangle)));
        let mut kept = 0;
        for i in 0..hits.len() {
            if hits[..kept].iter().all(|hit| hit.slot != hits[i].slot) {
                hits[kept] = hits[i];
                kept += 1;
            }
        }
        hits.truncate(kept);
    }

    /// Shares of each light of its object that are seen from where a ray from the eye meets it, in parts of 255.
    fn seen_lights(&self, place: DVec2, hit: &Hit, lights: &ObjectLights, open: &mut Open) -> Vec<u8> {
        let surface = self.surface(place, hit);
        // All of it where it gives no light.
        let share = |&light: &u32| {
            let light = lights.table.get(light as usize);
            light.and_then(|light| self.seen_share(&surface, light, open)).unwrap_or(u8::MAX)
        };
        lights.of(hit.slot).iter().map(share).collect()
    }

    /// Surface at a hit of a ray from the eye.
    fn surface(&self, place: DVec2, hit: &Hit) -> Surface {
        let (origin, direction) = self.eye_rays.through(place);
        let triangle = &self.triangles[hit.triangle as usize];
        let normal = triangle.normal().normalize_or_zero();
        Surface {
            place: origin + direction * hit.along,
            normal: if normal.dot(direction) > 0.0 { -normal } else { normal },
            error: ROUNDING * (self.eye.length() + triangle.reach()),
        }
    }

    /// The share of a light that is seen from a surface, in parts of 255; `None` where it gives no light.
    fn seen_share(&self, surface: &Surface, (light, near): &(LightRecord, f64), open: &mut Open) -> Option<u8> {
        let position = Vec3::from(light.position).as_dvec3();
        let (toward, distance) = if light.kind == LightRecord::DIRECTIONAL {
            (position.normalize_or_zero(), f64::INFINITY)
        } else {
            let way = position - self.eye - surface.place;
            (way.normalize_or_zero(), way.length())
        };
        if !gives_light(light, toward, distance) {
            return None;
        }
        let from = surface.place + surface.normal * surface.error;
        let mut is_seen = |toward: DVec3, distance: f64| {
            surface.normal.dot(toward) > 0.0 && self.is_free(from, toward, distance - near, open)
        };
        // Within a ball there is no disc to be seen.
        let size = if distance.is_finite() { f64::from(light.size) / distance } else { f64::from(light.size) };
        if size == 0.0 || size >= 1.0 && distance.is_finite() {
            return Some(if is_seen(toward, distance) { u8::MAX } else { 0 });
        }
        // What is seen of a ball is as wide as a disc that is a little nearer.
        let size = if distance.is_finite() { size / (1.0 - size * size).sqrt() } else { size };
        let (across, along) = toward.any_orthonormal_pair();
        let mut sees = |place: &&DVec2| {
            let way = toward + size * (place.x * across + place.y * along);
            is_seen(way.normalize(), distance * way.length())
        };
        let (first, others) = self.places.split_at(FIRST);
        let seen = match first.iter().filter(&mut sees).count() {
            0 => 0,
            FIRST => PLACES,
            some => some + others.iter().filter(sees).count(),
        };
        Some((seen * usize::from(u8::MAX) / PLACES) as u8)
    }

    /// Tells if no shadow caster blocks a ray for so many metres.
    fn is_free(&self, from: DVec3, toward: DVec3, distance: f64, open: &mut Open) -> bool {
        let mut is_free = true;
        self.search(from, toward, distance, open, |_, triangle, far| {
            let casts = self.drawn[triangle.slot as usize].is_some_and(|drawn| drawn.casts);
            let hit = triangle.intersect(from, toward).filter(|along| casts && 0.0 < *along && *along < distance);
            is_free &= hit.is_none();
            if is_free { far } else { f64::NEG_INFINITY }
        });
        is_free
    }

    /// Calls with the triangles that a ray may meet up to `far`, and with the end of the ray, which is what is returned
    /// from then on. Returns the last.
    fn search(
        &self,
        origin: DVec3,
        direction: DVec3,
        mut far: f64,
        open: &mut Open,
        mut meet: impl FnMut(u32, &PlacedTriangle, f64) -> f64,
    ) -> f64 {
        let ray = BoxRay::new(origin.as_vec3a(), direction.as_vec3a(), 0.0);
        self.tree.traverse(&ray, above(far), open, |leaf, _, _| {
            let numbers = self.tree.order()[leaf * GROUP..].iter().take(GROUP);
            for (&number, triangle) in numbers.filter_map(|i| Some((i, self.triangles.get(*i as usize)?))) {
                far = meet(number, triangle, far);
            }
            above(far)
        });
        far
    }
}

/// Places of a disc of radius 1, each of which stands for as much of it, those first that are asked first.
fn disc_places() -> Vec<DVec2> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let place =
        |number: usize| DVec2::from_angle(golden * number as f64) * ((number as f64 + 0.5) / PLACES as f64).sqrt();
    let (first, others): (Vec<usize>, Vec<usize>) =
        (0..PLACES).rev().partition(|&number| number >= PLACES - RIM || number.is_multiple_of(STRIDE));
    first.into_iter().chain(others).map(place).collect()
}

/// A float that is no less.
fn above(value: f64) -> f32 {
    (value * (1.0 + ROUNDING)) as f32
}

/// Tells if a light that reaches an object lights a place of it: within its range and its cone. Shaders may round
/// otherwise at the edge, so the cone is a little wider.
fn gives_light(light: &LightRecord, toward: DVec3, distance: f64) -> bool {
    match light.kind {
        LightRecord::OFF => false,
        LightRecord::DIRECTIONAL => true,
        kind => {
            let is_in_range = distance * distance * f64::from(light.inverse_range_squared) < 1.0;
            let versine = 0.5 * (Vec3::from(light.direction).as_dvec3() + toward).length_squared();
            is_in_range && (kind == LightRecord::POINT || versine < 1.0001 * f64::from(light.versine_outer))
        }
    }
}

/// The lights of each object, in the order in which shaders number them.
pub(crate) struct ObjectLights {
    /// By slot.
    lists: Vec<Vec<u32>>,
    /// With the distance from the light within which nothing is in its way, metres.
    table: Vec<(LightRecord, f64)>,
}

impl ObjectLights {
    /// Collects the lights of the world's last frame.
    pub fn new(simulation: &Simulation) -> Self {
        let (world, list) = (&simulation.world, simulation.draw_list());
        let lists = world.resource::<LightLists>();
        let of = |object: EntityIndex| {
            let selected = world.get::<SelectedLights>(world.entities().resolve_from_index(object))?;
            let first = selected.unpack(lists).lights.into_iter().filter(|&light| light != NO_LIGHT);
            Some(first.chain(lists.of(selected).0.into_iter().map(|(light, _)| light)).collect())
        };
        let casting = world.resource::<LightTable>().shadow_lights();
        let near = |slot| casting.get(slot).map_or(Light::SHADOW_NEAR, |light| light.near).into();
        let of = |object: &Option<EntityIndex>| object.and_then(of).unwrap_or_default();
        Self {
            lists: list.instances.objects.iter().map(of).collect(),
            table: (0..).zip(&list.lights.records).map(|(slot, light)| (light.unpacked(), near(slot))).collect(),
        }
    }

    /// Lights of the object in a slot.
    pub fn of(&self, slot: u32) -> &[u32] {
        self.lists.get(slot as usize).map_or(&[], Vec::as_slice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Affine3A;
    use systems::draw::{Camera, Intrinsics};

    #[test]
    fn rays_go_through_their_places_of_the_picture_and_count_depth() {
        let place = Affine3A::from_translation(Vec3::new(3.0, -4.0, 7.0))
            * Affine3A::from_rotation_y(0.7)
            * Affine3A::from_rotation_x(-0.3);
        let perspective = Projection::Perspective { fov_y: 0.9, aspect: Some(2.5) };
        let parallel = Projection::Orthographic { half_height: 3.0, aspect: None };
        let intrinsics = Intrinsics { fx: 120.0, fy: 130.0, cx: 20.0, cy: 60.0 };
        let pinhole = Projection::Pinhole { intrinsics, size: (160, 90) };
        for projection in [perspective, parallel, pinhole] {
            let view = View::new(&place, &Camera { projection, ..Camera::default() }, 160, 90);
            let (rays, clip_from_world) = (EyeRays::new(&view), view.clip_from_world());
            for at in [DVec2::new(0.5, 0.5), DVec2::new(80.0, 45.0), DVec2::new(153.25, 70.75)] {
                let (origin, direction) = rays.through(at);
                let point = view.eye() + (origin + direction * 5.0).as_vec3();
                let clip = clip_from_world * point.extend(1.0);
                let ndc = (clip / clip.w).truncate();
                let found = DVec2::new(f64::from(ndc.x) + 1.0, 1.0 - f64::from(ndc.y)) * rays.pixels * 0.5;
                // Floats of a few metres in 160 pixels.
                assert!(found.abs_diff_eq(at, 1e-3), "{projection:?}: {found} for {at}");
                let in_view = view.world_from_view.inverse().transform_point3(point);
                assert!((in_view.z + 5.0).abs() < 1e-4, "{in_view}");
            }
        }
    }

    #[test]
    fn triangles_are_hit_up_to_their_edges_and_from_both_sides() {
        let corners = [DVec3::new(1.0, 0.0, 0.0), DVec3::new(0.0, 1.0, 0.0), DVec3::ZERO];
        let triangle = PlacedTriangle { corners, slot: 0 };
        let along = |x: f64, y: f64, z: f64| triangle.intersect(DVec3::new(x, y, z), DVec3::NEG_Z * 2.0 * z.signum());
        assert_eq!(along(0.25, 0.25, 1.0), Some(0.5));
        assert_eq!(along(0.25, 0.25, -3.0), Some(1.5));
        assert_eq!((along(0.5, 0.5, 1.0), along(0.0, 0.0, 1.0)), (Some(0.5), Some(0.5)), "edge and corner");
        assert_eq!((along(0.5, 0.51, 1.0), along(-0.01, 0.5, 1.0)), (None, None));
        assert_eq!(triangle.intersect(DVec3::new(-1.0, 0.2, 0.0), DVec3::X), None, "in its plane");
    }
}
