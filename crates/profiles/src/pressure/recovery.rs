//! End of a fault: the moment from which the filtered values are those of an intact sensor again.

use super::Filter;

/// Samples after a fault that are ignored: the conversions of the first one began during the fault, so their mean is
/// neither the fault nor the signal.
const SETTLING: u16 = 2;

/// Holds a fault until the filter contains good samples only.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recovery {
    /// Number of good samples still missing.
    missing: u16,
}

impl Recovery {
    /// Takes note of a sample before the filter takes it. Returns whether the values still count as faulty. The filter
    /// restarts with the first sample that is not ignored.
    #[inline]
    pub fn next(&mut self, is_faulty: bool, filter: &mut Filter) -> bool {
        let is_well = !is_faulty && self.missing == 0;
        !is_well && self.hold(is_faulty, filter)
    }

    // Most samples are good ones, and their processing time is short.
    #[cold]
    #[inline(never)]
    fn hold(&mut self, is_faulty: bool, filter: &mut Filter) -> bool {
        let length = filter.length();
        if is_faulty {
            self.missing = length + SETTLING - 1;
            return true;
        }
        if self.missing >= length {
            filter.restart();
        }
        self.missing = self.missing.saturating_sub(1);
        self.missing > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Outputs of the filter after a fault, from the end of the fault on.
    fn after_a_fault(kind: u8, constant: u8, inputs: &[f32]) -> Vec<f32> {
        let (mut filter, mut recovery) = (Filter::new(kind, constant), Recovery::default());
        for input in [0.1, 7.0, 0.9] {
            assert!(recovery.next(true, &mut filter));
            filter.next(input);
        }
        let mut sample = |input: &f32| {
            let is_held = recovery.next(false, &mut filter);
            let output = filter.next(*input);
            (!is_held).then_some(output)
        };
        inputs.iter().filter_map(&mut sample).collect()
    }

    #[test]
    fn the_first_sample_after_a_fault_does_not_count() {
        for (kind, constant) in [(0, 1), (0, 255), (1, 1), (2, 1)] {
            assert_eq!(after_a_fault(kind, constant, &[5.0, 2.0, 3.0]), [2.0, 3.0], "{kind}, {constant}");
        }
    }

    #[test]
    fn a_filter_is_filled_before_anything_comes_out() {
        assert_eq!(after_a_fault(2, 3, &[9.0, 2.0, 3.0, 4.0, 6.0, 6.0, 6.0]), [3.0, 3.0, 3.0, 6.0]);
        assert_eq!(after_a_fault(1, 2, &[9.0, 4.0, 4.0, 2.0]), [4.0, 3.0]);
        assert_eq!(after_a_fault(2, 255, &[1.0; 255]), []);
        assert_eq!(after_a_fault(2, 255, &[1.0; 256]), [1.0]);
    }

    #[test]
    fn without_a_fault_everything_comes_out() {
        let (mut filter, mut recovery) = (Filter::new(2, 3), Recovery::default());
        for (input, output) in [(1.0, 1.0), (2.0, 1.0), (6.0, 3.0)] {
            assert!(!recovery.next(false, &mut filter));
            assert!((filter.next(input) - output).abs() < f32::EPSILON);
        }
    }
}
