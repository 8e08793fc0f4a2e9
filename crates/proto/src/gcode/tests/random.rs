//! Whatever comes: a block or an error inside the line, and never anything else.

use super::*;
use proptest::prelude::*;

/// Reads lines one after the other; an error lies inside its line and changes nothing.
fn survive(lines: &[Vec<u8>]) -> Result<(), TestCaseError> {
    let mut state = State::new([Pos::ZERO; 2]);
    for line in lines {
        let before = state;
        if let Err(error) = read(&mut state, line) {
            let column = usize::from(error.column);
            prop_assert!(
                (1..=line.len()).contains(&column),
                "{error} in {:?}",
                String::from_utf8_lossy(line)
            );
            prop_assert!(error.to_string().contains("; "), "{error} says not what to do");
            prop_assert_eq!(state, before);
        }
        let within = |pos: &Pos| pos.abs() <= REACH;
        prop_assert!(state.position().iter().all(within));
    }
    Ok(())
}

/// Something that looks like a word.
fn word() -> impl Strategy<Value = String> {
    prop_oneof![
        4 => (0..TABLE.len()).prop_map(|at| TABLE[at].name.to_string()),
        6 => (0..9_usize, -30_i64..30, 0_i64..10).prop_map(|(letter, whole, tenth)| {
            format!("{}{whole}.{tenth}", b"XYIJRPLQF"[letter] as char)
        }),
        1 => "[A-Z][-+]?[0-9]{0,11}(\\.[0-9]{0,11})?",
        1 => Just("(text)".to_owned()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5_000, ..ProptestConfig::default() })]

    #[test]
    fn any_bytes_end(lines in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..300), 1..4)) {
        survive(&lines)?;
    }

    #[test]
    fn any_words_end(lines in prop::collection::vec(prop::collection::vec(word(), 0..7), 1..12)) {
        survive(&lines.iter().map(|words| words.join(" ").into_bytes()).collect::<Vec<_>>())?;
    }

    /// A place that is written goes to that place, in both units.
    #[test]
    fn places_are_exact(x in -100_000_000_000_000_i64..=100_000_000_000_000, hundredths in -393_700_000_000_i64..=393_700_000_000) {
        let mut state = State::new([Pos::ZERO; 2]);
        read(&mut state, format!("X{}", Number::from_billionths(x)).as_bytes()).unwrap();
        prop_assert_eq!(state.position()[0], Pos::from_pm(x));
        // Eight decimals of an inch: 254 pm each.
        let inches = Number::from_billionths(hundredths * 10);
        read(&mut state, format!("G20 Y{inches}").as_bytes()).unwrap();
        prop_assert_eq!(state.position()[1], Pos::from_pm(hundredths * 254));
    }

    /// A thousand steps there and back end where they began.
    #[test]
    fn relative_steps_do_not_drift(step in -1_000_000_000_i64..1_000_000_000, inches: bool) {
        let mut state = after(&["G91"]);
        let unit = if inches { "G20" } else { "G21" };
        for sign in [1, -1] {
            let line = format!("{unit} X{}", Number::from_billionths(sign * step));
            for _ in 0..100 {
                read(&mut state, line.as_bytes()).unwrap();
            }
        }
        prop_assert_eq!(state.position(), [Pos::ZERO; 2]);
    }

    /// A checksum that fits is accepted, and any other is refused.
    #[test]
    fn checksums_are_proven(number in 0_u32..1_000_000, x in -99_i64..99, wrong in 1_u8..=255) {
        let text = format!("N{number} G0 X{x}");
        let sum = text.bytes().fold(0, |sum, byte| sum ^ byte);
        let good = format!("{text}*{sum}");
        prop_assert!(parse(good.as_bytes()).is_ok());
        let error = parse(format!("{text}*{}", sum ^ wrong).as_bytes()).unwrap_err();
        prop_assert_eq!(error.fault, Fault::Checksum { written: sum ^ wrong, found: sum });
    }
}
