//! Boxes of things in a camera's picture, and how much of each is seen.
//!
//! The box around what is seen comes from the numbers of pixels. The box of the whole is that of the outline of the
//! thing's vertices, with what lies out of the picture. How much is hidden is found by drawing: each thing that is seen
//! is drawn once more without what is in front of it, with the same pixels, and these are counted. Things whose
//! outlines are apart share such a picture.

use super::outline::{Outline, before_plane};
use super::things::Thing;
use crate::renderer::SlotSet;
use crate::sense::captures::boxes::{Motion, ObjectBox};
use crate::sense::captures::label_table::LabelRuns;
use crate::sense::captures::pose::Pose;
use crate::sense::motion::place::Place;
use glam::{DAffine3, DQuat, DVec2, DVec3};
use std::collections::BTreeMap;
use systems::sensors::{CameraSensor, Lens};

/// Pixels between outlines of things that share a picture, so that none is drawn over another.
const GAP: f64 = 2.0;

/// Place of a camera, and places of things before.
pub(super) struct Scene<'a> {
    pub things: &'a [Thing],
    /// Camera axes, X right, Y down, Z forward, from the scene's coordinates.
    pub camera_from_world: DAffine3,
    /// Places of things, by their numbers, at the capture before, and the seconds since.
    pub before: Option<(&'a BTreeMap<u32, Place>, f64)>,
    /// The number of the thing that the camera is on, of which there is no box.
    pub mounted_on: Option<u32>,
}

/// The boxes of a picture that is drawn, while pictures of hidden things are not.
pub(crate) struct Boxes {
    width: u32,
    /// Straight edges are curves in it: outlines of vertices are not those of things.
    is_bent: bool,
    boxes: Vec<ObjectBox>,
    /// Things that are drawn alone together: places in `boxes`.
    layers: Vec<Vec<usize>>,
}

impl Boxes {
    /// Those of a camera; `found`: what its pixels show.
    pub(super) fn of(camera: &CameraSensor, scene: &Scene, found: &LabelRuns) -> Self {
        let seen = count(found, camera.size.0);
        let mut boxes = Vec::new();
        let mut layers: Vec<(Vec<usize>, Vec<[f64; 4]>)> = Vec::new();
        let is_bent = camera.lens.has_distortion();
        for thing in scene.things.iter().filter(|thing| Some(thing.number) != scene.mounted_on) {
            let Some((outline, made)) = scene.object_box(camera, thing, seen.get(&thing.number)) else { continue };
            if made.pixels > 0 {
                let apart =
                    |(_, others): &&mut (_, Vec<[f64; 4]>)| others.iter().all(|other| are_apart(&outline, other));
                // What a picture has of a thing alone is within its outline, if that is known.
                match layers.iter_mut().find(apart).filter(|_| !is_bent) {
                    Some((members, outlines)) => {
                        members.push(boxes.len());
                        outlines.push(outline);
                    }
                    None => layers.push((vec![boxes.len()], vec![outline])),
                }
            }
            boxes.push(made);
        }
        let layers = layers.into_iter().map(|(members, _)| members).collect();
        Self { width: camera.size.0, is_bent, boxes, layers }
    }

    /// Slots to be drawn alone, a set for each picture.
    pub(super) fn drawn_alone(&self, things: &[Thing]) -> Vec<SlotSet> {
        let of = |id: u32| things.binary_search_by_key(&id, |thing| thing.number).ok();
        let slots = |members: &Vec<usize>| {
            let own = members.iter().filter_map(|&member| of(self.boxes[member].id));
            own.fold(SlotSet::default(), |mut all, thing| {
                all.extend(&things[thing].slots);
                all
            })
        };
        self.layers.iter().map(slots).collect()
    }

    /// Number of pictures of what is drawn alone.
    pub fn pictures(&self) -> usize {
        self.layers.len()
    }

    /// The boxes, when what was to be drawn alone is drawn; `found`: what the pixels of each picture show.
    pub fn finish(mut self, found: impl IntoIterator<Item = LabelRuns>) -> Vec<ObjectBox> {
        for (members, found) in self.layers.iter().zip(found) {
            let alone = count(&found, self.width);
            for &member in members {
                let made = &mut self.boxes[member];
                let all = alone.get(&made.id).map_or(0, |seen| seen.pixels);
                if let Some(seen) = alone.get(&made.id).filter(|_| self.is_bent) {
                    made.box_full = united(made.box_full, seen.bounds());
                }
                made.visible = made.pixels as f32 / all.max(made.pixels).max(1) as f32;
            }
        }
        self.boxes
    }
}

impl Scene<'_> {
    /// The box of a thing, and its outline within the picture; `None` where it is not in the picture.
    fn object_box(&self, camera: &CameraSensor, thing: &Thing, seen: Option<&Seen>) -> Option<([f64; 4], ObjectBox)> {
        // What sees to the side and back has no plane that all it sees is before.
        let sees_around = matches!(camera.lens, Lens::KannalaBrandt { .. });
        let nearest = self.camera_from_world.transform_point3(thing.center()).z - thing.radius();
        let is_behind = nearest + 2.0 * thing.radius() < f64::from(camera.near) && !sees_around;
        if is_behind || nearest > f64::from(camera.far) {
            return None;
        }
        let in_camera: Vec<DVec3> =
            thing.vertices.iter().map(|v| self.camera_from_world.transform_point3(*v)).collect();
        let before = if sees_around { in_camera } else { before_plane(&in_camera, camera.near.into()) };
        let projected: Vec<Option<DVec2>> = before.into_iter().map(|place| pixel(camera, place)).collect();
        let is_all_seen = projected.iter().all(Option::is_some);
        let outline = Outline::around(projected.into_iter().flatten().collect());
        let seen_edges = seen.map(|seen| seen.bounds().map(f64::from));
        let full = outline.bounds().or(seen_edges)?;
        let within = outline.within([0.0, 0.0, camera.size.0.into(), camera.size.1.into()]);
        let (area, area_within) = (outline.area(), within.area());
        let out_of_picture = if area > 0.0 { (1.0 - area_within / area).clamp(0.0, 1.0) as f32 } else { 0.0 };
        let bounds = within.bounds().or(seen_edges).filter(|_| seen.is_some() || area_within > 0.0)?;
        let Pose { translation, rotation } = thing.place.pose;
        let camera_from_thing = (DQuat::from_mat3(&self.camera_from_world.matrix3) * rotation).normalize();
        let center = thing.center();
        let size = thing.high - thing.low;
        let corners = std::array::from_fn(|corner| {
            let choose = |axis: usize| if corner >> (2 - axis) & 1 == 1 { thing.high[axis] } else { thing.low[axis] };
            let place = translation + rotation * DVec3::new(choose(0), choose(1), choose(2));
            let place = pixel(camera, self.camera_from_world.transform_point3(place));
            place.map(|place| place.as_vec2().to_array())
        });
        let made = ObjectBox {
            id: thing.number,
            class: thing.class,
            box_visible: seen.map_or([0.0; 4], Seen::bounds),
            box_full: full.map(|edge| edge as f32),
            visible: 0.0,
            truncated: is_all_seen.then_some(out_of_picture),
            pixels: seen.map_or(0, |seen| seen.pixels),
            center: self.camera_from_world.transform_point3(center).to_array(),
            size: [size.z as f32, size.x as f32, size.y as f32],
            quaternion: w_first(camera_from_thing),
            world_center: center.to_array(),
            world_quaternion: w_first(rotation),
            motion: self.motion(thing),
            corners_uv: corners,
        };
        Some((bounds, made))
    }

    /// From where a thing was.
    fn motion(&self, thing: &Thing) -> Option<Motion> {
        let (all, seconds) = self.before?;
        let before = all.get(&thing.number).filter(|before| before.leads_to(&thing.place, seconds))?.pose;
        let moved = thing.center() - (before.translation + before.rotation * thing.middle());
        let turned = (thing.place.pose.rotation * before.rotation.inverse()).normalize();
        // The shorter way.
        let turned = if turned.w < 0.0 { -turned } else { turned };
        let yaw_rate = (turned.to_scaled_axis().y / seconds) as f32;
        Some(Motion { velocity: (moved / seconds).as_vec3().to_array(), yaw_rate })
    }
}

/// Pixels from the picture's corner of a place in camera axes.
fn pixel(camera: &CameraSensor, place: DVec3) -> Option<DVec2> {
    camera.project(place).map(|place| place + 0.5)
}

fn w_first(rotation: DQuat) -> [f64; 4] {
    let [x, y, z, w] = rotation.to_array();
    [w, x, y, z]
}

fn united(a: [f32; 4], b: [f32; 4]) -> [f32; 4] {
    [a[0].min(b[0]), a[1].min(b[1]), a[2].max(b[2]), a[3].max(b[3])]
}

fn are_apart(a: &[f64; 4], b: &[f64; 4]) -> bool {
    a[2] + GAP < b[0] || b[2] + GAP < a[0] || a[3] + GAP < b[1] || b[3] + GAP < a[1]
}

/// The pixels that show a thing.
#[derive(Clone, Copy)]
struct Seen {
    pixels: u32,
    low: [u32; 2],
    high: [u32; 2],
}

impl Seen {
    fn bounds(&self) -> [f32; 4] {
        [self.low[0], self.low[1], self.high[0] + 1, self.high[1] + 1].map(|edge| edge as f32)
    }
}

/// The pixels of each thing, by its number.
fn count(found: &LabelRuns, width: u32) -> BTreeMap<u32, Seen> {
    let width = width.max(1) as usize;
    let mut seen: BTreeMap<u32, Seen> = BTreeMap::new();
    let mut end = 0;
    for (labels, pixels) in &found.0 {
        let (start, last) = (end, end + pixels - 1);
        end += pixels;
        if labels.instance == 0 {
            continue;
        }
        let [(top, left), (bottom, right)] =
            [start, last].map(|pixel| ((pixel / width) as u32, (pixel % width) as u32));
        // What goes on in the next row reaches both of its ends.
        let [left, right] = if top == bottom { [left, right] } else { [0, width as u32 - 1] };
        let new = Seen { pixels: 0, low: [left, top], high: [right, bottom] };
        let seen = seen.entry(labels.instance).or_insert(new);
        seen.pixels += *pixels as u32;
        seen.low = [seen.low[0].min(left), seen.low[1].min(top)];
        seen.high = [seen.high[0].max(right), seen.high[1].max(bottom)];
    }
    seen
}
