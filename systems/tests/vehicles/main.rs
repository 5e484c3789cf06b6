//! Vehicles: what they are made of, the models and bodies that they move by, and the rules of traffic.

mod crossings;
mod driving;
mod external;
mod parts;
mod physics;
mod precise;
mod rules;
mod traffic;
