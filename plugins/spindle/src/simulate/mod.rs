//! Campaigns in the time domain with a declared truth.
