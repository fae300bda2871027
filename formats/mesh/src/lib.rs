//! What mesh formats share.
//!
//! A [`Surface`](runout_core::surface::Surface) becomes a [`Wall`] of rings that closes at 0°, with caps on its ends where
//! asked; a [`HeightGrid`](runout_core::height_grid::HeightGrid) becomes a [`Sheet`], open at its edges and holes. A format
//! is a [`Format`]: an name, an extension, a unit and a function that writes one mesh; configuration, the second, magnified file,
//! notes and atomic files are here.

mod cap;
mod colour;
mod config;
mod ends;
mod export;
mod extremes;
mod format;
mod mesh;
mod notes;
mod portions;
mod sheet;
mod vertices;
mod wall;
mod whole;

pub use cap::Cap;
pub use colour::{ColourScale, STEPS as COLOUR_STEPS, UNMEASURED, linear, palette};
pub use format::Format;
pub use mesh::Mesh;
pub use notes::{InputNote, Notes};
pub use portions::{in_order, processors};
pub use sheet::Sheet;
pub use vertices::{LANES, Vertices};
pub use wall::Wall;
pub use whole::Vertex;
