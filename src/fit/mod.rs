//! Minimisation of weighted residuals over bounded parameters, and the cost that it minimises.
//!
//! *In*: a [`LeastSquares`] problem (residuals and their gradient as functions of the parameters), a start, bounds.
//! *Out*: an [`Estimate`], whatever happens on the way; only a start that cannot be evaluated is a [`FitError`].
//! *Must not happen here*: simulation, files, knowledge of bodies or names of channels.

mod alternatives;
mod chosen;
mod constrained;
mod cost;
mod levenberg_marquardt;
mod loss;
mod multi_start;
mod prior;
mod problem;
mod step;

pub use alternatives::{Optimiser, Search, observed_search, search};
pub use chosen::{Chosen, minimise};
pub use constrained::{Constraints, Region, constrained};
pub use cost::{ChannelCost, CostTree, magnitude_weight, noise_weight};
pub use levenberg_marquardt::levenberg_marquardt;
pub use loss::{original, robust_deviation, transformed};
pub use multi_start::{latin_hypercube, multi_start, parallel_starts};
pub use prior::{PriorRow, WithPriors};
pub use problem::*;
