//! Random numbers that are functions of counters: the same for any order, thread or number of worlds.
//!
//! Philox4x32-10 (Salmon, Moraes, Dror, Shaw: "Parallel Random Numbers: As Easy as 1, 2, 3", SC 2011) turns a key and a
//! counter into four words. Uniform and normal numbers are made of a word each by integers and one table. So shaders
//! can make the same bits.

use std::sync::LazyLock;

/// Multipliers of the two products, and what the key grows by in each round.
const MULTIPLIERS: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const KEY_STEPS: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
const ROUNDS: usize = 10;

/// Number of quantiles of the normal distribution that [`normal`] chooses from.
pub const QUANTILES: usize = 4096;

/// Philox4x32-10.
pub fn philox4x32([mut k0, mut k1]: [u32; 2], counter: [u32; 4]) -> [u32; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    for _ in 0..ROUNDS {
        let first = u64::from(MULTIPLIERS[0]) * u64::from(c0);
        let second = u64::from(MULTIPLIERS[1]) * u64::from(c2);
        [c0, c1, c2, c3] =
            [(second >> 32) as u32 ^ c1 ^ k0, second as u32, (first >> 32) as u32 ^ c3 ^ k1, first as u32];
        k0 = k0.wrapping_add(KEY_STEPS[0]);
        k1 = k1.wrapping_add(KEY_STEPS[1]);
    }
    [c0, c1, c2, c3]
}

/// The random numbers of one sensor in one capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Noise {
    key: [u32; 2],
    step: u64,
}

impl Noise {
    /// Those of the sensor `id` in the scene with a seed, captured after a step. 128 bits of seed and id become the 64
    /// bits of the key by Philox itself.
    pub fn new(seed: u64, id: u64, step: u64) -> Self {
        let [k0, k1, ..] = philox4x32([0; 2], [seed as u32, (seed >> 32) as u32, id as u32, (id >> 32) as u32]);
        Self { key: [k0, k1], step }
    }

    /// Four random words: for the element `index` of the capture, and one of its channels.
    pub fn words(&self, index: u32, channel: u32) -> [u32; 4] {
        philox4x32(self.key, [index, channel, self.step as u32, (self.step >> 32) as u32])
    }
}

/// A multiple of 2⁻²⁴ from 0 to below 1, each as likely.
pub fn uniform(word: u32) -> f32 {
    (word >> 8) as f32 / (1 << 24) as f32
}

/// A number of the [table](normal_table) by the word's highest 12 bits: mean 0, variance 1, at most
/// 3.67.
pub fn normal(word: u32) -> f32 {
    normal_table()[(word >> 20) as usize]
}

/// The quantiles of the normal distribution at (i + ½)/4096, divided by the square root of their mean square.
///
/// So the mean is exactly 0: entry 4095 − i is minus entry i. The variance is 1 but for the rounding to floats, within
/// 2⁻²⁴. Tails beyond the last quantile are cut: the fourth moment is 2.99 instead of 3.
pub fn normal_table() -> &'static [f32; QUANTILES] {
    static TABLE: LazyLock<[f32; QUANTILES]> = LazyLock::new(|| {
        let above: Vec<f64> =
            (QUANTILES / 2..QUANTILES).map(|i| normal_quantile((i as f64 + 0.5) / QUANTILES as f64)).collect();
        let deviation = (above.iter().map(|x| x * x).sum::<f64>() / above.len() as f64).sqrt();
        std::array::from_fn(|i| match i.checked_sub(QUANTILES / 2) {
            Some(i) => (above[i] / deviation) as f32,
            None => -((above[QUANTILES / 2 - 1 - i] / deviation) as f32),
        })
    });
    &TABLE
}

/// Quantile of the standard normal distribution, for `p` from 1e-11 to 1 − 1e-11; to a relative 1e-15 (Wichura:
/// "Algorithm AS 241: The Percentage Points of the Normal Distribution", Applied Statistics 37, 1988, PPND16).
pub fn normal_quantile(p: f64) -> f64 {
    let from_half = p - 0.5;
    if from_half.abs() <= 0.425 {
        let r = 0.180_625 - from_half * from_half;
        return from_half * polynomial(&CENTRE_ABOVE, r) / polynomial(&CENTRE_BELOW, r);
    }
    let r = (-p.min(1.0 - p).ln()).sqrt() - 1.6;
    (polynomial(&TAIL_ABOVE, r) / polynomial(&TAIL_BELOW, r)).copysign(from_half)
}

/// The lowest coefficient first.
fn polynomial(coefficients: &[f64; 8], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

const CENTRE_ABOVE: [f64; 8] = [
    3.387_132_872_796_366_5,
    1.331_416_678_917_843_8e2,
    1.971_590_950_306_551_3e3,
    1.373_169_376_550_946e4,
    4.592_195_393_154_987e4,
    6.726_577_092_700_87e4,
    3.343_057_558_358_813e4,
    2.509_080_928_730_122_7e3,
];
const CENTRE_BELOW: [f64; 8] = [
    1.0,
    4.231_333_070_160_091e1,
    6.871_870_074_920_579e2,
    5.394_196_021_424_751e3,
    2.121_379_430_158_659_7e4,
    3.930_789_580_009_271e4,
    2.872_908_573_572_194_3e4,
    5.226_495_278_852_854e3,
];
const TAIL_ABOVE: [f64; 8] = [
    1.423_437_110_749_683_5,
    4.630_337_846_156_546,
    5.769_497_221_460_691,
    3.647_848_324_763_204_5,
    1.270_458_252_452_368_4,
    2.417_807_251_774_506e-1,
    2.272_384_498_926_918_4e-2,
    7.745_450_142_783_414e-4,
];
const TAIL_BELOW: [f64; 8] = [
    1.0,
    2.053_191_626_637_759,
    1.676_384_830_183_803_8,
    6.897_673_349_851e-1,
    1.481_039_764_274_800_8e-1,
    1.519_866_656_361_645_7e-2,
    5.475_938_084_995_345e-4,
    1.050_750_071_644_416_9e-9,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Random123's `kat_vectors`, philox4x32 with 10 rounds.
    #[test]
    fn philox_gives_the_published_vectors() {
        let vectors = [
            ([0; 2], [0; 4], [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]),
            ([u32::MAX; 2], [u32::MAX; 4], [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]),
            (
                [0xa409_3822, 0x299f_31d0],
                [0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344],
                [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1],
            ),
        ];
        for (key, counter, expected) in vectors {
            assert_eq!(philox4x32(key, counter), expected);
        }
    }

    #[test]
    fn quantiles_are_those_of_published_tables() {
        // NIST/SEMATECH e-Handbook of Statistical Methods, and further digits of the well-known ones.
        let known = [
            (0.5, 0.0),
            (0.75, 0.674_489_750_196_081_7),
            (0.975, 1.959_963_984_540_054),
            (0.995, 2.575_829_303_548_901),
            (0.9999, 3.719_016_485_455_709),
        ];
        for (p, x) in known {
            // 1 − p rounds by 2⁻⁵⁴, which the slope in the tail multiplies by up to 2,500.
            assert!((normal_quantile(p) - x).abs() < 1e-12, "{p}: {}", normal_quantile(p));
            assert!((normal_quantile(1.0 - p) + x).abs() < 1e-12);
        }
    }

    #[test]
    fn the_table_has_the_mean_and_variance_that_it_is_said_to_have() {
        let table = normal_table();
        assert_eq!(table.iter().map(|&x| f64::from(x)).sum::<f64>(), 0.0);
        let moment = |power| table.iter().map(|&x| f64::from(x).powi(power)).sum::<f64>() / QUANTILES as f64;
        assert!((moment(2) - 1.0).abs() < 2f64.powi(-24), "{}", moment(2));
        assert!((moment(4) - 2.99).abs() < 0.005, "{}", moment(4));
        assert!(table.is_sorted() && (0..QUANTILES).all(|i| table[i] == -table[QUANTILES - 1 - i]));
        assert!(table[QUANTILES - 1] < 3.67, "{}", table[QUANTILES - 1]);
        assert_eq!((normal(0), normal(u32::MAX)), (table[0], table[QUANTILES - 1]));
    }

    #[test]
    fn a_million_numbers_have_mean_and_variance_within_three_deviations() {
        let count = 1_000_000u32;
        let noise = Noise::new(7, 3, 42);
        let (mut sums, mut squares) = ([0.0f64; 2], [0.0f64; 2]);
        for index in 0..count {
            let [first, second, ..] = noise.words(index, 0);
            for (i, x) in [uniform(first), normal(second)].into_iter().map(f64::from).enumerate() {
                sums[i] += x;
                squares[i] += x * x;
            }
        }
        let n = f64::from(count);
        // Mean, variance and fourth central moment of each; the variance of an estimate of a variance is (m₄ − σ⁴)/n.
        for (i, (mean, variance, fourth)) in [(0.5, 1.0 / 12.0, 1.0 / 80.0), (0.0, 1.0, 2.99)].into_iter().enumerate() {
            let (found, square) = (sums[i] / n, squares[i] / n);
            assert!((found - mean).abs() < 3.0 * f64::sqrt(variance / n), "{i}: mean {found}");
            let spread = square - found * found;
            let deviation = f64::sqrt((fourth - variance * variance) / n);
            assert!((spread - variance).abs() < 3.0 * deviation, "{i}: variance {spread}");
        }
    }

    #[test]
    fn seed_sensor_step_channel_and_index_all_count() {
        let base = Noise::new(1, 2, 3).words(4, 5);
        for other in [Noise::new(2, 1, 3), Noise::new(1 << 32 | 1, 2, 3), Noise::new(1, 2, 1 << 32 | 3)] {
            assert_ne!(other.words(4, 5), base);
        }
        assert_ne!(Noise::new(1, 2, 3).words(5, 4), base);
        assert_eq!(Noise::new(1, 2, 3).words(4, 5), base);
        assert_eq!((uniform(0), uniform(u32::MAX)), (0.0, 1.0 - 1.0 / (1 << 24) as f32));
    }
}
