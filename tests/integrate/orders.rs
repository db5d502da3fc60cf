//! Orders of convergence and exactness.
