//! Drawing of cameras with lens distortion: pinhole faces that cover the view, and the place of each pixel in these.
//!
//! One face along the axis where nothing is more than 50° aside of it; else those of a cube that are needed, each as
//! large as what is seen of it. Faces have [`DENSITY`] times as many pixels along a line as the picture has where it
//! has most. A map is made once, and kept while its camera is the same.

use crate::renderer::{OutputSet, Settings, ViewPlan};
use crate::sense::captures::axes::ENTITY_FROM_CAMERA;
use bevy_ecs::prelude::*;
use glam::{Affine3A, DMat3, DVec2, DVec3};
use std::collections::HashMap;
use std::sync::Arc;
use systems::draw::{Camera, Intrinsics, Projection, View};
use systems::ecs::parallel::map_in_parallel;
use systems::sensors::{CameraSensor, Lens};

/// Pixels of faces for one of the picture, along a line.
const DENSITY: f64 = 1.5;

/// Pixels along a face's side for one along the picture's: opposite to where a fisheye looks, a pixel of its border
/// sees ever less, and the face would have ever more.
const MOST_LARGER: f64 = 4.0;

/// tan 50°.
const WIDEST_FACE: f64 = 1.191_753_592_594_21;

/// From the axes of each face of a cube to the camera's, both X right, Y down, Z forward: ahead, right, left, down, up,
/// back.
const CUBE: [DMat3; 6] = [
    DMat3::IDENTITY,
    DMat3::from_cols(DVec3::NEG_Z, DVec3::Y, DVec3::X),
    DMat3::from_cols(DVec3::Z, DVec3::Y, DVec3::NEG_X),
    DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y),
    DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::NEG_Y),
    DMat3::from_cols(DVec3::NEG_X, DVec3::Y, DVec3::NEG_Z),
];

/// The number of a face, and a point of its plane at a distance of 1; `None`: not seen.
type OnFace = Option<(usize, DVec2)>;

/// A pinhole picture of a part of what a camera sees.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Face {
    pub camera_from_face: DMat3,
    pub intrinsics: Intrinsics,
    pub size: (u32, u32),
}

/// Place of a pixel in the faces.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Place {
    /// Its number; as many as there are where the lens does not see.
    pub face: u32,
    /// Pixels of the face, at least one inside of its border.
    pub at: [f32; 2],
}

/// Places of a camera's pixels in its faces.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct LensMap {
    lens: Lens,
    size: (u32, u32),
    pub(super) faces: Vec<Face>,
    /// Rows from the top.
    pub(super) places: Vec<Place>,
}

/// The maps of the cameras of a world.
#[derive(Debug, Default)]
pub(crate) struct LensMaps(HashMap<Entity, Arc<LensMap>>);

impl LensMaps {
    /// The map of a camera; none of one whose lens does not bend. Equal cameras share theirs.
    ///
    /// # Errors
    /// The fault of the lens.
    pub fn of(&mut self, entity: Entity, camera: &CameraSensor) -> Result<Option<Arc<LensMap>>, String> {
        let mut known = self.0.get(&entity).into_iter().chain(self.0.values());
        let found = known.find(|map| map.is_of(camera)).cloned();
        if found.is_none() {
            camera.check_lens().map_err(|fault| format!("lens: {fault}"))?;
        }
        if !camera.lens.has_distortion() {
            return Ok(None);
        }
        let map = found.unwrap_or_else(|| Arc::new(LensMap::new(camera)));
        if map.faces.is_empty() {
            return Err("lens: sees no pixel of the picture".to_owned());
        }
        self.0.insert(entity, map.clone());
        Ok(Some(map))
    }

    /// Forgets those of cameras that are gone.
    pub fn retain(&mut self, world: &World) {
        self.0.retain(|entity, _| world.get_entity(*entity).is_ok());
    }
}

impl LensMap {
    fn new(camera: &CameraSensor) -> Self {
        let (width, height) = camera.size;
        let rows = map_in_parallel(0..height, |v| {
            (0..width).map(|u| camera.direction(u.into(), v.into())).collect::<Vec<Option<DVec3>>>()
        });
        let is_narrow = |ray: &DVec3| ray.z > 0.0 && ray.truncate().abs().max_element() <= WIDEST_FACE * ray.z;
        let turns = if rows.iter().flatten().flatten().all(is_narrow) { &CUBE[..1] } else { &CUBE[..] };
        // The face of each pixel, and where its ray meets the face's plane at a distance of 1.
        let on_face = |ray: &Option<DVec3>| {
            let ray = (*ray)?;
            let own = turns.iter().map(|turn| turn.transpose() * ray);
            let (face, ray) = own.enumerate().reduce(|a, b| if b.1.z > a.1.z { b } else { a })?;
            Some((face, ray.truncate() / ray.z))
        };
        let rows: Vec<Vec<OnFace>> = rows.iter().map(|row| row.iter().map(on_face).collect()).collect();
        let on_axis = camera.intrinsics().map_or(1.0, |own| own.fx.max(own.fy));
        let focal = DENSITY * least_spacing(&rows).map_or(on_axis, f64::recip);
        let mut bounds = vec![(DVec2::INFINITY, DVec2::NEG_INFINITY); turns.len()];
        for (face, at) in rows.iter().flatten().flatten() {
            let (least, most) = &mut bounds[*face];
            (*least, *most) = (least.min(*at), most.max(*at));
        }
        let used: Vec<usize> = (0..turns.len()).filter(|&face| bounds[face].0.x <= bounds[face].1.x).collect();
        let most = MOST_LARGER * f64::from(width.max(height));
        let faces: Vec<Face> = used.iter().map(|&face| Face::new(turns[face], bounds[face], (focal, most))).collect();
        let place = |found: &OnFace| {
            let number = found.and_then(|(face, _)| used.iter().position(|&used| used == face));
            let Some((number, (_, at))) = number.zip(*found) else {
                return Place { face: faces.len() as u32, at: [0.0; 2] };
            };
            let Intrinsics { fx, fy, cx, cy } = faces[number].intrinsics;
            Place { face: number as u32, at: [(fx * at.x + cx) as f32, (fy * at.y + cy) as f32] }
        };
        let places = rows.iter().flatten().map(place).collect();
        Self { lens: camera.lens, size: camera.size, faces, places }
    }

    fn is_of(&self, camera: &CameraSensor) -> bool {
        (self.lens, self.size) == (camera.lens, camera.size)
    }

    /// The direction of a pixel, by its place in rows from the top; camera axes. `None`: not seen.
    pub fn direction(&self, pixel: usize) -> Option<DVec3> {
        let Place { face, at: [u, v] } = *self.places.get(pixel)?;
        let face = self.faces.get(face as usize)?;
        Some(face.camera_from_face * face.intrinsics.direction(u.into(), v.into()))
    }

    /// The camera's pixels along a row.
    pub fn width(&self) -> u32 {
        self.size.0
    }

    /// Views of the faces for a camera's plan, which says where it is and what it gives.
    pub fn plans(&self, whole: &ViewPlan) -> Vec<ViewPlan> {
        // Depths are told apart by what they are of.
        let outputs =
            OutputSet { id: whole.settings.outputs.id || whole.settings.outputs.depth, ..whole.settings.outputs };
        let plan = |face: &Face| {
            let turn = ENTITY_FROM_CAMERA * face.camera_from_face * ENTITY_FROM_CAMERA;
            let world_from_face = whole.view.world_from_view * Affine3A::from_mat3(turn.as_mat3());
            let projection = Projection::Pinhole { intrinsics: face.intrinsics, size: face.size };
            let camera = Camera { projection, ..whole.view.camera.clone() };
            let view = View::new(&world_from_face, &camera, face.size.0, face.size.1);
            ViewPlan { view, settings: Settings { outputs, ..whole.settings } }
        };
        self.faces.iter().map(plan).collect()
    }
}

impl Face {
    /// With a pixel more on each side than it takes to have one on each side of everything within some bounds.
    /// `focal`: pixels, less where the face had more than so many along a side.
    fn new(camera_from_face: DMat3, (least, most): (DVec2, DVec2), (focal, pixels): (f64, f64)) -> Self {
        let focal = focal.min(pixels / (most - least).max_element().max(1e-9));
        let size = ((most - least) * focal).ceil() + 3.0;
        let corner = 1.0 - least * focal;
        let intrinsics = Intrinsics { fx: focal, fy: focal, cx: corner.x, cy: corner.y };
        Self { camera_from_face, intrinsics, size: (size.x as u32, size.y as u32) }
    }
}

/// The least distance of two pixels side by side, on planes at a distance of 1.
fn least_spacing(rows: &[Vec<OnFace>]) -> Option<f64> {
    let distance = |a: &OnFace, b: &OnFace| {
        let ((face, a), (other, b)) = (*a).zip(*b)?;
        (face == other).then(|| a.distance(b)).filter(|distance| *distance > 0.0)
    };
    let across = rows.iter().flat_map(|row| row.windows(2)).filter_map(|two| distance(&two[0], &two[1]));
    let down = rows.windows(2).flat_map(|two| two[0].iter().zip(&two[1])).filter_map(|(a, b)| distance(a, b));
    across.chain(down).reduce(f64::min)
}
