//! What is simulated instead of the model of a scene, where several of its particles are one.

use std::sync::Arc;

use cloth_core::{Model, ModelBuilder, ModelError, Weld, Welding};

/// The welds of a scene: of seams once they are closed, and of cloth that tears, which is one as long as it does not.
#[derive(Clone, Debug, Default)]
pub struct Welds {
    whole: Option<Arc<Weld>>,
    sewn: Option<Arc<Weld>>,
    /// What other welds are made of.
    builder: Option<Arc<ModelBuilder>>,
}

impl Welds {
    /// Those of the model that `builder` builds.
    ///
    /// # Errors
    /// What cannot be welded.
    pub(super) fn new(builder: ModelBuilder, model: &Model) -> Result<Self, ModelError> {
        let weld = |sews| builder.weld(Welding { sews, ..Welding::default() });
        let whole = weld(false)?.map(Arc::new);
        let sews = model.seams().weld_time().is_some();
        let sewn = if sews { weld(true)?.map(Arc::new) } else { None };
        let builder = (whole.is_some() || sews).then(|| Arc::new(builder));
        Ok(Self { whole, sewn, builder })
    }

    /// What is simulated at the start, if it is not the model.
    #[must_use]
    pub const fn start(&self) -> Option<&Arc<Weld>> {
        self.whole.as_ref()
    }

    /// What is simulated once all seams are closed that are to be welded, if any is, and nothing is torn.
    #[must_use]
    pub const fn sewn(&self) -> Option<&Arc<Weld>> {
        self.sewn.as_ref()
    }

    /// What is simulated where this is one; `None` for the model.
    ///
    /// # Errors
    /// What [`ModelBuilder::weld`] reports.
    pub fn at(&self, welding: Welding<'_>) -> Result<Option<Arc<Weld>>, ModelError> {
        let sews = welding.sews && self.sewn.is_some();
        let welding = Welding { sews, open: if sews { welding.open } else { &[] }, ..welding };
        match &self.builder {
            Some(builder) if !(welding.torn.is_empty() && welding.open.is_empty()) => {
                Ok(builder.weld(welding)?.map(Arc::new))
            }
            _ if welding.sews => Ok(self.sewn.clone()),
            _ => Ok(self.whole.clone()),
        }
    }
}
