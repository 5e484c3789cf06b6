//! GPU memory of images, and how it is kept within a bound.
//!
//! Over the bound, the largest images lose their finest mip level until the rest fits. A reduced image looks as it
//! would from further away: softer, and nothing else.

use super::image::{Image, ImageId};
use super::library::Library;
use std::collections::{BinaryHeap, HashMap};

/// Megabytes that images may take unless something else is said: what a graphics card with 4 GB has to spare.
pub const DEFAULT_MEGABYTES: u64 = 2048;

/// GPU memory of images, with all their levels.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct TextureMemory {
    /// Images.
    pub images: usize,
    /// Texels of all levels.
    pub texels: u64,
    /// Bytes of all levels.
    pub bytes: u64,
}

/// GPU memory of the images of a library.
pub fn used(library: &Library) -> TextureMemory {
    let add = |sum: TextureMemory, (_, image): (ImageId, &Image)| TextureMemory {
        images: sum.images + 1,
        texels: sum.texels + image.texel_count(),
        bytes: sum.bytes + image.bytes(),
    };
    library.images().fold(TextureMemory::default(), add)
}

/// An image that is drawn smaller than it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Reduced {
    /// The image.
    pub image: ImageId,
    /// Its size in texels before.
    pub from: (u32, u32),
    /// Its size now.
    pub to: (u32, u32),
}

/// Takes the finest level off the largest image, again and again, until all take at most this many bytes or no more can
/// be taken. Returns what became smaller, in order of ids. For images that have not been drawn yet.
pub fn limit(library: &mut Library, most_bytes: u64) -> Vec<Reduced> {
    let mut bytes = used(library).bytes;
    let mut images: Vec<_> = library.images_mut().collect();
    // The first of equals goes first, so that the choice is the same everywhere.
    let mut largest: BinaryHeap<_> =
        images.iter().enumerate().map(|(i, (_, image))| (image.bytes(), std::cmp::Reverse(i))).collect();
    let mut before = HashMap::new();
    while bytes > most_bytes {
        let Some((own, index)) = largest.pop() else { break };
        let image = &mut *images[index.0].1;
        before.entry(index.0).or_insert((image.width, image.height));
        if image.drop_finest_level() {
            bytes = bytes - own + image.bytes();
            largest.push((image.bytes(), index));
        }
    }
    let reduced = |(index, from)| {
        let (id, image): &(ImageId, &mut Image) = &images[index];
        Reduced { image: *id, from, to: (image.width, image.height) }
    };
    let mut all: Vec<Reduced> = before.into_iter().map(reduced).filter(|r| r.from != r.to).collect();
    all.sort_by_key(|r| r.image);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assets::image::ImageKind;

    fn library_of(sides: &[(u32, u32)]) -> Library {
        let mut library = Library::default();
        for &(width, height) in sides {
            let texels = [9, 20, 200, 255].repeat((width * height) as usize);
            library.add_image(Image::rgba8("image", width, height, ImageKind::Color, texels));
        }
        library
    }

    #[test]
    fn all_levels_count() {
        let empty = used(&Library::default());
        let one = used(&library_of(&[(8, 2)]));
        assert_eq!(one.images - empty.images, 1);
        assert_eq!((one.texels - empty.texels, one.bytes - empty.bytes), (16 + 4 + 2 + 1, 4 * 23));
    }

    #[test]
    fn the_largest_images_lose_their_finest_levels_until_the_rest_fits() {
        let sides = [(64, 64), (7, 5), (128, 128), (64, 64)];
        let mut library = library_of(&sides);
        let all = used(&library).bytes;
        assert_eq!(limit(&mut library, all), []);
        // One byte too many: the large one gives a level, and that is enough.
        let reduced = limit(&mut library, all - 1);
        assert_eq!(reduced, [Reduced { image: ImageId::from_slot(7), from: (128, 128), to: (64, 64) }]);
        let most = 3000;
        let reduced = limit(&mut library, most);
        assert!(used(&library).bytes <= most);
        assert_eq!(reduced.iter().map(|r| r.image.slot()).collect::<Vec<_>>(), [5, 7, 8], "the smallest is left alone");
        for (_, image) in library.images() {
            let size = crate::assets::image::level_count(image.width, image.height) as usize;
            assert_eq!(image.levels.len(), size);
            assert_eq!(image.levels[0].len(), image.texels.level_bytes(image.width, image.height));
        }
    }

    #[test]
    fn a_bound_that_cannot_be_kept_ends() {
        let mut library = library_of(&[(16, 4)]);
        limit(&mut library, 0);
        assert!(library.images().all(|(_, image)| (image.width, image.height) == (1, 1)));
    }
}
