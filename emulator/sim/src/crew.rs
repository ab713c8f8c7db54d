//! The threads that run the boards. Between two events of the bus no board depends on another one, so each thread runs
//! its own boards, and always the same ones: the caches of its core keep their code. The result does not depend on the
//! number of threads.

use std::any::Any;
use std::cell::UnsafeCell;
use std::hint;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::thread::{self, JoinHandle, Thread};

use canbus::Time;

use crate::board::{Board, Turn};

/// Looks at the state before a thread goes to sleep. A turn takes some microseconds, less than to wake a thread.
const LOOKS: u32 = 2000;

/// States of a helper.
const IDLE: u8 = 0;
const WORKING: u8 = 1;
const QUITTING: u8 = 2;

/// The threads besides the one that owns the boards.
#[derive(Default)]
pub(crate) struct Crew {
    helpers: Vec<Helper>,
}

struct Helper {
    line: Arc<Line>,
    thread: Option<JoinHandle<()>>,
}

/// The memory that a helper and the owner of the boards share. The state says who may touch the rest: the helper while it is
/// [`WORKING`], the owner otherwise. Its alignment keeps the lines of two helpers in different lines of the caches.
#[repr(align(128))]
struct Line {
    state: AtomicU8,
    job: UnsafeCell<Option<Job>>,
    outcome: UnsafeCell<thread::Result<Time>>,
}

// SAFETY: the owner of the boards waits until a helper is idle before it touches the cells, and a helper touches them
// only while it works. The state is written with release and read with acquire ordering.
unsafe impl Sync for Line {}
// SAFETY: as above; the boards in a job are reached by one thread at a time.
unsafe impl Send for Line {}

/// The share of one thread in a turn.
struct Job {
    boards: *mut Board,
    count: usize,
    /// The thread's boards: this one, and every `stride`-th one after it.
    first: usize,
    stride: usize,
    turn: Turn,
    owner: Thread,
}

impl Crew {
    /// A crew of `threads` threads, the owner of the boards among them.
    pub(crate) fn new(threads: usize) -> Crew {
        Crew { helpers: (1..threads).map(|_| Helper::start()).collect() }
    }

    /// Runs the owner's share of the boards, and has the helpers run theirs. Returns the earliest instant that a board
    /// has reached; `rested` is called when the owner has nothing left to do but wait.
    pub(crate) fn run(&mut self, boards: &mut [Board], turn: Turn, rested: impl FnOnce()) -> Time {
        let (count, stride) = (boards.len(), self.helpers.len() + 1);
        let is_awake = |first: usize| {
            boards.iter().skip(first).step_by(stride).any(|board| board.next_event() <= turn.limit)
        };
        let awake: Vec<bool> = (0..stride).map(is_awake).collect();
        let boards = boards.as_mut_ptr();
        let owner = thread::current();
        let share = |first| Job { boards, count, first, stride, turn, owner: owner.clone() };
        for (number, helper) in self.helpers.iter().enumerate().filter(|(number, _)| awake[number + 1]) {
            helper.begin(share(number + 1));
        }
        let own = (0..stride).filter(|&first| first == 0 || !awake[first]);
        // SAFETY: no helper has these boards, and `boards` is borrowed until all helpers are idle.
        let reached =
            panic::catch_unwind(AssertUnwindSafe(|| own.map(|first| unsafe { share(first).run() }).min()));
        rested();
        let others = self.helpers.iter().enumerate().filter(|(number, _)| awake[number + 1]);
        let outcomes: Vec<thread::Result<Time>> = others.map(|(_, helper)| helper.end()).collect();
        let reached = reached.unwrap_or_else(|payload| panic::resume_unwind(payload));
        outcomes.into_iter().fold(reached.unwrap_or(turn.limit), |reached, outcome| {
            reached.min(outcome.unwrap_or_else(|payload| panic::resume_unwind(payload)))
        })
    }
}

impl Job {
    /// # Safety
    /// No other thread uses the boards of this share.
    unsafe fn run(&self) -> Time {
        let own = (self.first..self.count).step_by(self.stride);
        // SAFETY: the numbers are below the count, and the boards are this thread's alone. What a board shares with
        // another one, its images, is not touched while the board runs; the CPU library keeps all state in its handle.
        own.map(|number| unsafe { &mut *self.boards.add(number) }.run(self.turn))
            .fold(self.turn.limit, Time::min)
    }
}

impl Helper {
    fn start() -> Helper {
        let line = Arc::new(Line {
            state: AtomicU8::new(IDLE),
            job: UnsafeCell::new(None),
            outcome: UnsafeCell::new(Ok(Time::NEVER)),
        });
        let own = Arc::clone(&line);
        let thread = thread::spawn(move || own.work());
        Helper { line, thread: Some(thread) }
    }

    fn begin(&self, job: Job) {
        // SAFETY: the helper is idle, as it was new or has been waited for.
        unsafe { *self.line.job.get() = Some(job) };
        self.tell(WORKING);
    }

    fn tell(&self, state: u8) {
        self.line.state.store(state, Ordering::Release);
        self.thread.iter().for_each(|thread| thread.thread().unpark());
    }

    fn end(&self) -> thread::Result<Time> {
        self.line.wait_while(WORKING);
        // SAFETY: the helper is idle.
        std::mem::replace(unsafe { &mut *self.line.outcome.get() }, Ok(Time::NEVER))
    }
}

impl Drop for Helper {
    fn drop(&mut self) {
        self.tell(QUITTING);
        // A panic of the helper's boards was passed on already.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

impl Line {
    fn work(&self) {
        loop {
            self.wait_while(IDLE);
            if self.state.load(Ordering::Acquire) == QUITTING {
                return;
            }
            // SAFETY: this is the helper, and it works.
            let Some(job) = (unsafe { (*self.job.get()).take() }) else { return };
            // SAFETY: the owner of the boards gives each share to one thread.
            let run = AssertUnwindSafe(|| unsafe { job.run() });
            let outcome: Result<Time, Box<dyn Any + Send>> = panic::catch_unwind(run);
            // SAFETY: as above.
            unsafe { *self.outcome.get() = outcome };
            self.state.store(IDLE, Ordering::Release);
            job.owner.unpark();
        }
    }

    fn wait_while(&self, state: u8) {
        let lasts = || self.state.load(Ordering::Acquire) == state;
        for _ in 0..LOOKS {
            if !lasts() {
                return;
            }
            hint::spin_loop();
        }
        while lasts() {
            thread::park();
        }
    }
}
