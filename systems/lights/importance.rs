//! Choice of the lights that have a shadow map: those that matter most to a picture.
//!
//! A picture has room for some maps only. The importance of a light is the share of its flux that arrives in the
//! picture:
//!
//! ```text
//! I = q · Φ / (D² + R²/4)
//! Φ   Y of a point light, Y (1 − cos outer)/2 of a spot; Y is its luminance
//! D   from the eye to the middle of what it lights
//! R   the radius of what it lights: a sphere of its range, of a spot the smallest sphere around its cone
//! q   Π over the view's planes of smoothstep(0, 1, (d + R)/R); d is the signed distance of that middle
//! ```
//!
//! Flux over squared distance is the integral of irradiance over all surfaces, times the pixels per area. R²/4 is there
//! since what is lit is no point: it is some way from its middle. Where q is 0, no pixel can be lit. A light without a
//! range counts as if it ended at the distance where Y/R², times the exposure, is [`DARK`].
//!
//! The k lights of the highest importance have a map; of equal ones, those in the lower slots. So that nothing pops
//! when they change, a map counts by its fade m = 1 − (I₍k₊₁₎/I)⁴, as weights of selected lights do. Shading uses
//! 1 + m (V − 1) for the visibility V. A light comes and goes at m = 0, or where it lights no pixel.
//!
//! [`ShadowLight::importance`] is the definition; [`rank`] gives the best of all lights, bit for bit. Since q ≤ 1,
//! Φ / (D² + R²/4) is an upper bound: q is found only for lights of a block in which that is enough. One formula
//! serves both, a lane at a time, which the compiler makes vectors of.
//!
//! Directional lights have maps of their own: [`rank_suns`] ranks them by their luminance, which is what arrives of
//! them anywhere. They fade by the same formula, but against the brightest of the others that is less bright: what is
//! as bright to the bit is not about to overtake. So of five equal suns the four in the lower slots cast in full. A
//! fifth that becomes brighter comes and goes without a step, but for the one frame in which it is equal, if there is
//! one. Importances of lamps change with the eye, and pass through equality wherever a view is symmetric: of lamps
//! whose last map is contested by an equal one, that one fades to nothing.

use super::components::Light;
use super::record::LightRecord;
use super::relevance::ScoredLight;
use crate::space::bounds::Sphere;
use glam::{Vec3, Vec4};
use std::collections::BTreeMap;

/// The shown irradiance, of 1 for white, below which a light without a range counts as none.
pub const DARK: f32 = 0.004;
/// Metres: what a light reaches is no smaller, so that importances are finite.
const LEAST_RADIUS: f32 = 1e-3;
/// Metres: what [`Light::shadow_near`] may be.
const NEAR: [f32; 2] = [1e-3, 1e6];
/// Lights of a block.
const WIDTH: usize = 16;
/// One in so many blocks is looked at first, to know early what the best are.
const FIRST: usize = 16;

/// Part of a view that the importances of lights depend on.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShadowView {
    /// The eye, world space, metres.
    pub eye: Vec3,
    /// The frustum's planes without the far one, world space: inward unit normal and offset.
    pub planes: [Vec4; 5],
    /// Factor of light before it is shown.
    pub exposure: f32,
}

/// An enabled point light or spot that casts shadows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ShadowLight {
    /// In the light table.
    pub slot: u32,
    /// Metres: what is nearer casts no shadow.
    pub near: f32,
    reach: Reach,
}

/// Lit volume of a light, and its flux.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Reach {
    position: Vec3,
    /// To the middle of what it lights, metres; of a light without a range, at an exposure of 1.
    toward: Vec3,
    /// Radius of the lit volume, metres; of a light without a range, at an exposure of 1.
    radius: f32,
    flux: f32,
    /// 1 for a light without a range, 0 for others.
    endless: f32,
}

/// A light that has a map, or levels of maps.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ranked {
    /// In the light table.
    pub slot: u32,
    /// Above 0.
    pub importance: f32,
    /// Weight of its shadows, 0 to 1.
    pub fade: f32,
}

impl ShadowLight {
    /// `None` where the light is off or directional.
    pub(crate) fn new(slot: u32, near: f32, light: &ScoredLight) -> Option<Self> {
        if matches!(light.kind, LightRecord::OFF | LightRecord::DIRECTIONAL) {
            return None;
        }
        let is_endless = light.range.is_infinite();
        let range = if is_endless { (light.luminance / DARK).sqrt() } else { light.range };
        let [cos, sin] = light.edge;
        // The smallest sphere around a cone goes through its tip, or has the edge of its end for a great circle.
        let (toward, radius, share) = if light.kind == LightRecord::POINT {
            (0.0, 1.0, 1.0)
        } else {
            let middle = if cos > sin { 0.5 / cos } else { cos };
            // 1 − cos without the difference: sin² / (1 + cos).
            (middle, middle.max(sin), sin * sin / (1.0 + cos) * 0.5)
        };
        let reach = Reach {
            position: light.position,
            toward: light.axis * (range * toward),
            radius: range * radius,
            flux: light.luminance * share,
            endless: f32::from(u8::from(is_endless)),
        };
        let near = if near.is_nan() { Light::SHADOW_NEAR } else { near.clamp(NEAR[0], NEAR[1]) };
        Some(Self { slot, near, reach })
    }

    /// Importance of the light for the picture; 0 where none of it can be seen.
    pub fn importance(&self, view: &ShadowView) -> f32 {
        let lit = self.reach.lit(view.exposure.sqrt());
        let importance = self.reach.arriving(view, lit) * in_view(view, lit);
        // Not a number where something is too far away to be squared.
        if importance > 0.0 { importance } else { 0.0 }
    }
}

impl Reach {
    /// Bounding sphere of the lit volume, world space.
    #[inline(always)]
    fn lit(&self, exposure_root: f32) -> Sphere {
        let scale = if self.endless > 0.0 { exposure_root } else { 1.0 };
        Sphere { center: self.position + self.toward * scale, radius: (self.radius * scale).max(LEAST_RADIUS) }
    }

    /// Φ / (D² + R²/4).
    #[inline(always)]
    fn arriving(&self, view: &ShadowView, lit: Sphere) -> f32 {
        let way = lit.center - view.eye;
        self.flux / (way.dot(way) + lit.radius * lit.radius * 0.25)
    }
}

/// q, at most 1.
#[inline(always)]
fn in_view(view: &ShadowView, lit: Sphere) -> f32 {
    let mut share = 1.0;
    for plane in view.planes {
        let distance = plane.truncate().dot(lit.center) + plane.w;
        let x = ((distance + lit.radius) / lit.radius).clamp(0.0, 1.0);
        share *= (x * x * (3.0 - 2.0 * x)).min(1.0);
    }
    share
}

/// Sixteen lights, a field of all of them after the other; those that are none have no flux.
#[derive(Clone, Debug)]
struct Block {
    position: [[f32; WIDTH]; 3],
    toward: [[f32; WIDTH]; 3],
    radius: [f32; WIDTH],
    flux: [f32; WIDTH],
    endless: [f32; WIDTH],
}

impl Block {
    const EMPTY: Self = Self {
        position: [[0.0; WIDTH]; 3],
        toward: [[0.0; WIDTH]; 3],
        radius: [0.0; WIDTH],
        flux: [0.0; WIDTH],
        endless: [0.0; WIDTH],
    };

    fn set(&mut self, lane: usize, reach: &Reach) {
        for axis in 0..3 {
            self.position[axis][lane] = reach.position[axis];
            self.toward[axis][lane] = reach.toward[axis];
        }
        self.radius[lane] = reach.radius;
        self.flux[lane] = reach.flux;
        self.endless[lane] = reach.endless;
    }

    #[inline(always)]
    fn reach(&self, lane: usize) -> Reach {
        let vector = |[x, y, z]: &[[f32; WIDTH]; 3]| Vec3::new(x[lane], y[lane], z[lane]);
        Reach {
            position: vector(&self.position),
            toward: vector(&self.toward),
            radius: self.radius[lane],
            flux: self.flux[lane],
            endless: self.endless[lane],
        }
    }

    /// The importances of its lights; `None` where none can be as much as the least.
    fn importances(&self, view: &ShadowView, exposure_root: f32, least: f32) -> Option<[f32; WIDTH]> {
        let mut importances = [0.0; WIDTH];
        let mut is_enough = false;
        for (lane, importance) in importances.iter_mut().enumerate() {
            let reach = self.reach(lane);
            *importance = reach.arriving(view, reach.lit(exposure_root));
            is_enough |= *importance >= least;
        }
        if !is_enough {
            return None;
        }
        for (lane, importance) in importances.iter_mut().enumerate() {
            *importance *= in_view(view, self.reach(lane).lit(exposure_root));
        }
        Some(importances)
    }
}

/// All enabled lights that cast shadows.
#[derive(Clone, Debug, Default)]
pub struct ShadowLights {
    lights: Vec<ShadowLight>,
    /// Slots of the directional ones, and their luminances.
    suns: BTreeMap<u32, f32>,
    blocks: Vec<Block>,
    version: u64,
    /// Slots and their new lights since the last update, in this order.
    given: Vec<(u32, Option<ShadowLight>)>,
}

impl ShadowLights {
    /// Directional lights that have shadow maps at once.
    pub const MOST_SUNS: usize = 4;

    /// Point lights and spots, by ascending slot.
    pub fn lights(&self) -> &[ShadowLight] {
        &self.lights
    }

    /// Tells if there are none.
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty() && self.suns.is_empty()
    }

    /// Another number after each frame in which point lights or spots changed.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// The light in a slot.
    pub fn get(&self, slot: u32) -> Option<&ShadowLight> {
        self.find(slot).ok().map(|at| &self.lights[at])
    }

    fn find(&self, slot: u32) -> Result<usize, usize> {
        self.lights.binary_search_by_key(&slot, |light| light.slot)
    }

    /// Gives a slot a directional light of some luminance, or none.
    pub(crate) fn give_sun(&mut self, slot: u32, luminance: Option<f32>) {
        match luminance.filter(|luminance| *luminance > 0.0) {
            Some(luminance) => self.suns.insert(slot, luminance),
            None => self.suns.remove(&slot),
        };
    }

    /// Gives a slot a point light or spot, or none.
    pub(crate) fn give(&mut self, slot: u32, light: Option<ShadowLight>) {
        if light.is_some() || !self.lights.is_empty() || !self.given.is_empty() {
            self.given.push((slot, light));
        }
    }

    /// Brings the list up to date with what was given.
    pub(crate) fn update(&mut self) {
        let mut given = std::mem::take(&mut self.given);
        // Stable: of what a slot was given, the last counts.
        given.sort_by_key(|&(slot, _)| slot);
        let (mut came, mut gone, mut is_changed) = (Vec::new(), Vec::new(), false);
        for of_slot in given.chunk_by(|a, b| a.0 == b.0) {
            let Some(&(slot, light)) = of_slot.last() else { continue };
            match (self.find(slot), light) {
                (Ok(at), Some(light)) if self.lights[at] != light => {
                    self.lights[at] = light;
                    self.blocks[at / WIDTH].set(at % WIDTH, &light.reach);
                    is_changed = true;
                }
                (Ok(_), None) => gone.push(slot),
                (Err(_), Some(light)) => came.push(light),
                _ => {}
            }
        }
        if !came.is_empty() || !gone.is_empty() {
            let mut gone = gone.into_iter().peekable();
            self.lights.retain(|light| gone.next_if_eq(&light.slot).is_none());
            self.lights.append(&mut came);
            // Two ascending runs: they are merged.
            self.lights.sort_by_key(|light| light.slot);
            self.fill_blocks();
            is_changed = true;
        }
        self.version += u64::from(is_changed);
        given.clear();
        self.given = given;
    }

    fn fill_blocks(&mut self) {
        self.blocks.clear();
        self.blocks.extend(self.lights.chunks(WIDTH).map(|lights| {
            let mut block = Block::EMPTY;
            for (lane, light) in lights.iter().enumerate() {
                block.set(lane, &light.reach);
            }
            block
        }));
    }
}

/// The k most important lights of a picture, most important first, of equal ones the lower slot; fewer where others
/// cannot be seen in it. It takes time that grows with the number of lights, not with k.
pub fn rank(lights: &ShadowLights, view: &ShadowView, k: usize) -> Vec<Ranked> {
    let exposure_root = view.exposure.sqrt();
    let count = lights.blocks.len();
    let first = (0..count).step_by(FIRST);
    let others = (0..count).filter(|block| block % FIRST != 0);
    let mut best = Best::new(k.saturating_add(1).min(lights.lights.len() + 1));
    for at in first.chain(others) {
        let Some(importances) = lights.blocks[at].importances(view, exposure_root, best.least_importance()) else {
            continue;
        };
        for (light, importance) in lights.lights[at * WIDTH..].iter().zip(importances) {
            if importance > 0.0 {
                best.add(key(importance, light.slot));
            }
        }
    }
    let keys = best.finish();
    let next = keys.get(k).map_or(0.0, |&key| importance_of(key));
    ranked(&keys, k, |_| next)
}

/// The [`ShadowLights::MOST_SUNS`] brightest directional lights, brightest first, of equal ones the lower slot.
pub fn rank_suns(lights: &ShadowLights) -> Vec<Ranked> {
    let mut keys: Vec<u64> = lights.suns.iter().map(|(&slot, &luminance)| key(luminance, slot)).collect();
    keys.sort_unstable_by(|a, b| b.cmp(a));
    let others = keys.get(ShadowLights::MOST_SUNS..).unwrap_or_default();
    ranked(&keys, ShadowLights::MOST_SUNS, |importance| {
        others.iter().map(|&key| importance_of(key)).find(|next| *next < importance).unwrap_or(0.0)
    })
}

/// The weight of a light's shadows, of which `next` is the next most important without a map.
pub fn fade(importance: f32, next: f32) -> f32 {
    let ratio = next / importance;
    1.0 - (ratio * ratio) * (ratio * ratio)
}

/// The first k of some keys, greatest first. `next`: what one of some importance fades against.
fn ranked(keys: &[u64], k: usize, next: impl Fn(f32) -> f32) -> Vec<Ranked> {
    let ranked = |&key: &u64| {
        let importance = importance_of(key);
        Ranked { slot: !(key as u32), importance, fade: fade(importance, next(importance)) }
    };
    keys.iter().take(k).map(ranked).collect()
}

/// Orders by importance (positive floats order as their bits do), of equal ones the lower slot higher.
fn key(importance: f32, slot: u32) -> u64 {
    u64::from(importance.to_bits()) << 32 | u64::from(!slot)
}

fn importance_of(key: u64) -> f32 {
    f32::from_bits((key >> 32) as u32)
}

/// The greatest keys of many.
struct Best {
    count: usize,
    /// A key must be above; 0 until there are enough.
    least: u64,
    keys: Vec<u64>,
}

impl Best {
    fn new(count: usize) -> Self {
        Self { count, least: 0, keys: Vec::new() }
    }

    fn least_importance(&self) -> f32 {
        importance_of(self.least)
    }

    fn add(&mut self, key: u64) {
        if key <= self.least {
            return;
        }
        self.keys.push(key);
        // Twice as many, so that a key costs the same on average however many are kept.
        if self.keys.len() >= 2 * self.count {
            self.shorten();
        }
    }

    fn shorten(&mut self) {
        if self.keys.len() >= self.count {
            let (_, least, _) = self.keys.select_nth_unstable_by(self.count - 1, |a, b| b.cmp(a));
            self.least = *least;
            self.keys.truncate(self.count);
        }
    }

    /// Greatest first.
    fn finish(mut self) -> Vec<u64> {
        self.shorten();
        self.keys.sort_unstable_by(|a, b| b.cmp(a));
        self.keys
    }
}
