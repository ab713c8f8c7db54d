//! The rules and their breaches.

use std::fmt;

use canopen::{Frame, Instant};

/// A rule of the bus. The name of a rule is stable: tests and `nodectl rules --without` use it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rule {
    /// An SDO download that is aborted changes nothing.
    AbortActed,
    /// A value that is accepted reads back.
    ReadBack,
    /// A value that is saved is there after the next reset.
    SaveLost,
    /// The default value is there after a restore and the next reset.
    RestoreLost,
    /// An NMT state changes by an NMT command, or after an EMCY as 1029h demands; a state allows its services only.
    NmtState,
    /// A node reacts to an error as 1029h demands.
    ErrorBehaviour,
    /// A heartbeat arrives within 1.5 of its time (1017h) while the bus has room for it.
    HeartbeatLate,
    /// An SDO request is answered within a second while the bus has room.
    SdoSilent,
    /// The SDO server keeps to the protocol: command, toggle bit, sequence number, size, CRC.
    SdoProtocol,
    /// The inhibit time of a TPDO or of EMCY is kept (1800h:3, 1015h).
    Inhibit,
    /// A synchronous TPDO follows its SYNC, in the synchronous window (1800h:2, 1007h).
    Sync,
    /// A TPDO has the length of its mapping.
    PdoLength,
    /// Nothing is sent before the boot-up message.
    BeforeBootUp,
    /// A node sends with its own CAN-IDs only, and a CAN-ID has one sender.
    CanId,
    /// A node restarts by a command only, and a chip is reset by its program only.
    UnexpectedReset,
    /// The next deadline of a node lies after the present.
    Deadline,
    /// 1001h, 1003h and the EMCY messages fit each other.
    Emcy,
}

impl Rule {
    /// All rules.
    pub const ALL: [Rule; 17] = [
        Rule::AbortActed,
        Rule::ReadBack,
        Rule::SaveLost,
        Rule::RestoreLost,
        Rule::NmtState,
        Rule::ErrorBehaviour,
        Rule::HeartbeatLate,
        Rule::SdoSilent,
        Rule::SdoProtocol,
        Rule::Inhibit,
        Rule::Sync,
        Rule::PdoLength,
        Rule::BeforeBootUp,
        Rule::CanId,
        Rule::UnexpectedReset,
        Rule::Deadline,
        Rule::Emcy,
    ];

    /// The name, as `heartbeat-late`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Rule::AbortActed => "abort-acted",
            Rule::ReadBack => "read-back",
            Rule::SaveLost => "save-lost",
            Rule::RestoreLost => "restore-lost",
            Rule::NmtState => "nmt-state",
            Rule::ErrorBehaviour => "error-behaviour",
            Rule::HeartbeatLate => "heartbeat-late",
            Rule::SdoSilent => "sdo-silent",
            Rule::SdoProtocol => "sdo-protocol",
            Rule::Inhibit => "inhibit-time",
            Rule::Sync => "sync",
            Rule::PdoLength => "pdo-length",
            Rule::BeforeBootUp => "before-boot-up",
            Rule::CanId => "can-id",
            Rule::UnexpectedReset => "unexpected-reset",
            Rule::Deadline => "deadline",
            Rule::Emcy => "emcy",
        }
    }

    /// The clause or object behind the rule.
    #[must_use]
    pub const fn clause(self) -> &'static str {
        match self {
            Rule::AbortActed | Rule::ReadBack => "CiA 301, 7.2.4.3",
            Rule::SaveLost => "CiA 301, 1010h",
            Rule::RestoreLost => "CiA 301, 1011h",
            Rule::NmtState => "CiA 301, 7.3.2",
            Rule::ErrorBehaviour => "CiA 301, 1029h",
            Rule::HeartbeatLate => "CiA 301, 1017h",
            Rule::SdoSilent | Rule::SdoProtocol => "CiA 301, 7.2.4.3",
            Rule::Inhibit => "CiA 301, 7.2.1.3",
            Rule::Sync => "CiA 301, 7.2.2.2",
            Rule::PdoLength => "CiA 301, 1A00h",
            Rule::BeforeBootUp => "CiA 301, 7.2.8.3.3",
            Rule::CanId => "CiA 301, 7.3.5",
            Rule::UnexpectedReset => "CiA 301, 7.3.2",
            Rule::Deadline => "the caller of the node",
            Rule::Emcy => "CiA 301, 7.2.7, 1001h, 1003h",
        }
    }

    /// The rule with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Rule> {
        Rule::ALL.into_iter().find(|rule| rule.name() == name)
    }
}

impl fmt::Display for Rule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A breach of a rule.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Breach {
    /// The rule.
    pub rule: Rule,
    /// The node-ID; `None` for a node without one.
    pub node: Option<u8>,
    /// The time at which the breach was noticed.
    pub at: Instant,
    /// The breach in words.
    pub text: String,
    /// The last frames of the node or to the node, oldest first.
    pub frames: Vec<(Instant, Frame)>,
}

impl fmt::Display for Breach {
    /// `1.250000 node 5: heartbeat-late: …`, and a line for each frame.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Breach { rule, node, at, text, frames } = self;
        let node = node.map_or_else(|| "without a node-ID".to_owned(), |node| node.to_string());
        write!(f, "{} node {node}: {rule}: {text} ({})", seconds(*at), rule.clause())?;
        for (at, frame) in frames {
            write!(f, "\n    {} {:03X}h", seconds(*at), frame.id())?;
            if frame.is_remote() {
                write!(f, " remote")?;
            }
            frame.data().iter().try_for_each(|byte| write!(f, " {byte:02X}"))?;
        }
        Ok(())
    }
}

fn seconds(at: Instant) -> String {
    format!("{}.{:06}", at.0 / 1_000_000, at.0 % 1_000_000)
}
