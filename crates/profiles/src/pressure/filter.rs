//! Filters on the field value, objects 61A0h and 61A1h.
//!
//! The state has twice the digits of single precision ([`Precise`]). With a constant of 255, single precision would
//! drop increments below 255 units of the last place, and the output would stop short of its target.

use super::precise::{Divisor, Precise};

/// The filter of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    kind: Kind,
    constant: u8,
    divisor: Divisor,
    /// Last output; `None` until the first input.
    output: Option<Precise>,
    /// Sum of the inputs in the present block, for the repeating average.
    sum: Precise,
    count: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    None,
    MovingAverage,
    RepeatingAverage,
}

impl Filter {
    /// The filter for the values of 61A0h and 61A1h. Types above 2 are accepted and act as no filter; a constant of 0
    /// acts as 1.
    #[must_use]
    pub fn new(kind: u8, constant: u8) -> Filter {
        let kind = match kind {
            1 => Kind::MovingAverage,
            2 => Kind::RepeatingAverage,
            _ => Kind::None,
        };
        let constant = constant.max(1);
        Filter { kind, constant, divisor: Divisor::new(constant), output: None, sum: Precise::ZERO, count: 0 }
    }

    /// Whether both filters have the same parameters, whatever their states.
    #[must_use]
    pub fn is_like(&self, other: &Filter) -> bool {
        (self.kind, self.constant) == (other.kind, other.constant)
    }

    /// Number of inputs that fill the filter: its constant, or one without a filter.
    #[must_use]
    pub fn length(&self) -> u16 {
        match self.kind {
            Kind::None => 1,
            Kind::MovingAverage | Kind::RepeatingAverage => self.constant.into(),
        }
    }

    /// Forgets all inputs.
    pub fn restart(&mut self) {
        (self.output, self.sum, self.count) = (None, Precise::ZERO, 0);
    }

    /// Takes an input and returns the output. The first input is the first output, so the output never starts with a
    /// step from 0.
    pub fn next(&mut self, input: f32) -> f32 {
        match self.kind {
            Kind::None => input,
            Kind::MovingAverage => self.moving_average(Precise::of(input)).rounded(),
            Kind::RepeatingAverage => self.repeating_average(Precise::of(input)).rounded(),
        }
    }

    fn moving_average(&mut self, input: Precise) -> Precise {
        let last = self.output.unwrap_or(input);
        *self.output.insert(last.plus(input.minus(last).over(self.divisor)))
    }

    /// Gives a new output at the end of every block; the output stays constant in between.
    fn repeating_average(&mut self, input: Precise) -> Precise {
        self.sum = self.sum.plus(input);
        self.count = self.count.saturating_add(1);
        if self.count < self.constant {
            return *self.output.get_or_insert(input);
        }
        let average = self.sum.over(self.divisor);
        (self.sum, self.count) = (Precise::ZERO, 0);
        *self.output.insert(average)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::precise::LARGEST;
    use super::*;

    fn outputs(kind: u8, constant: u8, inputs: &[f32]) -> Vec<f32> {
        let mut filter = Filter::new(kind, constant);
        inputs.iter().map(|&input| filter.next(input)).collect()
    }

    #[test]
    fn a_constant_of_one_passes_everything() {
        let inputs = [3.0, -1.0, 7.5];
        for kind in [0, 1, 2, 3, 255] {
            assert_eq!(outputs(kind, 1, &inputs), inputs);
        }
    }

    #[test]
    fn the_repeating_average_holds_for_a_block() {
        assert_eq!(outputs(2, 3, &[1.0, 2.0, 6.0, 10.0, 10.0, 13.0]), [1.0, 1.0, 3.0, 3.0, 3.0, 11.0]);
    }

    #[test]
    fn the_moving_average_starts_at_the_first_input_and_settles_exactly() {
        assert_eq!(outputs(1, 2, &[8.0, 0.0, 0.0]), [8.0, 4.0, 2.0]);
        let mut filter = Filter::new(1, 255);
        filter.next(0.0);
        let settled = (0..20_000).map(|_| filter.next(100_000.0)).last();
        assert_eq!(settled, Some(100_000.0));
    }

    /// The same filters in double precision.
    fn in_double(kind: u8, constant: u8, inputs: &[f32]) -> Vec<f64> {
        let (mut output, mut block) = (f64::from(inputs[0]), Vec::new());
        let mut step = |input: f64| {
            block.push(input);
            if kind == 1 {
                output += (input - output) / f64::from(constant);
            } else if block.len() == usize::from(constant) {
                output = block.drain(..).sum::<f64>() / f64::from(constant);
            }
            output
        };
        inputs.iter().map(|&input| step(input.into())).collect()
    }

    /// Numbers of one sign and of both signs, of similar and of different size.
    fn any_inputs() -> impl Strategy<Value = Vec<f32>> {
        let any = prop_oneof![0.0..1e6_f32, -1e3..1e3_f32, -1e30..1e30_f32, Just(0.0)];
        prop::collection::vec(any, 1..600)
    }

    proptest! {
        #[test]
        fn agrees_with_double_precision(kind in 1..=2_u8, constant in 1..=255_u8, inputs in any_inputs()) {
            let largest = inputs.iter().fold(0.0, |largest, input| f64::max(largest, input.abs().into()));
            for (got, expected) in outputs(kind, constant, &inputs).into_iter().zip(in_double(kind, constant, &inputs)) {
                let tolerance = expected.abs() * f64::from(f32::EPSILON) / 2.0 + largest * 2_f64.powi(-44);
                prop_assert!((f64::from(got) - expected).abs() <= tolerance, "{} for {}", got, expected);
            }
        }

        #[test]
        fn any_input_gives_a_number(kind: u8, constant: u8, inputs in prop::collection::vec(any::<f32>(), 1..600)) {
            let inputs: Vec<f32> = inputs.into_iter().filter(|input| input.is_finite()).collect();
            prop_assert!(outputs(kind, constant, &inputs).iter().all(|output| output.is_finite()));
        }
    }

    #[test]
    fn the_largest_numbers_are_held() {
        for sign in [1.0, -1.0] {
            let inputs = [f32::MAX * sign, f32::MIN * sign, f32::MAX * sign];
            assert_eq!(outputs(1, 1, &inputs), [LARGEST * sign, -LARGEST * sign, LARGEST * sign]);
            assert_eq!(outputs(2, 255, &[f32::MAX * sign; 256]), [LARGEST * sign; 256]);
        }
    }
}
