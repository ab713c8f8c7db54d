//! The mends, and how to take each back.
//!
//! A row: the finding, the rule by which the monitor reports the fault, the scenario of
//! `host-tests/tests/scenarios`, and the edits that bring the fault back. The text of a mend must be in its file once.

/// A mend.
pub(super) struct Mend {
    /// The finding, or what is broken.
    pub(super) finding: &'static str,
    /// The name of the rule.
    pub(super) rule: &'static str,
    /// The scenario: `file::test`.
    pub(super) scenario: &'static str,
    pub(super) edits: &'static [Edit],
}

/// A change of one file.
pub(super) struct Edit {
    /// The file, from the root of the workspace.
    pub(super) file: &'static str,
    /// The present text.
    pub(super) mended: &'static str,
    /// The text that brings the fault back.
    pub(super) fault: &'static str,
}

pub(super) const MENDS: &[Mend] = &[
    Mend {
        finding: "inhibit",
        rule: "inhibit-time",
        scenario: "inhibit::an_inhibit_time_separates_events",
        edits: &[Edit {
            file: "crates/canopen/src/pdo/tpdo.rs",
            mended: "self.inhibited_until = context.now + Duration::from_inhibit(*inhibit);",
            fault: "self.inhibited_until = context.now + Duration::from_inhibit(*inhibit / 2);",
        }],
    },
    Mend {
        finding: "toggle",
        rule: "sdo-protocol",
        scenario: "transfers::a_text_is_read_in_segments",
        edits: &[Edit {
            file: "crates/canopen/src/sdo/segmented.rs",
            mended: "Ok(Segment { toggle: requested, last",
            fault: "Ok(Segment { toggle: !requested, last",
        }],
    },
];
