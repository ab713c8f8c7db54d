//! The places for connections that are no WebSocket yet. A new connection always gets a place: when no place is left, the
//! oldest connection that has not shown the token is closed.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::task::AbortHandle;

/// The number of connections that may be open at the same time. A browser opens up to six for a page.
const CONNECTIONS: usize = 128;

/// All open connections, the oldest first.
#[derive(Clone, Default)]
pub(crate) struct Places(Arc<Mutex<Vec<Open>>>);

/// The place of one connection, which is free again when this value is dropped.
pub(crate) struct Place {
    places: Places,
    number: u64,
}

struct Open {
    number: u64,
    /// A request of the connection had the token.
    has_token: bool,
    task: AbortHandle,
}

impl Places {
    /// A place for a new connection, which `task` serves. `number` is greater than those of all connections before.
    pub(crate) fn enter(&self, number: u64, task: AbortHandle) {
        let mut open = self.open();
        if open.len() >= CONNECTIONS {
            let stranger = open.iter().position(|open| !open.has_token).unwrap_or(0);
            open.remove(stranger).task.abort();
        }
        open.push(Open { number, has_token: false, task });
    }

    /// The place of the connection with this number.
    pub(crate) fn of(&self, number: u64) -> Place {
        Place { places: self.clone(), number }
    }

    /// Locks the list. A poisoned lock is ignored: no code panics while it holds the lock.
    fn open(&self) -> MutexGuard<'_, Vec<Open>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Place {
    /// Notes that the connection has shown the token.
    pub(crate) fn trust(&self) {
        let mut open = self.places.open();
        open.iter_mut().filter(|open| open.number == self.number).for_each(|open| open.has_token = true);
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.open().retain(|open| open.number != self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_oldest_connection_without_the_token_makes_room() {
        let places = Places::default();
        let tasks: Vec<_> =
            (0..CONNECTIONS + 2).map(|_| tokio::spawn(std::future::pending::<()>())).collect();
        let enter = |number: usize| {
            places.enter(number as u64, tasks[number].abort_handle());
            places.of(number as u64)
        };
        let first = enter(0);
        first.trust();
        let rest: Vec<Place> = (1..CONNECTIONS).map(enter).collect();
        let newest = [enter(CONNECTIONS), enter(CONNECTIONS + 1)];
        tokio::task::yield_now().await;
        let closed: Vec<usize> = (0..tasks.len()).filter(|number| tasks[*number].is_finished()).collect();
        assert_eq!(closed, [1, 2]);
        drop((first, rest, newest));
        assert!(places.open().is_empty());
    }
}
