//! Random numbers that are the same on every platform: additions, multiplications and square roots alone, which
//! IEEE 754 rounds the same everywhere. (Sines and cosines it does not.)

use glam::{Quat, Vec3};

/// SplitMix64 (Steele, Lea, Flood: "Fast Splittable Pseudorandom Number Generators", OOPSLA 2014; constants of
/// Vigna's public domain `splitmix64.c`): 64 bits of state, fine for placing things, not for secrets.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// 0 ≤ x < 1, in steps of 2⁻²⁴.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }

    pub fn between(&mut self, min: f32, max: f32) -> f32 {
        min + (max - min) * self.unit()
    }

    pub fn in_box(&mut self, min: Vec3, max: Vec3) -> Vec3 {
        Vec3::new(self.between(min.x, max.x), self.between(min.y, max.y), self.between(min.z, max.z))
    }

    /// Even over the unit disc in XZ, by rejection.
    pub fn in_disc(&mut self) -> Vec3 {
        loop {
            let at = self.in_box(Vec3::new(-1.0, 0.0, -1.0), Vec3::new(1.0, 0.0, 1.0));
            if at.length_squared() <= 1.0 {
                return at;
            }
        }
    }

    /// A turn about Y, evenly distributed: the half angle's cosine and sine are a random direction.
    pub fn yaw(&mut self) -> Quat {
        loop {
            let at = self.in_disc();
            if at.length_squared() > 1e-4 {
                let half = at.normalize();
                return Quat::from_xyzw(0.0, half.z, 0.0, half.x);
            }
        }
    }

    /// One of `count` alternatives, evenly (to 2⁻³²); 0 for none.
    pub fn index(&mut self, count: usize) -> usize {
        (((self.bits() >> 32) * count as u64) >> 32) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_numbers_are_those_of_the_published_generator() {
        let mut random = Random::new(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| random.bits()).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn random_values_fill_their_ranges_evenly() {
        let mut random = Random::new(5);
        let mut counts = [0; 5];
        let mut sum = Vec3::ZERO;
        let mut turned = Vec3::ZERO;
        for _ in 0..10_000 {
            counts[random.index(5)] += 1;
            sum += random.in_disc();
            let yaw = random.yaw();
            assert!((yaw.length() - 1.0).abs() < 1e-6);
            turned += yaw * Vec3::X;
        }
        assert!(counts.iter().all(|c| (1850..2150).contains(c)), "{counts:?}");
        assert!(sum.length() < 200.0 && turned.length() < 300.0, "{sum} {turned}");
        assert_eq!(random.index(0), 0);
    }
}
