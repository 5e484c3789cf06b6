//! Generators.

use super::entities::PARTS_OF_A_VEHICLE;
use super::walk::Check;
use crate::scene::format::generators::{Generator, Grid, MOST_ENTITIES, Place, Region, Scatter};

impl<'a> Check<'a> {
    pub(super) fn generator(&mut self, g: &'a Generator) -> u64 {
        let mut copies = 0;
        self.field("place", |c| {
            c.described(&g.place);
            copies = match &g.place {
                Place::Grid(grid) => c.grid(grid),
                Place::Scatter(scatter) => c.scatter(scatter),
                Place::Along(along) => c.along(along),
            };
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
        self.field("random_scale", |c| c.described(&g.random_scale));
        copies.saturating_mul(each)
    }

    fn grid(&mut self, grid: &Grid) -> u64 {
        let copies = grid.counts.iter().fold(1u64, |product, &n| product.saturating_mul(n.into()));
        if copies == 0 || copies > MOST_ENTITIES.into() {
            let message = format!("expected from 1 to {MOST_ENTITIES} copies in all, found {copies}");
            self.field("counts", |c| c.fault(message));
        }
        copies
    }

    fn scatter(&mut self, scatter: &Scatter) -> u64 {
        if let Region::Box { min, max } = &scatter.region
            && min.iter().zip(max).any(|(min, max)| min > max)
        {
            let message = format!("expected min to be at most max on every axis, found {min:?} and {max:?}");
            self.field("region", |c| c.fault(message));
        }
        scatter.count.into()
    }
}
