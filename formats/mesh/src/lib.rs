//! What mesh formats share.
//!
//! A [`Surface`](runout_core::surface::Surface) becomes a [`Mesh`]: a wall of rings that closes at 0°, with caps on its
//! ends where asked. A format is a [`Format`]: an extension, a unit and a function that writes one mesh; configuration,
//! the second, magnified file, notes and atomic files are here.

mod cap;
mod colour;
mod config;
mod ends;
mod export;
mod format;
mod mesh;
mod notes;
mod portions;

pub use cap::Cap;
pub use colour::{ColourScale, STEPS as COLOUR_STEPS, UNMEASURED, linear, palette};
pub use config::MeshConfig;
pub use format::Format;
pub use mesh::{LANES, Mesh, Vertices};
pub use notes::{InputNote, Notes};
pub use portions::{in_order, processors};
