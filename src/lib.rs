//! `ident` shows what a mechanical simulation gets wrong against measured data, names the cause, extends the model
//! and measures the gain.
//!
//! Data flows one way; each module is one stage and may use only modules above it in this list:
//!
//! ```text
//! diagnostics  what is wrong in a text or a file: code, place, cause, likely fix
//! quantities   dimensions, units, SI values
//! expression   the symbolic graph
//! linear       dense and sparse linear algebra, SVD
//! syntax       text                -> Tree
//! study        Tree                -> Study      names, dimensions, variants, topology
//! mechanics    Study               -> System     equations of motion as expressions
//! integrate    problem             -> Solution   equilibrium, BDF, Runge-Kutta, sensitivities in step
//! tape         System              -> Model      residual, sparse Jacobian, parameter derivatives as closures
//! signal       files               -> records    measured data, filters, spectra
//! simulation   Model + experiment  -> Trajectory measured channels and their gradient
//! fit          residuals           -> estimate   cost, scaling, Levenberg-Marquardt with bounds
//! statistics   estimate            -> confidence singular values, covariance, noise
//! identify     study + records     -> Identification  parameters with confidence, discrepancy tree
//! diagnose     study + data        -> Answer     what is wrong, why, and what the extension gains
//! analyse      estimate            -> validity   criteria, planning
//! report       results             -> terminal text, JSON, pages
//! command      arguments           -> exit status
//! ```

pub mod analyse;
pub mod command;
pub mod diagnose;
pub mod diagnostics;
pub mod expression;
pub mod fit;
pub mod identify;
pub mod integrate;
pub mod linear;
pub mod mechanics;
pub mod quantities;
pub mod report;
pub mod signal;
pub mod simulation;
pub mod statistics;
pub mod study;
pub mod syntax;
pub mod tape;
