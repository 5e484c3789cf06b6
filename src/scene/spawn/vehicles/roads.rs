//! A checked scene's routes and signals become those of the world; places along routes.

use super::road_warnings;
use crate::scene::format::roads::{self as format, Along};
use crate::scene::format::scene::Scene;
use crate::scene::spawn::random::Random;
use bevy_ecs::prelude::*;
use glam::DVec3;
use systems::space::Transform;
use systems::space::origin::Origin;
use systems::vehicles::routes::{RoutePlan, Routes, Stop, Wait};
use systems::vehicles::signals::{Signal, Signals};
use systems::vehicles::{OnRoute, RouteId};

/// Gives the world the scene's routes and signals; returns what a person should know of them.
pub fn insert(scene: &Scene, seed: u64, world: &mut World) -> Vec<String> {
    let signals =
        Signals::new(scene.signals.entries().iter().map(|(name, signal)| plan_signal(name, signal)).collect());
    let plans = scene.routes.entries().iter().map(|(name, route)| plan_route(name, route, scene, &signals)).collect();
    let routes = Routes::new(plans, scene.traffic.left_hand, seed);
    let warnings = road_warnings::of_routes(&routes, world.resource::<Origin>().0);
    world.insert_resource(routes);
    world.insert_resource(signals);
    warnings
}

fn plan_signal(name: &str, signal: &format::Signal) -> Signal {
    Signal {
        name: name.into(),
        green: signal.green_seconds.clone(),
        amber: signal.amber_seconds,
        red: signal.red_seconds,
        offset: signal.offset_seconds,
    }
}

fn plan_route(name: &str, route: &format::Route, scene: &Scene, signals: &Signals) -> RoutePlan {
    let stop = |stop: &format::Stop| {
        let head = stop.signal.as_ref().and_then(|signal| signals.head(signal, stop.group));
        let wait = head.map_or(Wait::Dwell(stop.seconds.unwrap_or(0.0)), Wait::Signal);
        Stop { at: stop.at, wait, clear: stop.keep_clear }
    };
    let mut limits: Vec<(f32, f32)> = route.limits.iter().map(|limit| (limit.from, limit.kmh / 3.6)).collect();
    limits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let id = |next: &String| scene.routes.position(next).map(|index| RouteId(index as u16));
    RoutePlan {
        name: name.into(),
        points: route.points.iter().map(|&point| DVec3::from_array(point)).collect(),
        spline: route.shape == format::Shape::Spline,
        closed: route.closed,
        lanes: route.lanes,
        lane_width: route.lane_width,
        speed_limit: route.speed_limit_kmh / 3.6,
        limits,
        stops: route.stops.iter().map(stop).collect(),
        then: route.then.iter().filter_map(id).collect(),
        from_lanes: route.from_lanes.clone(),
        longest: route.longest_vehicle.unwrap_or(f32::INFINITY),
    }
}

/// Places along routes, in the order of routes, lanes and metres; on a lane, or beside the centre line.
pub fn along(along: &Along, world: &World, random: &mut Random) -> Vec<(Transform, OnRoute)> {
    let routes = world.resource::<Routes>();
    let mut places = Vec::new();
    let is_named = |name: &String| along.routes.is_empty() || along.routes.contains(name);
    for (id, route) in routes.iter().filter(|(_, route)| is_named(&route.plan.name)) {
        let lanes = if along.beside.is_some() { 0..1 } else { 0..route.lanes() };
        for lane in lanes.filter(|lane| along.beside.is_some() || along.lane.is_none_or(|only| only == *lane)) {
            let mut at = f64::from(along.from);
            while at < route.length {
                let moved = f64::from(random.between(-along.jitter, along.jitter));
                let place = (at + moved).clamp(0.0, route.length - 0.1);
                let on = OnRoute::new(id, lane, place);
                let mut stands = routes.stand(&on);
                if let Some(beside) = along.beside {
                    stands.translation = route.place(place).beside(beside).as_vec3();
                }
                places.push((stands, on));
                at += f64::from(along.spacing);
            }
        }
    }
    places
}
