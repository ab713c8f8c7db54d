use super::*;

fn number(of: u16) -> &'static Pdo {
    by_number(of).unwrap()
}

#[test]
fn numbers_are_those_of_the_profile() {
    let numbers: Vec<u16> = PDOS.iter().map(|pdo| pdo.number).collect();
    assert!(numbers.is_sorted());
    assert!(numbers.iter().all(|&of| number(of).number == of));
    assert_eq!(number(258).name, "load measuring unit");
    assert_eq!(by_number(266), None, "the gap between door control and the first door");
    assert_eq!(by_number(387), None);
}

#[test]
fn parameters_are_where_cia_301_puts_the_pdo_of_that_number() {
    for (of, tpdo, rpdo) in
        [(257, 0x1900, 0x1500), (258, 0x1901, 0x1501), (272, 0x190F, 0x150F), (386, 0x1981, 0x1581)]
    {
        assert_eq!(number(of).tpdo_index(), tpdo);
        for producer in [0, 1, 127, 255] {
            assert_eq!(number(of).rpdo_index(producer), Some(rpdo), "the producer is no part of it");
        }
    }
}

#[test]
fn a_consumer_has_an_rpdo_for_each_producer_of_a_shared_identifier() {
    for (of, tpdo, first, last) in [(2, 0x1801, 0x1401, 0x147F), (130, 0x1881, 0x1481, 0x14FF)] {
        assert_eq!(number(of).tpdo_index(), tpdo);
        assert_eq!(number(of).rpdo_index(1), Some(first));
        assert_eq!(number(of).rpdo_index(127), Some(last));
        for none in [0, 128, 255] {
            assert_eq!(number(of).rpdo_index(none), None);
        }
    }
}

#[test]
fn identifiers_are_those_of_the_profile() {
    for (of, producer, id) in
        [(258, 5, 0x188), (261, 127, 0x180), (2, 1, 0x501), (2, 127, 0x57F), (130, 9, 0x489)]
    {
        assert_eq!(number(of).can_id(producer), id);
        let producer = matches!(number(of).cob_id, CobId::PlusNode(_)).then_some(producer);
        // Bit 31: not valid. Bit 30: no remote frames.
        for flags in [0, 0x4000_0000, 0x8000_0000, 0xC000_0000] {
            assert_eq!(by_cob_id(flags | u32::from(id)), Some(Definition { pdo: number(of), producer }));
        }
    }
}

#[test]
fn other_identifiers_are_none() {
    for cob_id in [0, 0x080, 0x184, 0x480, 0x500, 0x580, 0x601, 0x1_0188, 0x2000_0188] {
        assert_eq!(by_cob_id(cob_id), None, "{cob_id:X}h");
    }
}

#[test]
fn fields_lie_one_behind_the_other_low_byte_first() {
    let Definition { pdo, .. } = by_cob_id(0x182).unwrap();
    let fields: Vec<Field> = Definition { pdo, producer: None }.fields().collect();
    let places: Vec<(u16, u8, u8)> =
        fields.iter().map(|field| (field.object.index, field.start, field.object.bits)).collect();
    assert_eq!(places, [(0x6400, 0, 16), (0x6403, 16, 8), (0x67FE, 24, 8), (0x6430, 32, 32)]);
    let data = [0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88];
    let values: Vec<Option<u64>> = fields.iter().map(|field| field.value(&data)).collect();
    assert_eq!(values, [Some(0x2211), Some(0x33), Some(0x44), Some(0x8877_6655)]);
    let short: Vec<bool> = fields.iter().map(|field| field.value(&data[..7]).is_some()).collect();
    assert_eq!(short, [true, true, true, false]);
    assert_eq!(by_cob_id(0x501).unwrap().fields().count(), 0, "a multiplexed PDO names its object itself");
}

#[test]
fn every_content_fits_a_frame_and_every_object_has_its_name() {
    for pdo in PDOS {
        let definition = Definition { pdo, producer: None };
        assert!(definition.fields().all(|field| field.value(&[0; 8]) == Some(0)), "{}", pdo.name);
        assert!(definition.fields().all(|field| name_of(field.object.index, field.object.sub).is_some()));
    }
    assert_eq!(name_of(0x6480, 1), Some("load"));
    assert_eq!(name_of(0x6383, 4), Some("position 4"));
    assert_eq!(name_of(0x6480, 2), None);
    assert_eq!(name_of(0x6481, 1), None);
}

#[test]
fn a_mapping_entry_is_index_sub_index_and_length() {
    assert_eq!(object(0x6480, 1, 16, "").entry(), 0x6480_0110);
    assert_eq!(object(0x0103, 0x81, 0x81, "").entry(), 0x0103_8181);
}

#[test]
fn the_reserved_byte_is_a_dummy_for_its_consumer() {
    assert_eq!(RESERVED.consumed(), Object { index: 0x0005, ..RESERVED });
    let load = object(0x6480, 1, 16, "load");
    assert_eq!(load.consumed(), load);
}

#[test]
fn velocities_and_the_effort_have_a_sign() {
    let signed: Vec<u16> = (0x6000..0x6800).filter(|&index| object(index, 0, 32, "").is_signed()).collect();
    assert_eq!(signed, [0x6406, 0x6430, 0x6433]);
}
