//! Measured circles and generatrices of a cylinder.
