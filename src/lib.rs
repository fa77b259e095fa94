//! Decides where a handful of strain gauges go inside a flexible robot limb, so that they locate touches best.
//!
//! ```text
//! mesh, supports ──→ elastic model ──→ dataset ──→ feasible sites ──→ gauges ──→ error
//!  mesh, project      elasticity       dataset        feasible       placement   evaluation
//!                         │             X, p                                        ↑
//!                         └───────→ a finer reference model, held-out touches ──────┘
//! ```
//!
//! [`design`] joins the stages, each a pure function of those before it. From a mesh to the error of three gauges:
//!
//! ```
//! use std::{f64::consts::PI, sync::Arc};
//! use glam::{DVec2, DVec3};
//! use hapdef::{budget::*, design::*, evaluation::EstimatorKind, mesh::{TriMesh, oriented_box::OrientedBox}, project::*};
//!
//! // Mesh: half a tube, 40 mm long and 20 mm in radius, the middle of a wall of 1.5 mm.
//! let at = |k: u32| DVec2::from_angle(PI * f64::from(k % 13) / 12.0).extend(f64::from(k / 13) / 4.0) * 0.02;
//! let corners = (0..8 * 13).filter(|k| k % 13 < 12);
//! let triangles: Vec<_> = corners.flat_map(|k| [[k, k + 1, k + 14], [k, k + 14, k + 13]]).collect();
//! let (mesh, _) = TriMesh::new(&(0..9 * 13).map(at).collect::<Vec<_>>(), &triangles, 0)?;
//!
//! // Supports: its straight edges are clamped.
//! let mut project = Project::around("half-tube.stl", None);
//! let edges = OrientedBox::of_file(DVec3::new(-0.03, -0.01, -0.01), DVec3::new(0.03, 0.001, 0.05));
//! project.supports = vec![SupportKeys::clamping(&edges)];
//! project.selection.sensors = 3;
//! project.evaluation.estimator = EstimatorKind::Svr; // the paper's regression: quickest at this size
//! let inputs = Inputs { project, part: Arc::new(mesh), painted: None, masks: Masks::default() };
//!
//! // Dataset: strain at every site under every touch.
//! let small = BudgetLimits { vertices: Some(400), touches: Some(100), expected_places: Some(80), ..Default::default() };
//! let budget = Budget { test_touches: 50, ..Quality::Draft.budget().within(&small) };
//! let simulated = Arc::new(simulate(&inputs, &budget, &unwatched)?);
//! assert_eq!(simulated.dataset.x.columns(), simulated.dataset.touches.len());
//!
//! // Gauges, and their error on the reference model.
//! let kinds = inputs.project.selectors();
//! let asked = DesignRequest { inputs: &inputs, kinds: &kinds, budget: &budget };
//! let design = run_from(&asked, simulated, &|| 0.0, &unwatched)?;
//! let judged = design.chosen_row().ok_or("nothing was judged")?;
//! assert!(design.chosen().len() == 3 && judged.error_mm < 5.0, "{} mm", judged.error_mm);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! For a design that tells of its progress and can be stopped, see [`design::run_step_by_step`]. To choose sites from
//! signals without a part, see [`study`]; to ask the elastic model at points of your own, [`given`]; to turn the readings
//! of a board into touches, [`live`].
//!
//! SI units throughout (m, N, Pa, strain as a ratio), except in [`project`], whose fields carry the units of their
//! names. The core (everything but `io`, `job`, `link`, `document`, `render`, `test_bed`, `varied`, `session`, `cli` and `studio`) is pure: no
//! file, no clock, no thread of its own, no global random state.

// Every public item of the core says what it is: the compiler holds that. What lies around it is for the program alone.
#![warn(missing_docs)]

mod as_made;
pub mod bench;
pub mod board;
mod bounds;
pub mod budget;
#[allow(missing_docs)]
pub mod cli;
pub mod colormap;
pub mod dataset;
pub mod design;
#[allow(missing_docs)]
pub mod document;
mod draw;
mod eigen;
pub mod elasticity;
pub mod evaluation;
pub mod feasible;
pub mod gauge;
pub mod gaussian_process;
pub mod given;
pub mod inference;
#[allow(missing_docs)]
pub mod io;
pub mod jig;
#[allow(missing_docs)]
pub mod job;
mod lanes;
pub mod learning;
pub mod limb;
#[allow(missing_docs)]
pub mod link;
pub mod live;
pub mod memory;
pub mod mesh;
pub mod paper;
pub mod parameter_study;
pub mod pca;
pub mod placement;
pub mod plain;
pub mod project;
pub mod regression;
#[allow(missing_docs)]
pub mod render;
#[allow(missing_docs)]
pub mod session;
mod statistics;
#[cfg(feature = "studio")]
#[allow(missing_docs)]
pub mod studio;
pub mod study;
pub mod tally;
#[allow(missing_docs)]
pub mod test_bed;
pub mod trade;
pub mod uncertainty;
pub mod units;
#[allow(missing_docs)]
pub mod varied;
pub mod wire;
pub mod workshop;
