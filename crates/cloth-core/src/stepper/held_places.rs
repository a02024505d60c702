//! Where held particles are, as far as that is known without a look at the device.

use std::collections::BTreeMap;

use crate::{PinAction, PinControl, Precision, State};

/// Places of particles that are held at rest.
#[derive(Debug)]
pub(super) struct HeldPlaces {
    precision: Precision,
    places: BTreeMap<u32, [f64; 3]>,
}

impl HeldPlaces {
    pub(super) const fn new(precision: Precision) -> Self {
        Self { precision, places: BTreeMap::new() }
    }

    /// Starts again from a state.
    pub(super) fn state_set(&mut self, state: &State) {
        self.places.clear();
        for (particle, &held) in state.held.iter().enumerate() {
            // One with a velocity goes on with it.
            if held != 0 && state.velocities[particle] == [0.0; 3] {
                let place = self.rounded(state.positions[particle]);
                self.places.insert(particle as u32, place);
            }
        }
    }

    /// Takes notice of what a frame has done with a particle. One that is held wherever it happens to be is at a place
    /// that only the device knows, unless it was held before.
    pub(super) fn pin_set(&mut self, pin: &PinControl) {
        match pin.action {
            PinAction::Hold => {}
            PinAction::MoveTo(target) => {
                let place = self.rounded(target);
                self.places.insert(pin.particle, place);
            }
            PinAction::MoveBy(_) | PinAction::Release => {
                self.places.remove(&pin.particle);
            }
        }
    }

    /// Where a particle is, if that is known.
    pub(super) fn get(&self, particle: u32) -> Option<[f64; 3]> {
        self.places.get(&particle).copied()
    }

    /// A place as devices keep it: what is computed from it does not depend on who remembers it.
    fn rounded(&self, place: [f64; 3]) -> [f64; 3] {
        match self.precision {
            Precision::F32 => place.map(|number| f64::from(number as f32)),
            Precision::F64 => place,
        }
    }
}
