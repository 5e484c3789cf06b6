//! Policies of the choice among the lights that reach an object, and the objects that each policy is for.
//!
//! A policy is for the whole world, for the pieces of large objects, or for an entity that has it as a component. What
//! a policy means is said in [`brute_force`](crate::lights::brute_force) and, for the shares, in `enough`.

use crate::ecs::entity_numbers::EntityNumbers;
use bevy_ecs::entity::EntityIndex;
use bevy_ecs::prelude::*;
use serde::{Deserialize, Serialize};

/// Choice of the lights that shade an object, of those that reach it. The component is for that entity and its pieces,
/// and replaces the world's ([`LightPolicies`]).
#[derive(Component, Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub enum LightPolicy {
    /// The three most relevant with smooth weights, the others in an ambient cube.
    Three,
    /// The most relevant ones, as many as it takes to leave out no more than this share of the sum of the object's
    /// scores, and no fewer than `Three` has. What is left out is in an ambient cube. 0: all lights; 1 or more: three.
    Enough(f32),
    /// Every light that reaches the object: what the others are measured against.
    All,
    /// The three most relevant at full weight and nothing else: lights pop. To compare with.
    Hard,
}

impl LightPolicy {
    /// [`Self::Enough`] with the share that leaves no seams; what is measured with it stands in docs/lights.md.
    pub const ENOUGH: Self = Self::Enough(DEFAULT_TOLERANCE);

    /// All policies with the names that the command line uses.
    pub const ALL: [(&'static str, Self); 4] =
        [("three", Self::Three), ("enough", Self::ENOUGH), ("all", Self::All), ("hard", Self::Hard)];

    /// Description of the lights of an object, in a few words.
    pub fn lights_by(self) -> &'static str {
        match self {
            Self::Three => "the three most relevant lights, cross-faded, and an ambient cube for the others",
            Self::Enough(_) => "as many lights as leave out a thousandth of the light, an ambient cube for the rest",
            Self::All => "every light in range (slow reference)",
            Self::Hard => "the three most relevant lights alone",
        }
    }

    /// Its name on the command line, whatever its tolerance.
    pub fn name(self) -> &'static str {
        let is_same_kind = |other: &Self| std::mem::discriminant(other) == std::mem::discriminant(&self);
        Self::ALL.iter().find(|(_, policy)| is_same_kind(policy)).map_or("", |(name, _)| name)
    }

    /// The share of the sum of scores that lights beyond the three leave out at most, below 1; `None` where there are
    /// no more than three.
    pub(crate) fn tolerance(self) -> Option<f32> {
        match self {
            Self::All => Some(0.0),
            Self::Enough(share) if share < 1.0 => Some(share.max(0.0)),
            Self::Enough(_) | Self::Three | Self::Hard => None,
        }
    }
}

/// See [`LightPolicy::ENOUGH`].
const DEFAULT_TOLERANCE: f32 = 0.001;

/// The policies of entities that have none of their own.
#[derive(Resource, Clone, Copy, PartialEq, Debug)]
pub struct LightPolicies {
    /// Policy of objects.
    pub objects: LightPolicy,
    /// Policy of the pieces of large objects, which meet at edges.
    pub pieces: LightPolicy,
    /// Policy of everything, before all others; to compare policies.
    pub forced: Option<LightPolicy>,
}

impl Default for LightPolicies {
    fn default() -> Self {
        Self { objects: LightPolicy::ENOUGH, pieces: LightPolicy::ENOUGH, forced: None }
    }
}

impl LightPolicies {
    /// The same for objects and pieces; entities may have their own.
    pub fn same(policy: LightPolicy) -> Self {
        Self { objects: policy, pieces: policy, forced: None }
    }

    /// One for everything.
    pub fn forced(policy: LightPolicy) -> Self {
        Self { forced: Some(policy), ..Self::same(policy) }
    }
}

/// The policies of some objects that are searched together.
#[derive(Clone, Copy, Debug)]
pub enum Policies<'a> {
    /// All have the same.
    Same(LightPolicy),
    /// One for each.
    Each(&'a [LightPolicy]),
}

impl Policies<'_> {
    /// Policy of one of them.
    #[inline(always)]
    pub fn of(&self, index: usize) -> LightPolicy {
        match self {
            Self::Same(policy) => *policy,
            Self::Each(policies) => policies[index],
        }
    }

    /// Those of some of them.
    #[inline(always)]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        match self {
            Self::Same(policy) => Self::Same(*policy),
            Self::Each(policies) => Self::Each(&policies[range]),
        }
    }

    /// Tells if lights of objects beyond their three are listed, even where there are none.
    pub(crate) fn are_listed(&self) -> bool {
        match self {
            Self::Same(policy) => policy.tolerance().is_some(),
            Self::Each(_) => true,
        }
    }
}

/// The objects that have a policy of their own, or are pieces.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnPolicies {
    /// Policy of each in its bits. The lowest tells if it is a piece. The others are those of a tolerance below 1,
    /// whose highest bit is never set, or one of [`NO_POLICY`], [`THREE`] and [`HARD`].
    codes: EntityNumbers,
    policies: usize,
    pieces: usize,
}

const PIECE: u32 = 1;
// The bits of no tolerance.
const NO_POLICY: u32 = 0xffff_fff0;
const THREE: u32 = 0xffff_fff2;
const HARD: u32 = 0xffff_fff4;

impl OwnPolicies {
    /// An object has got or lost a policy.
    pub fn set_policy(&mut self, object: EntityIndex, policy: Option<LightPolicy>) {
        let code = match policy {
            None => NO_POLICY,
            Some(LightPolicy::Hard) => HARD,
            Some(policy) => policy.tolerance().map_or(THREE, |tolerance| tolerance.to_bits() << 1),
        };
        let before = self.code(object);
        self.policies = self.policies + usize::from(code != NO_POLICY) - usize::from(before & !PIECE != NO_POLICY);
        self.set(object, code | before & PIECE);
    }

    /// An object has become a piece or ceased to be one.
    pub fn set_piece(&mut self, object: EntityIndex, is_piece: bool) {
        let before = self.code(object);
        self.pieces = self.pieces + usize::from(is_piece) - (before & PIECE) as usize;
        self.set(object, before & !PIECE | u32::from(is_piece));
    }

    fn code(&self, object: EntityIndex) -> u32 {
        match self.codes.of_index(object) {
            EntityNumbers::NONE => NO_POLICY,
            code => code,
        }
    }

    fn set(&mut self, object: EntityIndex, code: u32) {
        if code == NO_POLICY {
            self.codes.take_index(object);
        } else {
            self.codes.set(object, code);
        }
    }

    /// The policy that all objects have, if it is the same.
    pub fn common(&self, policies: &LightPolicies) -> Option<LightPolicy> {
        let has_one = self.policies == 0 && (self.pieces == 0 || policies.pieces == policies.objects);
        policies.forced.or(has_one.then_some(policies.objects))
    }

    /// The policy of an object, where none is forced.
    #[inline]
    pub fn of(&self, object: EntityIndex, policies: &LightPolicies) -> LightPolicy {
        let code = self.code(object);
        match code & !PIECE {
            NO_POLICY if code & PIECE != 0 => policies.pieces,
            NO_POLICY => policies.objects,
            THREE => LightPolicy::Three,
            HARD => LightPolicy::Hard,
            tolerance => LightPolicy::Enough(f32::from_bits(tolerance >> 1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_s_own_policy_comes_before_the_world_s() {
        let (mut own, object) = (OwnPolicies::default(), EntityIndex::from_raw_u32(3).unwrap());
        let world = LightPolicies { pieces: LightPolicy::All, ..LightPolicies::same(LightPolicy::Three) };
        let mut after = |change: &dyn Fn(&mut OwnPolicies)| {
            change(&mut own);
            (own.of(object, &world), own.common(&world))
        };
        assert_eq!(after(&|_| {}), (LightPolicy::Three, Some(LightPolicy::Three)));
        assert_eq!(after(&|own| own.set_piece(object, true)), (LightPolicy::All, None));
        assert_eq!(after(&|own| own.set_policy(object, Some(LightPolicy::Hard))), (LightPolicy::Hard, None));
        for policy in [LightPolicy::Enough(0.25), LightPolicy::ENOUGH] {
            assert_eq!(after(&|own| own.set_policy(object, Some(policy))).0, policy);
        }
        assert_eq!(after(&|own| own.set_policy(object, Some(LightPolicy::Enough(2.0)))).0, LightPolicy::Three);
        assert_eq!(after(&|own| own.set_policy(object, None)), (LightPolicy::All, None));
        assert_eq!(after(&|own| own.set_piece(object, false)), (LightPolicy::Three, Some(LightPolicy::Three)));
    }
}
