//! Places that clients take, with limits in all and for each client.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use metrics::counter;

use crate::http::client::Client;
use crate::http::problem::Problem;
use crate::http::problem_kind::ProblemKind;

/// Seconds after which a client that found no place may ask again.
const AGAIN_SECONDS: u32 = 5;

/// Places of one kind. A place is given at once or refused: clients do not wait for one.
pub struct Places {
    /// Name of the setting that limits all places; with the suffix `_per_client`, of the setting that limits those of a client.
    setting: &'static str,
    /// Name of the things that take places, in the plural.
    what: &'static str,
    most: usize,
    most_of_client: usize,
    taken: Mutex<Taken>,
}

#[derive(Default)]
struct Taken {
    in_all: usize,
    /// Number of places of each client; clients without places are not in it.
    of_clients: HashMap<Client, usize>,
}

/// Places that a client holds; they are freed when this is dropped.
pub struct Place {
    places: Arc<Places>,
    client: Client,
    count: usize,
}

/// Error when no place is free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Full {
    what: &'static str,
    most: usize,
    /// Owner whose places are all taken.
    pub whose: Whose,
}

/// Owners of places: one client, or all clients of the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whose {
    Client,
    Service,
}

/// Counts a refusal by a limit. Refusals are reported by numbers and not logged, lest a client fills the log.
pub fn count_refusal(setting: &'static str, whose: Whose) {
    let of = match whose {
        Whose::Client => "client",
        Whose::Service => "service",
    };
    counter!("skyduct_refused_total", "limit" => setting, "of" => of).increment(1);
}

impl Places {
    pub fn new(setting: &'static str, what: &'static str, most: usize, most_of_client: usize) -> Arc<Self> {
        Arc::new(Self { setting, what, most, most_of_client, taken: Mutex::default() })
    }

    /// Takes a place for a client.
    pub fn take(self: &Arc<Self>, client: Client) -> Result<Place, Full> {
        let mut place = self.none(client);
        place.take(1)?;
        Ok(place)
    }

    /// Returns a [`Place`] without places yet, for a client that will take as many as it turns out to need.
    pub fn none(self: &Arc<Self>, client: Client) -> Place {
        Place { places: self.clone(), client, count: 0 }
    }

    /// Returns the number of places that are taken.
    pub fn taken(&self) -> usize {
        self.lock().in_all
    }

    fn lock(&self) -> MutexGuard<'_, Taken> {
        // counts are never left half changed
        self.taken.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Place {
    /// Takes `count` more places, all or none.
    pub fn take(&mut self, count: usize) -> Result<(), Full> {
        let places = &self.places;
        let mut taken = places.lock();
        let of_client = taken.of_clients.get(&self.client).copied().unwrap_or(0);
        let full = |most: usize, whose: Whose| {
            count_refusal(places.setting, whose);
            Err(Full { what: places.what, most, whose })
        };
        if of_client.saturating_add(count) > places.most_of_client {
            return full(places.most_of_client, Whose::Client);
        }
        if taken.in_all.saturating_add(count) > places.most {
            return full(places.most, Whose::Service);
        }
        taken.in_all += count;
        taken.of_clients.insert(self.client, of_client + count);
        self.count += count;
        Ok(())
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut taken = self.places.lock();
        taken.in_all -= self.count;
        if let Some(of_client) = taken.of_clients.get_mut(&self.client) {
            *of_client -= self.count;
            if *of_client == 0 {
                taken.of_clients.remove(&self.client);
            }
        }
    }
}

impl From<Full> for Problem {
    fn from(full: Full) -> Self {
        let Full { what, most, whose } = full;
        match whose {
            Whose::Client => Self::new(
                ProblemKind::TooMany,
                format!("this client has reached its limit of {most} {what} at the same time; try again later"),
            )
            .retry_after(AGAIN_SECONDS),
            Whose::Service => Self::unavailable(format!(
                "the service has reached its limit of {most} {what} at the same time; try again later"
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(number: u8) -> Client {
        Client::at(([192, 0, 2, number], 1).into())
    }

    #[test]
    fn one_client_cannot_take_all_and_places_come_back() {
        let places = Places::new("streams", "event streams", 3, 2);
        let of_first = [places.take(client(1)).unwrap(), places.take(client(1)).unwrap()];
        assert!(places.take(client(1)).is_err_and(|full| full.whose == Whose::Client));
        let of_second = places.take(client(2)).unwrap();
        assert_eq!(places.taken(), 3);
        assert!(places.take(client(2)).is_err_and(|full| full.whose == Whose::Service));
        drop(of_first);
        assert_eq!(places.taken(), 1);
        drop(of_second);
        let mut bytes = places.none(client(1));
        bytes.take(2).unwrap();
        assert!(bytes.take(1).is_err());
        drop(bytes);
        assert_eq!((places.taken(), places.lock().of_clients.len()), (0, 0));
    }
}
