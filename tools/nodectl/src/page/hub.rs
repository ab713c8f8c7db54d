//! The connected pages, and the messages that wait for each. The queues are bounded, so that a slow page needs limited
//! memory.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::Notify;

/// Bytes that may wait for a page before events for it are dropped.
const ROOM: usize = 512 * 1024;
/// The number of pages that may be connected at the same time, and how many of them without the token.
const PAGES: usize = 32;
const READERS: usize = 24;
/// Bytes that may wait for a page at all. A page with more waiting answers is disconnected.
const MOST: usize = 16 * 1024 * 1024;

/// The number of a page while it is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PageId(u64);

impl PageId {
    /// The page with this number, for tests.
    #[must_use]
    pub const fn new(number: u64) -> PageId {
        PageId(number)
    }
}

/// An action of a page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FromPage {
    /// The page has connected.
    Came {
        /// The page.
        page: PageId,
        /// Whether the page may change something.
        writes: bool,
    },
    /// The page has sent a message.
    Said {
        /// The page.
        page: PageId,
        /// The text of the message, which need not be valid.
        text: String,
    },
    /// The page has disconnected.
    Left {
        /// The page.
        page: PageId,
    },
}

/// All connected pages.
#[derive(Default)]
pub struct Hub {
    pages: Mutex<Pages>,
}

#[derive(Default)]
struct Pages {
    next: u64,
    outboxes: BTreeMap<PageId, Arc<Outbox>>,
    /// The pages without the token.
    readers: BTreeSet<PageId>,
}

/// The queue of one page.
#[derive(Default)]
pub(crate) struct Outbox {
    waiting: Mutex<Waiting>,
    news: Notify,
}

#[derive(Default)]
struct Waiting {
    texts: VecDeque<String>,
    bytes: usize,
    is_closed: bool,
}

/// The next action for a page.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Next {
    Text(String),
    Close,
}

impl Hub {
    /// Puts a text into the queue of a page. Nothing happens when there is no such page.
    pub fn send(&self, page: PageId, text: String) {
        if let Some(outbox) = self.outbox(page) {
            outbox.push(text);
        }
    }

    /// Whether the queue of a page has room for an event.
    #[must_use]
    pub fn has_room(&self, page: PageId) -> bool {
        self.outbox(page).is_some_and(|outbox| outbox.waiting().bytes < ROOM)
    }

    /// Disconnects a page after its queue is sent.
    pub fn close(&self, page: PageId) {
        if let Some(outbox) = self.outbox(page) {
            outbox.waiting().is_closed = true;
            outbox.news.notify_one();
        }
    }

    /// A place for a new page; `None` when there are too many.
    pub(crate) fn enter(&self, writes: bool) -> Option<(PageId, Arc<Outbox>)> {
        let mut pages = self.pages();
        if pages.outboxes.len() == PAGES || (!writes && pages.readers.len() == READERS) {
            return None;
        }
        pages.next += 1;
        let (page, outbox) = (PageId(pages.next), Arc::new(Outbox::default()));
        pages.outboxes.insert(page, Arc::clone(&outbox));
        if !writes {
            pages.readers.insert(page);
        }
        Some((page, outbox))
    }

    pub(crate) fn leave(&self, page: PageId) {
        let mut pages = self.pages();
        pages.outboxes.remove(&page);
        pages.readers.remove(&page);
    }

    fn outbox(&self, page: PageId) -> Option<Arc<Outbox>> {
        self.pages().outboxes.get(&page).cloned()
    }

    /// Locks the pages. A poisoned lock is ignored: no code panics while it holds the lock, and the lists would still
    /// be consistent.
    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.pages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Outbox {
    fn push(&self, text: String) {
        let mut waiting = self.waiting();
        if waiting.bytes + text.len() > MOST {
            (waiting.texts, waiting.is_closed) = (VecDeque::new(), true);
        } else if !waiting.is_closed {
            waiting.bytes += text.len();
            waiting.texts.push_back(text);
        }
        drop(waiting);
        self.news.notify_one();
    }

    /// Waits for the next action.
    pub(crate) async fn next(&self) -> Next {
        loop {
            if let Some(next) = self.take() {
                return next;
            }
            self.news.notified().await;
        }
    }

    fn take(&self) -> Option<Next> {
        let mut waiting = self.waiting();
        match waiting.texts.pop_front() {
            Some(text) => {
                waiting.bytes -= text.len();
                Some(Next::Text(text))
            }
            None => waiting.is_closed.then_some(Next::Close),
        }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_that_does_not_read_has_no_room_and_at_last_is_let_go() {
        let hub = Hub::default();
        let (page, outbox) = hub.enter(true).unwrap();
        assert!(hub.has_room(page));
        hub.send(page, "x".repeat(ROOM));
        assert!(!hub.has_room(page));
        let answers = (MOST - ROOM) / ROOM;
        (0..answers).for_each(|_| hub.send(page, "x".repeat(ROOM)));
        assert!(matches!(outbox.take(), Some(Next::Text(_))), "answers wait");
        (0..2).for_each(|_| hub.send(page, "x".repeat(ROOM)));
        assert_eq!(outbox.take(), Some(Next::Close));
    }

    #[test]
    fn pages_come_and_go_each_with_its_own_texts() {
        let hub = Hub::default();
        let ((one, first), (two, second)) = (hub.enter(true).unwrap(), hub.enter(false).unwrap());
        hub.send(one, "a".into());
        hub.send(two, "b".into());
        hub.leave(one);
        hub.send(one, "c".into());
        hub.close(two);
        assert_eq!((first.take(), first.take()), (Some(Next::Text("a".into())), None));
        assert_eq!((second.take(), second.take()), (Some(Next::Text("b".into())), Some(Next::Close)));
        assert!(!hub.has_room(one));
    }

    #[test]
    fn places_are_limited_and_a_closed_page_makes_room() {
        let hub = Hub::default();
        let pages: Vec<PageId> = (0..READERS).map(|_| hub.enter(false).unwrap().0).collect();
        assert!(hub.enter(false).is_none());
        let with_token: Vec<PageId> = (READERS..PAGES).map(|_| hub.enter(true).unwrap().0).collect();
        assert!(hub.enter(true).is_none());
        hub.leave(pages[0]);
        assert!(hub.enter(false).is_some_and(|(page, _)| !pages.contains(&page)));
        hub.leave(with_token[0]);
        assert!(hub.enter(false).is_none() && hub.enter(true).is_some());
    }
}
