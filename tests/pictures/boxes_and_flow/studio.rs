//! A world with a camera, and what captures it.

use crate::common::{self, prelude::*};
use relief::sense::{CameraCapture, ObjectBox};
use systems::sensors::{Class, Instance};

pub const SIZE: (u32, u32) = (160, 120);
pub const K: Intrinsics = Intrinsics { fx: 150.0, fy: 140.0, cx: 78.25, cy: 60.5 };

pub const BARREL: Lens =
    Lens::BrownConrady { intrinsics: K, coefficients: [-0.25, 0.05, 0.002, -0.001, 0.0, 0.0, 0.0, 0.0] };
/// Sees some of what is beside it, and not all of the picture.
pub const FISHEYE: Lens = Lens::KannalaBrandt {
    intrinsics: Intrinsics { fx: 50.0, fy: 50.0, ..K },
    coefficients: [0.02, -0.004, 0.0, 0.0],
    largest_angle: 0.7,
};

/// A world with a camera at the origin that looks along −Z, and what captures it.
pub struct Studio {
    pub simulation: Simulation,
    pub camera: Entity,
    pub suite: SensorSuite,
    pub cube: MeshId,
    pub material: MaterialId,
}

impl Studio {
    pub fn new() -> Option<Self> {
        Self::with_lens(Lens::Pinhole(K))
    }

    pub fn with_lens(lens: Lens) -> Option<Self> {
        let gpu = common::gpu()?;
        let mut simulation = Simulation::new();
        simulation.world.insert_resource(common::dark());
        let mut library = simulation.world.resource_mut::<Library>();
        let cube = library.add_mesh(shapes::cube(Vec3::ONE));
        let unlit = Material { shading: Shading::Unlit, double_sided: true, ..Material::default() };
        let material = library.add_material(unlit);
        let outputs = [
            CameraOutput::Depth,
            CameraOutput::Instance,
            CameraOutput::Part,
            CameraOutput::Boxes,
            CameraOutput::Flow,
            CameraOutput::FlowBack,
        ];
        let camera =
            CameraSensor { size: SIZE, lens, outputs: outputs.into_iter().collect(), ..CameraSensor::default() };
        let camera = simulation.world.spawn((Sensor::camera(camera), Name::new("eye"))).id();
        let mut suite = SensorSuite::new(&gpu);
        // Meshes as they are.
        suite.settings.levels = LevelOfDetail::OFF;
        Some(Self { simulation, camera, suite, cube, material })
    }

    /// A box that is a thing.
    pub fn thing(&mut self, size: Vec3, at: Vec3) -> Entity {
        let at = Transform::from_translation(at).with_scale(size);
        self.simulation.world.spawn((self.cube, self.material, at, Instance, Class(26))).id()
    }

    pub fn place(&mut self, entity: Entity) -> Mut<'_, Transform> {
        self.simulation.world.get_mut::<Transform>(entity).expect("lives")
    }

    /// Captures the state at hand.
    pub fn capture(&mut self) -> CameraCapture {
        register_all(&mut self.simulation.world);
        let capture = self.suite.capture(&mut self.simulation).expect("captured");
        capture["eye"].camera().expect("a camera").clone()
    }

    /// Captures the state after another step.
    pub fn next(&mut self) -> CameraCapture {
        self.simulation.step();
        self.capture()
    }

    pub fn number(&self, entity: Entity) -> u32 {
        self.simulation.world.resource::<EntityRegistry>().id(entity).expect("registered").0 + 1
    }

    pub fn box_of(&self, capture: &CameraCapture, entity: Entity) -> Option<ObjectBox> {
        let number = self.number(entity);
        capture.boxes.iter().find(|one| one.id == number).copied()
    }
}
