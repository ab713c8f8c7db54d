//! The requests of a device to its caller, kept until a test asks for them.

use std::collections::VecDeque;

use canopen::{Action, Next};

/// The requested actions in order, and whether there are new parameters.
#[derive(Debug, Default)]
pub struct Asked {
    actions: VecDeque<Action>,
    parameters: bool,
}

impl Asked {
    /// Keeps the requests that a call has returned.
    pub fn keep(&mut self, next: Next) {
        self.actions.extend(next.action);
        self.parameters |= next.parameters;
    }

    /// The next action.
    pub fn take_action(&mut self) -> Option<Action> {
        self.actions.pop_front()
    }

    /// Whether there are new parameters; resets the flag.
    pub fn take_parameters(&mut self) -> bool {
        std::mem::take(&mut self.parameters)
    }
}
