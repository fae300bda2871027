//! Parquet tables of form, motion and harmonics.
