//! Checks of what only the scene knows; the model checks the rest.

use crate::{SceneError, SceneOrigin, ScenePlace};

/// Makes errors that name a key and its place.
pub(super) struct Check<'a> {
    origin: &'a SceneOrigin,
}

impl<'a> Check<'a> {
    pub(super) const fn new(origin: &'a SceneOrigin) -> Self {
        Self { origin }
    }

    pub(super) fn place(&self, key: &str) -> ScenePlace {
        self.origin.place(key)
    }

    pub(super) const fn origin(&self) -> &SceneOrigin {
        self.origin
    }

    /// An error at `key`; `problem` follows the key, and says the mend.
    pub(super) fn error(&self, key: &str, problem: &str) -> SceneError {
        SceneError::Value { place: self.place(key), problem: format!("`{key}` {problem}") }
    }

    pub(super) fn finite(&self, key: &str, values: &[f64]) -> Result<(), SceneError> {
        match values.iter().find(|value| !value.is_finite()) {
            Some(value) => Err(self.error(key, &format!("is {value}: give a finite number"))),
            None => Ok(()),
        }
    }

    pub(super) fn positive(&self, key: &str, value: f64) -> Result<(), SceneError> {
        self.finite(key, &[value])?;
        if value > 0.0 {
            Ok(())
        } else {
            Err(self.error(key, &format!("is {value}: it must be greater than zero")))
        }
    }

    pub(super) fn not_negative(&self, key: &str, value: f64) -> Result<(), SceneError> {
        self.finite(key, &[value])?;
        if value >= 0.0 {
            Ok(())
        } else {
            Err(self.error(key, &format!("is {value}: it must not be negative")))
        }
    }

    /// A number from 0 to 1.
    pub(super) fn share(&self, key: &str, value: f64) -> Result<(), SceneError> {
        self.finite(key, &[value])?;
        if (0.0..=1.0).contains(&value) {
            Ok(())
        } else {
            Err(self.error(key, &format!("is {value}: it must lie between 0 and 1")))
        }
    }

    pub(super) fn at_least_one(&self, key: &str, count: u32) -> Result<(), SceneError> {
        if count > 0 { Ok(()) } else { Err(self.error(key, "is 0: give at least 1")) }
    }

    /// A count from 1 to `limit`. What a count makes the solver do has to end in a time that a person waits.
    pub(super) fn count(&self, key: &str, count: u32, limit: u32) -> Result<(), SceneError> {
        self.at_least_one(key, count)?;
        if count <= limit {
            Ok(())
        } else {
            Err(self.error(key, &format!("is {count}: give at most {limit}")))
        }
    }

    /// A vector that has a direction.
    pub(super) fn direction(&self, key: &str, vector: [f64; 3]) -> Result<(), SceneError> {
        self.finite(key, &vector)?;
        // What cannot be normalised has no direction either: the square of a tiny length is zero.
        match glam::DVec3::from(vector).try_normalize() {
            Some(_) => Ok(()),
            None => Err(self.error(key, "has no direction: give a vector of a usual length")),
        }
    }
}
