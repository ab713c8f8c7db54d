//! Contents of the flash at power-on, and the decision that the bootloader must make.

use std::sync::LazyLock;

use anyhow::{Result, ensure};
use bsp::flash::sectors;
use bsp::flash::update_layout::LAYOUT;
use ed25519_dalek::SigningKey;
use programmer::sign::image::Image;
use update::key::{Certificate, KeyList};
use update::mock::MockFlash;
use update::{
    Decision, Description, Flash, HEADER_LEN, Next, Phase, Start, Status, Target, Trial, Updater, Version,
};

use crate::glitch::program::{BAD, GOOD, code};

/// The secret key whose public half the bootloader was built with: `cargo xtask` and the tests of the owner's bootloader use it.
const OWNER: [u8; 32] = [0x42; 32];
const NEWER: u32 = 3;
const OLDER: u32 = 2;

/// Event before the decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Begin {
    /// Power-on.
    Power,
    /// Watchdog reset, after an application with a good signature has run. The flash of the scene replaces that of the application.
    Reset,
}

/// A content of the flash that holds a program which must not run.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name of the scene.
    pub name: &'static str,
    /// Description of the program that must not run.
    pub what: &'static str,
    pub(crate) flash: Vec<u8>,
    pub(crate) begin: Begin,
    /// Whether another program must run; otherwise the bootloader stays.
    pub(crate) has_good: bool,
}

impl Scene {
    /// All scenes.
    ///
    /// # Errors
    /// The images cannot be made.
    pub fn all() -> Result<Vec<Scene>> {
        let bare = |application: &[u8]| with(erased(), application);
        let unsigned = unsigned()?.to_bytes();
        let headless = [&[0xFF; HEADER_LEN][..], &code(BAD)].concat();
        let alone = |name, what, flash, begin| Scene { name, what, flash, begin, has_good: false };
        let staged = |name, what, flash| Scene { name, what, flash, begin: Begin::Power, has_good: true };
        Ok(vec![
            alone("unsigned", "an unsigned application", bare(&unsigned), Begin::Power),
            alone(
                "neutral",
                "an application with a signature of the neutral point and zero",
                bare(&neutral()?.to_bytes()),
                Begin::Power,
            ),
            alone(
                "certified",
                "an application whose release key nobody has certified",
                bare(&certified()?.to_bytes()),
                Begin::Power,
            ),
            alone("bare", "an application without a header", bare(&headless), Begin::Power),
            alone(
                "exchanged",
                "an unsigned application that has replaced a signed one before a reset",
                bare(&unsigned),
                Begin::Reset,
            ),
            staged("older", "an older signed image that waits to be copied", waiting(&older()?.to_bytes())?),
            staged("waiting", "an unsigned image that waits to be copied", waiting(&unsigned)?),
            staged(
                "returning",
                "an unsigned image in place of the kept one after a failed trial",
                returning(&unsigned)?,
            ),
        ])
    }

    /// A flash with the permitted application.
    pub(crate) fn good() -> Result<Vec<u8>> {
        Ok(with(erased(), &newer()?.to_bytes()))
    }
}

static PUBLIC_KEYS: LazyLock<[[u8; 32]; 3]> = LazyLock::new(|| {
    let others = [[0x43; 32], [0x44; 32]].map(|secret| SigningKey::from_bytes(&secret));
    let [root, recovery] = others.map(|key| key.verifying_key().to_bytes());
    [owner().verifying_key().to_bytes(), root, recovery]
});

fn owner() -> SigningKey {
    SigningKey::from_bytes(&OWNER)
}

fn signed(word: u32, counter: u32) -> Result<Image> {
    let version = Version { major: 1, minor: 0, patch: 0 };
    let about = Description {
        board: profiles::product::BOARD,
        hardware: 1,
        version,
        counter,
        ..Description::default()
    };
    Image::sign(about, code(word), &owner())
}

fn newer() -> Result<Image> {
    signed(GOOD, NEWER)
}

fn older() -> Result<Image> {
    signed(BAD, OLDER)
}

/// An unsigned image, newer than the application, for this board, with correct CRCs.
fn unsigned() -> Result<Image> {
    with_signature([0; 64])
}

/// The same image with a signature of R = neutral point, where the sum of the equation begins, and S = 0.
fn neutral() -> Result<Image> {
    let mut signature = [0; 64];
    signature[0] = 1;
    with_signature(signature)
}

/// The signature is good, of a release key that the list names without a signature of the root key.
fn certified() -> Result<Image> {
    let thief = SigningKey::from_bytes(&[0x66; 32]);
    let key = thief.verifying_key().to_bytes();
    let certificate = Certificate { generation: 1, counter: 0, key, signature: [0; 64] };
    let image = signed(BAD, NEWER)?;
    let keys = KeyList { release: Some(certificate), root: None };
    Image::sign(Description { keys, ..image.header.description() }, image.code, &thief)
}

fn with_signature(signature: [u8; 64]) -> Result<Image> {
    let image = signed(BAD, NEWER)?;
    Ok(Image { header: image.header.with_signature(signature), ..image })
}

/// Sizes of the sectors.
fn sizes() -> Vec<usize> {
    sectors::all().map(|sector| sector.size as usize).collect()
}

fn erased() -> Vec<u8> {
    vec![0xFF; sizes().iter().sum()]
}

fn with(mut flash: Vec<u8>, application: &[u8]) -> Vec<u8> {
    put(&mut flash, LAYOUT.application().start(), application);
    flash
}

fn put(flash: &mut [u8], at: u32, bytes: &[u8]) {
    flash[at as usize..at as usize + bytes.len()].copy_from_slice(bytes);
}

/// A flash with an image that waits to be copied over the permitted application, which has run. The commit record was made for a good
/// image: an attacker who can write the flash can write the record too.
fn waiting(image: &[u8]) -> Result<Vec<u8>> {
    let mut flash = downloaded()?.bytes().clone();
    put(&mut flash, LAYOUT.staging().start(), image);
    Ok(flash)
}

/// A flash in which the permitted application has failed its trial, and the kept image was replaced by another one.
fn returning(image: &[u8]) -> Result<Vec<u8>> {
    let mut flash = downloaded()?;
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.install()?;
    while updater.poll() != Next::Nothing {}
    ensure!(updater.phase() == Phase::Installed, "the image is good: {}", updater.status());
    let is_withdrawn = Trial::withdraw(&mut flash, &LAYOUT).is_ok();
    let decision = update::boot(&mut flash, &target(), Start::default());
    ensure!(is_withdrawn && decision == Decision::Revert, "the trial is lost: {decision:?}");
    let mut flash = flash.bytes().clone();
    put(&mut flash, LAYOUT.kept().start(), image);
    Ok(flash)
}

/// A flash with the permitted application, which has run, and a checked copy in staging.
fn downloaded() -> Result<MockFlash> {
    let mut flash = MockFlash::new(&sizes(), 1);
    let erased = flash.program(LAYOUT.application().start(), &newer()?.to_bytes());
    ensure!(erased.is_ok(), "the power of a mock is cut when a test says so");
    let decision = update::boot(&mut flash, &target(), Start::default());
    ensure!(matches!(decision, Decision::Start(_)), "the application is good: {decision:?}");
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.clear()?;
    while updater.poll() != Next::Nothing {}
    updater.begin(None)?;
    updater.receive(&newer()?.to_bytes())?;
    updater.finish()?;
    while updater.poll() != Next::Nothing {}
    ensure!(updater.phase() == Phase::Committed, "the image is good: {}", updater.status());
    Ok(flash)
}

fn target() -> Target {
    Target { layout: LAYOUT, board: profiles::product::BOARD, hardware: 0, keys: &PUBLIC_KEYS }
}
