//! The measurement chain compared with golden values, which golden/cia404_chain.py has computed in decimal arithmetic.

use profiles::pressure::{Channel, ChannelParameters, Filter, STATUS_INVALID, Span, Unit};

const CHAIN: &str = include_str!("../../golden/cia404_chain.csv");
const FILTER: &str = include_str!("../../golden/cia404_filter.csv");

fn number<T: std::str::FromStr<Err: std::fmt::Debug>>(text: &str) -> T {
    text.parse().unwrap()
}

fn unit(channel: &str, code: &str) -> Unit {
    let code = u32::from_str_radix(&code[2..], 16).unwrap();
    if channel == "pressure" { Unit::pressure(code) } else { Unit::temperature(code) }.unwrap()
}

#[test]
fn process_values() {
    for line in CHAIN.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let &[channel, code, field_value, factor, scaling_offset, offset, digits, ..] = &cells[..] else {
            panic!()
        };
        let mut parameters =
            ChannelParameters::new(unit(channel, code), Span { start: f32::MIN, end: f32::MAX });
        parameters.scaling_factor = number(factor);
        parameters.scaling_offset = number(scaling_offset);
        parameters.offset = number(offset);
        parameters.digits = number(digits);
        let values = Channel::new(&parameters).sample(number(field_value), true);

        let (exact, tolerance): (f64, f64) = (number(cells[7]), number(cells[8]));
        let error = (f64::from(values.process_value) - exact).abs();
        assert!(error <= tolerance, "{line}: {} is off by {error}", values.process_value);
        assert_eq!(values.process_value16, number::<i16>(cells[9]), "{line}");
        assert_eq!(values.process_value32, number::<i32>(cells[10]), "{line}");
        assert_eq!(values.status == STATUS_INVALID, cells[11] == "1", "{line}");
    }
}

#[test]
fn filters() {
    for line in FILTER.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let mut filter = Filter::new(number(cells[0]), number(cells[1]));
        for (input, output) in cells[2].split(' ').zip(cells[3].split(' ')) {
            let (got, expected): (f32, f64) = (filter.next(number(input)), number(output));
            // The result is rounded once, from a state in double precision.
            let error = (f64::from(got) - expected).abs();
            assert!(error <= expected.abs() * f64::from(f32::EPSILON) / 2.0 * 1.001, "{line}: {got}");
        }
    }
}

#[test]
fn the_example_of_the_profile() {
    let mut parameters = ChannelParameters::new(Unit::BAR, Span { start: 0.0, end: 10.0 });
    parameters.digits = 3;
    let values = Channel::new(&parameters).sample(204_800.0, true);
    assert_eq!((values.process_value16, values.process_value32), (2048, 2048));
}

#[test]
fn truncation_is_toward_zero() {
    let parameters = ChannelParameters::new(Unit::CELSIUS, Span { start: -300.0, end: 125.0 });
    let values = Channel::new(&parameters).sample(0.0, true);
    assert_eq!((values.process_value16, values.process_value32, values.status), (-273, -273, 0));
}
