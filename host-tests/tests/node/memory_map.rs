//! memory.x compared with the sectors of the chip: a region that shares a sector with another region would be erased
//! together with that region.

use std::collections::BTreeMap;
use std::ops::Range;

const KIB: u32 = 1024;
const FLASH: u32 = 0x0800_0000;
const RAM: Range<u32> = 0x2000_0000..0x2000_0000 + 128 * KIB;

/// Sector sizes of the STM32F446RE in KiB (RM0390, 3.3); the STM32F405 and F407 begin with the same eight.
const SECTORS: [u32; 8] = [16, 16, 16, 16, 64, 128, 128, 128];

fn regions() -> BTreeMap<String, Range<u32>> {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../memory.x")).unwrap();
    text.lines().filter_map(region).collect()
}

/// `NAME (attributes) : ORIGIN = 0x.., LENGTH = 16K`
fn region(line: &str) -> Option<(String, Range<u32>)> {
    let (name, rest) = line.split_once('(')?;
    let origin = number(rest.split_once("ORIGIN =")?.1);
    let length = number(rest.split_once("LENGTH =")?.1);
    Some((name.trim().to_owned(), origin..origin + length))
}

fn number(text: &str) -> u32 {
    let text = text.trim_start();
    let end = text.find(|c: char| !c.is_ascii_alphanumeric()).unwrap_or(text.len());
    let word = &text[..end];
    match (word.strip_prefix("0x"), word.strip_suffix('K')) {
        (Some(hex), _) => u32::from_str_radix(hex, 16).unwrap(),
        (None, Some(kib)) => kib.parse::<u32>().unwrap() * KIB,
        (None, None) => word.parse().unwrap(),
    }
}

fn sector_starts() -> Vec<u32> {
    SECTORS
        .iter()
        .scan(FLASH, |next, kib| {
            let start = *next;
            *next += kib * KIB;
            Some(start)
        })
        .collect()
}

#[test]
fn every_part_of_flash_that_is_erased_on_its_own_is_made_of_whole_sectors() {
    let regions = regions();
    let starts = sector_starts();
    let end = FLASH + SECTORS.iter().sum::<u32>() * KIB;
    for range in [
        regions["BOOTLOADER"].clone(),
        regions["PARAMETERS"].clone(),
        regions["STAGING"].clone(),
        regions["KEPT"].clone(),
    ] {
        assert!(starts.contains(&range.start), "{:#x} is no sector's start", range.start);
        assert!(starts.contains(&range.end) || range.end == end, "{:#x} is no sector's end", range.end);
    }
}

/// No erase of another area may affect the sector of the security counter.
#[test]
fn the_security_counter_has_a_sector_of_its_own() {
    let regions = regions();
    let sector = |place: u32| sector_starts().into_iter().rfind(|start| *start <= place).unwrap();
    let inside = sector(regions["SECURITY"].start);
    assert_eq!(sector(regions["SECURITY"].end - 1), inside);
    // The count of erases is never erased either.
    let others = regions.iter().filter(|(name, _)| !["SECURITY", "WEAR"].contains(&name.as_str()));
    for (name, region) in others.filter(|(_, region)| region.start < RAM.start) {
        assert!(sector(region.start) != inside && sector(region.end - 1) != inside, "{name}");
    }
}

#[test]
fn the_regions_of_the_flash_do_not_overlap() {
    let regions = regions();
    let order =
        ["BOOTLOADER", "PARAMETERS", "SECURITY", "WEAR", "IMAGE_HEADER", "APPLICATION", "STAGING", "KEPT"];
    let mut next = FLASH;
    for name in order {
        assert!(regions[name].start >= next, "{name}");
        next = regions[name].end;
    }
    assert!(next <= FLASH + 512 * KIB);
}

#[test]
fn staging_and_the_kept_image_have_room_for_any_image_of_the_application_area_beside_their_records() {
    let regions = regions();
    let image = regions["IMAGE_HEADER"].len() + regions["APPLICATION"].len();
    assert_eq!(bsp::flash::update_layout::LAYOUT.longest_image() as usize, image);
    assert!(["STAGING", "KEPT"].iter().all(|name| regions[*name].len() >= image + 512));
}

/// The areas that the bootloader erases are those of memory.x, sector by sector.
#[test]
fn the_update_knows_the_areas_and_their_sectors() {
    let regions = regions();
    let layout = bsp::flash::update_layout::LAYOUT;
    assert_eq!(regions["IMAGE_HEADER"].len(), update::HEADER_LEN);
    for (area, region) in [
        (layout.security(), regions["SECURITY"].clone()),
        (layout.application(), regions["IMAGE_HEADER"].start..regions["APPLICATION"].end + 512),
        (layout.staging(), regions["STAGING"].clone()),
        (layout.kept(), regions["KEPT"].clone()),
    ] {
        assert_eq!(FLASH + area.start()..FLASH + area.end(), region);
        let inside = sector_starts().into_iter().filter(|start| region.contains(start));
        assert!(area.sectors().map(|sector| FLASH + sector.start).eq(inside));
    }
}

#[test]
fn the_parameter_store_has_two_pages_of_one_size() {
    let pages = regions()["PARAMETERS"].clone();
    let inside: Vec<u32> = sector_starts().into_iter().filter(|start| pages.contains(start)).collect();
    assert_eq!(inside, [pages.start, pages.start + 16 * KIB]);
}

/// VTOR must be aligned to the table's size rounded up to a power of two (PM0214, 4.4.4): 16 + 97 vectors.
#[test]
fn the_application_starts_where_vtor_may_point() {
    let table = ((16 + 97) * 4_u32).next_power_of_two();
    assert_eq!(regions()["APPLICATION"].start % table, 0);
}

/// A stack overflow must leave RAM, which is a fault, instead of overwriting data.
#[test]
fn the_stack_is_at_the_very_start_of_ram() {
    let regions = regions();
    assert_eq!(regions["STACK"].start, RAM.start);
    assert_eq!(regions["STACK"].end, regions["LOADER_RAM"].start);
    assert_eq!(regions["LOADER_RAM"].end, regions["NODE_RAM"].start);
    assert_eq!(regions["NODE_RAM"].end, regions["RETAINED"].start);
    assert_eq!(regions["RETAINED"].end, RAM.end);
}
