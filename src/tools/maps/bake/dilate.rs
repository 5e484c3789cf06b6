//! Texels beyond the charts, filled from within: filtering and mip levels read a little past every border.

use crate::tools::maps::Raster;

/// Grows the filled texels by one texel all round, so many times (`None`: until all are filled). A texel takes the mean
/// of its filled neighbours among eight. The map goes around at its edges, as a repeating texture does. Returns how
/// many were filled.
pub fn dilate(maps: &mut [&mut Raster], filled: &mut [bool], width: usize, steps: Option<usize>) -> usize {
    let height = filled.len() / width.max(1);
    let mut queued = filled.to_vec();
    let empty_beside = |index: usize, queued: &mut [bool], next: &mut Vec<usize>| {
        for neighbour in neighbours(index, width, height) {
            if !std::mem::replace(&mut queued[neighbour], true) {
                next.push(neighbour);
            }
        }
    };
    let mut ring = Vec::new();
    for index in (0..filled.len()).filter(|&index| filled[index]) {
        empty_beside(index, &mut queued, &mut ring);
    }
    let (mut step, mut count) = (0, 0);
    while !ring.is_empty() && steps.is_none_or(|steps| step < steps) {
        for map in maps.iter_mut() {
            grow(map, filled, &ring, width, height);
        }
        ring.iter().for_each(|&index| filled[index] = true);
        count += ring.len();
        let mut next = Vec::new();
        ring.iter().for_each(|&index| empty_beside(index, &mut queued, &mut next));
        ring = next;
        step += 1;
    }
    count
}

/// Gives the texels of a ring the mean of their filled neighbours, none of which is in the ring.
fn grow(map: &mut Raster, filled: &[bool], ring: &[usize], width: usize, height: usize) {
    let channels = map.channels;
    for &index in ring {
        let sources = neighbours(index, width, height).into_iter().filter(|&neighbour| filled[neighbour]);
        let mut sum = [0.0; 4];
        let mut count = 0.0;
        for source in sources {
            let texel = &map.values[source * channels..(source + 1) * channels];
            sum.iter_mut().zip(texel).for_each(|(sum, value)| *sum += value);
            count += 1.0;
        }
        let texel = &mut map.values[index * channels..(index + 1) * channels];
        texel.iter_mut().zip(sum).for_each(|(value, sum)| *value = sum / count);
    }
}

fn neighbours(index: usize, width: usize, height: usize) -> [usize; 8] {
    let (x, y) = (index % width, index / width);
    let (left, right) = ((x + width - 1) % width, (x + 1) % width);
    let (above, below) = ((y + height - 1) % height, (y + 1) % height);
    [(left, above), (x, above), (right, above), (left, y), (right, y), (left, below), (x, below), (right, below)]
        .map(|(x, y)| y * width + x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grown(filled: &[usize], steps: Option<usize>) -> (Vec<f32>, usize) {
        let mut map = Raster::new(8, 4, 1);
        let mut is_filled = vec![false; 32];
        for &index in filled {
            map.values[index] = index as f32;
            is_filled[index] = true;
        }
        let count = dilate(&mut [&mut map], &mut is_filled, 8, steps);
        (map.values, count)
    }

    #[test]
    fn texels_are_filled_ring_by_ring_and_around_the_edges() {
        let (values, count) = grown(&[9], Some(1));
        assert_eq!(count, 8);
        for (index, &value) in values.iter().enumerate() {
            let near = (index % 8) < 3 && index / 8 < 3;
            assert_eq!(value, if near { 9.0 } else { 0.0 }, "{index}");
        }
        // The corner's neighbours are on all sides.
        let (values, count) = grown(&[0], Some(1));
        assert_eq!(count, 8);
        assert!(values.iter().sum::<f32>() == 0.0);
        assert_eq!(grown(&[9], Some(0)).1, 0);
        assert_eq!(grown(&[9], None), (vec![9.0; 32], 31));
        assert_eq!(grown(&[], None).1, 0);
    }

    #[test]
    fn between_two_is_their_mean() {
        let (values, _) = grown(&[8, 10], Some(1));
        assert_eq!(values[9], 9.0);
        assert_eq!((values[8], values[10]), (8.0, 10.0));
    }
}
