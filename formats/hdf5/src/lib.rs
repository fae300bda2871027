//! HDF5: measurement files and results.
