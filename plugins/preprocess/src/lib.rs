//! From raw samples to one profile a capture: trims, filters, synchronous average.
