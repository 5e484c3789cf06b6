//! Origin of a scene's coordinates: its `origin`, or one that is chosen where they are large.
//!
//! A file has its places in 64 bits. The origin is taken from each before anything is made of it, as decimal numbers:
//! what is left of 500012.3 is the 12.3 that the same scene near zero would have, and not the 12.299999999988 that is
//! left of the binary numbers. So both scenes are the same to the bit.

use crate::scene::format::entities::{self, Entity};
use crate::scene::format::generators::{Generator, Place, Region};
use crate::scene::format::scene::Scene;
use crate::scene::format::values::Origin;
use glam::{Affine3A, DVec3};
use systems::lights::LightDescription;
use systems::space::origin::{PRECISE, spacing};

/// Metres from the middle of a scene within which its origin is chosen, if something in it is as near.
const NEAR: f64 = 10_000.0;
/// Metres: origins are whole multiples of one of these, of the first that comes out.
const ROUND: [f64; 4] = [1e6, 1e5, 1e4, 1e3];

/// The list and the index of the entry that a place belongs to.
type Whose = (&'static str, usize);

/// Makes all places of a checked scene count from its origin; returns it, and what a person should know of it.
pub fn move_to_origin(scene: &mut Scene) -> (DVec3, Vec<String>) {
    let mut warnings = Vec::new();
    let origin = scene.origin.map(|Origin(origin)| origin).unwrap_or_else(|| {
        let chosen = choose(scene);
        if chosen != [0.0; 3] {
            warnings.push(format!(
                "the scene's coordinates are large: positions are relative to the origin {0}; \
                 set it explicitly: origin: {0}",
                tuple(chosen)
            ));
        }
        chosen
    });
    each_place(scene, |_, place| {
        for (coordinate, from) in place.iter_mut().zip(origin) {
            *coordinate = minus(*coordinate, from);
        }
    });
    let mut farthest: Option<(f64, Whose)> = None;
    let mut count = 0usize;
    each_reach(scene, |whose, place| {
        let distance = place.abs().max_element();
        if distance > PRECISE {
            count += 1;
            if farthest.is_none_or(|(most, _)| distance > most) {
                farthest = Some((distance, whose));
            }
        }
    });
    if let Some((distance, (list, index))) = farthest {
        let others = match count - 1 {
            0 => " is".to_owned(),
            1 => " and 1 other position are".to_owned(),
            more => format!(" and {more} other positions are"),
        };
        warnings.push(format!(
            "{list}[{index}]{others} up to {:.1} km from the origin {}: positions there are rounded to {:.1e} m; \
             within {} km they are precise",
            distance / 1e3,
            tuple(origin),
            spacing(distance),
            PRECISE / 1e3,
        ));
    }
    warnings.extend(scene.entities.iter().enumerate().filter_map(|(i, entity)| looks_far(i, entity)));
    (DVec3::from_array(origin), warnings)
}

/// Warns of an entity that stands at the origin for want of a place, and looks at a point that is hardly relative to
/// it.
fn looks_far(index: usize, entity: &Entity) -> Option<String> {
    let what = match &entity.light {
        _ if entity.camera.is_some() => "camera",
        Some(LightDescription::Spot(_)) => "light",
        _ => return None,
    };
    let target = entity.transform.look_at.filter(|_| entity.transform.translation.is_none())?;
    let distance = DVec3::from_array(target).abs().max_element();
    (distance > PRECISE).then(|| {
        format!(
            "entities[{index}].transform.look_at is {:.1} km from the origin: without a `translation`, the \
             {what} is at the origin and looks at a point relative to it; is `translation` missing?",
            distance / 1e3
        )
    })
}

fn tuple([x, y, z]: [f64; 3]) -> String {
    format!("({x}, {y}, {z})")
}

/// Zero where nothing lies far from it on an axis. Else the roundest number of kilometres that lies within the scene,
/// near its middle: a scene that was built near zero and moved to a map gets the place that it was moved to.
fn choose(scene: &mut Scene) -> [f64; 3] {
    let mut coordinates: [Vec<f64>; 3] = Default::default();
    each_place(scene, |_, place| {
        coordinates.iter_mut().zip(&*place).for_each(|(axis, coordinate)| axis.push(*coordinate));
    });
    coordinates.map(choose_on_axis)
}

fn choose_on_axis(mut coordinates: Vec<f64>) -> f64 {
    if coordinates.iter().all(|coordinate| coordinate.abs() <= PRECISE) {
        return 0.0;
    }
    coordinates.sort_unstable_by(f64::total_cmp);
    // Of numbers in order the one in the middle: a few that are elsewhere do not draw it there.
    let (low, middle, high) = (coordinates[0], coordinates[coordinates.len() / 2], coordinates[coordinates.len() - 1]);
    let nearest = |round: f64, margin: f64| {
        let (low, high) = ((low - margin).max(middle - NEAR), (high + margin).min(middle + NEAR));
        let inside = (low / round).ceil()..=(high / round).floor();
        let nearest = (middle / round).round().clamp(*inside.start(), inside.end().max(*inside.start()));
        (!inside.is_empty()).then_some(nearest * round + 0.0)
    };
    // Within the scene rather than just beside it. Zero is a multiple of everything.
    let beside = ROUND[ROUND.len() - 1] / 2.0;
    let of_round = |round: &f64| nearest(*round, 0.0).or_else(|| nearest(*round, beside));
    ROUND.iter().find_map(of_round).unwrap_or_default()
}

/// Visits the places that a scene reaches, relative to its origin, axis by axis: also the extents of grids and regions,
/// and what is below an entity.
fn each_reach(scene: &Scene, mut see: impl FnMut(Whose, DVec3)) {
    for (i, entity) in scene.entities.iter().enumerate() {
        let target = entity.transform.look_at.filter(|_| entity.transform.translation.is_some());
        target.iter().for_each(|target| see(("entities", i), DVec3::from_array(*target)));
        each_below(entity, &Affine3A::IDENTITY, &mut |at| see(("entities", i), at));
    }
    for (i, (_, route)) in scene.routes.entries().iter().enumerate() {
        route.points.iter().for_each(|point| see(("routes", i), DVec3::from_array(*point)));
    }
    for (i, (_, cell)) in scene.cells.entries().iter().enumerate() {
        let hull = cell.hull.is_some().then_some(&cell.translation);
        cell.r#box.iter().flatten().chain(hull).for_each(|corner| see(("cells", i), DVec3::from_array(*corner)));
    }
    for (i, portal) in scene.portals.iter().enumerate() {
        portal.polygon.iter().for_each(|corner| see(("portals", i), DVec3::from_array(*corner)));
    }
    for (i, generator) in scene.generators.iter().enumerate() {
        let extent = extent(&generator.place, scene);
        each_below(&generator.entity, &Affine3A::IDENTITY, &mut |at| {
            see(("generators", i), extent + turned(generator, at));
        });
    }
}

/// Visits the places of an entity and all below it, in its parent's axes. What is attached counts as if its node were
/// at the model's origin.
fn each_below(entity: &Entity, parent: &Affine3A, see: &mut impl FnMut(DVec3)) {
    let at = *parent * entities::transform(&entity.transform).compute_affine();
    see(at.translation.as_dvec3());
    entity.children.iter().chain(&entity.attach).for_each(|below| each_below(below, &at, see));
}

/// Farthest coordinates of a generator's places, axis by axis.
fn extent(place: &Place, scene: &Scene) -> DVec3 {
    let vector = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    match place {
        Place::Grid(grid) => {
            let middle = (DVec3::from_array(grid.counts.map(f64::from)) - 1.0) * 0.5;
            let center = DVec3::from_array(grid.center.unwrap_or_default());
            center.abs() + (middle * vector(grid.spacing)).abs() + vector(grid.jitter)
        }
        Place::Scatter(scatter) => match scatter.region {
            Region::Box { min, max } => DVec3::from_array(min).abs().max(DVec3::from_array(max).abs()),
            Region::Disc { center, radius } => {
                DVec3::from_array(center).abs() + DVec3::new(1.0, 0.0, 1.0) * f64::from(radius)
            }
        },
        Place::Along(along) => {
            let is_named = |name: &String| along.routes.is_empty() || along.routes.contains(name);
            let routes = scene.routes.entries().iter().filter(|(name, _)| is_named(name));
            let points = routes.flat_map(|(_, route)| &route.points).map(|point| DVec3::from_array(*point).abs());
            let beside = along.beside.map_or(0.0, |metres| f64::from(metres.abs()));
            points.fold(DVec3::ZERO, DVec3::max) + DVec3::new(beside, 0.0, beside)
        }
    }
}

/// A place in a copy, axis by axis, however the generator turns and scales it.
fn turned(generator: &Generator, at: DVec3) -> DVec3 {
    let is_turned = generator.random_yaw || matches!(generator.place, Place::Along(_));
    let flat = at.x.hypot(at.z);
    let at = if is_turned { DVec3::new(flat, at.y.abs(), flat) } else { at.abs() };
    at * f64::from(generator.random_scale.0[1])
}

/// Everything in a scene that is a place in the world. Below an entity places are its own; what has none stands at the
/// origin, and vehicles with a route stand on it.
fn each_place(scene: &mut Scene, mut see: impl FnMut(Whose, &mut [f64; 3])) {
    let has_route = |entity: &Entity| entity.vehicle.as_ref().is_some_and(|vehicle| vehicle.route.is_some());
    for (i, entity) in scene.entities.iter_mut().enumerate().filter(|(_, entity)| !has_route(entity)) {
        let Some(translation) = &mut entity.transform.translation else { continue };
        see(("entities", i), translation);
        entity.transform.look_at.iter_mut().for_each(|target| see(("entities", i), target));
    }
    for (i, (_, route)) in scene.routes.entries_mut().iter_mut().enumerate() {
        route.points.iter_mut().for_each(|point| see(("routes", i), point));
    }
    for (i, (_, cell)) in scene.cells.entries_mut().iter_mut().enumerate() {
        cell.r#box.iter_mut().flatten().for_each(|corner| see(("cells", i), corner));
        if cell.hull.is_some() {
            see(("cells", i), &mut cell.translation);
        }
    }
    for (i, portal) in scene.portals.iter_mut().enumerate() {
        portal.polygon.iter_mut().for_each(|corner| see(("portals", i), corner));
    }
    for (i, generator) in scene.generators.iter_mut().enumerate() {
        match &mut generator.place {
            Place::Grid(grid) => grid.center.iter_mut().for_each(|center| see(("generators", i), center)),
            Place::Scatter(scatter) => match &mut scatter.region {
                Region::Box { min, max } => [min, max].into_iter().for_each(|corner| see(("generators", i), corner)),
                Region::Disc { center, .. } => see(("generators", i), center),
            },
            Place::Along(_) => {}
        }
    }
}

/// The number nearest to a − b, where both count as the shortest decimal numbers that read as them.
fn minus(a: f64, b: f64) -> f64 {
    if b == 0.0 {
        return a;
    }
    decimal_minus(a, b).unwrap_or(a - b)
}

/// Places behind the point, beyond which nothing is gained: a coordinate of 1 km has 13.
const MOST_DECIMALS: usize = 18;

fn decimal_minus(a: f64, b: f64) -> Option<f64> {
    let [(a, decimals_a), (b, decimals_b)] = [decimal(a)?, decimal(b)?];
    let decimals = decimals_a.max(decimals_b);
    let scale = |decimals: usize| 10i128.pow(decimals as u32);
    let difference = a * scale(decimals - decimals_a) - b * scale(decimals - decimals_b);
    let (sign, digits) = (if difference < 0 { "-" } else { "" }, difference.unsigned_abs());
    let one = scale(decimals).unsigned_abs();
    format!("{sign}{}.{:0>decimals$}", digits / one, digits % one).parse().ok()
}

/// A number as whole multiples of 10^−n, and n.
fn decimal(number: f64) -> Option<(i128, usize)> {
    let text = number.to_string();
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    if fraction.len() > MOST_DECIMALS {
        return None;
    }
    Some((format!("{whole}{fraction}").parse().ok()?, fraction.len()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn origins_are_round_and_within_the_scene() {
        let of = |coordinates: &[f64]| choose_on_axis(coordinates.to_vec());
        assert_eq!(of(&[-19_999.0, 0.0, 20_000.0]), 0.0, "nothing is far");
        assert_eq!(of(&[5e6, 5e6 + 600.0, 5e6 + 200.0]), 5e6);
        assert_eq!(of(&[500_000.0, 500_000.0, 504_000.0]), 500_000.0, "the roundest of five");
        assert_eq!(of(&[512_000.0, 512_700.0, 512_900.0]), 512_000.0, "within the scene");
        assert_eq!(of(&[512_100.0, 512_400.0]), 512_000.0, "just beside it");
        assert_eq!(of(&[512_700.0, 513_300.0]), 513_000.0);
        assert_eq!(of(&[-5_403_010.0, -5_402_990.0]), -5_403_000.0);
        // Only a mountain is far; the rest is where it is.
        assert_eq!(of(&[0.0, 10.0, -4.0, 60_000.0]), 0.0);
        assert_eq!(of(&[600_000.0, 600_100.0, 600_200.0, 0.0]), 600_000.0);
        // A country: near its middle.
        let wide: Vec<f64> = (0..=100).map(|i| 300_000.0 + 5000.0 * f64::from(i)).collect();
        assert_eq!(of(&wide), 550_000.0);
    }

    #[test]
    fn what_is_left_is_what_was_written() {
        for (a, b, left) in [
            (500_012.3, 5e5, 12.3),
            (5_000_000.003, 5e6, 0.003),
            (4_999_999.7, 5e6, -0.3),
            (-5_000_000.3, -5e6, -0.3),
            (0.1, 5e5, -499_999.9),
            (5e5, 5e5, 0.0),
            (500_012.25, 500_000.5, 11.75),
            (1e-300, 5e5, -5e5),
        ] {
            assert_eq!(minus(a, b), left, "{a} - {b}");
        }
        assert!(minus(5e5, 5e5).is_sign_positive());
    }

    proptest! {
        #[test]
        fn a_place_that_was_moved_by_whole_kilometres_is_what_it_was(
            micrometres in -20_000_000_000i64..20_000_000_000, kilometres in -9_900i64..9_900,
        ) {
            let near = format!("{micrometres}e-6").parse::<f64>().expect("a number");
            let far = format!("{}e-6", micrometres + kilometres * 1_000_000_000).parse::<f64>().expect("a number");
            prop_assert_eq!(minus(far, kilometres as f64 * 1e3).to_bits(), (near + 0.0).to_bits());
        }
    }
}
