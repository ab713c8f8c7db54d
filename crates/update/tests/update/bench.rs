//! A small node with sectors of different sizes, images for it, and the actions of bootloader and master.

use std::sync::LazyLock;

use update::key::{Certificate, KEYS_CONTEXT};
use update::mock::MockFlash;
use update::{
    Area, CONTEXT, Decision, Description, HEADER_LEN, Header, Layout, Next, Refusal, Reset, Start, Status,
    Target, Trial, Updater, Version, boot,
};

/// Sectors of the mock: security counter and key generation; application in two; staging in two; the kept image in two;
/// the count of erases.
pub(crate) const SECTORS: [usize; 8] = [1536, 1024, 2048, 2048, 2048, 2048, 2048, 2048];
pub(crate) const APPLICATION: usize = 1536;
pub(crate) const STAGING: usize = 1536 + 3072;
const SECURITY_AREA: Area = Area::new(0, &[1536]);
const APPLICATION_AREA: Area = Area::new(1536, &[1024, 2048]);
const STAGING_AREA: Area = Area::new(1536 + 3072, &[2048, 2048]);
const KEPT_AREA: Area = Area::new(1536 + 3072 + 4096, &[2048, 2048]);
const WEAR_AREA: Area = Area::new(1536 + 3072 + 4096 + 4096, &[2048]);

pub(crate) const BOARD: u32 = 0x0001_8271;
pub(crate) const REVISION: u8 = 2;

/// The release key of the test node.
pub(crate) fn keys() -> salty::Keypair {
    key_number(0)
}

/// A key: 0 the release key, 1 the root key, 2 the recovery key of the test node; the others are unused.
pub(crate) fn key_number(number: u8) -> salty::Keypair {
    salty::Keypair::from(&[7 + number; 32])
}

static PUBLIC_KEYS: LazyLock<[[u8; 32]; 3]> =
    LazyLock::new(|| [0, 1, 2].map(|number| key_number(number).public.to_bytes()));

/// The certificate of a key, signed with another one.
pub(crate) fn certificate(generation: u32, counter: u32, key: u8, by: u8) -> Certificate {
    let key = key_number(key).public.to_bytes();
    let certificate = Certificate { generation, counter, key, signature: [0; 64] };
    let hash = salty::Sha512::new().updated(&certificate.signed_part()).finalize();
    let signature = key_number(by).sign_prehashed(&hash, Some(KEYS_CONTEXT));
    Certificate { signature: signature.to_bytes(), ..certificate }
}

pub(crate) fn target() -> Target {
    let layout = Layout::new(SECURITY_AREA, WEAR_AREA, APPLICATION_AREA, STAGING_AREA, KEPT_AREA).unwrap();
    Target { layout, board: BOARD, hardware: REVISION, keys: &PUBLIC_KEYS }
}

/// A header and its code, as consistent as the test needs; [`Image::bytes`] are the bytes sent over the bus.
#[derive(Clone)]
pub(crate) struct Image {
    pub(crate) header: Header,
    pub(crate) code: Vec<u8>,
}

pub(crate) fn description(version: u16, counter: u32) -> Description {
    let version = Version { major: version, minor: 2, patch: 3 };
    Description { board: BOARD, hardware: 1 << REVISION, version, counter, ..Description::default() }
}

impl Image {
    /// An image of `len` bytes of noise, signed.
    pub(crate) fn new(description: Description, len: usize) -> Image {
        let seed = u64::from(description.version.major);
        Image::of(description, noise(seed, len))
    }

    pub(crate) fn of(description: Description, code: Vec<u8>) -> Image {
        let header = Header::describe(description, &code).unwrap();
        Image { header, code }.signed_by(&keys())
    }

    pub(crate) fn signed_by(self, keys: &salty::Keypair) -> Image {
        let hash = self.hash();
        self.with_signature(keys.sign_prehashed(&hash, Some(CONTEXT)))
    }

    pub(crate) fn hash(&self) -> [u8; 64] {
        salty::Sha512::new().updated(self.header.signed_part()).updated(&self.code).finalize()
    }

    pub(crate) fn with_signature(self, signature: salty::Signature) -> Image {
        Image { header: self.header.with_signature(signature.to_bytes()), ..self }
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        [&self.header.encode()[..], &self.code].concat()
    }
}

/// The images of most tests. Their lengths end within a chunk, and within different sectors.
pub(crate) fn image_a() -> Image {
    Image::new(description(1, 5), 404)
}

pub(crate) fn image_b() -> Image {
    Image::new(description(2, 5), 620)
}

/// `len` pseudo-random bytes, the same each time.
pub(crate) fn noise(seed: u64, len: usize) -> Vec<u8> {
    let mut random = fastrand::Rng::with_seed(seed);
    (0..len).map(|_| random.u8(..)).collect()
}

/// A pseudo-random number, the same each time.
pub(crate) fn chance(seed: u32) -> u32 {
    u32::from_le_bytes(noise(u64::from(seed), 4).try_into().unwrap())
}

/// Whether all cases are to be tested: `cargo xtask test --thorough` sets THOROUGH=1.
pub(crate) fn is_thorough() -> bool {
    std::env::var("THOROUGH").is_ok_and(|value| value == "1")
}

/// A flash in which `image` was installed by an update.
pub(crate) fn flash_with(image: &Image, seed: u64) -> MockFlash {
    flash_of_words_with(image, 4, seed)
}

/// The same with a flash that programs words of `word` bytes.
pub(crate) fn flash_of_words_with(image: &Image, word: usize, seed: u64) -> MockFlash {
    let mut flash = MockFlash::with_words(&SECTORS, word, seed);
    update(&mut flash, &image.bytes()).unwrap();
    flash
}

/// Polls until nothing is left to do.
pub(crate) fn run(updater: &mut Updater<&mut MockFlash>) -> Result<(), Refusal> {
    for _ in 0..10_000 {
        if updater.poll() == Next::Nothing {
            return outcome(updater);
        }
        assert_eq!(updater.status(), Status::BUSY);
    }
    panic!("it does not end");
}

fn outcome(updater: &mut Updater<&mut MockFlash>) -> Result<(), Refusal> {
    if updater.status() == Status::GOOD { Ok(()) } else { Err(Refusal::Unspecified) }
}

/// Actions of a master up to the end of the download, in pieces of odd sizes.
pub(crate) fn download(updater: &mut Updater<&mut MockFlash>, image: &[u8]) -> Result<(), Refusal> {
    updater.clear()?;
    run(updater)?;
    updater.begin(u32::try_from(image.len()).ok())?;
    for (piece, len) in pieces(image) {
        assert!(len <= 889);
        updater.receive(piece)?;
    }
    updater.finish()?;
    run(updater)
}

/// Pieces of 1, 889 (a block of 127 segments), 7 and 250 bytes in turn.
fn pieces(mut image: &[u8]) -> impl Iterator<Item = (&[u8], usize)> {
    let mut sizes = [1, 889, 7, 250].into_iter().cycle();
    std::iter::from_fn(move || {
        let len = sizes.next()?.min(image.len());
        let (piece, rest) = image.split_at(len);
        image = rest;
        (len > 0).then_some((piece, len))
    })
}

/// A whole update.
pub(crate) fn update(flash: &mut MockFlash, image: &[u8]) -> Result<(), Refusal> {
    stage(flash, image)?;
    install(flash)
}

/// The first part of an update, up to the commit.
pub(crate) fn stage(flash: &mut MockFlash, image: &[u8]) -> Result<(), Refusal> {
    download(&mut Updater::new(flash, target(), Status::GOOD), image)
}

/// The second part, the copy.
pub(crate) fn install(flash: &mut MockFlash) -> Result<(), Refusal> {
    let mut updater = Updater::new(flash, target(), Status::GOOD);
    updater.install()?;
    run(&mut updater)
}

/// Copies the kept image back.
pub(crate) fn revert(flash: &mut MockFlash) -> Result<(), Refusal> {
    let mut updater = Updater::new(flash, target(), Status::GOOD);
    updater.revert()?;
    run(&mut updater)
}

/// Confirms the application.
pub(crate) fn confirm(flash: &mut MockFlash) {
    Trial::confirm(flash, &target().layout).unwrap();
}

/// A requested start of the bootloader: the decision, after a copy that was still to be done.
pub(crate) fn start(flash: &mut MockFlash) -> Decision {
    start_after(flash, Reset::Asked)
}

/// The same for a start after this reset.
pub(crate) fn start_after(flash: &mut MockFlash, reset: Reset) -> Decision {
    // A refusal shows in the next decision.
    let _ = match boot(flash, &target(), Start { reset, ..Start::default() }) {
        Decision::Copy => install(flash),
        Decision::Revert => revert(flash),
        decision => return decision,
    };
    boot(flash, &target(), Start::default())
}

/// Whether the application area holds exactly this image.
pub(crate) fn holds(flash: &MockFlash, image: &Image) -> bool {
    let bytes = image.bytes();
    flash.bytes()[APPLICATION..APPLICATION + bytes.len()] == bytes
}

/// Asserts that `image` starts and is complete.
pub(crate) fn assert_starts(flash: &mut MockFlash, image: &Image) {
    assert_eq!(start(flash), Decision::Start(image.header));
    assert!(holds(flash, image), "the code too");
}

pub(crate) const HEADER: usize = HEADER_LEN;
