//! A world, a component, a system and a schedule of one's own: boats that follow waves, drawn without a `Simulation`.
//!
//! `cargo run --release --example own_world` writes `own_world.png`.

use relief::prelude::*;
use relief::renderer::{Gpu, Settings, SingleView};
use relief::systems::FrameSet;
use relief::systems::draw::{FrameData, View};
use relief::systems::space::GlobalTransform;

/// Seconds since the beginning.
#[derive(Resource)]
struct Time(f32);

/// Marks an entity that floats, at a place of the water.
#[derive(Component)]
struct Floating {
    x: f32,
    z: f32,
}

fn float(time: Res<Time>, mut boats: Query<(&Floating, &mut Transform)>) {
    for (&Floating { x, z }, mut place) in &mut boats {
        let phase = 0.8 * x + 0.5 * z + time.0;
        place.translation = Vec3::new(x, 0.4 * phase.sin(), z);
        place.rotation = Quat::from_rotation_z((0.32 * phase.cos()).atan());
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut world = World::new();
    systems::install::core(&mut world);
    world.insert_resource(Time(0.0));
    let mut library = world.resource_mut::<Library>();
    let boat = library.add_mesh(shapes::cube(Vec3::new(0.9, 0.25, 0.4)));
    let wood = library.add_material(Material { base_factor: Vec4::new(0.6, 0.35, 0.15, 1.0), ..Material::default() });
    for index in 0..100 {
        let (x, z) = ((index % 10) as f32 * 1.3 - 6.0, (index / 10) as f32 * -1.3);
        world.spawn((boat, wood, Transform::IDENTITY, Floating { x, z }));
    }
    world.spawn((Light::directional(2.0), Transform::from_xyz(3.0, 5.0, 4.0).looking_at(Vec3::ZERO, Vec3::Y)));

    // What is posed for a picture is posed before the frame's systems find where everything is.
    let mut frame = systems::frame_schedule();
    frame.add_systems(float.after(FrameSet::Begin).before(FrameSet::Transforms));

    let mut renderer = SingleView::new(&Gpu::headless()?);
    let eye = Transform::from_xyz(0.0, 4.0, 6.0).looking_at(Vec3::new(0.0, 0.0, -3.0), Vec3::Y);
    let view = View::new(&GlobalTransform::from(eye).affine(), &Camera::default(), 640, 360);
    for _ in 0..10 {
        world.resource_mut::<Time>().0 += 0.1;
        frame.run(&mut world);
        world.clear_trackers();
        FrameData::of_world(&mut world, |frame| renderer.prepare(frame, &view, &Settings::default()))?;
    }
    renderer.draw_picture().save("own_world.png")?;
    renderer.gpu().check()?;
    Ok(())
}
