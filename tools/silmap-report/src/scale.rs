//! Logarithmic scales: round ends, round ticks, and where a value lies between them.

/// A range of positive values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LogScale {
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// The digits that ticks start with.
const DIGITS: [f64; 3] = [1.0, 2.0, 5.0];
/// More ticks than this are thinned to powers of ten.
const MOST_TICKS: usize = 9;

impl LogScale {
    /// The smallest range with ends at round values that holds all that are positive and finite, and no less than one step;
    /// `None` when there are none.
    pub(crate) fn around(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.filter(|v| *v > 0.0 && v.is_finite()) {
            least = least.min(value);
            most = most.max(value);
        }
        (least <= most).then(|| {
            // Values at a tick, up to rounding, are at its end of the range.
            const SLACK: f64 = 1e-9;
            let from = round_values(least, most)
                .filter(|v| *v <= least * (1.0 + SLACK))
                .fold(0.0, f64::max);
            let to = round_values(least, most)
                .filter(|v| *v >= most * (1.0 - SLACK) && *v > from)
                .fold(f64::INFINITY, f64::min);
            Self { from, to }
        })
    }

    /// Round values in the range.
    pub(crate) fn ticks(&self) -> Vec<f64> {
        const SLACK: f64 = 1e-9;
        let is_inside = |v: &f64| *v >= self.from * (1.0 - SLACK) && *v <= self.to * (1.0 + SLACK);
        let all: Vec<f64> = round_values(self.from, self.to).filter(is_inside).collect();
        if all.len() <= MOST_TICKS {
            return all;
        }
        let is_power = |v: &f64| (v.log10() - v.log10().round()).abs() < SLACK;
        all.into_iter().filter(is_power).collect()
    }

    /// Where a value lies, 0 at the range's start and 1 at its end; values outside are at the ends.
    pub(crate) fn place(&self, value: f64) -> f64 {
        if value <= self.from {
            return 0.0;
        }
        ((value / self.from).ln() / (self.to / self.from).ln()).min(1.0)
    }
}

/// Round values in a range, and some beyond both ends.
fn round_values(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let first = from.log10().floor() as i32 - 1;
    let last = to.log10().ceil() as i32 + 1;
    (first..=last).flat_map(|power| {
        DIGITS.map(|digit| {
            // Powers of ten below 1 are not exact: dividing rounds once only.
            if power < 0 {
                digit / 10_f64.powi(-power)
            } else {
                digit * 10_f64.powi(power)
            }
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_ticks_are_round() {
        let scale = LogScale::around([0.013, 0.4].into_iter()).unwrap();
        assert_eq!(
            scale,
            LogScale {
                from: 0.01,
                to: 0.5
            }
        );
        assert_eq!(scale.ticks(), [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]);
        let wide = LogScale::around([1e-4, 700.0].into_iter()).unwrap();
        assert_eq!(wide.to, 1000.0);
        assert!(wide.ticks().len() <= MOST_TICKS && wide.ticks().contains(&1.0));
    }

    #[test]
    fn a_single_value_has_room_and_none_has_no_scale() {
        let one = LogScale::around([2.0].into_iter()).unwrap();
        assert_eq!(one, LogScale { from: 2.0, to: 5.0 });
        assert_eq!(LogScale::around([0.0, f64::NAN, -1.0].into_iter()), None);
    }

    #[test]
    fn places_run_from_end_to_end() {
        let scale = LogScale {
            from: 1.0,
            to: 100.0,
        };
        for (value, place) in [
            (0.0, 0.0),
            (1.0, 0.0),
            (10.0, 0.5),
            (100.0, 1.0),
            (1e9, 1.0),
        ] {
            assert!((scale.place(value) - place).abs() < 1e-12, "{value}");
        }
    }
}
