//! Filters, units, digit shifts and status compared with golden values, which golden/cia404_edges.py has computed in
//! decimal arithmetic.

use profiles::pressure::{Channel, ChannelParameters, ChannelValues, Filter, Span, Unit};

const RESPONSE: &str = include_str!("../../golden/cia404_response.csv");
const UNIT: &str = include_str!("../../golden/cia404_unit.csv");
const DIGITS: &str = include_str!("../../golden/cia404_digits.csv");
const STATUS: &str = include_str!("../../golden/cia404_status.csv");

const STEP: f32 = 100_000.0;

fn number<T: std::str::FromStr<Err: std::fmt::Debug>>(text: &str) -> T {
    text.parse().unwrap()
}

/// The rows of a table, split into cells.
fn rows<const N: usize>(table: &'static str) -> impl Iterator<Item = [&'static str; N]> {
    let cells = |line: &'static str| line.split(',').collect::<Vec<_>>().try_into().unwrap();
    table.lines().skip(1).map(cells)
}

/// A channel in Pa whose spans are as wide as their types.
fn wide() -> ChannelParameters {
    ChannelParameters::new(Unit::pressure(0x0022_0000).unwrap(), Span { start: f32::MIN, end: f32::MAX })
}

fn sample(parameters: &ChannelParameters, field_value: f32) -> ChannelValues {
    Channel::new(parameters).sample(field_value, true)
}

#[test]
fn filters_answer_a_step_and_an_impulse_until_they_have_settled() {
    let rows: Vec<[&str; 5]> = rows(RESPONSE).collect();
    let responses = rows.chunk_by(|a, b| a[..3] == b[..3]);
    assert_eq!(responses.clone().count(), 20);
    for response in responses {
        let [kind, constant, stimulus, ..] = response[0];
        let mut filter = Filter::new(number(kind), number(constant));
        let input = |sample: usize| match sample {
            0 => 0.0,
            1 => STEP,
            _ if stimulus == "step" => STEP,
            _ => 0.0,
        };
        let mut outputs = (0..).map(|sample| filter.next(input(sample))).enumerate();
        for [.., sample, expected] in response {
            let (_, got) = outputs.find(|(at, _)| *at == number::<usize>(sample)).unwrap();
            let expected: f64 = number(expected);
            // The result is rounded once, from a state in double precision.
            let error = (f64::from(got) - expected).abs();
            let tolerance = expected.abs() * f64::from(f32::EPSILON) / 2.0 * 1.001;
            assert!(error <= tolerance, "{kind} {constant} {stimulus} {sample}: {got} for {expected}");
        }
        if stimulus == "step" {
            let (_, last) = outputs.next().unwrap();
            assert_eq!(last.to_bits(), STEP.to_bits(), "{kind} {constant} has settled");
        }
    }
}

#[test]
fn every_unit_with_every_prefix() {
    let mut count = 0;
    for [channel, code, field_value, expected, tolerance] in rows(UNIT) {
        let code = u32::from_str_radix(&code[2..], 16).unwrap();
        let unit = if channel == "pressure" { Unit::pressure(code) } else { Unit::temperature(code) };
        let value = unit.unwrap().of(number(field_value));
        let error = (f64::from(value) - number::<f64>(expected)).abs();
        assert!(error <= number(tolerance), "{code:08X} {field_value}: {value} for {expected}");
        count += 1;
    }
    assert_eq!(count, 37 * (7 * 3 + 3 * 6));
}

#[test]
fn every_digit_shift_at_the_limits_of_the_integers() {
    for row @ [digits, value, int16, int32, status] in rows(DIGITS) {
        let values = sample(&ChannelParameters { digits: number(digits), ..wide() }, number(value));
        assert_eq!(values.process_value.to_bits(), number::<f32>(value).to_bits());
        let got = (values.process_value16, values.process_value32, values.status);
        assert_eq!(got, (number(int16), number(int32), number(status)), "{row:?}");
    }
}

#[test]
fn the_status_at_and_beside_the_limits_of_each_span() {
    for row @ [format, start, end, value, status] in rows(STATUS) {
        let mut parameters = wide();
        match format {
            "REAL32" => parameters.span = Span { start: number(start), end: number(end) },
            "INTEGER16" => parameters.span16 = Span { start: number(start), end: number(end) },
            "INTEGER32" => parameters.span32 = Span { start: number(start), end: number(end) },
            other => panic!("{other}"),
        }
        assert_eq!(sample(&parameters, number(value)).status, number::<u8>(status), "{row:?}");
    }
}
