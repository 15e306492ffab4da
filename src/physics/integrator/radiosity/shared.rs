//! Exchanges of one room that several methods share: those of the parts of its light.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::Exchange;
use crate::sampling::Key;
use crate::traceable::{SurfacePoint, TraceableScene};

/// Cost of a solution as a fraction of that of its exchange.
const COST_OF_SOLUTION: f64 = 0.05;

/// Exchanges of a room, each computed when it is first asked for.
#[derive(Debug)]
pub struct SharedExchanges {
    scene: Arc<TraceableScene>,
    /// Number of methods that share them.
    methods: f64,
    /// Exchanges by what they are computed from; `None` where no light is reflected.
    made: Mutex<Vec<(u64, Option<Arc<Exchange>>)>>,
}

impl SharedExchanges {
    /// Makes exchanges of the room of a scene, which has all light that some of these `methods` compute.
    pub fn new(scene: &Arc<TraceableScene>, methods: usize) -> Self {
        Self { scene: scene.clone(), methods: methods.max(1) as f64, made: Mutex::default() }
    }

    /// Returns the cost of an exchange of so many rays for each of its methods: its part of the rays, and a solution of its own.
    pub fn cost(&self, rays: f64) -> f64 {
        rays * (1.0 / self.methods + COST_OF_SOLUTION).min(1.0)
    }

    /// Returns what [`Exchange::new`] computes for the room; `None` when cancelled, too.
    pub fn exchange(
        &self,
        with_clear_zones: bool,
        starts: &[SurfacePoint],
        edge: f64,
        (random, cancel): (Key, &AtomicBool),
    ) -> Option<Arc<Exchange>> {
        let mut hasher = DefaultHasher::new();
        (with_clear_zones, edge.to_bits(), random).hash(&mut hasher);
        for start in starts {
            [start.position, start.normal].map(|of| of.to_array().map(f64::to_bits)).hash(&mut hasher);
        }
        let key = hasher.finish();
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, exchange)) = made.iter().find(|(of, _)| *of == key) {
            return exchange.clone();
        }
        let exchange = Exchange::new((&self.scene, with_clear_zones), starts, edge, (random, cancel)).map(Arc::new);
        // one that was cancelled may be asked for again
        if exchange.is_some() || !cancel.load(Ordering::Relaxed) {
            made.push((key, exchange.clone()));
        }
        exchange
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::optics::Surface;
    use crate::traceable::test_rooms::{compiled, empty};

    /// Checks that what is asked for again is computed once, other starts, edges or random numbers are not taken for it, and one that was
    /// cancelled is computed later.
    #[test]
    fn the_same_exchange_is_computed_once() {
        let scene = Arc::new(compiled(&empty(DVec3::new(4.0, 3.0, 2.5), Some(Surface::diffuse([0.5; 3])))));
        let shared = SharedExchanges::new(&scene, 2);
        let start = |x: f64| SurfacePoint { position: DVec3::new(x, 1.0, 0.8), normal: DVec3::Z, surface: None };
        let cancel = AtomicBool::new(true);
        let of = |x: f64, edge: f64, seed: u64| shared.exchange(false, &[start(x)], edge, (Key::new(seed), &cancel));
        assert!(of(1.0, 0.5, 1).is_none());
        cancel.store(false, Ordering::Relaxed);
        let of = |x: f64, edge: f64, seed: u64| of(x, edge, seed).unwrap();
        let first = of(1.0, 0.5, 1);
        assert!(Arc::ptr_eq(&first, &of(1.0, 0.5, 1)));
        assert!([of(1.5, 0.5, 1), of(1.0, 0.4, 1), of(1.0, 0.5, 2)].iter().all(|other| !Arc::ptr_eq(&first, other)));
    }
}
