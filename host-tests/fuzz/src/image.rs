//! An update under the actions of a master, noise and power cuts. The node runs image A and is sent image B. In any
//! case the node starts A or B, complete: without the owner's key no one can sign a third image.

use std::sync::LazyLock;

use arbitrary::{Arbitrary, Unstructured};
use update::mock::{MockFlash, Weak};
use update::{
    Area, CONTEXT, Decision, Description, HEADER_LEN, Header, Layout, Next, Refusal, Reset, Start, Status,
    Target, Trial, Updater, Version, boot,
};

/// Sectors: security counter; application in two sectors; staging in two; the kept image in two.
const SECTORS: [usize; 8] = [1536, 512, 512, 512, 1024, 512, 1024, 512];
const APPLICATION: usize = 1536;
const BOARD: u32 = 0x8271;
/// Number of polls that no step of an update exceeds.
const POLLS: u32 = 2000;

#[derive(Arbitrary, Debug)]
enum Step<'a> {
    /// A write of 3 (clear) to 1F51h.
    Clear,
    /// The begin of a download to 1F50h.
    Begin { size: Option<u16> },
    /// Received bytes.
    Receive(&'a [u8]),
    /// The next bytes of image B, with one byte changed if `flip` is set.
    ReceiveImage { len: u16, flip: Option<(u16, u8)> },
    /// The end of the download.
    Finish,
    /// A write of 1 (start) to 1F51h, which installs the image.
    Install,
    /// Polls while time passes.
    Poll { times: u8 },
    /// Polls until no work is left.
    PollAll,
    /// Power off and on.
    Restart,
    /// A power cut in the middle of an operation, after `after` further operations.
    Cut { after: u8, weak: u8 },
    /// The application confirms itself.
    Confirm,
    /// The application is withdrawn.
    Withdraw,
    /// The application crashes.
    Crash,
}

/// Runs the steps, and decodes the first bytes as a header.
pub fn run(data: &[u8]) {
    if let Some(bytes) = data.first_chunk::<HEADER_LEN>()
        && let Ok(header) = Header::parse(bytes)
    {
        assert_eq!(&header.encode(), bytes);
    }
    let mut input = Unstructured::new(data);
    let mut node = Node::new();
    while !input.is_empty() {
        let Ok(step) = input.arbitrary::<Step>() else { break };
        node.take(&step);
    }
    node.restart(Reset::Power);
}

fn keys() -> salty::Keypair {
    salty::Keypair::from(&[7; 32])
}

static PUBLIC_KEYS: LazyLock<[[u8; 32]; 3]> = LazyLock::new(|| [keys().public.to_bytes(); 3]);

fn target() -> Target {
    let application = Area::new(1536, &[512, 512]);
    let layout = Layout::new(
        Area::new(0, &[1536]),
        Area::new(5632, &[512]),
        application,
        Area::new(2560, &[512, 1024]),
        Area::new(4096, &[512, 1024]),
    );
    Target { layout: layout.expect("they fit"), board: BOARD, hardware: 0, keys: &PUBLIC_KEYS }
}

fn image(major: u16, len: usize) -> Image {
    let version = Version { major, minor: 0, patch: 0 };
    let description =
        Description { board: BOARD, hardware: 1, version, counter: 1, ..Description::default() };
    let code: Vec<u8> = (1..=u8::MAX).cycle().skip(usize::from(major)).take(len).collect();
    let header = Header::describe(description, &code).expect("it fits");
    let hash = salty::Sha512::new().updated(header.signed_part()).updated(&code).finalize();
    let header = header.with_signature(keys().sign_prehashed(&hash, Some(CONTEXT)).to_bytes());
    (header, [&header.encode()[..], &code].concat())
}

/// The header of an image and all its bytes.
type Image = (Header, Vec<u8>);

/// A and B, and the flash of a node that runs A. Shared, because signing takes longer than everything else.
static START: LazyLock<([Image; 2], MockFlash)> = LazyLock::new(|| {
    let images = [image(1, 300), image(2, 420)];
    let flash = installed(&images[0].1);
    (images, flash)
});

struct Node {
    updater: Updater<MockFlash>,
    images: &'static [Image; 2],
    /// Number of bytes of B that have been sent.
    sent: usize,
}

impl Node {
    fn new() -> Node {
        let (images, flash) = &*START;
        Node { updater: Updater::new(flash.clone(), target(), Status::GOOD), images, sent: 0 }
    }

    fn take(&mut self, step: &Step) {
        match *step {
            Step::Poll { times } => (0..times).for_each(|_| {
                self.updater.poll();
            }),
            Step::PollAll => poll_all(&mut self.updater),
            Step::Restart => self.restart(Reset::Power),
            Step::Crash => self.restart(Reset::Crash),
            Step::Cut { after, weak } => {
                let weak = Weak::ALL[usize::from(weak) % Weak::ALL.len()];
                self.updater.flash().cut_after(after.into(), weak);
            }
            // A refusal is only an answer to the master.
            ref command => drop(self.command(command)),
        }
        if self.updater.flash().is_down() {
            self.restart(Reset::Power);
        }
    }

    fn command(&mut self, step: &Step) -> Result<(), Refusal> {
        match *step {
            Step::Clear => self.updater.clear(),
            Step::Begin { size } => {
                self.sent = 0;
                self.updater.begin(size.map(u32::from))
            }
            Step::Receive(bytes) => self.updater.receive(bytes),
            Step::ReceiveImage { len, flip } => {
                let piece = self.piece(len, flip);
                self.updater.receive(&piece)
            }
            Step::Finish => self.updater.finish(),
            Step::Install => self.updater.install(),
            // No application runs while the updater has work to do.
            Step::Confirm | Step::Withdraw if self.updater.next() != Next::Nothing => Ok(()),
            Step::Confirm => Trial::confirm(self.updater.flash(), &target().layout),
            Step::Withdraw => Trial::withdraw(self.updater.flash(), &target().layout),
            _ => Ok(()),
        }
    }

    fn piece(&mut self, len: u16, flip: Option<(u16, u8)>) -> Vec<u8> {
        let rest = &self.images[1].1[self.sent..];
        let mut piece = rest[..usize::from(len).min(rest.len())].to_vec();
        self.sent += piece.len();
        if let Some((at, by)) = flip
            && !piece.is_empty()
        {
            let at = usize::from(at) % piece.len();
            piece[at] ^= by;
        }
        piece
    }

    /// A start of the bootloader: carries out its decision and checks that A or B runs.
    fn restart(&mut self, reset: Reset) {
        let mut flash = self.updater.flash().clone();
        flash.power_up();
        let decision = boot(&mut flash, &target(), Start { reset, ..Start::default() });
        if matches!(decision, Decision::Copy | Decision::Revert) {
            let mut updater = Updater::new(flash, target(), Status::GOOD);
            let begun = if decision == Decision::Copy { updater.install() } else { updater.revert() };
            begun.expect("a checked image waits");
            poll_all(&mut updater);
            flash = updater.flash().clone();
        }
        let decision = boot(&mut flash, &target(), Start::default());
        let bytes = flash.bytes();
        let started = self.images.iter().find(|(header, _)| decision == Decision::Start(*header));
        let (_, image) = started.unwrap_or_else(|| panic!("neither A nor B starts: {decision:?}"));
        assert_eq!(&bytes[APPLICATION..APPLICATION + image.len()], image, "all of it");
        self.updater = Updater::new(flash, target(), Status::GOOD);
    }
}

fn poll_all(updater: &mut Updater<MockFlash>) {
    let mut polls = 0..POLLS;
    while updater.poll() != Next::Nothing {
        assert!(polls.next().is_some(), "it does not end");
    }
}

/// The flash after a complete update, with the steps of a master.
fn installed(image: &[u8]) -> MockFlash {
    let mut updater = Updater::new(MockFlash::new(&SECTORS, 1), target(), Status::GOOD);
    updater.clear().expect("it is idle");
    poll_all(&mut updater);
    updater.begin(u32::try_from(image.len()).ok()).expect("it is clear");
    updater.receive(image).expect("it fits");
    updater.finish().expect("it is whole");
    poll_all(&mut updater);
    updater.install().expect("it is signed");
    poll_all(&mut updater);
    updater.flash().clone()
}
