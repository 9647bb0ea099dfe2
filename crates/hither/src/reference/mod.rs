//! Brute-force truth: slow, obvious, sharing no code with the fast paths.
