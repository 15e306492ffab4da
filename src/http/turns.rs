//! Turns at work of which a limited amount is done at a time: clients take them one after the other.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::extract::Request;
use axum::middleware::Next;
use axum::response::Response;
use tokio::sync::oneshot;

use crate::http::client::Client;
use crate::http::problem::Problem;

tokio::task_local! {
    /// Client whose request is being answered.
    static CLIENT: Client;
}

/// Answers a request for its client, in whose name the answer waits for turns.
pub async fn answer_for(client: Client, request: Request, next: Next) -> Response {
    CLIENT.scope(client, next.run(request)).await
}

/// Line for work of one kind, a limited number of pieces of which are done for requests at the same time.
///
/// The next turn is that of the client for whom least of it runs, and among these of the one whose last turn is longest ago:
/// however much one client requests, another one waits for one turn of each of the others at the most.
pub struct Line(Mutex<State>);

struct State {
    free: usize,
    /// Number of the newest turn or waiting request; they are counted together.
    count: u64,
    /// Clients with work that runs or waits.
    clients: HashMap<Client, OfClient>,
}

#[derive(Default)]
struct OfClient {
    running: usize,
    /// Number of the client's last turn.
    last: u64,
    /// Waiting requests, each with its number, the oldest first.
    waiting: VecDeque<(u64, oneshot::Sender<Turn>)>,
}

/// Turn at the work of a line. Copies are the same turn, which ends when the last of them is dropped.
#[derive(Clone)]
pub struct Turn {
    _running: Arc<Running>,
}

struct Running {
    line: Arc<Line>,
    client: Client,
}

impl Line {
    /// Creates a line in which work is done for `count` requests at the same time.
    pub fn new(count: usize) -> Arc<Self> {
        Arc::new(Self(Mutex::new(State { free: count, count: 0, clients: HashMap::new() })))
    }

    /// Waits for a turn of the client whose request is being answered.
    pub async fn turn(self: &Arc<Self>) -> Result<Turn, Problem> {
        self.turn_of(CLIENT.try_with(|client| *client).unwrap_or_default()).await
    }

    async fn turn_of(self: &Arc<Self>, client: Client) -> Result<Turn, Problem> {
        let coming = {
            let mut state = self.state();
            state.count += 1;
            let count = state.count;
            if state.free > 0 {
                state.begin(client);
                drop(state);
                return Ok(self.running(client));
            }
            let of_client = state.clients.entry(client).or_default();
            // requests whose clients have disconnected do not wait
            of_client.waiting.retain(|(_, waits)| !waits.is_closed());
            let (turn, coming) = oneshot::channel();
            of_client.waiting.push_back((count, turn));
            coming
        };
        // the line, and with it the sender that waits in it, lives at least as long as this call
        coming.await.map_err(|_| Problem::internal())
    }

    fn running(self: &Arc<Self>, client: Client) -> Turn {
        Turn { _running: Arc::new(Running { line: self.clone(), client }) }
    }

    /// Locks the state, even after a panic elsewhere: it is never left half changed.
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn begin(&mut self, client: Client) {
        self.free -= 1;
        let of_client = self.clients.entry(client).or_default();
        of_client.running += 1;
        of_client.last = self.count;
    }

    fn end(&mut self, client: Client) {
        self.free += 1;
        if let Some(of_client) = self.clients.get_mut(&client) {
            of_client.running -= 1;
        }
    }

    /// Begins the turn of the next waiting request, and returns the request.
    fn next(&mut self) -> Option<(Client, oneshot::Sender<Turn>)> {
        self.clients.retain(|_, of_client| {
            of_client.waiting.retain(|(_, waits)| !waits.is_closed());
            of_client.running > 0 || !of_client.waiting.is_empty()
        });
        if self.free == 0 {
            return None;
        }
        let waiting = self.clients.iter_mut().filter(|(_, of_client)| !of_client.waiting.is_empty());
        let rank = |of_client: &OfClient| {
            (of_client.running, of_client.last, of_client.waiting.front().map(|(number, _)| *number))
        };
        let (client, of_client) = waiting.min_by_key(|(_, of_client)| rank(of_client))?;
        let (client, (_, turn)) = (*client, of_client.waiting.pop_front()?);
        self.count += 1;
        self.begin(client);
        Some((client, turn))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let next = {
            let mut state = self.line.state();
            state.end(self.client);
            state.next()
        };
        if let Some((client, turn)) = next {
            // one that has gone in this moment drops its turn, and the next one's comes
            let _ = turn.send(self.line.running(client));
        }
    }
}

#[cfg(test)]
mod tests {
    use futures::FutureExt;

    use super::*;

    fn client(number: u8) -> Client {
        Client::at(([192, 0, 2, number], 1).into())
    }

    /// Returns the names of requests that wait in a line of one turn, in the order in which their turns come.
    fn order(line: &Arc<Line>, waiting: &[(u8, &'static str)]) -> Vec<&'static str> {
        let mut all: Vec<_> =
            waiting.iter().map(|(number, name)| (*name, Box::pin(line.clone().turn_owned(client(*number))))).collect();
        // all wait, in this order
        let mut turns: Vec<_> = all.iter_mut().map(|(_, turn)| turn.now_or_never()).collect();
        assert_eq!(turns.iter().filter(|turn| turn.is_some()).count(), 1);
        let mut order = Vec::new();
        loop {
            let begun = turns.iter().position(Option::is_some);
            let Some(begun) = begun else { return order };
            order.push(all[begun].0);
            drop(turns[begun].take());
            for (turn, (name, waits)) in turns.iter_mut().zip(&mut all) {
                if turn.is_none() && !order.contains(name) {
                    *turn = waits.now_or_never();
                }
            }
        }
    }

    impl Line {
        async fn turn_owned(self: Arc<Self>, client: Client) -> Turn {
            self.turn_of(client).await.unwrap()
        }
    }

    #[test]
    fn clients_take_turns_however_much_one_asks_for() {
        let line = Line::new(1);
        let order = order(&line, &[(1, "a1"), (1, "a2"), (1, "a3"), (1, "a4"), (2, "b1"), (2, "b2"), (3, "c1")]);
        assert_eq!(order, ["a1", "b1", "c1", "a2", "b2", "a3", "a4"]);
        let state = line.state();
        assert_eq!((state.free, state.clients.len()), (1, 0));
    }

    #[test]
    fn a_client_for_whom_nothing_runs_comes_before_one_for_whom_something_does() {
        let line = Line::new(2);
        let now = |number: u8| line.turn_of(client(number)).now_or_never();
        let (first, second) = (now(1).unwrap().unwrap(), now(1).unwrap().unwrap());
        let mut own = Box::pin(line.turn_of(client(1)));
        assert!((&mut own).now_or_never().is_none());
        let mut other = Box::pin(line.turn_of(client(2)));
        assert!((&mut other).now_or_never().is_none());
        drop(first);
        assert!((&mut own).now_or_never().is_none());
        let other = (&mut other).now_or_never().unwrap();
        // a copy is the same turn
        let copy = second.clone();
        drop(second);
        assert!((&mut own).now_or_never().is_none());
        drop(copy);
        assert!((&mut own).now_or_never().is_some());
        drop(other);
    }

    #[test]
    fn who_has_gone_has_no_turn() {
        let line = Line::new(1);
        let first = line.turn_of(client(1)).now_or_never().unwrap();
        for _ in 0..100 {
            assert!(line.turn_of(client(1)).now_or_never().is_none());
        }
        assert!(line.state().clients[&client(1)].waiting.len() <= 2);
        let mut last = Box::pin(line.turn_of(client(2)));
        assert!((&mut last).now_or_never().is_none());
        drop(first);
        assert!((&mut last).now_or_never().is_some());
    }
}
