//! Classes and pictures of the Cityscapes data set (Cordts and others, "The Cityscapes Dataset for Semantic Urban Scene
//! Understanding", CVPR 2016; `cityscapesscripts/helpers/labels.py`). Its `labelIds` are classes as they are.

use super::{check_count, unfit};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Result;

/// A class of Cityscapes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label {
    /// Its name.
    pub name: &'static str,
    /// The number of those that networks learn; 255 for none.
    pub train_id: u8,
    /// Whether its pixels belong to things that can be counted.
    pub is_thing: bool,
    /// sRGB.
    pub color: [u8; 3],
}

const fn label(name: &'static str, train_id: u8, is_thing: bool, color: [u8; 3]) -> Label {
    Label { name, train_id, is_thing, color }
}

/// All classes by their numbers (`labelIds`).
pub const LABELS: [Label; 34] = [
    label("unlabeled", 255, false, [0, 0, 0]),
    label("ego vehicle", 255, false, [0, 0, 0]),
    label("rectification border", 255, false, [0, 0, 0]),
    label("out of roi", 255, false, [0, 0, 0]),
    label("static", 255, false, [0, 0, 0]),
    label("dynamic", 255, false, [111, 74, 0]),
    label("ground", 255, false, [81, 0, 81]),
    label("road", 0, false, [128, 64, 128]),
    label("sidewalk", 1, false, [244, 35, 232]),
    label("parking", 255, false, [250, 170, 160]),
    label("rail track", 255, false, [230, 150, 140]),
    label("building", 2, false, [70, 70, 70]),
    label("wall", 3, false, [102, 102, 156]),
    label("fence", 4, false, [190, 153, 153]),
    label("guard rail", 255, false, [180, 165, 180]),
    label("bridge", 255, false, [150, 100, 100]),
    label("tunnel", 255, false, [150, 120, 90]),
    label("pole", 5, false, [153, 153, 153]),
    label("polegroup", 255, false, [153, 153, 153]),
    label("traffic light", 6, false, [250, 170, 30]),
    label("traffic sign", 7, false, [220, 220, 0]),
    label("vegetation", 8, false, [107, 142, 35]),
    label("terrain", 9, false, [152, 251, 152]),
    label("sky", 10, false, [70, 130, 180]),
    label("person", 11, true, [220, 20, 60]),
    label("rider", 12, true, [255, 0, 0]),
    label("car", 13, true, [0, 0, 142]),
    label("truck", 14, true, [0, 0, 70]),
    label("bus", 15, true, [0, 60, 100]),
    label("caravan", 255, true, [0, 0, 90]),
    label("trailer", 255, true, [0, 0, 110]),
    label("train", 16, true, [0, 80, 100]),
    label("motorcycle", 17, true, [0, 0, 230]),
    label("bicycle", 18, true, [119, 11, 32]),
];

/// The class with a number; `unlabeled` where there is none.
pub fn label_of(class: u8) -> Label {
    LABELS.get(usize::from(class)).copied().unwrap_or(LABELS[0])
}

/// The values of `instanceIds`: 1000·class + n for the nth thing of its class in the picture, from 0 by instance
/// number; the class alone for what is no thing, or none that has a number.
///
/// # Errors
/// As many instances as classes were expected; a class of things beyond 64, or 1,000 things of a class, for which
/// 16 bits have no number.
pub fn instance_ids(classes: &[u8], instances: &[u32], is_thing: impl Fn(u8) -> bool) -> Result<Vec<u16>> {
    check_count("Cityscapes instances", classes.len(), instances.len())?;
    let pixels = || classes.iter().copied().zip(instances.iter().copied());
    let things: BTreeSet<(u8, u32)> = pixels().filter(|(class, instance)| *instance != 0 && is_thing(*class)).collect();
    let mut counts = BTreeMap::<u8, u32>::new();
    let mut ids = BTreeMap::new();
    for (class, instance) in things {
        let count = counts.entry(class).or_default();
        let id = u16::try_from(1000 * u32::from(class) + *count).ok().filter(|_| *count < 1000);
        let message = || format!("Cityscapes: thing {count} of class {class} has no number of 16 bits");
        ids.insert((class, instance), id.ok_or_else(|| unfit(message()))?);
        *count += 1;
    }
    Ok(pixels().map(|pixel| ids.get(&pixel).copied().unwrap_or(u16::from(pixel.0))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_are_where_their_numbers_are() {
        let number = |name| LABELS.iter().position(|label| label.name == name);
        let known = ["road", "sky", "person", "car", "bicycle"].map(number);
        assert_eq!(known, [Some(7), Some(23), Some(24), Some(26), Some(33)]);
        assert_eq!((label_of(26).train_id, label_of(33).color, label_of(200)), (13, [119, 11, 32], LABELS[0]));
        let trained: BTreeSet<u8> = LABELS.iter().map(|label| label.train_id).filter(|id| *id != 255).collect();
        assert_eq!(trained, (0..19).collect());
    }

    #[test]
    fn things_are_counted_in_their_class() {
        let is_thing = |class| label_of(class).is_thing;
        let (classes, instances) = ([26, 7, 26, 24, 26, 26], [900, 5, 8, 9, 900, 0]);
        let expected = [26_001, 7, 26_000, 24_000, 26_001, 26];
        assert_eq!(instance_ids(&classes, &instances, is_thing).unwrap(), expected);
        let refusal =
            |classes: &[u8], instances: &[u32]| instance_ids(classes, instances, |_| true).unwrap_err().to_string();
        assert_eq!(refusal(&[66], &[1]), "Cityscapes: thing 0 of class 66 has no number of 16 bits");
        let many: Vec<u32> = (1..=1001).collect();
        assert_eq!(refusal(&[26; 1001], &many), "Cityscapes: thing 1000 of class 26 has no number of 16 bits");
        assert_eq!(instance_ids(&[65], &[1], |_| true).unwrap(), [65_000]);
    }
}
