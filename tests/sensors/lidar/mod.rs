//! Lidar: scans whose every beam is known, and rays against a plain search.

mod brute_force;
mod known;
mod materials;
mod order;
mod runs;

use crate::common::prelude::*;
use glam::DQuat;
use relief::sense::{LidarScan, Pose, RayScene, lidar};
use systems::sensors::philox::Noise;
use systems::sensors::{Beam, Beams};

/// A world of meshes.
struct Scene {
    simulation: Simulation,
}

impl Scene {
    fn new() -> Self {
        Self { simulation: Simulation::new() }
    }

    fn material(&mut self, material: Material) -> MaterialId {
        self.simulation.world.resource_mut::<Library>().add_material(material)
    }

    /// White, and met from both sides.
    fn white(&mut self) -> MaterialId {
        self.material(Material { base_factor: Vec4::ONE, double_sided: true, ..Material::default() })
    }

    /// Half as bright, and met from the front.
    fn grey(&mut self) -> MaterialId {
        self.material(Material { base_factor: Vec4::new(0.5, 0.5, 0.5, 1.0), ..Material::default() })
    }

    fn add(&mut self, mesh: Mesh, material: MaterialId, place: Transform) -> Entity {
        let mesh = self.simulation.world.resource_mut::<Library>().add_mesh(mesh);
        self.simulation.world.spawn((mesh, material, place)).id()
    }

    /// Runs a frame and builds its ray scene.
    fn rays(&mut self) -> RayScene {
        self.simulation.frame();
        let mut rays = RayScene::default();
        rays.update(&self.simulation);
        rays
    }

    fn scan(&mut self, lidar: &LidarSensor, pose: Pose) -> LidarScan {
        let rays = self.rays();
        lidar::scan(&rays, lidar, &[pose; 2], lidar.revolution(), Noise::new(1, 2, 3))
    }
}

/// A lidar with these elevations.
fn lidar(degrees: &[f32], columns: u32) -> LidarSensor {
    let beams = degrees.iter().map(|&elevation_degrees| Beam { elevation_degrees, ..Beam::default() }).collect();
    LidarSensor { beams: Beams::List(beams), columns, range: (0.1, 200.0), ..LidarSensor::default() }
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose { translation: DVec3::new(x, y, z), rotation: DQuat::IDENTITY }
}

/// Random numbers that need no more than to be spread.
struct Random(u64);

impl Random {
    /// 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn direction(&mut self) -> DVec3 {
        let (z, angle) = (self.next() * 2.0 - 1.0, self.next() * std::f64::consts::TAU);
        let ring = (1.0 - z * z).sqrt();
        DVec3::new(ring * angle.cos(), ring * angle.sin(), z)
    }
}
