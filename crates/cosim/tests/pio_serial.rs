//! The serial receiver: every byte, baud errors, noise, missing stop bits.

use abbe_cosim::serial::{Received, Receiver};

const BAUD: f64 = 115_200.0;

fn bytes(of: impl IntoIterator<Item = u8>) -> Vec<Received> {
    of.into_iter().map(Received::Byte).collect()
}

#[test]
fn every_byte_is_received_back_to_back_at_three_percent_either_way() {
    for error in [-0.03, -0.02, -0.01, 0.0, 0.01, 0.02, 0.03] {
        let mut receiver = Receiver::new(BAUD, error);
        receiver.hold(true, 3.0);
        for byte in 0..=255 {
            receiver.send(byte);
        }
        receiver.hold(true, 2.0);
        assert_eq!(receiver.received(), bytes(0..=255), "{error}");
    }
}

#[test]
fn bytes_may_come_at_any_time() {
    let mut receiver = Receiver::new(BAUD, 0.01);
    for byte in 0..=255_u8 {
        receiver.hold(true, 1.0 + f64::from(byte) / 37.0);
        receiver.send(byte.wrapping_mul(73));
    }
    receiver.hold(true, 2.0);
    assert_eq!(receiver.received(), bytes((0..=255_u8).map(|byte| byte.wrapping_mul(73))));
}

#[test]
fn a_pulse_shorter_than_half_a_bit_is_no_start_bit() {
    let mut receiver = Receiver::new(BAUD, 0.0);
    for length in [0.05, 0.1, 0.2, 0.3, 0.4] {
        receiver.hold(true, 1.0);
        receiver.hold(false, length);
        receiver.hold(true, 0.7);
        receiver.send(0x55);
    }
    receiver.hold(true, 2.0);
    assert_eq!(receiver.received(), bytes([0x55; 5]));
}

#[test]
fn a_missing_stop_bit_is_told_and_the_next_byte_is_received() {
    let mut receiver = Receiver::new(BAUD, 0.0);
    receiver.hold(true, 2.0);
    receiver.send(b'a');
    receiver.send_with_stop(b'b', false);
    receiver.hold(true, 1.0);
    receiver.send(b'c');
    // A break of thirty bits is one error.
    receiver.hold(false, 30.0);
    receiver.hold(true, 1.0);
    receiver.send(0);
    receiver.hold(true, 2.0);
    let expected =
        [Received::Byte(b'a'), Received::Framing, Received::Byte(b'c'), Received::Framing, Received::Byte(0)];
    assert_eq!(receiver.received(), expected);
}
