//! Labels as the COCO data set has them (Lin and others, "Microsoft COCO: Common Objects in Context", ECCV 2014;
//! Kirillov and others, "Panoptic Segmentation", CVPR 2019): one JSON file for all pictures, after "Data format" of
//! cocodataset.org. Masks are runs that are not packed further; boxes are left, top, width, height along pixel edges.

use super::checks::{check_count, pixels_of, unfit};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{Result, Write};

/// A picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Its number, which no other has.
    pub id: u64,
    /// Below the folder of pictures.
    pub file_name: String,
    /// In pixels.
    pub width: u32,
    /// In pixels.
    pub height: u32,
}

/// A class.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Category {
    /// Its number.
    pub id: u8,
    /// Its name.
    pub name: String,
    /// Kind of things that it belongs to; its own name will do.
    pub supercategory: String,
    /// 1 for things, 0 for what cannot be counted.
    pub isthing: u8,
    /// sRGB.
    pub color: [u8; 3],
}

/// Run-length encoding of a thing's pixels, column by column: runs without and with it take turns.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Runs {
    /// Height and width in pixels.
    pub size: [u32; 2],
    /// The lengths of the runs, first those without; their sum is all pixels.
    pub counts: Vec<u32>,
}

/// Pixels of a thing in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Mask {
    /// Its pixels.
    pub runs: Runs,
    /// The box around them: left, top, width, height in pixels.
    pub bbox: [u32; 4],
    /// Number of its pixels.
    pub area: u64,
}

/// A thing in a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Annotation {
    /// Its number, which no other of any picture has.
    pub id: u64,
    /// The picture's number.
    pub image_id: u64,
    /// The class's number.
    pub category_id: u8,
    /// Its pixels.
    pub segmentation: Runs,
    /// The box around them.
    pub bbox: [u32; 4],
    /// Number of its pixels.
    pub area: u64,
    /// 0: a single thing.
    pub iscrowd: u8,
}

/// A file of things: `instances_….json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Instances {
    /// The pictures.
    pub images: Vec<Picture>,
    /// Things in the pictures.
    pub annotations: Vec<Annotation>,
    /// Classes of the things.
    pub categories: Vec<Category>,
}

impl Instances {
    /// Adds the pictures of a file of the same categories, numbered on from those that are there.
    pub fn append(&mut self, other: Self) {
        let pictures = self.images.len() as u64;
        let annotations = self.annotations.len() as u64;
        self.images.extend(numbered_on(other.images, pictures));
        self.annotations.extend(other.annotations.into_iter().map(|annotation| Annotation {
            id: annotation.id.wrapping_add(annotations),
            image_id: annotation.image_id.wrapping_add(pictures),
            ..annotation
        }));
    }

    /// Adds what is in a picture, as instances `[height, width]` tell, 0 for none. Things are numbered on in the order
    /// of their instances. `class_of` names the class of an instance; those of none are left out.
    ///
    /// # Errors
    /// More or fewer instances than pixels.
    pub fn add(&mut self, picture: Picture, ids: &[u32], class_of: impl Fn(u32) -> Option<u8>) -> Result<()> {
        for (instance, Mask { runs, bbox, area }) in masks((picture.width, picture.height), ids)? {
            let Some(category_id) = class_of(instance) else { continue };
            // From 1: pycocotools takes a match with number 0 for none.
            let id = self.annotations.len() as u64 + 1;
            let image_id = picture.id;
            self.annotations.push(Annotation { id, image_id, category_id, segmentation: runs, bbox, area, iscrowd: 0 });
        }
        self.images.push(picture);
        Ok(())
    }
}

/// A segment of a panoptic picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Its number in that picture.
    pub id: u32,
    /// Its class.
    pub category_id: u8,
    /// Number of its pixels.
    pub area: u64,
    /// The box around them.
    pub bbox: [u32; 4],
    /// 0: a single thing, or all of a class that cannot be counted.
    pub iscrowd: u8,
}

impl Segment {
    /// The instance of a thing; `None` of a class that cannot be counted.
    pub fn instance(&self) -> Option<u32> {
        self.id.checked_sub(FIRST_THING)
    }
}

/// The segments of a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Segments {
    /// The picture's number.
    pub image_id: u64,
    /// The PNG file with [`rgb_of_id`] of its segments.
    pub file_name: String,
    /// Segments of the picture.
    pub segments_info: Vec<Segment>,
}

/// A file of segments: `panoptic_….json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Panoptic {
    /// The pictures.
    pub images: Vec<Picture>,
    /// Segments in the pictures.
    pub annotations: Vec<Segments>,
    /// Classes of the segments.
    pub categories: Vec<Category>,
}

impl Panoptic {
    /// Adds the pictures of a file of the same categories, numbered on from those that are there.
    pub fn append(&mut self, other: Self) {
        let pictures = self.images.len() as u64;
        self.images.extend(numbered_on(other.images, pictures));
        let of_pictures = other.annotations.into_iter();
        self.annotations.extend(
            of_pictures.map(|segments| Segments { image_id: segments.image_id.wrapping_add(pictures), ..segments }),
        );
    }
}

fn numbered_on(pictures: Vec<Picture>, before: u64) -> impl Iterator<Item = Picture> {
    pictures.into_iter().map(move |picture| Picture { id: picture.id.wrapping_add(before), ..picture })
}

/// A number as the colour of a panoptic picture: R + 256·G + 65536·B (`panopticapi/utils.py`); 24 bits of it.
pub fn rgb_of_id(id: u32) -> [u8; 3] {
    let [r, g, b, _] = id.to_le_bytes();
    [r, g, b]
}

/// The first number of a thing: those below are classes.
const FIRST_THING: u32 = 256;

/// Parts a picture into segments: each thing is one, and so are all pixels of a class that cannot be counted. Returns
/// the number of each pixel's segment, and the segments. Numbers are those of classes, and 256 + instance for things:
/// the same in all pictures. Pixels of class 0 are in none. A thing with pixels of several classes has that of most.
///
/// # Errors
/// More or fewer values than pixels; an instance beyond 2²⁴−257, for which 24 bits have no number.
pub fn segments(
    size: (u32, u32),
    classes: &[u8],
    instances: &[u32],
    is_thing: impl Fn(u8) -> bool,
) -> Result<(Vec<u32>, Vec<Segment>)> {
    check_count("panoptic classes", pixels_of(size), classes.len())?;
    check_count("panoptic instances", pixels_of(size), instances.len())?;
    let mut ids = Vec::with_capacity(classes.len());
    let mut areas = BTreeMap::<u32, BTreeMap<u8, u64>>::new();
    for (&class, &instance) in classes.iter().zip(instances) {
        let is_counted = class != 0 && instance != 0 && is_thing(class);
        let id = if is_counted { instance.saturating_add(FIRST_THING) } else { u32::from(class) };
        if id >= 1 << 24 {
            return Err(unfit(format!("panoptic: instance {instance} has no number of 24 bits")));
        }
        *areas.entry(id).or_default().entry(class).or_default() += 1;
        ids.push(id);
    }
    let class_of = |id: u32| {
        let most =
            areas.get(&id).and_then(|areas| areas.iter().max_by_key(|(class, area)| (**area, u8::MAX - **class)));
        most.map_or(0, |(class, _)| *class)
    };
    let segment = |(id, Mask { bbox, area, .. })| Segment { id, category_id: class_of(id), area, bbox, iscrowd: 0 };
    let segments = masks(size, &ids)?.into_iter().map(segment).collect();
    Ok((ids, segments))
}

/// The pixels of a number as they are found, column by column.
struct Found {
    counts: Vec<u32>,
    /// End of its last run.
    end: u32,
    /// Left, top, and right and bottom within.
    corners: [u32; 4],
    area: u64,
}

/// Masks of each number but 0 in a picture of them, rows from the top; width and height in pixels.
///
/// # Errors
/// More or fewer numbers than pixels; more than 2³²−1 pixels.
pub fn masks((width, height): (u32, u32), ids: &[u32]) -> Result<BTreeMap<u32, Mask>> {
    check_count("COCO mask", pixels_of((width, height)), ids.len())?;
    let pixels = u32::try_from(ids.len()).map_err(|_| unfit("COCO mask: more than 2³²−1 pixels"))?;
    let mut found = BTreeMap::<u32, Found>::new();
    for x in 0..width {
        let mut y = 0;
        let id_at = |y: u32| ids[y as usize * width as usize + x as usize];
        while y < height {
            let (first, id) = (y, id_at(y));
            while y < height && id_at(y) == id {
                y += 1;
            }
            if id == 0 {
                continue;
            }
            let new = || Found { counts: Vec::new(), end: 0, corners: [x, first, x, y - 1], area: 0 };
            let thing = found.entry(id).or_insert_with(new);
            let (start, length) = (x * height + first, y - first);
            match thing.counts.last_mut() {
                // It goes on from the column before.
                Some(last) if start == thing.end => *last += length,
                _ => thing.counts.extend([start - thing.end, length]),
            }
            let [left, top, _, bottom] = thing.corners;
            thing.corners = [left, top.min(first), x, bottom.max(y - 1)];
            thing.end = start + length;
            thing.area += u64::from(length);
        }
    }
    let mask = |(id, Found { mut counts, end, corners: [left, top, right, bottom], area })| {
        if end < pixels {
            counts.push(pixels - end);
        }
        let bbox = [left, top, right - left + 1, bottom - top + 1];
        (id, Mask { runs: Runs { size: [height, width], counts }, bbox, area })
    };
    Ok(found.into_iter().map(mask).collect())
}

/// Writes a file: [`Instances`] or [`Panoptic`].
///
/// # Errors
/// The error of writing.
pub fn write(to: impl Write, file: &impl Serialize) -> Result<()> {
    serde_json::to_writer(to, file).map_err(std::io::Error::from)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn runs_go_down_the_columns_and_begin_with_what_is_not_there() {
        // 1 1 0
        // 1 2 2
        let masks = masks((3, 2), &[1, 1, 0, 1, 2, 2]).unwrap();
        let mask =
            |counts: &[u32], bbox, area| Mask { runs: Runs { size: [2, 3], counts: counts.to_vec() }, bbox, area };
        assert_eq!(masks[&1], mask(&[0, 3, 3], [0, 0, 2, 2], 3));
        assert_eq!(masks[&2], mask(&[3, 1, 1, 1], [1, 1, 2, 1], 2));
        assert_eq!(masks.len(), 2);
    }

    #[test]
    fn segments_are_things_and_the_rest_by_class() {
        let is_thing = |class| class == 26;
        let (classes, instances) = ([7, 26, 26, 0, 24, 26], [3, 5, 5, 4, 5, 0]);
        let (ids, found) = segments((6, 1), &classes, &instances, is_thing).unwrap();
        // The fifth pixel's class is no thing, and the last has no number.
        assert_eq!(ids, [7, 261, 261, 0, 24, 26]);
        let all: Vec<(u32, u8, u64)> = found.iter().map(|s| (s.id, s.category_id, s.area)).collect();
        assert_eq!(all, [(7, 7, 1), (24, 24, 1), (26, 26, 1), (261, 26, 2)]);
        let (_, mixed) = segments((3, 1), &[25, 26, 26], &[1; 3], |_| true).unwrap();
        assert_eq!((mixed.len(), mixed[0].category_id), (1, 26));
        assert_eq!(rgb_of_id(0x0001_0203), [3, 2, 1]);
        let error = segments((1, 1), &[26], &[u32::MAX], is_thing).unwrap_err().to_string();
        assert_eq!(error, "panoptic: instance 4294967295 has no number of 24 bits");
    }

    #[test]
    fn what_is_not_labelled_is_not_annotated() {
        let mut file = Instances::default();
        for id in 0..2 {
            let picture = Picture { id, file_name: format!("{id}.png"), width: 2, height: 1 };
            file.add(picture, &[8, 9], |instance| (instance == 9).then_some(26)).unwrap();
        }
        let all: Vec<(u64, u64, u8)> = file.annotations.iter().map(|a| (a.id, a.image_id, a.category_id)).collect();
        assert_eq!((all, file.images.len()), (vec![(1, 0, 26), (2, 1, 26)], 2));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Against each pixel asked by itself.
        #[test]
        fn masks_hold_the_pixels_of_their_numbers(width in 1_u32..7, height in 1_u32..7, seed in any::<u64>()) {
            let number = |i: u32| (seed.rotate_left(i * 7) % 4) as u32;
            let ids: Vec<u32> = (0..width * height).map(number).collect();
            let masks = masks((width, height), &ids).unwrap();
            for id in 1..4 {
                let columns = (0..width).flat_map(|x| (0..height).map(move |y| (x, y)));
                let inside: Vec<bool> = columns.clone().map(|(x, y)| ids[(y * width + x) as usize] == id).collect();
                let Some(Mask { runs, bbox, area }) = masks.get(&id) else {
                    prop_assert!(!inside.contains(&true));
                    continue;
                };
                let run = |(i, count): (usize, &u32)| vec![i % 2 == 1; *count as usize];
                prop_assert_eq!(runs.counts.iter().enumerate().flat_map(run).collect::<Vec<_>>(), inside.clone());
                prop_assert!(runs.counts[1..].iter().all(|count| *count > 0));
                let seen: Vec<(u32, u32)> = columns.zip(inside).filter(|(_, is)| *is).map(|(at, _)| at).collect();
                prop_assert_eq!(*area, seen.len() as u64);
                let least = |of: fn(&(u32, u32)) -> u32| seen.iter().map(of).min().unwrap_or_default();
                let most = |of: fn(&(u32, u32)) -> u32| seen.iter().map(of).max().unwrap_or_default();
                let (left, top) = (least(|at| at.0), least(|at| at.1));
                prop_assert_eq!(*bbox, [left, top, most(|at| at.0) - left + 1, most(|at| at.1) - top + 1]);
            }
        }
    }
}
