//! Calls of a lift panel: checks whether the frames on the bus report every transition of the buttons.

/// A button that was pressed or released.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transition {
    /// The instant in microseconds.
    pub at: u64,
    /// The number of the button, from 0 on.
    pub button: usize,
    /// Whether it is pressed now.
    pub is_pressed: bool,
}

/// How the log reports the transitions of a panel's two buttons.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Verdict {
    /// Transitions that are reported individually, in order.
    pub told: usize,
    /// Transitions that are covered by a full state.
    pub covered: usize,
    /// Full states: one word for each button, in order.
    pub full_states: usize,
}

/// Checks a log against the transitions. Every transition is reported once and in order, or is covered by a later full
/// state. A word of the log was formed at most `lag` microseconds after the latest transition that it contains.
///
/// Among several interpretations of the log, the one with the fewest full states counts.
///
/// # Errors
/// The first word without an explanation, or the number of transitions that are missing at the end of the log.
pub fn verify(transitions: &[Transition], log: &[Transition], lag: u64) -> Result<Verdict, String> {
    // The possible states after each word: the next transition to report, and whether the second half of a full state
    // is due.
    let mut possible = vec![(0_usize, false, Verdict::default())];
    for (place, word) in log.iter().enumerate() {
        let made = transitions.partition_point(|transition| transition.at <= word.at);
        let known = transitions.partition_point(|transition| transition.at + lag <= word.at);
        let mut next: Vec<(usize, bool, Verdict)> = vec![];
        for &(told, is_half, verdict) in &possible {
            let mut add = |state: (usize, bool, Verdict)| match next
                .iter_mut()
                .find(|other| (other.0, other.1) == (state.0, state.1))
            {
                Some(other) if other.2.full_states <= state.2.full_states => {}
                Some(other) => *other = state,
                None => next.push(state),
            };
            let follows = transitions[told..made].first();
            if follows.is_some_and(|other| (other.button, other.is_pressed) == (word.button, word.is_pressed))
            {
                add((told + 1, is_half, Verdict { told: verdict.told + 1, ..verdict }));
            }
            let is_so = |at: usize| level(&transitions[..at], word.button) == word.is_pressed;
            if is_half && word.button == 1 && is_so(told) {
                add((told, false, verdict));
            }
            for at in told.max(known)..=made {
                // A start may interrupt a full state; a new full state then begins.
                if word.button == 0 && is_so(at) {
                    let covered = verdict.covered + at - told;
                    add((at, true, Verdict { covered, full_states: verdict.full_states + 1, ..verdict }));
                }
            }
        }
        if next.is_empty() {
            let told = possible.iter().map(|(told, ..)| *told).max().unwrap_or(0);
            let around = &transitions[told.saturating_sub(4)..transitions.len().min(told + 4)];
            let before = &log[place.saturating_sub(8)..place];
            return Err(format!(
                "word {place} of {}: {word:?} after {before:#?}, {possible:?}; what happened: {around:#?}",
                log.len()
            ));
        }
        possible = next;
    }
    let complete = possible.iter().filter(|(told, is_half, _)| *told == transitions.len() && !is_half);
    let best = complete.map(|(.., verdict)| *verdict).min_by_key(|verdict| verdict.full_states);
    best.ok_or_else(|| format!("of {} transitions the log ends with {possible:?}", transitions.len()))
}

/// Whether the button is pressed after these transitions.
fn level(transitions: &[Transition], button: usize) -> bool {
    let last = transitions.iter().rev().find(|transition| transition.button == button);
    last.is_some_and(|transition| transition.is_pressed)
}

#[cfg(test)]
mod tests {
    use super::*;

    const fn at(at: u64, button: usize, is_pressed: bool) -> Transition {
        Transition { at, button, is_pressed }
    }

    const HAPPENED: [Transition; 4] = [at(10, 0, true), at(20, 1, true), at(30, 0, false), at(40, 1, false)];

    fn later(transition: Transition) -> Transition {
        Transition { at: transition.at + 100, ..transition }
    }

    #[test]
    fn events_reported_once_and_in_order_are_accepted() {
        let log = HAPPENED.map(later);
        let expected = Verdict { told: 4, covered: 0, full_states: 0 };
        assert_eq!(verify(&HAPPENED, &log, 100), Ok(expected));
    }

    #[test]
    fn a_word_that_is_missing_twice_or_too_early_is_not() {
        // The last transition prevents the interpretation of the words before it as a full state.
        let more = [HAPPENED[0], HAPPENED[1], HAPPENED[2], HAPPENED[3], at(50, 0, true)];
        assert!(verify(&more, &more.map(later), 0).is_ok());
        for missing in 0..5 {
            let mut log = more.map(later).to_vec();
            log.remove(missing);
            assert!(verify(&more, &log, 0).is_err(), "without {missing}");
        }
        let log = HAPPENED.map(later);
        let mut twice = log.to_vec();
        twice.insert(1, log[0]);
        assert!(verify(&HAPPENED, &twice, 0).is_err());
        assert!(verify(&HAPPENED, &[log[1], log[0], log[2], log[3]], 0).is_err(), "another order");
        assert!(
            verify(&HAPPENED, &[at(5, 0, true), log[1], log[2], log[3]], 0).is_err(),
            "before it happened"
        );
    }

    #[test]
    fn a_full_state_covers_the_events_before_it() {
        let log = [later(HAPPENED[0]), at(200, 0, false), at(200, 1, false)];
        let expected = Verdict { told: 1, covered: 3, full_states: 1 };
        assert_eq!(verify(&HAPPENED, &log, 10), Ok(expected));
        assert!(verify(&HAPPENED, &log[..2], 10).is_err(), "half of it");
        assert!(verify(&HAPPENED, &[log[0], log[1], at(200, 1, true)], 10).is_err(), "a wrong state");
    }
}
