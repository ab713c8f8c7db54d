//! What a device has left to its caller, until a test asks for it.

use std::collections::VecDeque;

use canopen::{Action, Next};

/// Actions in their order, and whether there are new parameters.
#[derive(Debug, Default)]
pub struct Asked {
    actions: VecDeque<Action>,
    parameters: bool,
}

impl Asked {
    /// Keeps what follows from a call.
    pub fn keep(&mut self, next: Next) {
        self.actions.extend(next.action);
        self.parameters |= next.parameters;
    }

    /// The next action.
    pub fn take_action(&mut self) -> Option<Action> {
        self.actions.pop_front()
    }

    /// Whether there are new parameters; once.
    pub fn take_parameters(&mut self) -> bool {
        std::mem::take(&mut self.parameters)
    }
}
