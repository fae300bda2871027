//! Spindles: separators of the part's form from the axis's error motion, and a simulator of both.

pub mod simulate;
