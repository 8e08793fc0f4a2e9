use super::*;
use crate::specimen::Tissue;

/// A specimen given by a formula.
struct Formula<F>(F);

impl<F: Fn(f64, f64) -> f32 + Send + Sync> Specimen for Formula<F> {
    fn rgb(&self, x_um: f64, y_um: f64) -> [f32; 3] {
        [(self.0)(x_um, y_um); 3]
    }
}

/// A grey camera without faults or noise to speak of, one micrometre a pixel.
fn perfect() -> CameraSettings {
    CameraSettings {
        width_px: 200,
        height_px: 160,
        pixel_um: 1.0,
        pixel_scale_error: 0.0,
        angle_deg: 0.0,
        distortion_corner_px: 0.0,
        vignetting: 0.0,
        full_well_e: 1e7,
        read_noise_e: 0.0,
        white_level: 1.0,
        black_level: 0.0,
        colour: false,
        ..CameraSettings::default()
    }
}

fn camera(settings: CameraSettings) -> Camera {
    Camera::new(settings).unwrap()
}

/// Centre of brightness of a frame, pixels from its middle.
fn centroid(frame: &Frame) -> [f64; 2] {
    let (width, height) = (frame.width as usize, frame.height as usize);
    let mut sums = [0.0; 3];
    for row in 0..height {
        for column in 0..width {
            let light = f64::from(frame.data[row * width + column]);
            sums[0] += light;
            sums[1] += light * (column as f64 + 0.5 - 0.5 * width as f64);
            sums[2] += light * (row as f64 + 0.5 - 0.5 * height as f64);
        }
    }
    [sums[1] / sums[0], sums[2] / sums[0]]
}

/// A soft bright spot of 6 µm at a place.
fn spot(at: [f64; 2]) -> Formula<impl Fn(f64, f64) -> f32> {
    Formula(move |x, y| {
        let (dx, dy) = (x - at[0], y - at[1]);
        f64::max(1.0 - (dx * dx + dy * dy) / 36.0, 0.0) as f32
    })
}

fn mean_and_variance(values: &[u8]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().map(|v| f64::from(*v)).sum::<f64>() / count;
    let variance = values.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / count;
    (mean, variance)
}

#[test]
fn the_same_frame_on_one_thread_and_on_three() {
    let (camera, tissue) = (camera(CameraSettings::default()), Tissue::new(3));
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| camera.expose(&tissue, &[[10.0, 20.0]], 7))
    };
    let frame = on(1);
    assert_eq!(frame, on(3));
    assert_eq!(frame.data.len(), 640 * 480 * 3);
    assert_ne!(frame, camera.expose(&tissue, &[[10.0, 20.0]], 8), "another seed, other noise");
}

#[test]
fn each_axis_sign_moves_the_picture_the_way_it_says() {
    for (sign_x, sign_y) in [(1, 1), (-1, 1), (1, -1), (-1, -1)] {
        let camera = camera(CameraSettings { axis_sign_x: sign_x, axis_sign_y: sign_y, ..perfect() });
        let at = camera.specimen_centre_um([500.0, 300.0]);
        // The table goes on by (20, 10): the spot stays behind, on the side it came from.
        let seen = centroid(&camera.expose(&spot(at), &[[520.0, 310.0]], 0));
        assert!((seen[0] + 20.0 * f64::from(sign_x)).abs() < 0.05, "{seen:?}");
        assert!((seen[1] + 10.0 * f64::from(sign_y)).abs() < 0.05, "{seen:?}");
        let tile = camera.true_pixel_of([20.0, 10.0]);
        assert!((tile[0] - 20.0 * f64::from(sign_x)).abs() < 1e-9, "{tile:?}");
        assert!((tile[1] - 10.0 * f64::from(sign_y)).abs() < 1e-9, "{tile:?}");
    }
}

#[test]
fn tile_places_agree_with_what_the_pictures_show() {
    let camera = camera(CameraSettings {
        angle_deg: 3.0,
        pixel_scale_error: 0.02,
        pixel_um: 0.5,
        axis_sign_y: -1,
        ..perfect()
    });
    let (first, second) = ([100.0, -40.0], [121.0, -28.0]);
    let spot = spot(camera.specimen_centre_um([110.0, -35.0]));
    let (a, b) =
        (centroid(&camera.expose(&spot, &[first], 1)), centroid(&camera.expose(&spot, &[second], 2)));
    let (tile_a, tile_b) = (camera.true_pixel_of(first), camera.true_pixel_of(second));
    for axis in 0..2 {
        let (shown, told) = (a[axis] - b[axis], tile_b[axis] - tile_a[axis]);
        assert!((shown - told).abs() < 0.05, "axis {axis}: {shown} against {told}");
    }
}

#[test]
fn the_angle_and_the_scale_are_recovered_from_two_places() {
    let camera = camera(CameraSettings { distortion_corner_px: 0.0, ..CameraSettings::default() });
    let [right, down] = camera.true_pixel_of([1000.0, 0.0]);
    // The camera is turned by +0.3°, so the table's x axis runs 0.3° upwards in its picture.
    assert!(((-down).atan2(right).to_degrees() - 0.3).abs() < 1e-9);
    assert!((right.hypot(down) - 1000.0 / (0.5 * 1.002)).abs() < 1e-6);
}

#[test]
fn the_corner_is_drawn_in_by_one_pixel() {
    let with = camera(CameraSettings {
        pixel_um: 1.0,
        pixel_scale_error: 0.0,
        angle_deg: 0.0,
        ..Default::default()
    });
    let shown = with.specimen_offset_um(0.0, 0.0);
    let moved = (shown[0] + 320.0).hypot(shown[1] + 240.0);
    assert!((moved - 1.0).abs() < 1e-9, "moved {moved} px");
    assert!(shown[0] < -320.0 && shown[1] < -240.0, "a barrel shows more at the corner");
    assert_eq!(with.specimen_offset_um(320.0, 240.0), [0.0, 0.0]);
}

#[test]
fn motion_smears_along_its_direction_only() {
    let camera = camera(perfect());
    let width = |path: &[[f64; 2]]| {
        let frame = camera.expose(&spot([0.0, 0.0]), path, 0);
        let lit = |at: &dyn Fn(usize) -> usize, count: usize| {
            (0..count).filter(|index| frame.data[at(*index)] > 20).count() as f64
        };
        [lit(&|c| 80 * 200 + c, 200), lit(&|r| r * 200 + 100, 160)]
    };
    let still = width(&[[0.0, 0.0]]);
    let moved = width(&[[-10.0, 0.0], [0.0, 0.0], [10.0, 0.0]]);
    assert!(moved[0] >= still[0] + 10.0, "{still:?} {moved:?}");
    assert!(moved[1] <= still[1], "{still:?} {moved:?}");
}

#[test]
fn a_smear_is_centred_on_the_mean_place_and_a_tremor_is_no_smear() {
    let camera = camera(perfect());
    // Three quarters of the time at the start, then a quick step: the picture stays near the start.
    let slow = [[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [8.0, 0.0]];
    let seen = centroid(&camera.expose(&spot([0.0, 0.0]), &slow, 0));
    assert!((seen[0] + 1.0).abs() < 0.05, "{seen:?}");
    let points = exposure::points(&[[0.0, 0.0], [0.01, 0.0], [0.0, 0.02]], 1.0);
    assert_eq!(points.len(), 1);
    let share: f32 = exposure::points(&slow, 0.5).iter().map(|point| point.share).sum();
    assert!((share - 1.0).abs() < 1e-5, "{share}");
}

#[test]
fn a_closed_shutter_gives_black() {
    let frame = camera(CameraSettings { read_noise_e: 0.0, ..CameraSettings::default() }).expose(
        &Tissue::new(1),
        &[],
        0,
    );
    assert!(frame.data.iter().all(|count| *count == 4), "the black level");
}

#[test]
fn the_corner_is_a_quarter_darker() {
    let settings = CameraSettings { vignetting: 0.25, ..perfect() };
    let frame = camera(settings).expose(&Formula(|_, _| 0.8), &[[0.0, 0.0]], 0);
    let middle = f64::from(frame.data[80 * 200 + 100]);
    let corner = f64::from(frame.data[0]);
    assert!((middle - 0.8 * 255.0).abs() <= 1.0, "{middle}");
    assert!((corner / middle - 0.75).abs() < 0.01, "{}", corner / middle);
}

#[test]
fn noise_variance_is_shot_plus_read_plus_rounding() {
    let settings = CameraSettings { full_well_e: 2000.0, read_noise_e: 12.0, ..perfect() };
    let e_per_count = 2000.0 / 255.0;
    let camera = camera(settings);
    for level in [0.1_f32, 0.3, 0.6, 0.85] {
        let frame = camera.expose(&Formula(move |_, _| level), &[[0.0, 0.0]], 42);
        let (mean, variance) = mean_and_variance(&frame.data);
        let electrons = f64::from(level) * 2000.0;
        let expected = (electrons + 144.0) / (e_per_count * e_per_count) + 1.0 / 12.0;
        assert!((mean - electrons / e_per_count).abs() < 0.1, "mean {mean} at {level}");
        assert!((variance / expected - 1.0).abs() < 0.04, "variance {variance} for {expected} at {level}");
    }
}

#[test]
fn settings_out_of_range_are_named() {
    let wrong = [
        (CameraSettings { bits: 12, ..perfect() }, "bits"),
        (CameraSettings { pixel_um: 0.0, ..perfect() }, "pixel_um"),
        (CameraSettings { pixel_um: f64::NAN, ..perfect() }, "pixel_um"),
        (CameraSettings { axis_sign_x: 0, ..perfect() }, "axis_sign_x"),
        (CameraSettings { width_px: 0, ..perfect() }, "width_px"),
        (CameraSettings { vignetting: 1.5, ..perfect() }, "vignetting"),
        (CameraSettings { distortion_corner_px: 50.0, ..perfect() }, "distortion_corner_px"),
    ];
    for (settings, key) in wrong {
        let error = Camera::new(settings).unwrap_err();
        assert_eq!(error.key, key);
        assert!(error.to_string().contains(key), "{error}");
    }
}

#[test]
fn settings_are_read_from_toml_and_an_unknown_key_is_refused() {
    let read: CameraSettings = toml::from_str("pixel_um = 0.25\ncolour = false\n").unwrap();
    assert_eq!(read, CameraSettings { pixel_um: 0.25, colour: false, ..CameraSettings::default() });
    let error = toml::from_str::<CameraSettings>("pixel_mm = 0.25\n").unwrap_err();
    assert!(error.to_string().contains("pixel_mm"), "{error}");
}

#[test]
fn few_bits_keep_to_their_largest_count() {
    let camera = camera(CameraSettings { bits: 4, read_noise_e: 100.0, full_well_e: 1000.0, ..perfect() });
    let frame = camera.expose(&Formula(|_, _| 1.0), &[[0.0, 0.0]], 1);
    assert_eq!(frame.data.iter().max(), Some(&15));
}
