//! Updates without accidents, commands in the wrong order, decisions at a start, and a worn-out flash.

use crate::bench::{
    APPLICATION, HEADER, Image, STAGING, assert_starts, confirm, description, download, flash_with, holds,
    image_a, image_b, install, run, stage, start, target, update,
};
use embedded_storage::nor_flash::{ErrorType, ReadNorFlash};
use update::mock::{MockFlash, PowerCut};
use update::{
    Crashes, Decision, Flash, Header, Next, Phase, Proof, Refusal, Reset, Start, Status, Stay, Updater,
    application, boot,
};

/// A master that clears in a loop wears nothing out: the second command finds staging erased and proven.
#[test]
fn a_repeated_clear_erases_nothing() {
    let mut flash = flash_with(&image_a(), 1);
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.clear().unwrap();
    run(&mut updater).unwrap();
    let erased = updater.flash().operations();
    for _ in 0..1000 {
        assert_eq!(updater.begin(Some(u32::MAX)), Err(Refusal::TooLong));
        updater.clear().unwrap();
        assert_eq!((run(&mut updater), updater.status()), (Ok(()), Status::GOOD));
    }
    assert_eq!(updater.flash().operations(), erased);
    updater.begin(None).unwrap();
    updater.receive(&image_b().bytes()[..600]).unwrap();
    updater.clear().unwrap();
    run(&mut updater).unwrap();
    assert!(updater.flash().operations() > erased, "what was programmed is erased");
}

#[test]
fn from_a_to_b_and_back() {
    let mut flash = flash_with(&image_a(), 1);
    for image in [image_b(), image_a(), image_b()] {
        update(&mut flash, &image.bytes()).unwrap();
        assert_starts(&mut flash, &image);
        confirm(&mut flash);
    }
}

#[test]
fn images_of_every_length_around_chunks_and_sectors_and_the_longest() {
    let area = target().layout.application().size() as usize;
    for len in (4..=16).chain(496..=528).chain(1016..=1032).step_by(4).chain([area - HEADER]) {
        let image = Image::new(description(3, 5), len & !3);
        let mut flash = flash_with(&image_a(), 1);
        update(&mut flash, &image.bytes()).unwrap();
        assert_starts(&mut flash, &image);
    }
}

#[test]
fn the_updater_reports_its_state_and_the_bootloader_stays_responsive() {
    let mut flash = flash_with(&image_a(), 1);
    let mut updater = Updater::new(&mut flash, target(), Status::refused(Refusal::NoProgram));
    assert_eq!((updater.phase(), updater.status().code), (Phase::Idle, 1));
    updater.clear().unwrap();
    assert_eq!((updater.phase(), updater.status()), (Phase::Clearing, Status::BUSY));
    let mut seen = Vec::new();
    while updater.next() != Next::Nothing {
        seen.push(updater.poll());
    }
    let erasing = seen.iter().filter(|next| **next == Next::Erasing).count();
    assert!(erasing >= 4, "two sectors, each for several polls: {seen:?}");
    assert!(seen.contains(&Next::Step), "then it is read, whether it is erased: {seen:?}");
    assert_eq!((updater.phase(), updater.status()), (Phase::Cleared, Status::GOOD));
    updater.begin(None).unwrap();
    updater.receive(&image_b().bytes()).unwrap();
    assert_eq!((updater.phase(), updater.next()), (Phase::Receiving, Next::Nothing));
    updater.finish().unwrap();
    assert_eq!((updater.phase(), updater.next()), (Phase::Checking, Next::Step));
    let steps = 1 + std::iter::from_fn(|| (updater.poll() == Next::Step).then_some(())).count();
    assert_eq!(steps, 1 + 2 * 65, "the code in one piece, then the signature in many, twice");
    assert_eq!((updater.phase(), updater.status()), (Phase::Committed, Status::GOOD));
    updater.install().unwrap();
    while updater.phase() == Phase::Checking {
        updater.poll();
    }
    assert_eq!((updater.phase(), updater.status()), (Phase::Copying, Status::BUSY));
    run(&mut updater).unwrap();
    assert_eq!((updater.phase(), updater.status()), (Phase::Installed, Status::GOOD));
    assert_starts(&mut flash, &image_b());
}

#[test]
fn no_step_programs_more_than_64_words_but_the_last_of_a_copy() {
    let mut flash = flash_with(&image_a(), 1);
    stage(&mut flash, &image_b().bytes()).unwrap();
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.install().unwrap();
    while updater.next() != Next::Nothing {
        let before = updater.flash().operations();
        updater.poll();
        let operations = updater.flash().operations() - before;
        assert!(
            operations <= 64
                || (operations == 133 && updater.phase() == Phase::Copying)
                || (operations == 129 && updater.phase() == Phase::Installed),
            "{operations}"
        );
    }
}

#[test]
fn commands_in_the_wrong_order_are_refused_and_change_nothing() {
    let mut flash = flash_with(&image_a(), 1);
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    assert_eq!(updater.begin(None), Err(Refusal::NotCleared));
    assert_eq!(updater.status(), Status::refused(Refusal::NotCleared));
    assert_eq!(updater.receive(&[1]), Err(Refusal::Unspecified));
    assert_eq!(updater.finish(), Err(Refusal::Unspecified));
    updater.clear().unwrap();
    assert_eq!(updater.clear(), Err(Refusal::Unspecified), "busy");
    assert_eq!(updater.begin(None), Err(Refusal::Unspecified), "busy");
    assert_eq!(updater.install(), Err(Refusal::Unspecified), "busy");
    run(&mut updater).unwrap();
    assert_eq!(updater.begin(Some(3073)), Err(Refusal::TooLong));
    updater.begin(Some(3072)).unwrap();
    updater.receive(&image_b().bytes()).unwrap();
    assert_eq!(updater.begin(None), Err(Refusal::NotCleared), "a download is under way");
    updater.finish().unwrap();
    run(&mut updater).unwrap();
    assert_eq!(updater.begin(None), Err(Refusal::NotCleared), "there is an image");
    updater.install().unwrap();
    run(&mut updater).unwrap();
    assert_starts(&mut flash, &image_b());
}

#[test]
fn a_committed_image_is_copied_at_the_next_start_before_anything_else() {
    let mut flash = flash_with(&image_a(), 1);
    stage(&mut flash, &image_b().bytes()).unwrap();
    let stay = Start { stay: true, ..Start::default() };
    assert_eq!(boot(&mut flash, &target(), stay), Decision::Copy);
    assert!(holds(&flash, &image_a()), "nothing was copied yet");
    assert_starts(&mut flash, &image_b());
    assert_eq!(boot(&mut flash, &target(), stay), Decision::Stay(Stay::Asked));
}

#[test]
fn a_committed_image_may_be_cleared_as_long_as_it_was_not_copied() {
    let mut flash = flash_with(&image_a(), 1);
    stage(&mut flash, &image_b().bytes()).unwrap();
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.clear().unwrap();
    run(&mut updater).unwrap();
    assert_starts(&mut flash, &image_a());
}

#[test]
fn a_committed_image_that_is_no_longer_good_is_given_up() {
    for at in [STAGING + 40, STAGING + HEADER + 100] {
        let mut flash = flash_with(&image_a(), 1);
        stage(&mut flash, &image_b().bytes()).unwrap();
        flash.disturb(at, |byte| byte ^ 8);
        assert!(install(&mut flash).is_err());
        assert_starts(&mut flash, &image_a());
    }
}

#[test]
fn a_damaged_application_is_restored_from_staging() {
    for at in [APPLICATION + 3, APPLICATION + HEADER + 100] {
        let mut flash = flash_with(&image_a(), 1);
        flash.disturb(at, |byte| byte ^ 8);
        assert_starts(&mut flash, &image_a());
    }
}

#[test]
fn a_damaged_application_without_another_copy_does_not_start() {
    let mut flash = flash_with(&image_a(), 1);
    flash.disturb(APPLICATION + HEADER + 100, |byte| byte ^ 8);
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.clear().unwrap();
    run(&mut updater).unwrap();
    let stay = Stay::NoProgram(Refusal::CodeCrc);
    assert_eq!(start(&mut flash), Decision::Stay(stay));
    assert_eq!(stay.status().word(), 2, "code 1: no valid program");
    update(&mut flash, &image_b().bytes()).unwrap();
    assert_starts(&mut flash, &image_b());
}

#[test]
fn an_installed_program_for_other_hardware_does_not_start() {
    let mut flash = flash_with(&image_a(), 1);
    let mut other = target();
    other.hardware = 5;
    assert_eq!(application(&mut flash, &other, Proof::Waived), Err(Refusal::Hardware { revision: 5 }));
    other.hardware = 32;
    assert_eq!(application(&mut flash, &other, Proof::Waived), Err(Refusal::Hardware { revision: 32 }));
}

#[test]
fn the_security_counter_may_grow_or_stay_and_never_goes_back() {
    let mut flash = flash_with(&image_a(), 1);
    let with = |version, counter| Image::new(description(version, counter), 100);
    for (image, good) in [(with(3, 5), true), (with(4, 9), true), (with(5, 8), false), (with(6, 9), true)] {
        assert_eq!(update(&mut flash, &image.bytes()).is_ok(), good);
        confirm(&mut flash);
    }
    assert_starts(&mut flash, &with(6, 9));
}

/// No damage of the application lowers the security counter that an image has reached.
#[test]
fn the_security_counter_outlives_the_application() {
    let with = |version, counter| Image::new(description(version, counter), 100);
    let mut flash = flash_with(&with(1, 5), 1);
    assert_starts(&mut flash, &with(1, 5));
    clear(&mut flash);
    flash.disturb(APPLICATION + 40, |byte| byte ^ 8);
    assert!(update(&mut flash, &with(2, 4).bytes()).is_err());
    assert_eq!(start(&mut flash), Decision::Stay(Stay::NoProgram(Refusal::HeaderCrc)));
    // Nor does a debugger, or another way to program the application area.
    put(&mut flash, &with(2, 4));
    assert_eq!(start(&mut flash), Decision::Stay(Stay::NoProgram(Refusal::Counter { least: 5 })));
    update(&mut flash, &with(3, 5).bytes()).unwrap();
    assert_starts(&mut flash, &with(3, 5));
}

/// The counter is recorded before the bootloader takes the next download, also if a master has sent the application into the
/// bootloader.
#[test]
fn the_counter_is_kept_before_the_application_can_be_replaced() {
    let with = |version, counter| Image::new(description(version, counter), 100);
    let mut flash = flash_with(&with(1, 5), 1);
    let proof = Proof::Of(with(1, 5).header.crc());
    let asked = Start { stay: true, proof, ..Start::default() };
    assert_eq!(boot(&mut flash, &target(), asked), Decision::Stay(Stay::Asked));
    flash.disturb(APPLICATION, |byte| byte ^ 8);
    clear(&mut flash);
    assert!(update(&mut flash, &with(2, 4).bytes()).is_err());
}

/// The counter is recorded for a signed application only: otherwise a forged header would lock the node for good.
#[test]
fn the_counter_of_an_unsigned_application_is_not_recorded() {
    let mut flash = flash_with(&image_a(), 1);
    clear(&mut flash);
    let forged = Header::describe(description(1, 20), &image_b().code).unwrap();
    put(&mut flash, &Image { header: forged, ..image_b() });
    for stay in [false, true] {
        boot(&mut flash, &target(), Start { stay, ..Start::default() });
    }
    put(&mut flash, &image_a());
    assert_starts(&mut flash, &image_a());
}

#[test]
fn an_application_that_keeps_crashing_keeps_the_node_in_the_bootloader() {
    let mut flash = flash_with(&image_a(), 1);
    let mut crashes = Crashes::default();
    let mut after = |crashes| boot(&mut flash, &target(), Start { crashes, ..Start::default() });
    for _ in 1..Crashes::LIMIT {
        crashes = crashes.after(Reset::Crash);
        assert_eq!(after(crashes), Decision::Start(image_a().header));
    }
    crashes = crashes.after(Reset::Crash);
    let stay = Stay::Crashes(Crashes::LIMIT);
    assert_eq!(after(crashes), Decision::Stay(stay));
    assert_eq!(stay.status(), Status::refused(Refusal::Crashes { count: 3 }));
    assert_eq!(after(crashes.confirmed()), Decision::Start(image_a().header));
}

/// A flash with one word in which a bit cannot be programmed, or with one sector that cannot be erased.
struct Worn {
    flash: MockFlash,
    word: u32,
    sector: u32,
}

impl ErrorType for Worn {
    type Error = PowerCut;
}

impl ReadNorFlash for Worn {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        self.flash.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl Flash for Worn {
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        let mut bytes = bytes.to_vec();
        if let Some(byte) = self.word.checked_sub(offset).and_then(|at| bytes.get_mut(at as usize)) {
            *byte |= 1;
        }
        self.flash.program(offset, &bytes)
    }

    fn start_erase(&mut self, offset: u32) -> Result<(), PowerCut> {
        if offset == self.sector { Ok(()) } else { self.flash.start_erase(offset) }
    }

    fn is_busy(&mut self) -> Result<bool, PowerCut> {
        self.flash.is_busy()
    }
}

/// An update to B on a worn flash, as far as possible.
fn update_worn(worn: &mut Worn) -> Status {
    let mut updater = Updater::new(worn, target(), Status::GOOD);
    let poll = |updater: &mut Updater<&mut Worn>| while updater.poll() != Next::Nothing {};
    updater.clear().unwrap();
    poll(&mut updater);
    let _ = updater
        .begin(None)
        .and_then(|()| updater.receive(&image_b().bytes()))
        .and_then(|()| updater.finish());
    poll(&mut updater);
    if updater.phase() == Phase::Committed {
        updater.install().unwrap();
        poll(&mut updater);
    }
    updater.status()
}

#[test]
fn a_flash_that_does_not_program_is_a_write_error() {
    // A bit of B that is 0, in its header and in its code.
    for at in [9, HEADER + image_b().code.iter().position(|byte| byte & 1 == 0).unwrap()] {
        for area in [APPLICATION, STAGING] {
            let word = u32::try_from(area + at).unwrap();
            let mut worn = Worn { flash: flash_with(&image_a(), 1), word, sector: u32::MAX };
            assert_eq!(update_worn(&mut worn), Status::refused(Refusal::Write), "{word:#x}");
            if area == STAGING {
                assert_starts(&mut worn.flash, &image_a());
            }
        }
    }
}

#[test]
fn a_sector_that_does_not_erase_is_code_4() {
    for (sector, starts) in [(STAGING, true), (APPLICATION, false)] {
        let mut worn =
            Worn { flash: flash_with(&image_a(), 1), word: 0, sector: u32::try_from(sector).unwrap() };
        assert_eq!(update_worn(&mut worn).code, 4);
        if starts {
            assert_starts(&mut worn.flash, &image_a());
        }
    }
}

#[test]
fn downloads_one_after_the_other_need_no_restart() {
    let mut flash = flash_with(&image_a(), 1);
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    let bad = &image_b().bytes()[..800];
    assert!(download(&mut updater, bad).is_err());
    assert_eq!((updater.poll(), updater.status()), (Next::Nothing, Status::refused(Refusal::Truncated)));
    assert_eq!(updater.begin(None), Err(Refusal::NotCleared));
    download(&mut updater, &image_b().bytes()).unwrap();
    updater.install().unwrap();
    run(&mut updater).unwrap();
    assert_starts(&mut flash, &image_b());
}

/// Code and header are complete and all sums are right, but the image is not signed. Such an application is refused
/// however it got there.
#[test]
fn an_installed_unsigned_application_is_not_started() {
    let mut flash = flash_with(&image_a(), 1);
    let forged = Image { header: Header::describe(description(1, 5), &image_b().code).unwrap(), ..image_b() };
    put(&mut flash, &forged);
    let start = |flash: &mut MockFlash, proof| boot(flash, &target(), Start { proof, ..Start::default() });
    let refused = Stay::NoProgram(Refusal::Signature);
    // The last copied image is still in staging and replaces the application.
    assert_eq!(start(&mut flash, Proof::None), Decision::Copy);
    clear(&mut flash);
    for proof in [Proof::None, Proof::Of(0), Proof::Of(image_a().header.crc())] {
        assert_eq!(start(&mut flash, proof), Decision::Stay(refused), "{proof:?}");
    }
    assert_eq!(refused.status(), Status::refused(Refusal::Signature));
    assert_eq!(start(&mut flash, Proof::Of(forged.header.crc())), Decision::Start(forged.header));
}

#[test]
fn a_proof_spares_the_signature_and_not_the_sum() {
    let mut flash = flash_with(&image_a(), 1);
    clear(&mut flash);
    let mut damaged = image_a();
    damaged.code[100] ^= 1;
    put(&mut flash, &damaged);
    for proof in [Proof::None, Proof::Of(image_a().header.crc()), Proof::Waived] {
        let decision = boot(&mut flash, &target(), Start { proof, ..Start::default() });
        assert_eq!(decision, Decision::Stay(Stay::NoProgram(Refusal::CodeCrc)), "{proof:?}");
    }
}

/// Erases staging.
fn clear(flash: &mut MockFlash) {
    let mut updater = Updater::new(flash, target(), Status::GOOD);
    updater.clear().unwrap();
    run(&mut updater).unwrap();
}

/// Puts an image into the application area without the bootloader, as a debugger does.
fn put(flash: &mut MockFlash, image: &Image) {
    for sector in target().layout.application().sectors() {
        flash.start_erase(sector.start).unwrap();
        while flash.is_busy().unwrap() {}
    }
    let start = target().layout.application().start();
    let mut bytes = image.bytes();
    bytes.resize(bytes.len().next_multiple_of(4), 0xFF);
    flash.program(start, &bytes).unwrap();
}
