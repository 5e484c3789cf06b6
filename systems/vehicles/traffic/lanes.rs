//! Lanes and the vehicles in them: entries sorted by where their fronts are.
//!
//! Tasks first list [`Entry`]s as they find them, by stretches of lanes ([`Found`]). Then each stretch is put in order
//! by one task, which needs nothing of the others: entries go to their lanes, are sorted there, and mind those ahead.
//! Vehicles are entered in the order in which they were in their lanes in the last step, so that lanes are nearly
//! sorted before they are: insertion sort does the rest.

use super::crossings::Coming;
use crate::ecs::parallel::in_parallel;
use crate::vehicles::components::{RouteId, VehicleTypeId};
use bevy_tasks::ComputeTaskPool;

/// A vehicle in a lane; metres along the route.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(crate) struct Entry {
    pub front: f32,
    pub back: f32,
    /// Metres that it drives per metre of the centre line: less than 1 inside of a bend.
    pub scale: f32,
    pub speed: f32,
    pub row: u32,
    pub number: u32,
    pub kind: VehicleTypeId,
    /// The route that it is on now.
    pub road: RouteId,
    pub role: Role,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Role {
    /// In its lane.
    #[default]
    Main,
    /// Minds what is ahead: in a lane that it leaves, or will come to.
    Follower,
    /// Is only minded.
    Obstacle,
}

impl Entry {
    fn is_before(&self, other: &Self) -> bool {
        self.front.total_cmp(&other.front).then(self.number.cmp(&other.number)).then(self.back.total_cmp(&other.back))
            == std::cmp::Ordering::Less
    }

    /// Metres from its front to another's back.
    pub fn gap(&self, leader: &Self) -> f32 {
        (leader.back - self.front) * self.scale
    }
}

/// Vehicles that are worth a task.
const LEAST: usize = 512;

/// Division of lanes among tasks: 2^`bits` in each stretch.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Stretches {
    bits: u32,
    count: usize,
}

impl Stretches {
    pub fn new(lanes: u32, vehicles: usize) -> Self {
        let tasks = (vehicles / LEAST).clamp(1, 8 * ComputeTaskPool::get().thread_num());
        let bits = lanes.max(1).div_ceil(tasks as u32).next_power_of_two().trailing_zeros();
        Self { bits, count: (lanes as usize).div_ceil(1 << bits) }
    }
}

/// Finds of one task: entries and their lanes, by stretch; vehicles that come to a crossing.
#[derive(Default)]
pub(crate) struct Found {
    bits: u32,
    stretches: Vec<Vec<(u32, Entry)>>,
    pub coming: Vec<Coming>,
}

impl Found {
    /// Empties it.
    pub fn reset(&mut self, stretches: Stretches) {
        self.bits = stretches.bits;
        self.stretches.resize_with(stretches.count, Vec::new);
        self.stretches.iter_mut().for_each(Vec::clear);
        self.coming.clear();
    }

    pub fn push(&mut self, lane: u32, entry: Entry) {
        self.stretches[(lane >> self.bits) as usize].push((lane, entry));
    }
}

/// The entries of all lanes.
#[derive(Default)]
pub(crate) struct Lanes {
    /// Sorted within each lane.
    entries: Vec<Entry>,
    /// Beginning of the entries of each lane, and the end.
    starts: Vec<u32>,
    /// Rows of vehicles in their lanes, in order, by stretch.
    pub order: Vec<Vec<u32>>,
}

impl Lanes {
    /// The entries of a lane, first the hindmost.
    pub fn get(&self, lane: u32) -> &[Entry] {
        let range = self.starts.get(lane as usize).zip(self.starts.get(lane as usize + 1));
        range.map_or(&[], |(&from, &to)| &self.entries[from as usize..to as usize])
    }

    /// Puts what was found into its lanes; calls `mind` with each entry that minds others, and those ahead of it.
    pub fn fill(
        &mut self,
        found: &[Found],
        (stretches, lanes): (Stretches, u32),
        mind: impl Fn(&Entry, &[Entry]) + Sync,
    ) {
        let of = |stretch: usize| found.iter().map(move |found| &found.stretches[stretch][..]);
        let count = |stretch: usize| of(stretch).map(<[_]>::len).sum::<usize>();
        self.entries.resize((0..stretches.count).map(count).sum(), Entry::default());
        self.starts.resize(lanes as usize + 1, 0);
        self.starts[lanes as usize] = self.entries.len() as u32;
        self.order.resize_with(stretches.count, Vec::new);
        let (mut base, mut rest) = (0, &mut self.entries[..]);
        let starts = self.starts[..lanes as usize].chunks_mut(1 << stretches.bits);
        let parts = starts.zip(&mut self.order).enumerate().map(|(stretch, (starts, order))| {
            let entries = rest.split_off_mut(..count(stretch)).unwrap_or_default();
            let first = base;
            base += entries.len() as u32;
            (stretch, Stretch { first_lane: (stretch as u32) << stretches.bits, base: first, starts, entries, order })
        });
        in_parallel(parts.collect::<Vec<_>>().into_iter(), |(stretch, mut part)| {
            part.fill(of(stretch));
            part.put_in_order(&mind);
        });
    }
}

/// Some lanes in a row, and room for their entries.
struct Stretch<'a> {
    first_lane: u32,
    /// Entries in the stretches before.
    base: u32,
    /// Beginning of each lane's entries, among those of all stretches.
    starts: &'a mut [u32],
    entries: &'a mut [Entry],
    order: &'a mut Vec<u32>,
}

impl Stretch<'_> {
    fn fill<'b>(&mut self, found: impl DoubleEndedIterator<Item = &'b [(u32, Entry)]> + Clone) {
        self.starts.fill(0);
        found.clone().flatten().for_each(|(lane, _)| self.starts[(lane - self.first_lane) as usize] += 1);
        let mut sum = self.base;
        for start in &mut *self.starts {
            sum += *start;
            *start = sum;
        }
        // From behind, which leaves `starts` where they should be.
        for (lane, entry) in found.rev().flat_map(|part| part.iter().rev()) {
            let start = &mut self.starts[(lane - self.first_lane) as usize];
            *start -= 1;
            self.entries[(*start - self.base) as usize] = *entry;
        }
    }

    fn put_in_order(&mut self, mind: &impl Fn(&Entry, &[Entry])) {
        self.order.clear();
        let ends = self.starts.iter().skip(1).map(|start| (start - self.base) as usize).chain([self.entries.len()]);
        let mut from = 0;
        for to in ends {
            let entries = &mut self.entries[from..to];
            sort_lane(entries);
            for (index, entry) in entries.iter().enumerate() {
                if entry.role != Role::Obstacle {
                    mind(entry, &entries[index + 1..]);
                }
                if entry.role == Role::Main {
                    self.order.push(entry.row);
                }
            }
            from = to;
        }
    }
}

/// Sorts a lane that is nearly sorted; one that is not takes no longer than others.
fn sort_lane(entries: &mut [Entry]) {
    let mut moves = 8 * entries.len();
    for i in 1..entries.len() {
        let mut at = i;
        while at > 0 && entries[i].is_before(&entries[at - 1]) {
            at -= 1;
        }
        if at < i {
            entries[at..=i].rotate_right(1);
            if moves < i - at {
                entries.sort_unstable_by(|a, b| {
                    if a.is_before(b) { std::cmp::Ordering::Less } else { std::cmp::Ordering::Greater }
                });
                return;
            }
            moves -= i - at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::sync::Mutex;

    /// A lane, metres, a vehicle and its role.
    type Plain = (u32, i8, u8, u8);

    fn entry(&(_, front, number, role): &Plain) -> Entry {
        let (front, number) = (f32::from(front), u32::from(number));
        let role = [Role::Main, Role::Follower, Role::Obstacle][usize::from(role)];
        Entry { front, back: front - 4.0, row: number, number, role, ..Entry::default() }
    }

    proptest! {
        #[test]
        fn lanes_are_as_if_each_was_sorted_by_itself(
            lanes in 1u32..40,
            tasks in 1usize..5,
            all in prop::collection::vec((0u32..40, any::<i8>(), 0u8..20, 0u8..3), 0..300),
        ) {
            crate::ecs::parallel::set_threads(None);
            let all: Vec<Plain> = all.into_iter().map(|(lane, front, n, role)| (lane % lanes, front, n, role)).collect();
            let stretches = Stretches::new(lanes, 512 * tasks);
            let mut found: Vec<Found> = (0..tasks).map(|_| Found::default()).collect();
            let mut kept = Lanes::default();
            // Twice: what is left of the first time must not show.
            for all in [&all[..], &all[all.len() / 3..]] {
                found.iter_mut().for_each(|found| found.reset(stretches));
                all.iter().enumerate().for_each(|(i, plain)| found[i % tasks].push(plain.0, entry(plain)));
                let minded = Mutex::new(Vec::new());
                kept.fill(&found, (stretches, lanes), |entry, ahead| {
                    minded.lock().expect("no panic").push((entry.row, ahead.len()));
                });
                let (mut expected_minded, mut main) = (Vec::new(), Vec::new());
                for lane in 0..lanes {
                    let of_lane = || all.iter().filter(|plain| plain.0 == lane);
                    let mut fronts: Vec<(i8, u8)> = of_lane().map(|plain| (plain.1, plain.2)).collect();
                    fronts.sort_unstable();
                    let entries = kept.get(lane);
                    let got: Vec<(i8, u8)> = entries.iter().map(|e| (e.front as i8, e.number as u8)).collect();
                    prop_assert_eq!(got, fronts);
                    let roles = |entries: Vec<Entry>| {
                        let mut roles: Vec<(u32, i8, u8)> =
                            entries.iter().map(|e| (e.number, e.front as i8, e.role as u8)).collect();
                        roles.sort_unstable();
                        roles
                    };
                    prop_assert_eq!(roles(entries.to_vec()), roles(of_lane().map(entry).collect()));
                    let minding = entries.iter().rev().enumerate().filter(|(_, e)| e.role != Role::Obstacle);
                    expected_minded.extend(minding.map(|(ahead, e)| (e.row, ahead)));
                    main.extend(entries.iter().filter(|e| e.role == Role::Main).map(|e| e.row));
                }
                let mut minded = minded.into_inner().expect("no panic");
                minded.sort_unstable();
                expected_minded.sort_unstable();
                prop_assert_eq!(minded, expected_minded);
                prop_assert_eq!(kept.order.concat(), main, "the order that the next step begins with");
            }
        }
    }
}
