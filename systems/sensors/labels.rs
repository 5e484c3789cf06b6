//! Labels of visible things in outputs: semantic classes, and instances.

use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// The semantic class of an entity and of what is below it, as an id of [`Classes`]. The nearest one above counts.
#[derive(Component, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Default, Serialize, Deserialize)]
pub struct Class(pub u8);

/// This entity counts as one thing with what is below it, down to the next that does. Vehicles have it.
#[derive(Component, Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct Instance;

/// A semantic class.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ClassInfo {
    /// In pictures of classes; 0 is what has no class.
    pub id: u8,
    /// Name in scenes.
    pub name: String,
    /// Colour in painted pictures, 8-bit sRGB.
    pub color: [u8; 3],
    /// Set if its instances are counted; else it is stuff, such as road or sky.
    pub is_thing: bool,
    /// Number in benchmarks; 255: it is left out of them.
    pub train_id: u8,
}

/// The classes of a world. By default those of Cityscapes.
#[derive(Resource, Clone, PartialEq, Eq, Debug)]
pub struct Classes(pub Vec<ClassInfo>);

impl Default for Classes {
    fn default() -> Self {
        Self::cityscapes()
    }
}

impl Classes {
    /// Those of Cityscapes: ids, colours and train ids of `cityscapesscripts/helpers/labels.py` of the Cityscapes
    /// scripts; its licence plate, which has no id of its own, left out.
    pub fn cityscapes() -> Self {
        let class = |(id, (name, color, is_thing, train_id)): (usize, &Label)| ClassInfo {
            id: id as u8,
            name: (*name).to_owned(),
            color: *color,
            is_thing: *is_thing,
            train_id: *train_id,
        };
        Self(CITYSCAPES.iter().enumerate().map(class).collect())
    }

    /// The class of that name.
    pub fn find(&self, name: &str) -> Option<Class> {
        self.0.iter().find(|class| class.name == name).map(|class| Class(class.id))
    }

    /// Entry of a class; `None` for an id that is not listed.
    pub fn get(&self, class: Class) -> Option<&ClassInfo> {
        self.0.iter().find(|info| info.id == class.0)
    }
}

/// Name, colour, whether it is a thing, train id.
type Label = (&'static str, [u8; 3], bool, u8);

/// By id.
const CITYSCAPES: [Label; 34] = [
    ("unlabeled", [0, 0, 0], false, 255),
    ("ego vehicle", [0, 0, 0], false, 255),
    ("rectification border", [0, 0, 0], false, 255),
    ("out of roi", [0, 0, 0], false, 255),
    ("static", [0, 0, 0], false, 255),
    ("dynamic", [111, 74, 0], false, 255),
    ("ground", [81, 0, 81], false, 255),
    ("road", [128, 64, 128], false, 0),
    ("sidewalk", [244, 35, 232], false, 1),
    ("parking", [250, 170, 160], false, 255),
    ("rail track", [230, 150, 140], false, 255),
    ("building", [70, 70, 70], false, 2),
    ("wall", [102, 102, 156], false, 3),
    ("fence", [190, 153, 153], false, 4),
    ("guard rail", [180, 165, 180], false, 255),
    ("bridge", [150, 100, 100], false, 255),
    ("tunnel", [150, 120, 90], false, 255),
    ("pole", [153, 153, 153], false, 5),
    ("polegroup", [153, 153, 153], false, 255),
    ("traffic light", [250, 170, 30], false, 6),
    ("traffic sign", [220, 220, 0], false, 7),
    ("vegetation", [107, 142, 35], false, 8),
    ("terrain", [152, 251, 152], false, 9),
    ("sky", [70, 130, 180], false, 10),
    ("person", [220, 20, 60], true, 11),
    ("rider", [255, 0, 0], true, 12),
    ("car", [0, 0, 142], true, 13),
    ("truck", [0, 0, 70], true, 14),
    ("bus", [0, 60, 100], true, 15),
    ("caravan", [0, 0, 90], true, 255),
    ("trailer", [0, 0, 110], true, 255),
    ("train", [0, 80, 100], true, 16),
    ("motorcycle", [0, 0, 230], true, 17),
    ("bicycle", [119, 11, 32], true, 18),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_found_by_name_and_id() {
        let classes = Classes::default();
        let car = classes.find("car").expect("listed");
        assert_eq!(car, Class(26));
        let info = classes.get(car).expect("listed");
        assert_eq!((info.name.as_str(), info.is_thing, info.train_id), ("car", true, 13));
        assert_eq!(classes.find("zeppelin"), None);
        // The nineteen that are evaluated, each once.
        let mut trained: Vec<u8> = classes.0.iter().map(|class| class.train_id).filter(|&id| id != 255).collect();
        trained.sort_unstable();
        assert!(trained.into_iter().eq(0..19));
    }
}
