//! How fast frames follow each other, in whole numbers, so that no time is lost or won.

use std::fmt;

/// Frames per second, to a thousandth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRate {
    per_1000_seconds: u16,
}

impl FrameRate {
    /// The fastest that browsers show as it is: they slow down frames that are much shorter.
    pub const FASTEST: f64 = 60.0;
    /// One frame in ten seconds.
    pub const SLOWEST: f64 = 0.1;

    /// The nearest rate that there is; `None` beyond the slowest and fastest.
    #[must_use]
    pub fn new(per_second: f64) -> Option<Self> {
        (Self::SLOWEST..=Self::FASTEST)
            .contains(&per_second)
            .then(|| Self {
                per_1000_seconds: (1e3 * per_second).round() as u16,
            })
    }

    /// Frames per second.
    #[must_use]
    pub fn per_second(self) -> f64 {
        f64::from(self.per_1000_seconds) / 1e3
    }

    /// Milliseconds that a frame is shown: from the millisecond nearest to its beginning to that nearest to the next one's.
    pub(super) fn millis(self, frame: u32) -> u32 {
        let begins = |k: u64| {
            let rate = u64::from(self.per_1000_seconds);
            (2 * k * 1_000_000 + rate) / (2 * rate)
        };
        (begins(u64::from(frame) + 1) - begins(frame.into())) as u32
    }

    /// Seconds that a frame is shown, as a fraction.
    pub(super) fn delay(self) -> (u16, u16) {
        const PER_1000: u16 = 1000;
        let shared = common_divisor(PER_1000, self.per_1000_seconds);
        (PER_1000 / shared, self.per_1000_seconds / shared)
    }
}

impl fmt::Display for FrameRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.per_second().fmt(f)
    }
}

fn common_divisor(a: u16, b: u16) -> u16 {
    if b == 0 { a } else { common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_rate_drifts() {
        for per_second in [0.1, 0.999, 7.0, 12.5, 24.0, 29.97, 30.0, 60.0] {
            let rate = FrameRate::new(per_second).unwrap();
            assert_eq!(rate.per_second(), per_second);
            let mut millis = 0;
            for frame in 0..3600 {
                millis += rate.millis(frame);
                let exact = 1e3 * f64::from(frame + 1) / per_second;
                assert!((f64::from(millis) - exact).abs() <= 0.5, "{frame}");
            }
            let (seconds, parts) = rate.delay();
            assert!((f64::from(seconds) / f64::from(parts) * per_second - 1.0).abs() < 1e-12);
        }
        assert_eq!(FrameRate::new(30.0).unwrap().delay(), (1, 30));
        // The mean length, rounded down, would lose a second in a minute and a half.
        let thirty = FrameRate::new(30.0).unwrap();
        assert_eq!([0, 1, 2].map(|k| thirty.millis(k)), [33, 34, 33]);
    }

    #[test]
    fn rates_that_no_browser_shows_are_none() {
        for per_second in [0.0, -1.0, 0.09, 60.1, f64::NAN, f64::INFINITY] {
            assert_eq!(FrameRate::new(per_second), None, "{per_second}");
        }
    }
}
