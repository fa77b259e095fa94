//! Linear elasticity of a thin shell: flat triangular facets with six degrees of freedom a node.
//!
//! Membrane: the optimal triangle with drilling freedoms (Felippa 2003). Bending: the shear-flexible
//! discrete Kirchhoff–Mindlin triangle (Katili 1993). Assembled once, factored once, all loads solved
//! in blocks.

pub mod bedding;
pub mod bending;
mod both;
pub mod element;
pub mod error;
pub mod estimate;
pub mod grade;
pub mod linearity;
pub mod load;
pub mod material;
pub mod membrane;
pub mod model;
pub mod observe;
mod reading;
mod recover;
pub mod respond;
mod rows;
pub mod scope;
pub mod sensitivity;
pub mod shell;
pub mod solid;
mod solver;
mod spare;
pub mod support;
pub mod system;

pub use error::ElasticError;
pub use load::{NodalForces, Push, Touch};
pub use material::{Material, ShellSection};
pub use model::Model;
pub use shell::ShellModel;
pub use support::{DofSet, Support};
