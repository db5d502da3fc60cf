//! Stable text of a study's mechanics.
