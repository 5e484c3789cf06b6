//! Places of sensors when they were due before.

use super::place::Place;
use crate::sense::captures::pose::Pose;

/// Places of a sensor when it was due last: steps and places, the latest last.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track(Vec<(u64, Place)>);

impl Track {
    /// Notes where a sensor is that is due after a step, `seconds` after it was due before. Returns where it was then,
    /// and before that, as far as that is known and it moved from there to here. The same again where it is asked
    /// again. `needed`: number of earlier poses that it measures by.
    pub fn note(&mut self, needed: usize, every: u32, step: u64, seconds: f64, now: Place) -> [Option<Pose>; 2] {
        self.0.retain(|(at, _)| *at < step);
        let noted = |intervals: u64| {
            let due = step.checked_sub(intervals * u64::from(every)).filter(|_| intervals <= needed as u64)?;
            self.0.iter().find(|(at, _)| *at == due).map(|(_, place)| *place)
        };
        let last = noted(1).filter(|last| last.leads_to(&now, seconds));
        let first = last.and_then(|last| noted(2).filter(|first| first.leads_to(&last, seconds)));
        self.0.push((step, now));
        self.0.drain(..self.0.len().saturating_sub(needed + 1));
        [last, first].map(|place| place.map(|place| place.pose))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn at(x: f64) -> Pose {
        Pose { translation: DVec3::X * x, ..Pose::default() }
    }

    fn place(x: f64) -> Place {
        Place { pose: at(x), jumps: 0 }
    }

    #[test]
    fn a_track_knows_the_poses_of_the_last_intervals() {
        let mut track = Track::default();
        let mut note = |step, x| track.note(2, 3, step, 1.0, place(x));
        assert_eq!(note(1, 1.0), [None, None]);
        assert_eq!(note(4, 4.0), [Some(at(1.0)), None]);
        // Asked twice, it says the same.
        for _ in 0..2 {
            assert_eq!(note(7, 7.0), [Some(at(4.0)), Some(at(1.0))]);
        }
        // It was not asked after step 10: nothing leads from what was before that.
        assert_eq!(note(13, 13.0), [None, None]);
        // The world went back.
        assert_eq!(note(10, 10.0), [Some(at(7.0)), Some(at(4.0))]);
        assert_eq!(note(13, 14.0), [Some(at(10.0)), Some(at(7.0))]);
        let mut track = Track::default();
        let is_known = [1, 2, 3].map(|step| track.note(1, 1, step, 1.0, place(0.0))[0].is_some());
        assert_eq!((is_known, track.0.len()), ([false, true, true], 2));
    }

    #[test]
    fn nothing_leads_over_a_jump_however_slow() {
        let mut track = Track::default();
        let mut note = |step, x, jumps| {
            let [last, first] = track.note(2, 60, step, 1.0, Place { pose: at(x), jumps });
            (last.is_some(), first.is_some())
        };
        assert_eq!(note(0, 0.0, 3), (false, false));
        assert_eq!(note(60, 10.0, 3), (true, false));
        assert_eq!(note(120, 20.0, 3), (true, true));
        // 30 m back in a second, where it drives 10.
        assert_eq!(note(180, -10.0, 4), (false, false));
        assert_eq!(note(240, 0.0, 4), (true, false));
        assert_eq!(note(300, 10.0, 4), (true, true));
        // Where it jumped to where it would have been.
        assert_eq!(note(360, 20.0, 5), (false, false));
    }
}
