//! Relief: a data-oriented ECS simulation renderer. The world is plain data in an ECS ([`systems`]); systems turn what
//! changed in it into a draw list; [`renderer`] draws that, in a window (`app`) or without one ([`frames`]).
//!
//! A frame, whoever asks for it:
//!
//! ```text
//! simulation.step()                      0..n fixed steps: what moves by itself, moves
//! simulation.frame()                     transforms → bounds → tangents → levels → materials → lights → instances
//!                                        → batches
//! simulation.with_frame(|frame| renderer.prepare(frame, …))
//!                                        what is new or dirty goes to the GPU, once; missing pipelines are made
//! renderer.encode(encoder, views)        of each view: batches, sky, blended objects → HDR → tone map → its texture
//! queue.submit(…)                        is the caller's
//! ```
//!
//! ```text
//! scene     scene files (and glTF files as scenes) into entities     import   glTF and images into library items
//! export    arrays, labels and messages as the bytes of files
//! frames    scenes to pictures; Headless for programs of one's own   app      the window, its keys and panel
//! renderer  all that draws scenes, by wgpu                           check    everything wrong with a file
//! sense     cameras, lidars and other sensors, captured together     box_tree, triangle_tree   what rays meet
//! data      captures as files: formats, data sets, runs in parts that many machines render
//! tools     what measures and compares, and makes maps               recording   runs as files, to be replayed
//! session   a world and its run, for all of these                    viewpoint   what is looked through
//! problem, name, output, video, demo  shared
//! ```
//!
//! Programs begin with [`prelude`]; `examples/` continue from there; `docs/extending.md` says where your own code joins
//! in. The crates whose types are in this one's interface are re-exported: [`systems`], [`bevy_ecs`], [`glam`],
//! [`wgpu`].
//!
//! Features, all on unless told otherwise: `vehicles` (with their routes and traffic lights), `physics` (vehicles as
//! rigid bodies), `window` (`app`), `tools`, `mcap` (logs of ROS 2), `cli` (`commands`: the program `relief`).
//! `physics`, `window` and `cli` bring `vehicles` with them.

pub use {bevy_ecs, glam, systems, wgpu};

pub mod animation;
#[cfg(feature = "window")]
pub mod app;
pub mod check;
#[cfg(feature = "cli")]
pub mod commands;
pub mod data;
pub mod demo;
pub mod export;
pub mod frame_time;
pub mod frames;
pub mod import;
pub mod name;
pub mod output;
pub mod prelude;
pub mod problem;
pub mod recording;
pub mod renderer;
pub mod scene;
pub mod sense;
pub mod session;
#[cfg(feature = "tools")]
pub mod tools;
pub mod video;
pub mod viewpoint;

/// The README's program, compiled with the documentation's tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// The program of the page on vehicles.
#[cfg(all(doctest, feature = "vehicles"))]
#[doc = include_str!("../docs/vehicles.md")]
struct VehiclesPage;
