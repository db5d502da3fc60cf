//! Sensitivities.
