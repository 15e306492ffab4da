//! Cache of recently computed values, for repeated requests.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Values by all that they depend on, as many as weigh no more than a bound; results do not depend on which are kept.
///
/// ```
/// use skyduct::present::cache::Cache;
///
/// static SQUARES: Cache<u64, u64> = Cache::new(2, |_| 1);
/// assert_eq!(SQUARES.get(3, || 3 * 3), 9);
/// assert_eq!(SQUARES.get(3, || unreachable!()), 9);
/// ```
pub struct Cache<K, T> {
    most: usize,
    weight: fn(&T) -> usize,
    /// Values by key, the most recently requested one last.
    values: Mutex<VecDeque<(K, Slot<T>)>>,
}

/// Value that the first thread to request it computes, while all others wait for it.
type Slot<T> = Arc<OnceLock<T>>;

impl<K: PartialEq, T: Clone> Cache<K, T> {
    /// Creates a cache of values that weigh at most `most` together: those that were requested last. The newest one is kept, whatever it
    /// weighs.
    pub const fn new(most: usize, weight: fn(&T) -> usize) -> Self {
        Self { most, weight, values: Mutex::new(VecDeque::new()) }
    }

    /// Returns the value of a key; `compute` computes it where it is not kept.
    pub fn get(&self, key: K, compute: impl FnOnce() -> T) -> T {
        // the lock is free while a value is computed: requests of other keys need not wait
        let value = self.slot(key).get_or_init(compute).clone();
        self.keep_to_bound();
        value
    }

    /// Returns the value of a key if it is kept.
    pub fn kept(&self, key: &K) -> Option<T> {
        self.values().iter().find(|(other, _)| other == key).and_then(|(_, slot)| slot.get().cloned())
    }

    /// Forgets the value of a key, so that the next request computes it.
    pub fn forget(&self, key: &K) {
        self.values().retain(|(other, _)| other != key);
    }

    fn slot(&self, key: K) -> Slot<T> {
        let mut values = self.values();
        let known = values.iter().rposition(|(other, _)| *other == key).and_then(|index| values.remove(index));
        let slot = known.map_or_else(Slot::default, |(_, slot)| slot);
        values.push_back((key, slot.clone()));
        slot
    }

    fn keep_to_bound(&self) {
        let mut values = self.values();
        let weight = |(_, slot): &(K, Slot<T>)| slot.get().map_or(0, self.weight);
        let mut weighs: usize = values.iter().map(weight).sum();
        while weighs > self.most && values.len() > 1 {
            weighs -= values.pop_front().as_ref().map_or(0, weight);
        }
    }

    fn values(&self) -> MutexGuard<'_, VecDeque<(K, Slot<T>)>> {
        // never left half changed: a panic elsewhere does not matter
        self.values.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The most recently requested value stays, and is not computed again.
    #[test]
    fn the_values_that_were_asked_for_last_are_kept() {
        let kept = Cache::new(3, |_| 1);
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
        assert_eq!(kept.values().len(), 3);
        kept.forget(&1);
        assert_eq!(ask(1), 7);
    }

    #[test]
    fn values_weigh_no_more_than_the_bound_together() {
        let kept = Cache::new(10, Vec::len);
        let keep = |key: u32, weight: usize| {
            kept.get(key, || vec![0_u8; weight]);
            kept.values().iter().map(|(key, _)| *key).collect::<Vec<_>>()
        };
        assert_eq!(keep(1, 4), [1]);
        assert_eq!(keep(2, 6), [1, 2]);
        assert_eq!(keep(3, 5), [3]);
        assert_eq!(keep(4, 5), [3, 4]);
        assert_eq!(keep(5, 11), [5], "the newest one stays");
    }
}
