//! CSV measurements: one file a setup and station.
