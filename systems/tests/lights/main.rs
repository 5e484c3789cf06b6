//! Lights: what one gives, which are chosen for objects, through portals and for shadow maps, and what a world keeps.

#[path = "../common/mod.rs"]
mod common;
mod light_components;
mod light_search;
mod portals;
mod relevance;
mod shadow_lights;
mod world;
