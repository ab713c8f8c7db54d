//! Filters on the field value, objects 61A0h and 61A1h.
//!
//! The state is double precision: with a constant of 255, single precision would drop increments below 255 units
//! of the last place and the output would stick beside its target.

/// The filter of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    kind: Kind,
    constant: u8,
    /// Output; `None` until the first input.
    output: Option<f64>,
    /// Inputs of the block under way, for the repeating average.
    sum: f64,
    count: u8,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    None,
    MovingAverage,
    RepeatingAverage,
}

impl Filter {
    /// By the values of 61A0h and 61A1h. Types above 2 are accepted and act as none; a constant of 0 acts as 1.
    #[must_use]
    pub fn new(kind: u8, constant: u8) -> Filter {
        let kind = match kind {
            1 => Kind::MovingAverage,
            2 => Kind::RepeatingAverage,
            _ => Kind::None,
        };
        Filter { kind, constant: constant.max(1), output: None, sum: 0.0, count: 0 }
    }

    /// Whether it is the same filter, whatever its state.
    #[must_use]
    pub fn is_like(&self, other: &Filter) -> bool {
        (self.kind, self.constant) == (other.kind, other.constant)
    }

    /// Takes an input and gives the output. The first input is the first output, so that nothing starts with a step from 0.
    #[allow(clippy::cast_possible_truncation)]
    pub fn next(&mut self, input: f32) -> f32 {
        match self.kind {
            Kind::None => input,
            Kind::MovingAverage => self.moving_average(input.into()) as f32,
            Kind::RepeatingAverage => self.repeating_average(input.into()) as f32,
        }
    }

    fn moving_average(&mut self, input: f64) -> f64 {
        let last = self.output.unwrap_or(input);
        *self.output.insert(last + (input - last) / f64::from(self.constant))
    }

    /// A new output at the end of every block, held in between.
    fn repeating_average(&mut self, input: f64) -> f64 {
        self.sum += input;
        self.count = self.count.saturating_add(1);
        if self.count < self.constant {
            return *self.output.get_or_insert(input);
        }
        let average = self.sum / f64::from(self.constant);
        (self.sum, self.count) = (0.0, 0);
        *self.output.insert(average)
    }
}

#[cfg(test)]
mod tests {
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
}
