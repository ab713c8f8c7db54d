//! Errors of one node: EMCY messages, the error register (1001h) and the list of errors (1003h).

use canopen::{Duration, Instant};

use crate::{Findings, Rule};

/// How long an EMCY may follow the register or the list that shows its error, in us.
const PATIENCE: u64 = 100_000;

/// A read that no EMCY has explained yet.
#[derive(Clone, Copy, Debug)]
struct Doubt {
    at: Instant,
    what: What,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// The error register.
    Register(u8),
    /// The number of errors in the list.
    Count(usize),
    /// An entry of the list.
    Code(u16),
}

/// The errors.
#[derive(Debug, Default)]
pub(crate) struct Errors {
    /// The error codes of the EMCY messages since the list was empty; `None` while the list is not known.
    sent: Option<Vec<u16>>,
    /// The register in the last EMCY; `None` before the node has started.
    register: Option<u8>,
    last: Option<Instant>,
    doubts: Vec<Doubt>,
}

impl Errors {
    /// A boot-up message. `is_empty`: the list of errors is empty.
    pub(crate) fn boot_up(&mut self, is_empty: bool) {
        let sent = is_empty.then(Vec::new);
        *self = Errors { sent, register: Some(0), last: None, doubts: Vec::new() };
    }

    /// The node is not observed any more.
    pub(crate) fn forget(&mut self) {
        *self = Errors::default();
    }

    /// The client has cleared the list.
    pub(crate) fn cleared(&mut self) {
        self.sent = Some(Vec::new());
        self.doubts.retain(|doubt| matches!(doubt.what, What::Register(_)));
    }

    /// The time for an EMCY restarts.
    pub(crate) fn resume(&mut self, now: Instant) {
        self.doubts.iter_mut().for_each(|doubt| doubt.at = now);
    }

    /// The time of the last EMCY.
    pub(crate) fn last(&self) -> Option<Instant> {
        self.last
    }

    /// An EMCY. `wait`: how long the message before may have waited for the bus.
    pub(crate) fn emcy(
        &mut self,
        data: &[u8],
        inhibit: Option<Duration>,
        wait: Duration,
        now: Instant,
        findings: &mut Findings,
    ) -> Option<u16> {
        let &[low, high, register, _, _, _, _, _] = data else {
            findings.push((Rule::Emcy, format!("an EMCY of {} bytes", data.len())));
            return None;
        };
        let code = u16::from_le_bytes([low, high]);
        if code != 0 && register & 1 == 0 {
            findings.push((Rule::Emcy, format!("EMCY {code:04X}h without the generic bit of 1001h")));
        }
        if let (Some(inhibit), Some(last)) = (inhibit, self.last)
            && now.0 + wait.0 < last.0 + inhibit.0
        {
            let gap = now.0 - last.0;
            findings.push((Rule::Inhibit, format!("an EMCY after {gap} us, 1015h is {} us", inhibit.0)));
        }
        (self.last, self.register) = (Some(now), Some(register));
        if code != 0
            && let Some(sent) = &mut self.sent
        {
            sent.push(code);
        }
        let (register, sent) = (self.register, self.sent.clone());
        self.doubts.retain(|doubt| !is_explained(doubt.what, register, sent.as_deref()));
        Some(code)
    }

    /// 1001h was read.
    pub(crate) fn read_register(&mut self, register: u8, now: Instant) {
        self.doubt(What::Register(register), now);
    }

    /// An entry of 1003h was read.
    pub(crate) fn read_list(&mut self, sub: u8, value: u32, now: Instant) {
        match sub {
            0 => self.doubt(What::Count(value as usize), now),
            _ => self.doubt(What::Code(value as u16), now),
        }
    }

    fn doubt(&mut self, what: What, now: Instant) {
        if !is_explained(what, self.register, self.sent.as_deref()) {
            self.doubts.push(Doubt { at: now, what });
        }
    }

    /// Time has passed: reads without an explanation are reported.
    pub(crate) fn advance(&mut self, inhibit: Option<Duration>, now: Instant, findings: &mut Findings) {
        let inhibit = inhibit.map_or(0, |inhibit| inhibit.0);
        let is_late = |doubt: &Doubt| now.0 > doubt.at.0 + PATIENCE + inhibit;
        for doubt in self.doubts.iter().filter(|doubt| is_late(doubt)) {
            let sent = self.sent.as_ref().map_or(0, Vec::len);
            let text = match doubt.what {
                What::Register(read) => {
                    format!("1001h reads {read:02X}h, the last EMCY has {:02X}h", self.register.unwrap_or(0))
                }
                What::Count(count) => format!("1003h lists {count} errors, {sent} EMCY were sent"),
                What::Code(code) => format!("1003h lists {code:04X}h, which no EMCY has sent"),
            };
            findings.push((Rule::Emcy, text));
        }
        self.doubts.retain(|doubt| !is_late(doubt));
    }
}

fn is_explained(what: What, register: Option<u8>, sent: Option<&[u16]>) -> bool {
    match what {
        What::Register(read) => register.is_none_or(|register| register == read),
        What::Count(count) => sent.is_none_or(|sent| count <= sent.len() && (count > 0 || sent.is_empty())),
        What::Code(code) => sent.is_none_or(|sent| code == 0 || sent.contains(&code)),
    }
}
