//! Generators.

use super::entities::PARTS_OF_A_VEHICLE;
use super::walk::{Check, MOST_ENTITIES, SIZES};
use crate::scene::format::generators::{Generator, Grid, Place, Region, Scatter};
use systems::space::FARTHEST;

impl<'a> Check<'a> {
    pub(super) fn generator(&mut self, g: &'a Generator) -> u64 {
        let mut copies = 0;
        self.field("place", |c| match &g.place {
            Place::Grid(grid) => copies = c.grid(grid),
            Place::Scatter(scatter) => copies = c.scatter(scatter),
            Place::Along(along) => copies = c.along(along),
        });
        let mut each = 0;
        self.field("entity", |c| {
            each = c.entity(&g.entity, &g.meshes, false);
            if !g.vehicles.is_empty() && g.entity.vehicle.is_none() {
                each += PARTS_OF_A_VEHICLE;
            }
            if g.entity.camera.is_some() {
                c.field("camera", |c| c.fault("cameras are not allowed in generators"));
            }
        });
        if !g.vehicles.is_empty() {
            self.field("vehicles", Self::generated_vehicles);
        }
        self.each("meshes", &g.meshes, |c, mesh| c.known_mesh(mesh));
        self.each("materials", &g.materials, |c, material| c.known_material(material));
        self.each("lights", &g.lights, Self::described);
        self.numbers("random_scale", &g.random_scale, SIZES.0, SIZES.1);
        let [least, most] = g.random_scale;
        if least > most {
            let message = format!("expected (least, most), found ({least}, {most}); write ({most}, {least})");
            self.field("random_scale", |c| c.fault(message));
        }
        copies.saturating_mul(each)
    }

    fn grid(&mut self, grid: &Grid) -> u64 {
        let copies = grid.counts.iter().fold(1u64, |product, &n| product.saturating_mul(n.into()));
        if copies == 0 || copies > MOST_ENTITIES {
            let message = format!("expected from 1 to {MOST_ENTITIES} copies in all, found {copies}");
            self.field("counts", |c| c.fault(message));
        }
        self.numbers("spacing", &grid.spacing, -FARTHEST as f32, FARTHEST as f32);
        grid.center.iter().for_each(|center| self.position("center", center));
        self.numbers("jitter", &grid.jitter, 0.0, FARTHEST as f32);
        copies
    }

    fn scatter(&mut self, scatter: &Scatter) -> u64 {
        self.count("count", scatter.count, 1, MOST_ENTITIES as u32);
        self.number("min_distance", scatter.min_distance, 0.0, FARTHEST as f32);
        self.field("region", |c| match &scatter.region {
            Region::Box { min, max } => {
                c.position("min", min);
                c.position("max", max);
                if min.iter().zip(max).any(|(min, max)| min > max) {
                    c.fault(format_args!("expected min to be at most max on every axis, found {min:?} and {max:?}"));
                }
            }
            Region::Disc { center, radius } => {
                c.position("center", center);
                c.number("radius", *radius, SIZES.0, FARTHEST as f32);
            }
        });
        scatter.count.into()
    }
}
