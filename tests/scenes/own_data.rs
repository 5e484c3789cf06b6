//! Renderers draw data that no `Simulation` made: a world with resources and a schedule of its own, and no world at
//! all.

use crate::common::{self, prelude::*};
use systems::FrameSet;
use systems::assets::{MAP_COUNT, MapSlot};
use systems::draw::{
    Batch, BatchKey, ClassId, DrawList, FrameData, InstanceRecord, MaterialClass, MaterialRecord, PipelineKey,
    TextureArray,
};
use systems::ecs::tables::Table;
use systems::lights::{LightLists, NO_LIGHT};

const SIZE: (u32, u32) = (32, 32);
const RED: [u8; 3] = [255, 0, 0];
const BLUE: [u8; 3] = [0, 0, 255];

fn blue_sky() -> Environment {
    let blue = Vec3::new(0.0, 0.0, 1.0);
    Environment { zenith: blue, horizon: blue, ground: blue, tone_map: ToneMap::Clamp, ..Environment::default() }
}

/// Colours at the middle and on its right, halfway to the edge.
fn drawn(renderer: &mut SingleView, frame: &mut FrameData<'_>) -> [[u8; 3]; 2] {
    let view = View::new(&GlobalTransform::default().affine(), &Camera::default(), SIZE.0, SIZE.1);
    renderer.prepare(frame, &view, &Settings::default()).expect("it fits");
    let picture = renderer.draw_picture();
    renderer.gpu().check().expect("nothing was refused");
    [16, 24].map(|x| {
        let [r, g, b, _] = picture.get_pixel(x, 16).0;
        [r, g, b]
    })
}

/// A red cube 3 m before the camera, which covers the middle of the picture and not what is halfway to its edge: there
/// the view is 0.87 m wide, as tan 30° says.
fn cube() -> systems::assets::Mesh {
    shapes::cube(Vec3::splat(0.6))
}

#[derive(Resource)]
struct Shift(f32);

#[test]
fn a_world_with_a_schedule_of_its_own_is_drawn() {
    let Some(gpu) = common::gpu() else { return };
    let mut world = World::new();
    systems::install::core(&mut world);
    world.insert_resource(Shift(0.0));
    world.insert_resource(blue_sky());
    let mut library = world.resource_mut::<Library>();
    let mesh = library.add_mesh(cube());
    let red = Material { base_factor: Vec3::X.extend(1.0), shading: Shading::Unlit, ..Material::default() };
    let red = library.add_material(red);
    world.spawn((mesh, red, Transform::from_xyz(0.0, 0.0, -3.0)));
    let mut schedule = systems::frame_schedule();
    let shift = |shift: Res<Shift>, mut objects: Query<&mut Transform, With<MeshId>>| {
        objects.iter_mut().for_each(|mut place| place.translation.x = shift.0);
    };
    schedule.add_systems(shift.after(FrameSet::Begin).before(FrameSet::Transforms));
    let mut renderer = SingleView::new(&gpu);
    for (place, expected) in [(0.0, [RED, BLUE]), (0.87, [BLUE, RED]), (0.0, [RED, BLUE])] {
        world.resource_mut::<Shift>().0 = place;
        schedule.run(&mut world);
        world.clear_trackers();
        let found = FrameData::of_world(&mut world, |frame| drawn(&mut renderer, frame));
        assert_eq!(found, expected, "shifted by {place} m");
    }
}

/// Lists, records and meshes by hand.
struct Data {
    list: DrawList,
    instances: Table<InstanceRecord>,
    library: Library,
}

impl Data {
    fn new() -> Self {
        let mut library = Library::default();
        let mesh = library.add_mesh_without_levels(cube());
        let mut list = DrawList { environment: blue_sky(), ..DrawList::default() };
        // Maps that are missing are layers of stand-ins: base colours in one texture array, all else in another.
        let array =
            |id| TextureArray { layers: vec![Some(id)], ..TextureArray::of(library.image(id).expect("it is there")) };
        list.texture_arrays = [ImageId::WHITE_COLOR, ImageId::WHITE_DATA].map(array).to_vec();
        let mut arrays = [1; MAP_COUNT];
        arrays[MapSlot::Base as usize] = 0;
        list.classes = vec![MaterialClass { arrays, ..MaterialClass::default() }];
        let red = MaterialRecord { base_factor: [1.0, 0.0, 0.0, 1.0], ..MaterialRecord::default() };
        list.materials.write(0, red);
        let pipeline = PipelineKey { shading: Shading::Unlit, ..PipelineKey::default() };
        let key = BatchKey { pipeline, class: ClassId(0), mesh };
        list.batches = vec![Batch { key, pages: 0..1 }];
        list.pages = vec![0];
        (list.objects, list.batches_version) = (1, 1);
        // The second slot is empty.
        let mut instances = Table::default();
        instances.write(1, InstanceRecord::default());
        Self { list, instances, library }
    }

    /// The next frame, with the object at a place.
    fn draw(&mut self, renderer: &mut SingleView, place: Vec3) -> [[u8; 3]; 2] {
        self.list.frame += 1;
        self.instances.dirty.clear();
        let matrix = Affine3A::from_translation(place);
        let row = |i| matrix.matrix3.row(i).extend(matrix.translation[i]).to_array();
        let record = InstanceRecord {
            world_from_object: [0, 1, 2].map(row),
            lights: [NO_LIGHT; 3],
            entity: 7,
            ..InstanceRecord::default()
        };
        self.instances.write(0, record);
        let Self { list, instances, library } = self;
        let light_lists = &LightLists::default();
        let (shadows, cells, open_portals) = (None, None, &[][..]);
        drawn(renderer, &mut FrameData { list, instances, light_lists, shadows, cells, open_portals, library })
    }
}

#[test]
fn data_without_a_world_is_drawn() {
    let Some(gpu) = common::gpu() else { return };
    let (mut data, mut renderer) = (Data::new(), SingleView::new(&gpu));
    let before = Vec3::new(0.0, 0.0, -3.0);
    assert_eq!(data.draw(&mut renderer, before), [RED, BLUE]);
    assert_eq!(data.draw(&mut renderer, before + 0.87 * Vec3::X), [BLUE, RED]);
    assert_eq!(renderer.stats().instance_bytes, size_of::<InstanceRecord>() as u64, "what changed");
    let picked = renderer.pick(glam::UVec2::new(24, 16)).expect("the object");
    // Its near side. A depth of 32 bits is the end of some ten operations, of less than 2⁻²⁴ each.
    assert!(picked.entity == 7 && (picked.depth - 2.7).abs() < 1e-5 * 2.7, "{picked:?}");
}

/// Texels that the library does not keep are released as they are uploaded, and the world's library has not changed.
#[test]
fn texels_are_released_when_they_are_uploaded() {
    let Some(gpu): Option<Gpu> = common::gpu() else { return };
    let mut simulation = Simulation::new();
    let mut library = simulation.world.resource_mut::<Library>();
    library.keep_texels(false);
    let mesh = library.add_mesh(cube());
    simulation.world.spawn((mesh, Transform::from_xyz(0.0, 0.0, -3.0)));
    simulation.frame();
    simulation.world.increment_change_tick();
    let before = simulation.world.resource_ref::<Library>().last_changed();
    assert!(!simulation.library().lacks_texels());
    simulation.with_frame(|frame| drawn(&mut SingleView::new(&gpu), frame));
    assert!(simulation.library().lacks_texels());
    assert_eq!(simulation.world.resource_ref::<Library>().last_changed(), before, "no change that systems see");
}
