//! An analogue-to-digital converter for two channels.

use crate::noise::scattered;
use crate::plant::HeadPlant;
use crate::trig::floor;

/// A converter of 8 to 16 bits; its codes are left-aligned in 16.
#[derive(Clone, Debug)]
pub(super) struct Converter {
    bits: u8,
    /// LSB of half the range.
    full: f64,
    bow: f64,
    codes: f64,
    seed: u64,
}

impl Converter {
    pub(super) fn new(plant: &HeadPlant, seed: u64) -> Self {
        let full = f64::from(1 << (plant.bits - 1));
        Self { bits: plant.bits, full, bow: plant.bow_lsb, codes: plant.codes_lsb, seed }
    }

    /// The code of a signal (part of the full scale) in channel 0 or 1. Beyond the rails it is that of the rail.
    pub(super) fn code(&self, channel: i64, signal: f64) -> i16 {
        let inside = signal.clamp(-1.0, 1.0);
        // A bow between the ends of the range, upwards in one channel and downwards in the other.
        let sign = if channel == 0 { 1.0 } else { -1.0 };
        let bowed = inside * self.full + sign * self.bow * (1.0 - inside * inside);
        // Each code begins somewhat beside its place, the same each time.
        let place = floor(bowed) * 2 + channel;
        let code = floor(bowed + self.codes * scattered(self.seed, place) + 0.5);
        self.aligned(code.clamp(-(self.full as i64), self.full as i64 - 1))
    }

    fn aligned(&self, code: i64) -> i16 {
        (code << (16 - self.bits)) as i16
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn converter(bits: u8, bow: f64, codes: f64) -> Converter {
        Converter { bits, full: f64::from(1 << (bits - 1)), bow, codes, seed: 5 }
    }

    /// Largest and rms difference of the codes from a perfect converter, LSB, over all of the range but its rails.
    fn errors(converter: &Converter) -> (f64, f64) {
        let errors: Vec<f64> = (-4000..4000)
            .map(|i| {
                let signal = f64::from(i) / 4040.0;
                let lsb = f64::from(converter.code(0, signal)) / f64::from(1 << (16 - converter.bits));
                lsb - signal * converter.full
            })
            .collect();
        let square = errors.iter().map(|e| e * e).sum::<f64>() / 8000.0;
        (errors.iter().fold(0.0, |most: f64, e| most.max(e.abs())), square.sqrt())
    }

    #[test]
    fn a_perfect_converter_is_half_a_step_off_at_most_at_every_width() {
        for bits in 8..=16 {
            let (most, rms) = errors(&converter(bits, 0.0, 0.0));
            assert!(most < 0.5 + 1e-9, "{bits} bits: {most}");
            // A step's rms is 1/√12; at 16 bits the test's own steps are coarser.
            assert!(bits > 12 || (rms - 0.2887).abs() < 0.01, "{bits} bits: {rms}");
        }
    }

    #[test]
    fn bow_and_codes_have_their_sizes_and_repeat() {
        // 2 · (1 − u²) is 2 · √(8/15) rms over the range.
        let (most, rms) = errors(&converter(12, 2.0, 0.0));
        assert!((most - 2.5).abs() < 0.1 && (rms - 1.489).abs() < 0.03, "{most} {rms}");
        let scattered = converter(12, 0.0, 0.7);
        let (_, rms) = errors(&scattered);
        assert!((rms - (0.7f64 * 0.7 + 1.0 / 12.0).sqrt()).abs() < 0.04, "{rms}");
        assert_eq!(errors(&scattered), errors(&scattered.clone()));
        assert_ne!(scattered.code(0, 0.1234), Converter { seed: 6, ..scattered }.code(0, 0.2));
    }

    #[test]
    fn codes_are_left_aligned_and_stop_at_the_rails() {
        for (bits, high) in [(8, 0x7f00), (12, 0x7ff0), (16, 0x7fff)] {
            let plain = converter(bits, 0.0, 0.0);
            for signal in [1.0, 1.3, 100.0] {
                assert_eq!((plain.code(0, signal), plain.code(1, -signal)), (high, i16::MIN));
            }
            assert_eq!(plain.code(0, 0.0), 0);
        }
    }
}
