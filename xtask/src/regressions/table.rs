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

/// A deadline in the past reaches the caller.
const PAST_DEADLINES: Edit = Edit {
    file: "crates/canopen/src/device/process.rs",
    mended: "self.process_due = due.max(context.now.plus(Span(1)));",
    fault: "self.process_due = due;",
};

/// PDOs take the whole bus.
const NO_SHARE: &[Edit] = &[Edit {
    file: "crates/canopen/src/pdo/budget.rs",
    mended: "self.credit >= self.enough || self.admits_scarce(id, len, now)",
    fault: "true || self.admits_scarce(id, len, now)",
}];

/// A write that cannot be stored is refused after its effect.
const CHECK_AFTER_EFFECT: &[Edit] = &[
    Edit {
        file: "crates/canopen/src/device/objects.rs",
        mended: "let job = self.job_of(entry)?;",
        fault: "let job = self.job_of(entry);",
    },
    Edit {
        file: "crates/canopen/src/device/objects.rs",
        mended: "job.map_or(Ok(()), |job| self.begin_deferred(job))",
        fault: "job?.map_or(Ok(()), |job| self.begin_deferred(job))",
    },
];

pub(super) const MENDS: &[Mend] = &[
    Mend {
        finding: "K21",
        rule: "deadline",
        scenario: "deadlines::button_calls_on_a_busy_bus_leave_all_deadlines_in_the_future",
        edits: &[
            PAST_DEADLINES,
            Edit {
                file: "crates/canopen/src/pdo/tpdo.rs",
                mended: "        let number = self.events_of()?;\n        let settings = &self.settings;\n        let is_asked_now",
                fault: "        let settings = &self.settings;\n        let is_asked_now",
            },
            Edit {
                file: "crates/canopen/src/pdo/tpdo.rs",
                mended: "        is_asked_now.then_some(number)",
                fault: "        settings.events_of.filter(|_| is_asked_now)",
            },
        ],
    },
    Mend {
        finding: "K22",
        rule: "deadline",
        scenario: "deadlines::a_deselected_multiplexed_tpdo_has_no_deadline_in_the_past",
        edits: &[
            PAST_DEADLINES,
            Edit {
                file: "crates/canopen/src/pdo/scanner.rs",
                mended: "if elapsed || self.is_pending && settings.event != 0 && self.event_due == Tick::NEVER {",
                fault: "if self.is_pending && settings.event != 0 && (elapsed || self.event_due == Tick::NEVER) {",
            },
        ],
    },
    Mend {
        finding: "P25",
        rule: "heartbeat-late",
        scenario: "starving::a_tpdo_every_millisecond_leaves_room_at_every_bit_rate",
        edits: NO_SHARE,
    },
    Mend {
        finding: "P25, events",
        rule: "heartbeat-late",
        scenario: "starving::event_timers_of_a_millisecond_on_all_tpdos_of_a_lift_leave_room",
        edits: &[Edit {
            file: "crates/canopen/src/pdo/budget.rs",
            mended: "self.room() > ROOM_FOR_OTHERS && self.admits(id, len)",
            fault: "self.room() > ROOM_FOR_OTHERS",
        }],
    },
    Mend {
        finding: "P25, noise",
        rule: "heartbeat-late",
        scenario: "starving::a_noisy_pressure_without_inhibit_time_leaves_room",
        edits: NO_SHARE,
    },
    Mend {
        finding: "L25",
        rule: "heartbeat-late",
        scenario: "starving::three_position_units_of_a_lift_leave_room_by_their_defaults",
        edits: NO_SHARE,
    },
    Mend {
        finding: "E34",
        rule: "heartbeat-late",
        scenario: "starving::a_cyclic_timer_of_a_millisecond_leaves_room",
        edits: NO_SHARE,
    },
    Mend {
        finding: "P28, writes",
        rule: "inhibit-time",
        scenario: "inhibit::an_inhibit_time_outlasts_writes_and_remote_frames",
        edits: &[Edit {
            file: "crates/canopen/src/pdo/tpdo.rs",
            mended: "(self.event_due, self.inhibited_until) = (Tick::NEVER, self.settings.inhibit_end(self.sent));",
            fault: "(self.event_due, self.inhibited_until) = (Tick::NEVER, Instant(0));",
        }],
    },
    Mend {
        finding: "P28, remote",
        rule: "inhibit-time",
        scenario: "inhibit::an_inhibit_time_outlasts_writes_and_remote_frames",
        edits: &[Edit {
            file: "crates/canopen/src/pdo/tpdo.rs",
            mended: "                self.pending = true;\n                self.poll(image, context);",
            fault: "                self.send(image, context);",
        }],
    },
    Mend {
        finding: "C21",
        rule: "save-lost",
        scenario: "storing::a_value_between_two_saves_is_saved",
        edits: &[Edit {
            file: "crates/canopen/src/device/store.rs",
            mended: "self.jobs.is_repeated = true;",
            fault: "self.jobs.is_repeated = false;",
        }],
    },
    Mend {
        finding: "C22, E27",
        rule: "abort-acted",
        scenario: "aborts::a_preset_of_an_encoder_is_in_force_or_refused",
        edits: CHECK_AFTER_EFFECT,
    },
    Mend {
        finding: "C22, L24",
        rule: "abort-acted",
        scenario: "aborts::a_preset_of_a_position_unit_is_in_force_or_refused",
        edits: CHECK_AFTER_EFFECT,
    },
    Mend {
        finding: "P21",
        rule: "nmt-state",
        scenario: "states::an_error_that_stops_a_node_is_reported_first",
        edits: &[
            Edit {
                file: "crates/canopen/src/device/inner.rs",
                mended: "        if Self::has(Services::EMCY) && self.state.has_services() {\n            self.emcy.poll(D::Application::LISTS_DETAIL, context);\n        }\n",
                fault: "        self.react();\n        if Self::has(Services::EMCY) && self.state.has_services() {\n            self.emcy.poll(D::Application::LISTS_DETAIL, context);\n        }\n",
            },
            Edit {
                file: "crates/canopen/src/device/faults.rs",
                mended: "if has_to_stop && (!Self::has(Services::EMCY) || self.emcy.is_idle()) && !self.is_bus_off {",
                fault: "if has_to_stop {",
            },
        ],
    },
    Mend {
        finding: "P26",
        rule: "error-behaviour",
        scenario: "states::an_error_that_is_found_at_a_start_acts_as_1029h_demands",
        edits: &[Edit {
            file: "crates/canopen/src/emcy/fault.rs",
            mended: "detail: [in_use, 0, 0, 0, 0], class: Some(ErrorClass::DEVICE) }",
            fault: "detail: [in_use, 0, 0, 0, 0], class: None }",
        }],
    },
    Mend {
        finding: "P31",
        rule: "emcy",
        scenario: "errors::an_error_that_no_emcy_has_sent_is_not_in_the_list",
        edits: &[
            Edit {
                file: "crates/canopen/src/emcy/producer.rs",
                mended: "            self.errors |= self.repeat(fault, detail, now);\n        } else if is_change",
                fault: "            { let [low, high] = fault.condition(self.conditions).code.to_le_bytes(); self.history.push([low, high, 0, 0]); }\n            self.errors |= self.repeat(fault, detail, now);\n        } else if is_change",
            },
            Edit {
                file: "crates/canopen/src/emcy/producer.rs",
                mended: "self.history.push([low, high, detail[0], detail[1]]);",
                fault: "let _ = detail;",
            },
        ],
    },
    Mend {
        finding: "P24",
        rule: "can-id",
        scenario: "identities::a_predefined_cob_id_follows_the_node_id",
        edits: &[
            Edit {
                file: "crates/canopen/src/dictionary/packed.rs",
                mended: "Some(number) => number,",
                fault: "Some(_) => return None,",
            },
            Edit {
                file: "crates/canopen/src/dictionary/packed.rs",
                mended: "entry.attributes.group == Some(group) && !(entry.attributes.node_relative && is_default())",
                fault: "entry.attributes.group == Some(group) && (!entry.attributes.node_relative || is_default() || true)",
            },
        ],
    },
    Mend {
        finding: "inhibit",
        rule: "inhibit-time",
        scenario: "inhibit::an_inhibit_time_separates_events",
        edits: &[Edit {
            file: "crates/canopen/src/pdo/tpdo.rs",
            mended: "=> sent.plus(Span::from_inhibit(self.inhibit)),",
            fault: "=> sent.plus(Span::from_inhibit(self.inhibit / 2)),",
        }],
    },
    Mend {
        finding: "toggle",
        rule: "sdo-protocol",
        scenario: "transfers::a_text_is_read_in_segments",
        edits: &[Edit {
            file: "crates/canopen/src/sdo/segmented.rs",
            mended: "*command = if requested { TOGGLE }",
            fault: "*command = if !requested { TOGGLE }",
        }],
    },
];
