//! Memory that tasks hand on to each other.

use std::ops::{Deref, DerefMut};
use std::sync::{Mutex, PoisonError};

/// Values not in use; there are never more than tasks that ran at the same time. What one holds must not matter.
#[derive(Debug, Default)]
pub(crate) struct Spare<T>(Mutex<Vec<T>>);

impl<T: Default> Spare<T> {
    /// A value, fresh if none is spare; it comes back by itself.
    pub(crate) fn take(&self) -> Borrowed<'_, T> {
        let value = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
        Borrowed { value, home: self }
    }
}

impl<T> Clone for Spare<T> {
    /// Without the memory.
    fn clone(&self) -> Spare<T> {
        Spare(Mutex::new(Vec::new()))
    }
}

/// A value in use.
pub(crate) struct Borrowed<'a, T: Default> {
    value: T,
    home: &'a Spare<T>,
}

impl<T: Default> Deref for Borrowed<'_, T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T: Default> DerefMut for Borrowed<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

impl<T: Default> Drop for Borrowed<'_, T> {
    fn drop(&mut self) {
        let value = std::mem::take(&mut self.value);
        self.home.0.lock().unwrap_or_else(PoisonError::into_inner).push(value);
    }
}
