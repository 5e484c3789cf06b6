//! Light of the sky in a frame: the sky in the world's units with the lights of sun and moon (`drawn_sky`), objects that
//! stand and hide it (`hiding`), and movers that hide it from what is beside them (`movers`).

pub(crate) mod drawn_sky;
pub(crate) mod hiding;
pub(crate) mod movers;

pub use drawn_sky::{DrawnSky, WeatherLight};
pub use hiding::{KeptLattices, LatticeStore, OpennessState};
pub use movers::{MoverTexel, Movers};
