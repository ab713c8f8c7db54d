//! The turn of a running job: the pump lets it wait between two transfers, or ends it there.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use crate::network::Gate;

/// The state of a job, shared by its thread and the pump.
#[derive(Debug, Default)]
pub(super) struct Turn {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Runs,
    /// The job stops before its next transfer.
    IsToWait,
    Waits,
    /// The job ends before its next transfer.
    Ended,
}

impl Turn {
    /// Lets the job wait before its next transfer.
    pub(super) fn hold(&self) {
        let mut state = self.state();
        if *state == State::Runs {
            *state = State::IsToWait;
        }
    }

    /// Lets the job continue.
    pub(super) fn resume(&self) {
        let mut state = self.state();
        if *state != State::Ended {
            *state = State::Runs;
        }
        self.changed.notify_all();
    }

    /// Ends the job before its next transfer.
    pub(super) fn end(&self) {
        *self.state() = State::Ended;
        self.changed.notify_all();
    }

    /// Whether the job has stopped between two transfers.
    pub(super) fn is_waiting(&self) -> bool {
        *self.state() == State::Waits
    }

    /// Called by the job before a transfer. `stopped` is called when the job has to wait.
    pub(super) fn pass(&self, stopped: impl FnOnce()) -> Gate {
        let mut state = self.state();
        if *state == State::IsToWait {
            *state = State::Waits;
            stopped();
            let waiting = self.changed.wait_while(state, |state| *state == State::Waits);
            state = waiting.unwrap_or_else(PoisonError::into_inner);
            // A job that has to stop again stops before the transfer after this one.
            return if *state == State::Ended { Gate::Closed } else { Gate::Waited };
        }
        if *state == State::Ended { Gate::Closed } else { Gate::Open }
    }

    /// Locks the state. A poisoned lock is ignored: the state is always one of its values.
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_waits_and_continues_or_ends() {
        let turn = Turn::default();
        assert_eq!(turn.pass(|| unreachable!()), Gate::Open);
        for (act, expected) in [(Turn::resume as fn(&Turn), Gate::Waited), (Turn::end, Gate::Closed)] {
            turn.hold();
            assert!(!turn.is_waiting(), "a transfer may run");
            let passed = std::thread::scope(|scope| {
                let job = scope.spawn(|| turn.pass(|| ()));
                while !turn.is_waiting() {
                    std::thread::yield_now();
                }
                act(&turn);
                job.join().unwrap()
            });
            assert_eq!(passed, expected);
        }
        turn.resume();
        assert_eq!(turn.pass(|| unreachable!()), Gate::Closed, "an end is final");
    }
}
