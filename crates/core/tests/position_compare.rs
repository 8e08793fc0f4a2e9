//! Position compare against brute force: each place by itself, edge by edge, and where a smooth motion really was.

use abbe_core::Pos;
use abbe_core::front::QuadratureCounter;
use abbe_core::front::compare::{Counted, Event, Fired, MOST, Places, PlacesError, Sampled, When};
use abbe_core::front::quadrature::levels;
use abbe_core::plan::Limits;
use abbe_core::plan::compare::Axis;
use abbe_core::plan::pieces::Piece;
use abbe_core::plan::scan::{Lines, Order, Scan};
use abbe_core::plan::transfer::{State, Transfer};
use rand::{RngExt, SeedableRng};
use rand_distr::Normal;
use rand_pcg::Pcg64Mcg;

mod walked;

use walked::STAGE;

/// One place by itself: what the rule says of it, without any other.
#[derive(Clone, Copy)]
struct Place {
    at: i64,
    armed_up: bool,
    armed_down: bool,
}

impl Place {
    fn new(at: i64, position: i64) -> Self {
        Self { at, armed_up: position < at, armed_down: position >= at }
    }

    /// Whether it fires, and upwards.
    fn fires(&mut self, position: i64, places: &Places) -> Option<bool> {
        let (up, down) = (self.armed_up && position >= self.at, self.armed_down && position < self.at);
        self.armed_up = !up && (self.armed_up || position < self.at - places.play);
        self.armed_down = !down && (self.armed_down || position >= self.at + places.play);
        (up && places.when != When::Down)
            .then_some(true)
            .or((down && places.when != When::Up).then_some(false))
    }
}

/// All places by themselves.
struct BruteForce {
    places: Places,
    each: Vec<Place>,
}

impl BruteForce {
    fn new(places: Places, position: i64) -> Self {
        let at = |k: u32| places.first + i64::from(k) * places.pitch;
        Self { places, each: (0..places.number).map(|k| Place::new(at(k), position)).collect() }
    }

    /// What fires, in the order of the way: numbers and directions.
    fn fires(&mut self, position: i64) -> Vec<(u32, bool)> {
        let places = self.places;
        let fires = |(k, place): (usize, &mut Place)| place.fires(position, &places).map(|up| (k as u32, up));
        let mut fired: Vec<(u32, bool)> = self.each.iter_mut().enumerate().filter_map(fires).collect();
        if fired.first().is_some_and(|(_, up)| !up) {
            fired.reverse();
        }
        fired
    }
}

fn random_places(random: &mut Pcg64Mcg, about: i64, unit: f64) -> Places {
    let mut any = |low: f64, high: f64| (unit * 10_f64.powf(random.random_range(low..high))) as i64;
    let (pitch, play) = (any(0.0, 2.0), any(-0.5, 1.5));
    let number = random.random_range(1..30_u32);
    let first = about - pitch * i64::from(random.random_range(0..number));
    let when = [When::Up, When::Down, When::Both][random.random_range(0..3)];
    Places {
        first,
        pitch: pitch.max(1),
        number,
        when,
        play: if random.random_range(0..4) == 0 { 0 } else { play },
    }
}

fn assert_kept(fired: &Fired, expected: &[(u32, bool)], context: &Places) {
    let told: Vec<(u32, bool)> = fired.as_slice().iter().map(|event| (event.place, event.up)).collect();
    let kept = expected.len().min(MOST);
    assert_eq!(told, expected[..kept], "{context:?}");
    assert_eq!(fired.lost as usize, expected.len() - kept, "{context:?}");
}

/// Steps, trembling, turns and jumps over many places at once; the tick wraps, and some ticks have no sample.
#[test]
fn samples_fire_what_each_place_by_itself_would_and_when() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (mut events, mut lost) = (0, 0);
    for _ in 0..3000 {
        let mut position = random.random_range(-1_000_000_000..1_000_000_000_i64);
        let places = random_places(&mut random, position, 1000.0);
        let mut tick = u32::MAX - 50;
        let mut compare = Sampled::new(places, tick, Pos::from_pm(position)).expect("places");
        let mut brute = BruteForce::new(places, position);
        let mut drift = 0_i64;
        for _ in 0..200 {
            if random.random_range(0..20) == 0 {
                drift = random.random_range(-3000..3000);
            }
            let jump =
                if random.random_range(0..50) == 0 { random.random_range(-300_000..300_000) } else { 0 };
            let next = position + drift + jump + random.random_range(-2000..2000);
            let ticks = if random.random_range(0..10) == 0 { random.random_range(1..5) } else { 1 };
            let fired = compare.sample(tick.wrapping_add(ticks), Pos::from_pm(next));
            assert_kept(&fired, &brute.fires(next), &places);
            for event in fired.as_slice() {
                let at = places.first + i64::from(event.place) * places.pitch;
                let part = (i128::from(at.abs_diff(position)) << 32) / i128::from(next.abs_diff(position));
                let exact = part * i128::from(ticks);
                let told = i128::from(event.time.wrapping_sub(u64::from(tick) << 32));
                // Rounded down for the first, and once for each behind it.
                assert!((0..=i128::from(ticks) * MOST as i128).contains(&(exact - told)), "{told} {exact}");
            }
            events += fired.as_slice().len();
            lost += fired.lost;
            (position, tick) = (next, tick.wrapping_add(ticks));
        }
    }
    assert!(events > 20_000 && lost > 1000, "{events} {lost}");
}

/// A decoder with its filter, edge by edge: a stage that trembles over its counts, turns, and counts through zero both ways.
#[test]
fn counts_fire_what_each_place_by_itself_would_and_when() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let mut events = 0;
    for filter in [1_u8, 4, 21] {
        for _ in 0..300 {
            let places = random_places(&mut random, 0, 1.0);
            // Power-on is at zero: what lies below is beyond the wrap. The decoder's zero is somewhere among the places.
            let away = random.random_range(-50..50_i64);
            let (a, b) = levels(0);
            let mut decoder = QuadratureCounter::new(filter, a, b);
            let mut compare = Counted::new(places, decoder.counter(), away).expect("places");
            let mut brute = BruteForce::new(places, away);
            let (mut told, mut expected) = (Vec::<Event>::new(), Vec::<Event>::new());
            let (mut clock, mut count, mut up) = (0_u64, 0_i64, true);
            for _ in 0..500 {
                let steady = if random.random_range(0..10) == 0 { 2 } else { 40 };
                if random.random_range(0..steady) == 0 {
                    up = !up;
                }
                count += if up { 1 } else { -1 };
                clock += u64::from(filter) + random.random_range(0..30);
                let (a, b) = levels(count);
                compare.follow(&mut decoder, clock, |fired| told.extend(fired.as_slice()));
                decoder.edge(clock, a, b, false);
                let time = clock + u64::from(filter);
                let fires = brute.fires(away + count).into_iter();
                expected.extend(fires.map(|(place, up)| Event { place, up, time }));
            }
            compare.follow(&mut decoder, u64::MAX, |fired| told.extend(fired.as_slice()));
            assert_eq!(told, expected, "{places:?}");
            assert_eq!(decoder.counter(), count as u32);
            events += told.len();
        }
    }
    assert!(events > 5000, "{events}");
}

#[test]
fn a_counter_that_jumps_passes_all_that_lies_between_at_once_through_the_wrap() {
    let places = Places { first: 10, pitch: 2, number: 20, when: When::Both, play: 0 };
    let mut compare = Counted::new(places, u32::MAX - 3, 0).expect("places");
    // 14 counts on: places at 10, 12, 14.
    let fired = compare.count(77, 10);
    let event = |place, up| Event { place, up, time: 77 };
    assert_eq!(fired.as_slice(), [event(0, true), event(1, true), event(2, true)]);
    assert_eq!(fired.lost, 0);
    // To 47, beyond the last one at 48 - 2 · 1: nine of seventeen are lost.
    let fired = compare.count(77, 43);
    assert_eq!((fired.as_slice().len(), fired.lost), (8, 8));
    assert_eq!(fired.as_slice()[0], event(3, true));
    let fired = compare.count(77, u32::MAX - 3);
    assert_eq!((fired.as_slice()[0], fired.lost), (event(18, false), 11));
}

/// Where it fires a smooth motion is off its place by a/8 of a tick's square at most. With `--nocapture` it prints how far.
#[test]
fn the_time_within_a_tick_is_that_of_the_motion_but_for_its_acceleration() {
    let litho = Limits { speed: 5e5, acceleration: 1000.0, jerk: 5.0 };
    for (name, limits) in [("microscope-100", STAGE), ("litho-120", litho)] {
        let mut random = Pcg64Mcg::seed_from_u64(3);
        let (mut worst, mut worst_at_speed, mut seen) = (0.0_f64, 0.0_f64, 0);
        for _ in 0..300 {
            let way = 10_f64.powf(random.random_range(6.0..9.3)) * if random.random() { 1.0 } else { -1.0 };
            let at = |position: f64| State { position, ..State::default() };
            let from = random.random_range(0.0..1e11_f64).round();
            let motion =
                Transfer::fastest(at(from), at(from + way.round()), &limits).expect("it is possible");
            let pitch = random.random_range(limits.speed / 6.0..2e7) as i64;
            let places = Places {
                first: (from + way.min(0.0)) as i64 + 7,
                pitch,
                number: 10_000,
                when: When::Both,
                play: 0,
            };
            let mut compare = Sampled::new(places, 0, Pos::from_pm(from as i64)).expect("places");
            for tick in 1..=motion.ticks().ceil() as u32 {
                let position = motion.at(f64::from(tick)).position.round();
                for event in compare.sample(tick, Pos::from_pm(position as i64)).as_slice() {
                    let state = motion.at(event.time as f64 / 2_f64.powi(32));
                    let off = (state.position - (places.first + i64::from(event.place) * pitch) as f64).abs();
                    worst = worst.max(off);
                    if state.acceleration == 0.0 && motion.at(f64::from(tick) - 1.0).acceleration == 0.0 {
                        worst_at_speed = worst_at_speed.max(off);
                    }
                    assert_eq!(event.up, way > 0.0);
                    seen += 1;
                }
            }
        }
        println!(
            "{name}: {seen} places, off by {worst:.1} pm at most, at full speed by {worst_at_speed:.2} pm"
        );
        assert!(seen > 5000, "{seen}");
        // Two positions are rounded to a picometre.
        assert!(worst <= limits.acceleration / 8.0 + 1.0, "{worst}");
        assert!(worst_at_speed <= 0.51, "{worst_at_speed}");
    }
}

/// A whole scan with a noisy reading: each place once a line, in order and in time, although the reading goes back now and then.
#[test]
fn each_line_of_a_noisy_scan_fires_each_place_once() {
    let at = |x: f64, y: f64| [Pos::from_um(x), Pos::from_um(y)];
    let scan = |speed: f64| Scan {
        corners: [at(100.0, 0.0), at(600.0, 100.0)],
        fast: Axis::X,
        lines: Lines::Number(5),
        order: Order::Serpentine,
        speed,
        settle: 100,
    };
    let mut random = Pcg64Mcg::seed_from_u64(4);
    // 20 nm rms, cut at 80 nm; in a tick the stage goes 2 µm, or 2 nm: it trembles over each place hundreds of times.
    for speed in [2e6, 2e4, 2e3] {
        let plan = scan(speed).plan(&[STAGE; 2]).expect("it is possible");
        let pieces: Vec<Piece> = plan.pieces().map(|piece| piece.expect("it fits")).collect();
        let path = walked::walked(&pieces, f64::from(plan.ticks()));
        walked::assert_within(&path, &[STAGE; 2]);
        let places =
            Places { first: 100_000_000, pitch: 500_000, number: 1000, when: When::Both, play: 160_000 };
        let noise = Normal::new(0.0, 20_000.0_f64).expect("a width");
        let mut reading = |tick: usize| {
            Pos::from_pm((path[tick][0] + random.sample(noise).clamp(-80_000.0, 80_000.0)) as i64)
        };
        let mut compare = Sampled::new(places, 0, reading(0)).expect("places");
        let mut events = Vec::new();
        for tick in 1..path.len() {
            let fired = compare.sample(tick as u32, reading(tick));
            assert_eq!(fired.lost, 0);
            events.extend_from_slice(fired.as_slice());
        }
        assert_eq!(events.len(), 5 * 1000, "{speed}");
        assert!(events.windows(2).all(|two| two[0].time <= two[1].time));
        for (line, events) in events.chunks(1000).enumerate() {
            let planned = plan.line(line as u32).expect("there is one");
            let up = line % 2 == 0;
            for (k, event) in events.iter().enumerate() {
                let place = if up { k } else { 999 - k } as u32;
                assert_eq!((event.place, event.up), (place, up));
                let way =
                    (places.first + i64::from(place) * places.pitch) as f64 - planned.from[0].pm() as f64;
                let due = f64::from(planned.enters) + way.abs() / speed;
                let off = (event.time as f64 / 2_f64.powi(32) - due) * speed;
                assert!(off.abs() <= 80_000.0 + 2.0, "{off} pm at {speed}");
            }
        }
    }
}

#[test]
fn a_stage_that_trembles_on_a_place_has_passed_it_once() {
    for when in [When::Up, When::Down, When::Both] {
        let places = Places { first: 1000, pitch: 1000, number: 3, when, play: 100 };
        let mut compare = Sampled::new(places, 0, Pos::from_pm(1900)).expect("places");
        let mut fired = Vec::new();
        let mut go =
            |tick: u32, pm: i64| fired.extend_from_slice(compare.sample(tick, Pos::from_pm(pm)).as_slice());
        for tick in 1..1000_u32 {
            go(tick, if tick % 2 == 1 { 2049 } else { 1950 });
        }
        // Up and far beyond, back below by as much as the play, up: not passed anew. Then by one more: passed.
        for (tick, pm) in [(1000, 2900), (1001, 1900), (1002, 2099), (1003, 1899), (1004, 2000)] {
            go(tick, pm);
        }
        let passed: Vec<(u64, bool)> = fired.iter().map(|event| (event.time >> 32, event.up)).collect();
        let expected: &[(u64, bool)] = match when {
            When::Up => &[(0, true), (1004, true)],
            When::Down => &[(1000, false)],
            When::Both => &[(0, true), (1000, false), (1004, true)],
        };
        assert_eq!(passed, expected);
        assert!(fired.iter().all(|event| event.place == 1));
    }
}

#[test]
fn what_are_no_places_is_refused() {
    let places = Places { first: 0, pitch: 10, number: 3, when: When::Up, play: 0 };
    let refused = |places: Places| {
        let error = Sampled::new(places, 0, Pos::ZERO).map(|_| ()).unwrap_err();
        assert_eq!(Counted::new(places, 0, 0).map(|_| ()), Err(error));
        error
    };
    assert_eq!(refused(Places { number: 0, ..places }), PlacesError::NoPlace);
    assert_eq!(refused(Places { pitch: 0, ..places }), PlacesError::Pitch(0));
    assert_eq!(refused(Places { pitch: -10, ..places }), PlacesError::Pitch(-10));
    assert_eq!(refused(Places { play: -1, ..places }), PlacesError::Play(-1));
    assert_eq!(refused(Places { first: i64::MAX - 19, ..places }), PlacesError::TooFar);
    assert_eq!(refused(Places { pitch: i64::MAX / 2, number: 4, ..places }), PlacesError::TooFar);
    // As far as it goes: from one end of 64 bits to the other.
    let whole = Places { first: i64::MIN, pitch: i64::MAX, number: 2, when: When::Both, play: i64::MAX };
    let mut compare = Sampled::new(whole, 0, Pos::from_pm(i64::MIN)).expect("places");
    let fired = compare.sample(1, Pos::from_pm(i64::MAX));
    assert_eq!(fired.as_slice().iter().map(|event| event.place).collect::<Vec<_>>(), [1]);
    assert_eq!(compare.sample(2, Pos::from_pm(i64::MIN)).as_slice().len(), 1);
}
