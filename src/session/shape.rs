//! The part as it is pointed at and as it is laid flat: made once, where nobody waits for it.

use std::sync::Arc;

use crate::document::Document;
use crate::mesh::flatten::Flat;
use crate::mesh::locate::SurfaceIndex;

/// What whoever shows a part needs of it.
#[derive(Clone)]
pub struct PartShape {
    pub index: Arc<SurfaceIndex>,
    /// As the part stands when it is opened.
    pub flat: Arc<Flat>,
}

impl PartShape {
    #[must_use]
    pub fn of(document: &Document) -> Self {
        let part = &document.part;
        let stance = document.state.project.part.axis.stance(part);
        Self {
            index: Arc::clone(part.index()),
            flat: Arc::new(Flat::of(part, stance)),
        }
    }
}
