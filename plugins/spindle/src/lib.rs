//! Separators and a simulator for spindles: form of the part, error motion of the axis.
