use abbe_metrology::Approach;
use abbe_metrology::readings::{Note, Readings, ReadingsFault};
use proptest::prelude::*;

const GOOD: &str = "approach,target_mm,run1,run2\n\
                    up,10,10.001,10.002\n\
                    up,20,20.001,20.003\n\
                    down,10,9.999,9.998\n\
                    down,20,19.999,19.998\n";

/// The sentence for `GOOD` with `old` replaced by `new`.
fn complaint(old: &str, new: &str) -> String {
    let text = GOOD.replacen(old, new, 1);
    assert_ne!(text, GOOD, "the replacement must change the file");
    Readings::parse("r.csv", text.as_bytes()).unwrap_err().to_string()
}

#[test]
fn reads_a_good_file() {
    let readings = Readings::parse("r.csv", GOOD.as_bytes()).unwrap();
    assert_eq!(readings.targets_mm(), [10.0, 20.0]);
    assert_eq!(readings.positions_mm(Approach::Up), [[10.001, 10.002], [20.001, 20.003]]);
    assert_eq!(readings.positions_mm(Approach::Down), [[9.999, 9.998], [19.999, 19.998]]);
    assert_eq!((readings.runs(), readings.count()), (2, 8));
    assert_eq!(readings.notes(), [Note::FewRuns { runs: 2 }, Note::FewTargets { targets: 2 }]);
}

#[test]
fn order_of_blocks_and_rows_blanks_quotes_and_line_ends_do_not_matter() {
    let same = [
        "approach,target_mm,run1,run2\ndown,20,19.999,19.998\ndown,10,9.999,9.998\nup,10,10.001,10.002\nup,20,20.001,20.003",
        "\u{feff}approach, target_mm, run1, run2\r\nup,10,10.001,10.002\r\ndown,10,9.999,9.998\r\n\r\nup,20,20.001,20.003\r\ndown,20,19.999,19.998\r\n",
        "\"approach\",\"target_mm\",\"run1\",\"run2\"\n\"up\",\"1e1\",10.001,10.002\nup,20,20.001,20.003\ndown,20,19.999,19.998\ndown,10,9.999,9.998\n",
    ];
    let expected = Readings::parse("r.csv", GOOD.as_bytes()).unwrap();
    for text in same {
        assert_eq!(Readings::parse("r.csv", text.as_bytes()).unwrap(), expected, "{text}");
    }
}

#[test]
fn every_fault_is_one_sentence_with_file_line_and_value() {
    let table = [
        ("10.001,10.002", "10.001", "r.csv, line 2: the cell of column `run2` is missing"),
        ("10.001,", ",", "r.csv, line 2: the cell of column `run1` is missing"),
        ("up,20,", ",20,", "r.csv, line 3: the cell of column `approach` is missing"),
        (
            "20.003\n",
            "20.003,7.5\n",
            "r.csv, line 3: there is an extra cell `7.5`: 5 cells under a header of 4 columns",
        ),
        (
            "9.998",
            "9,998",
            "r.csv, line 4: there is an extra cell `998`: 5 cells under a header of 4 columns",
        ),
        ("9.999", "n/a", "r.csv, line 4: `n/a` in column `run1` is not a number"),
        ("up,10,", "up,ten,", "r.csv, line 2: `ten` in column `target_mm` is not a number"),
        ("19.998", "NaN", "r.csv, line 5: `NaN` in column `run2` is not a finite number"),
        ("19.998", "-inf", "r.csv, line 5: `-inf` in column `run2` is not a finite number"),
        ("19.998", "1e999", "r.csv, line 5: `inf` in column `run2` is not a finite number"),
        ("19.998", "1e9", "r.csv, line 5: 1000000000 in column `run2` is beyond ±1000000 mm"),
        ("up,20", "sideways,20", "r.csv, line 3: the approach is `sideways`, expected `up` or `down`"),
        ("up,20,", "up,10.0,", "r.csv, line 3: target 10 mm appears a second time with approach up"),
        (
            "up,20,20.001,20.003\n",
            "up,20,20.001,20.003\nup,15,15,15\n",
            "r.csv, line 4: target 15 mm with approach up is out of order after 20 mm; \
             the targets of one approach must ascend or descend",
        ),
        (
            "down,20",
            "down,21",
            "r.csv, line 3: target 20 mm was approached up only; up and down need the same targets",
        ),
        (
            "down,20,19.999,19.998\n",
            "down,20,19.999,19.998\ndown,30,30,30\n",
            "r.csv, line 6: target 30 mm was approached down only; up and down need the same targets",
        ),
        ("target_mm", "target", "r.csv, line 1: column 2 of the header is `target`, expected `target_mm`"),
        ("run1,run2", "run1,run3", "r.csv, line 1: column 4 of the header is `run3`, expected `run2`"),
        (",target_mm,run1,run2", ",target_mm", "r.csv, line 1: the header has no column `run1`"),
        (
            ",run1,run2",
            ",run1",
            "r.csv, line 1: only one run; ISO 230-2 needs at least 2 runs and asks for 5",
        ),
        (
            "10.002\nup,20",
            "10.002\rup,20",
            "r.csv, line 2: there is an extra cell `20`: 7 cells under a header of 4 columns",
        ),
    ];
    for (old, new, expected) in table {
        assert_eq!(complaint(old, new), expected);
    }
}

#[test]
fn faults_of_the_whole_file() {
    let complaint = |bytes: &[u8]| Readings::parse("r.csv", bytes).unwrap_err().to_string();
    let empty = "r.csv: the file is empty; expected the header approach,target_mm,run1,run2,…";
    assert_eq!(complaint(b""), empty);
    assert_eq!(complaint(b" \r\n\n"), empty);
    assert_eq!(
        complaint(b"approach,target_mm,run1,run2\nup,1,\xff,2\n"),
        "r.csv, line 2: the file is not UTF-8 text"
    );
    let header = "approach,target_mm,run1,run2\n";
    assert_eq!(
        complaint(header.as_bytes()),
        "r.csv: 0 target(s); at least 2 are needed and ISO 230-2 asks for 5"
    );
    assert_eq!(
        complaint(format!("{header}up,1,1,1\ndown,1,1,1\n").as_bytes()),
        "r.csv: 1 target(s); at least 2 are needed and ISO 230-2 asks for 5"
    );
    assert_eq!(
        complaint(format!("{header}down,1,1,1\ndown,2,2,2\n").as_bytes()),
        "r.csv: every row has approach down; the evaluation needs both up and down"
    );
}

#[test]
fn a_file_that_cannot_be_read_or_written_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let absent = folder.path().join("absent.csv");
    let error = Readings::read(&absent).unwrap_err();
    assert!(matches!(error.fault, ReadingsFault::Unreadable(_)));
    assert!(error.to_string().contains("absent.csv: cannot be read: "), "{error}");
    let readings = Readings::parse("r.csv", GOOD.as_bytes()).unwrap();
    let error = readings.write(&folder.path().join("no/folder.csv")).unwrap_err();
    assert!(matches!(error.fault, ReadingsFault::Unwritable(_)));
}

#[test]
fn a_program_meets_the_same_rules_as_a_file() {
    let rows = |n: usize, runs: usize| vec![vec![1.0; runs]; n];
    let new = |targets: &[f64], up: &[Vec<f64>], down: &[Vec<f64>]| Readings::new(targets, up, down);
    assert!(new(&[1.0, 2.0], &rows(2, 2), &rows(2, 2)).is_ok());
    let fault = |targets: &[f64], up: &[_], down: &[_]| new(targets, up, down).unwrap_err();
    assert!(matches!(fault(&[1.0, 2.0], &rows(2, 1), &rows(2, 1)), ReadingsFault::OneRun));
    assert!(matches!(fault(&[1.0, 2.0], &rows(2, 2), &rows(2, 3)), ReadingsFault::ExtraCell { .. }));
    assert!(matches!(fault(&[1.0, 2.0], &rows(2, 3), &rows(2, 2)), ReadingsFault::MissingCell { .. }));
    assert!(matches!(fault(&[1.0], &rows(2, 2), &rows(2, 2)), ReadingsFault::MissingCell { .. }));
    assert!(matches!(fault(&[1.0, 2.0, 3.0], &rows(2, 2), &rows(3, 2)), ReadingsFault::OneSided { .. }));
    assert!(matches!(fault(&[1.0, 2.0, 3.0], &rows(3, 2), &rows(2, 2)), ReadingsFault::OneSided { .. }));
    assert!(matches!(fault(&[1.0, 1.0], &rows(2, 2), &rows(2, 2)), ReadingsFault::DuplicateTarget { .. }));
    assert!(matches!(fault(&[1.0, f64::NAN], &rows(2, 2), &rows(2, 2)), ReadingsFault::NotFinite { .. }));
}

#[test]
fn a_reading_in_the_wrong_unit_is_noted() {
    let text = GOOD.replacen("10.001", "1.0", 1);
    let notes = Readings::parse("r.csv", text.as_bytes()).unwrap().notes();
    assert!(notes.contains(&Note::LargeDeviation { target_mm: 10.0, deviation_mm: -9.0 }));
    assert!(notes[2].to_string().starts_with("a reading lies -9 mm from its target 10 mm"));
}

fn any_readings() -> impl Strategy<Value = Readings> {
    (2usize..8, 2usize..8).prop_flat_map(|(targets, runs)| {
        let rows = move || prop::collection::vec(prop::collection::vec(-200.0..200.0f64, runs), targets);
        let steps = prop::collection::vec(0.001..50.0f64, targets);
        (steps, rows(), rows()).prop_map(|(steps, up, down)| {
            let ascending = steps.iter().scan(-100.0, |at, step| {
                *at += step;
                Some(*at)
            });
            Readings::new(&ascending.collect::<Vec<_>>(), &up, &down).unwrap()
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn any_bytes_are_answered_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = Readings::parse("fuzz", &bytes);
    }

    #[test]
    fn any_text_of_the_right_letters_is_answered_without_panic(text in "[updown,.0-9eNa\\-\" \\r\\n]{0,300}") {
        let _ = Readings::parse("fuzz", format!("approach,target_mm,run1,run2\n{text}").as_bytes());
    }

    #[test]
    fn a_good_file_with_one_byte_changed_is_answered_without_panic(at in 0..GOOD.len(), byte: u8) {
        let mut bytes = GOOD.as_bytes().to_vec();
        bytes[at] = byte;
        if let Ok(readings) = Readings::parse("fuzz", &bytes) {
            prop_assert!(readings.targets_mm().is_sorted());
            prop_assert_eq!(readings.count(), 8);
        }
    }

}

proptest! {
    // Each case waits for a disk.
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn written_files_read_back_to_a_tenth_of_a_picometre(readings in any_readings()) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("readings.csv");
        readings.write(&path).unwrap();
        let back = Readings::read(&path).unwrap();
        for approach in Approach::BOTH {
            let pairs = readings.positions_mm(approach).iter().flatten().zip(back.positions_mm(approach).iter().flatten());
            for (wrote, read) in pairs {
                prop_assert!((wrote - read).abs() < 0.6e-10);
            }
        }
        prop_assert_eq!(back.to_csv(), readings.to_csv());
    }
}
