//! What noise does to values of measured profiles: least form, most form, measured again.
//!
//! A measured profile is the true one and noise, of which the variance is known order by order. What noise does to a value depends on the true
//! form: it raises the peak to valley of three equal lobes by four standard deviations, the depth of one deep scratch by nothing. So two forms
//! are evaluated that the data allow: the *least* (what certainly stands out: lines, marks such as a scratch, waves at the lower limit of their
//! power; its crests as flat as they may be) and the *most* (what may be there: the upper limit), of which true profiles are drawn. Each is measured again (noise is
//! added), processed and evaluated as the measured one was. By as much as a value misses the truth there, it may miss it here: the interval is the
//! value less the 2 to 98 % range of these differences, from the lower end for one form to the upper end for the other.
//!
//! No value and no standard is known here: a value is a function of a draw ([`Profiles::values`]).

mod again;
mod angles;
mod errors;
mod flat;
mod interval;
mod marks;
mod open;
mod profiles;
mod section;
mod spectrum;
mod uncertainty;

pub use again::{Draw, MeasuredAgain, Truth, measured_again, without_noise};
pub use angles::{angles_for_parabolas, crest_order, drawn_angles};
pub use errors::{DrawnErrors, Errors};
pub use interval::Interval;
pub use open::OpenErrors;
pub use profiles::{Draws, KINDS, Profiles, Source};
pub use section::Measured;
pub use spectrum::VarianceFrom;
pub use uncertainty::*;
