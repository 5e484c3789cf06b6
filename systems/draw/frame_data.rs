//! Frame of a world as data for renderers. Renderers need no world: programs with data of their own fill a [`DrawList`]
//! and a table of records themselves.

use super::instance_records::InstanceRecords;
use super::list::DrawList;
use super::records::InstanceRecord;
use super::shadow_casters::ShadowScene;
use crate::assets::library::Library;
use crate::cells::cells::Cells;
use crate::ecs::tables::Records;
use crate::lights::floods::LightFloods;
use crate::lights::lists::LightLists;
use bevy_ecs::change_detection::DetectChangesMut;
use bevy_ecs::prelude::*;

/// A frame of a world, for renderers.
pub struct FrameData<'a> {
    /// Drawn objects, and their changes since the frame before.
    pub list: &'a DrawList,
    /// The records of drawn objects by slot, and which of them changed.
    pub instances: &'a dyn Records<Record = InstanceRecord>,
    /// The lights of objects that have more than three.
    pub light_lists: &'a LightLists,
    /// Shadow casters; `None`: nothing casts a shadow.
    pub shadows: Option<ShadowScene<'a>>,
    /// Rooms, for culling: objects that no window shows are not drawn. `None`, or empty: there are none.
    pub cells: Option<&'a Cells>,
    /// Opening of each portal of the cells, 0 to 1, in their order. Missing ones are open.
    pub open_portals: &'a [f32],
    /// Meshes and images of the list. A renderer releases the texels that it has uploaded
    /// ([`Library::release_texels`]).
    pub library: &'a mut Library,
}

impl FrameData<'_> {
    /// Borrows the frame of a world that has a [`DrawList`] and a [`Library`], as the last run of the frame's schedule
    /// left them.
    ///
    /// # Panics
    /// If the world has no draw list or no library.
    pub fn of_world<R>(world: &mut World, read: impl FnOnce(&mut FrameData<'_>) -> R) -> R {
        // What is released is no change: no system reads texels of images that a renderer has.
        let changed = world.resource_ref::<Library>().last_changed();
        let made = world.resource_scope(|world, mut library: Mut<Library>| {
            let list = world.resource::<DrawList>();
            let instances = InstanceRecords::new(world, &list.instances);
            let light_lists = world.resource::<LightLists>();
            let (shadows, cells) = (ShadowScene::of(world), world.get_resource::<Cells>());
            let open_portals = world.get_resource::<LightFloods>().map_or(&[][..], LightFloods::open);
            let library = library.bypass_change_detection();
            read(&mut FrameData { list, instances: &instances, light_lists, shadows, cells, open_portals, library })
        });
        world.resource_mut::<Library>().set_last_changed(changed);
        made
    }
}
