//! Stable text of expressions.
