//! Reference circles: contact conditions on random profiles, brute force on small ones, digits from elsewhere.

mod brute_force;
mod contact;
mod profiles;
