//! How whoever shows a session is told to look again.

use std::sync::Arc;
use std::time::Duration;

/// Calls whoever shows a session, from any thread; nobody where none was named.
#[derive(Clone)]
pub struct Wake(Arc<dyn Fn(Duration) + Send + Sync>);

impl Wake {
    /// `call` is given how long to wait before there is something to see.
    pub fn new(call: impl Fn(Duration) + Send + Sync + 'static) -> Self {
        Self(Arc::new(call))
    }

    /// There is something to see.
    pub fn now(&self) {
        self.after(Duration::ZERO);
    }

    /// There will be something to see.
    pub fn after(&self, wait: Duration) {
        (self.0)(wait);
    }
}

impl Default for Wake {
    fn default() -> Self {
        Self::new(|_| ())
    }
}
