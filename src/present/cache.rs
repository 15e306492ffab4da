//! Cache of recently computed values, for repeated requests.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Values by all that they depend on, a bounded number of them for the whole process; results do not depend on which are kept.
///
/// ```
/// use skyduct::present::cache::Cache;
///
/// static SQUARES: Cache<u64, u64> = Cache::new(2);
/// assert_eq!(SQUARES.get(3, || 3 * 3), 9);
/// assert_eq!(SQUARES.get(3, || unreachable!()), 9);
/// ```
pub struct Cache<K, T> {
    most: usize,
    /// Values by key, the most recently requested one last.
    values: Mutex<VecDeque<(K, Slot<T>)>>,
}

/// Value that the first thread to request it computes, while all others wait for it.
type Slot<T> = Arc<OnceLock<T>>;

impl<K: PartialEq, T: Clone> Cache<K, T> {
    /// Creates a cache of at most `most` values: those that were requested last.
    pub const fn new(most: usize) -> Self {
        Self { most, values: Mutex::new(VecDeque::new()) }
    }

    /// Returns the value of a key; `compute` computes it where it is not kept.
    pub fn get(&self, key: K, compute: impl FnOnce() -> T) -> T {
        // the lock is free while a value is computed: requests of other keys need not wait
        self.slot(key).get_or_init(compute).clone()
    }

    fn slot(&self, key: K) -> Slot<T> {
        // never left half changed: a panic elsewhere does not matter
        let mut values = self.values.lock().unwrap_or_else(PoisonError::into_inner);
        let known = values.iter().rposition(|(other, _)| *other == key).and_then(|index| values.remove(index));
        let slot = known.map_or_else(Slot::default, |(_, slot)| slot);
        values.push_back((key, slot.clone()));
        if values.len() > self.most {
            values.pop_front();
        }
        slot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most recently requested value stays, and is not computed again.
    #[test]
    fn the_values_that_were_asked_for_last_are_kept() {
        let kept = Cache::new(3);
        let computed = std::cell::Cell::new(0);
        let ask = |key: u32| {
            let value = kept.get(key, || {
                computed.set(computed.get() + 1);
                10 * key
            });
            assert_eq!(value, 10 * key);
            computed.get()
        };
        assert_eq!([1, 2, 3, 1].map(ask), [1, 2, 3, 3]);
        assert_eq!(ask(4), 4, "2 goes");
        assert_eq!([1, 3, 4].map(ask), [4, 4, 4]);
        assert_eq!(ask(2), 5, "1 goes");
        assert_eq!(ask(1), 6);
        assert_eq!(kept.values.lock().unwrap().len(), 3);
    }
}
