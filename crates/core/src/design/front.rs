//! The front end: decoding and filter, and whether the stage's own edges pass.

use super::{AxisSettings, DesignError, Encoder, check};
use crate::front::{CLOCK_HZ, Decode, Setup, filter_for};

/// A clock of the front end, ns.
const CLOCK_NS: f64 = 1e9 / CLOCK_HZ as f64;
/// Part of the mean time between two edges that the filter may take. Of encoders whose channels are 90° ± 45° apart no
/// two edges are closer.
const PART: f64 = 0.5;

impl AxisSettings {
    pub(super) fn check_front(&self, number: usize) -> Result<(), DesignError> {
        let axis = Some(number);
        let known = Decode::of_counts(self.decode);
        check(axis, "decode", f64::from(self.decode), known.is_some(), "1, 2 or 4")?;
        let joined = matches!(self.encoder, Encoder::Analogue(analogue) if analogue.counted);
        let fits = !joined || known == Some(Decode::X4);
        let accepted =
            "4: an encoder with a sine and a cosine joins its phase with counts of a quarter period";
        check(axis, "decode", f64::from(self.decode), fits, accepted)?;
        let filter = filter_for(self.filter_ns);
        check(axis, "filter_ns", f64::from(self.filter_ns), filter.is_ok(), "0 … 2032 ns")?;
        self.check_edges(number)
    }

    /// The filter must not take the stage's own edges for pulses: see "When no count is lost" at [`crate::front::quadrature`].
    fn check_edges(&self, number: usize) -> Result<(), DesignError> {
        let room = libm::floor(PART * self.edge_ns() / CLOCK_NS);
        let accepted = "smaller, or count_um larger: two edges would come within two clocks of 125 MHz";
        check(Some(number), "speed_mm_s", self.speed_mm_s, room >= 1.0, accepted)?;
        if f64::from(self.front().filter) <= room {
            return Ok(());
        }
        Err(DesignError {
            axis: Some(number),
            key: "filter_ns",
            value: f64::from(self.filter_ns),
            accepted: "shorter than half the time between two edges at the largest speed that the law asks for",
            at_most: Some(((room - 1.0) * CLOCK_NS) as u32),
        })
    }

    /// Mean time between two edges, on either channel, at the largest speed that the law may ask for, ns.
    fn edge_ns(&self) -> f64 {
        let period_um = match self.encoder {
            Encoder::Digital => self.count_um * f64::from(self.decode),
            Encoder::Analogue(analogue) => analogue.period_um,
        };
        period_um / 4.0 / self.motor.fastest_mm_s(self.speed_mm_s) * 1e6
    }

    /// Settings that have passed [`Self::check_front`].
    pub(super) fn front(&self) -> Setup {
        Setup {
            decode: Decode::of_counts(self.decode).unwrap_or_default(),
            filter: filter_for(self.filter_ns).unwrap_or(1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::{Analogue, Config, Motor, StageSettings};

    fn built(axis: &AxisSettings) -> Result<Config<1>, DesignError> {
        StageSettings { axes: [*axis], ..StageSettings::default() }.build()
    }

    #[test]
    fn each_decoding_and_filter_is_what_the_front_end_is_set_to() {
        for (decode, expected) in [(1, Decode::X1), (2, Decode::X2), (4, Decode::X4)] {
            for (filter_ns, filter) in [(0, 1), (300, 39), (2000, 251)] {
                let axis = AxisSettings { decode, filter_ns, ..AxisSettings::default() };
                let count_um = 0.4 / f64::from(decode);
                let config = built(&AxisSettings { count_um, ..axis }).unwrap();
                assert_eq!(config.axes[0].front, Setup { decode: expected, filter });
            }
        }
    }

    #[test]
    fn what_the_front_end_cannot_do_is_named() {
        let good = AxisSettings::default();
        let analogue =
            AxisSettings { count_um: 0.2, encoder: Encoder::Analogue(Analogue::default()), ..good };
        let uncounted = Encoder::Analogue(Analogue { counted: false, ..Analogue::default() });
        let fast = AxisSettings { count_um: 0.001, speed_mm_s: 100.0, ..good };
        for (axis, key, value, accepted) in [
            (AxisSettings { decode: 0, ..good }, "decode", 0.0, "1, 2 or 4"),
            (AxisSettings { decode: 3, ..good }, "decode", 3.0, "1, 2 or 4"),
            (AxisSettings { decode: 2, ..analogue }, "decode", 2.0, "4: an encoder"),
            (AxisSettings { filter_ns: 2033, ..good }, "filter_ns", 2033.0, "0 … 2032 ns"),
            (fast, "speed_mm_s", 100.0, "smaller, or count_um larger"),
        ] {
            let error = built(&axis).unwrap_err();
            assert_eq!((error.axis, error.key, error.value), (Some(0), key, value), "{error}");
            assert!(error.accepted.starts_with(accepted), "{error}");
        }
        // Nothing is joined with the counts of a counter that is not looked at.
        assert!(built(&AxisSettings { decode: 2, encoder: uncounted, ..analogue }).is_ok());
    }

    #[test]
    fn a_filter_that_would_swallow_edges_is_refused_with_the_longest_that_would_not() {
        // Period and largest speed say how close edges are, whatever is counted of them: half of 0.05 µm at 24 mm/s is
        // 1041.7 ns, 130 clocks.
        for decode in [1, 2, 4] {
            let count_um = 0.2 / f64::from(decode);
            let axis = AxisSettings { count_um, decode, filter_ns: 1033, ..AxisSettings::default() };
            let error = built(&axis).unwrap_err();
            assert_eq!((error.key, error.value, error.at_most), ("filter_ns", 1033.0, Some(1032)));
            assert!(error.to_string().ends_with("the law asks for, here at most 1032"), "{error}");
            assert!(built(&AxisSettings { filter_ns: 1032, ..axis }).is_ok());
        }
        // A DC motor may run as fast as full duty drives it.
        let motor = Motor::Dc { full_speed_mm_s: 48.0, friction_mm_s: 2.0 };
        let axis = AxisSettings { motor, filter_ns: 1033, ..AxisSettings::default() };
        assert_eq!(built(&axis).unwrap_err().at_most, Some(1032));
        assert!(built(&AxisSettings { filter_ns: 1032, ..axis }).is_ok());
    }
}
