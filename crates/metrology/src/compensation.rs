//! The compensation of a stage: one error curve an axis, its file, and the inverse that applies it.
//!
//! The file is TOML, one table an axis, with what a doubter asks of a calibration: how many runs, how warm, how well
//! the curve fits. Loading refuses, with file and line, everything that would make a stage worse than it was.

use std::f64::consts::PI;
use std::fmt;
use std::fs;
use std::io;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use crate::axis::Axis;
use crate::fit::{DegreeQuality, Fit};
use crate::polynomial::{MAX_DEGREE, Polynomial, PolynomialFault};
use crate::whole_file;

/// Version of the file's form.
pub const VERSION: u32 = 1;

/// No stage worth compensating errs by more, µm.
pub const LARGEST_ERROR_UM: f64 = 1000.0;

/// Above this slope |de/dx| (mm of error per mm) a curve is taken for a mistake; at 1 the scale would fold.
pub const STEEPEST_SLOPE: f64 = 0.05;

/// The inverse is found when a step is no longer than this, mm.
pub const INVERSE_STEP_MM: f64 = 1e-9;

/// Steps the inverse may take. Each is at most [`STEEPEST_SLOPE`] of the one before and the first at most 1 mm inside
/// the range, so eight do there; twelve do for targets 1 km outside it.
pub const INVERSE_STEPS: usize = 12;

/// The error of one axis along its travel: a polynomial inside the fitted range, straight on outside it.
#[derive(Clone, Debug, PartialEq)]
pub struct ErrorCurve(Polynomial);

/// Why a polynomial cannot compensate an axis.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveFault {
    /// It is not even a polynomial.
    #[error(transparent)]
    Polynomial(#[from] PolynomialFault),
    /// Too large an error.
    #[error("the error of {error_um:.1} µm at {x_mm:.3} mm is beyond ±{LARGEST_ERROR_UM} µm")]
    TooLarge {
        /// Where.
        x_mm: f64,
        /// How large.
        error_um: f64,
    },
    /// Too steep.
    #[error("the error changes by {slope:.4} mm per mm at {x_mm:.3} mm, the limit is ±{STEEPEST_SLOPE}")]
    TooSteep {
        /// Where.
        x_mm: f64,
        /// How steep, mm per mm.
        slope: f64,
    },
}

/// The command that brings the table to a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inverse {
    /// Command `c` with `c + e(c)` = target to within 0.1 nm, mm.
    pub command_mm: f64,
    /// Steps taken, at most [`INVERSE_STEPS`].
    pub steps: usize,
}

impl ErrorCurve {
    /// Accepts a polynomial whose error stays within ±1 mm and whose slope stays below 0.05 on its whole range.
    ///
    /// Both are checked at 32 Chebyshev nodes a degree, between which a polynomial exceeds them by less than 0.2 %.
    ///
    /// # Errors
    /// [`CurveFault`] with the place.
    pub fn new(polynomial: Polynomial) -> Result<Self, CurveFault> {
        let (x_mm, error_um) = largest(&polynomial, |x_mm| polynomial.value_um(x_mm));
        // Coefficients near the end of f64 can make a NaN here, which no comparison would catch.
        if error_um.is_nan() || error_um.abs() > LARGEST_ERROR_UM {
            return Err(CurveFault::TooLarge { x_mm, error_um });
        }
        let (x_mm, slope) = largest(&polynomial, |x_mm| polynomial.slope_um_per_mm(x_mm) / 1e3);
        if slope.is_nan() || slope.abs() >= STEEPEST_SLOPE {
            return Err(CurveFault::TooSteep { x_mm, slope });
        }
        Ok(Self(polynomial))
    }

    /// The polynomial, valid inside its range.
    pub fn polynomial(&self) -> &Polynomial {
        &self.0
    }

    /// Error at `x_mm` (actual minus commanded) in µm.
    ///
    /// Outside the range the curve goes on along its end tangent: nothing was measured there, and a polynomial would
    /// run away with its highest power.
    pub fn error_um(&self, x_mm: f64) -> f64 {
        let [low, high] = self.0.range_mm();
        let inside = x_mm.clamp(low, high);
        self.0.value_um(inside) + self.0.slope_um_per_mm(inside) * (x_mm - inside)
    }

    /// The command that brings the table to `target_mm` (finite): `c ← target − e(c)` until a step is ≤ 1e-9 mm.
    ///
    /// A single subtraction `target − e(target)` would leave `e'·e`: on paper A's Y axis 0.93 µm at 100 mm.
    pub fn inverse(&self, target_mm: f64) -> Inverse {
        let mut command_mm = target_mm;
        for steps in 1..=INVERSE_STEPS {
            let next = target_mm - self.error_um(command_mm) / 1e3;
            let step = (next - command_mm).abs();
            command_mm = next;
            if step <= INVERSE_STEP_MM {
                return Inverse { command_mm, steps };
            }
        }
        Inverse { command_mm, steps: INVERSE_STEPS }
    }
}

/// Place and value of largest size over the nodes of `polynomial`'s range; NaN counts as larger than any number.
fn largest(polynomial: &Polynomial, value: impl Fn(f64) -> f64) -> (f64, f64) {
    let nodes = 32 * polynomial.degree().max(1);
    let [low, high] = polynomial.range_mm();
    let node = |i: usize| low + (high - low) * (1.0 - (PI * i as f64 / nodes as f64).cos()) / 2.0;
    let values = (0..=nodes).map(|i| (node(i), value(node(i))));
    values.fold(
        (low, 0.0),
        |worst, here| if here.1.abs().total_cmp(&worst.1.abs()).is_gt() { here } else { worst },
    )
}

/// How the readings behind a curve were taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circumstances {
    /// Runs in each direction.
    pub runs: usize,
    /// Readings in all.
    pub readings: usize,
    /// Mean temperature of the stage, °C, if it was measured.
    pub temperature_c: Option<f64>,
    /// Time powered before the first run, s, if it is known.
    pub warm_up_s: Option<f64>,
}

/// The compensation of one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisCompensation {
    /// The error to remove.
    pub curve: ErrorCurve,
    /// How well the curve follows the readings.
    pub quality: DegreeQuality,
    /// How they were taken.
    pub circumstances: Circumstances,
}

impl AxisCompensation {
    /// The compensation by a fit's chosen polynomial.
    ///
    /// # Errors
    /// [`CurveFault`] if the curve is too large or too steep to be a stage's error.
    pub fn from_fit(fit: &Fit, circumstances: Circumstances) -> Result<Self, CurveFault> {
        let curve = ErrorCurve::new(fit.polynomial.clone())?;
        Ok(Self { curve, quality: fit.chosen, circumstances })
    }
}

/// A compensation file.
#[derive(Clone, Debug, PartialEq)]
pub struct Compensation {
    /// Day of the measurement, as the caller writes it (2026-03-14).
    pub date: String,
    /// Preset of the stage that was measured.
    pub preset: String,
    /// The first axis, if it was measured.
    pub x: Option<AxisCompensation>,
    /// The second axis, if it was measured.
    pub y: Option<AxisCompensation>,
}

/// Why a compensation file was refused, and where.
#[derive(Debug, thiserror::Error)]
#[error("{}{}: {fault}", file, line.map(|line| format!(", line {line}")).unwrap_or_default())]
pub struct CompensationError {
    /// The file as the caller named it.
    pub file: String,
    /// Line of the file, from 1, where one line is to blame.
    pub line: Option<usize>,
    /// What is wrong.
    pub fault: CompensationFault,
}

/// What is wrong with a compensation file.
#[derive(Debug, thiserror::Error)]
pub enum CompensationFault {
    /// The file system refused to give the file.
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    /// The file system refused to take the file.
    #[error("cannot be written: {0}")]
    Unwritable(io::Error),
    /// No TOML, a missing key, a value of the wrong kind; the message names the key.
    #[error("{message}")]
    Form {
        /// What the parser says.
        message: String,
    },
    /// A key that no compensation file has, most likely a slip of the pen.
    #[error("unknown key `{key}`; the nearest valid one is `{nearest}`")]
    UnknownKey {
        /// The key in the file.
        key: String,
        /// The valid key most like it.
        nearest: String,
    },
    /// Written by another version of the program.
    #[error("version {found} is not known, expected {VERSION}")]
    Version {
        /// The version in the file.
        found: u32,
    },
    /// No axis at all.
    #[error("there is neither a table [x] nor [y]")]
    NoAxis,
    /// A degree that contradicts the coefficients.
    #[error("{axis}.degree is {degree} but there are {coefficients} coefficients, expected degree + 1")]
    Degree {
        /// The axis.
        axis: Axis,
        /// The degree in the file.
        degree: usize,
        /// Coefficients in the file.
        coefficients: usize,
    },
    /// A number that is NaN, infinite or negative where none can be.
    #[error("{axis}.{key} is {value}, expected {expected}")]
    Number {
        /// The axis.
        axis: Axis,
        /// The key.
        key: &'static str,
        /// The number.
        value: f64,
        /// What is allowed.
        expected: &'static str,
    },
    /// Numbers that are no error curve of a stage.
    #[error("{axis}: {fault}")]
    Curve {
        /// The axis.
        axis: Axis,
        /// What is wrong with the curve.
        fault: CurveFault,
    },
}

impl Compensation {
    /// The compensation of one axis, if the file has it.
    pub fn axis(&self, axis: Axis) -> Option<&AxisCompensation> {
        match axis {
            Axis::X => self.x.as_ref(),
            Axis::Y => self.y.as_ref(),
        }
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`CompensationError`]: one sentence with file, line and value.
    pub fn read(path: &Path) -> Result<Self, CompensationError> {
        let file = path.display().to_string();
        match fs::read_to_string(path) {
            Ok(text) => Self::parse(&file, &text),
            Err(e) => Err(CompensationError { file, line: None, fault: CompensationFault::Unreadable(e) }),
        }
    }

    /// Parses a file's text; `file` is only used to name it in an error.
    ///
    /// # Errors
    /// [`CompensationError`]: one sentence with file, line and value.
    pub fn parse(file: &str, text: &str) -> Result<Self, CompensationError> {
        toml::from_str::<FileForm>(text).map_err(|e| form_fault(&e)).and_then(FileForm::judge).map_err(
            |(offset, fault)| CompensationError {
                file: file.to_owned(),
                line: offset.map(|offset| line_at(text, offset)),
                fault,
            },
        )
    }

    /// Writes the file beside its place and renames it.
    ///
    /// # Errors
    /// [`CompensationFault::Unwritable`] with the file's name; an older file is then untouched.
    pub fn write(&self, path: &Path) -> Result<(), CompensationError> {
        whole_file::put(path, self.to_string().as_bytes()).map_err(|e| CompensationError {
            file: path.display().to_string(),
            line: None,
            fault: CompensationFault::Unwritable(e),
        })
    }
}

/// The text of the file; numbers are written so that they read back exactly.
impl fmt::Display for Compensation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = toml::to_string(&FileForm::of(self)).map_err(|_| fmt::Error)?;
        write!(
            f,
            "# Error of the stage in µm, actual minus commanded: the sum of chebyshev_um[k] * T_k(u), where u is the\n\
             # position scaled from range_mm to -1 … 1. Outside range_mm the curve goes on along its end tangent.\n{text}"
        )
    }
}

/// The file as it stands, not yet judged.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct FileForm {
    version: Spanned<u32>,
    date: String,
    preset: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    x: Option<AxisForm>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y: Option<AxisForm>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct AxisForm {
    degree: Spanned<usize>,
    range_mm: Spanned<[Spanned<f64>; 2]>,
    chebyshev_um: Spanned<Vec<Spanned<f64>>>,
    sse_um2: Spanned<f64>,
    r2: Spanned<f64>,
    cv_um: Spanned<f64>,
    runs: usize,
    readings: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    temperature_c: Option<Spanned<f64>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    warm_up_s: Option<Spanned<f64>>,
}

/// A fault and the byte it is at.
type Located = (Option<usize>, CompensationFault);

impl FileForm {
    fn of(compensation: &Compensation) -> Self {
        Self {
            version: unplaced(VERSION),
            date: compensation.date.clone(),
            preset: compensation.preset.clone(),
            x: compensation.x.as_ref().map(AxisForm::of),
            y: compensation.y.as_ref().map(AxisForm::of),
        }
    }

    fn judge(self) -> Result<Compensation, Located> {
        let found = *self.version.get_ref();
        if found != VERSION {
            return Err((Some(self.version.span().start), CompensationFault::Version { found }));
        }
        if self.x.is_none() && self.y.is_none() {
            return Err((None, CompensationFault::NoAxis));
        }
        let judge = |axis, form: Option<AxisForm>| form.map(|form| form.judge(axis)).transpose();
        let (x, y) = (judge(Axis::X, self.x)?, judge(Axis::Y, self.y)?);
        Ok(Compensation { date: self.date, preset: self.preset, x, y })
    }
}

impl AxisForm {
    fn of(axis: &AxisCompensation) -> Self {
        let (polynomial, quality, taken) = (axis.curve.polynomial(), axis.quality, axis.circumstances);
        Self {
            degree: unplaced(polynomial.degree()),
            range_mm: unplaced(polynomial.range_mm().map(unplaced)),
            chebyshev_um: unplaced(polynomial.chebyshev_um().iter().copied().map(unplaced).collect()),
            sse_um2: unplaced(quality.sse_um2),
            r2: unplaced(quality.r2),
            cv_um: unplaced(quality.cv_um),
            runs: taken.runs,
            readings: taken.readings,
            temperature_c: taken.temperature_c.map(unplaced),
            warm_up_s: taken.warm_up_s.map(unplaced),
        }
    }

    fn judge(self, axis: Axis) -> Result<AxisCompensation, Located> {
        let degree = *self.degree.get_ref();
        let coefficients = self.chebyshev_um.get_ref().len();
        if degree > MAX_DEGREE || coefficients != degree + 1 {
            let fault = CompensationFault::Degree { axis, degree, coefficients };
            return Err((Some(self.degree.span().start), fault));
        }
        let quality = DegreeQuality {
            degree,
            sse_um2: at_least(axis, "sse_um2", &self.sse_um2, 0.0, "a number from 0 up")?,
            r2: at_least(axis, "r2", &self.r2, f64::MIN, "a finite number")?,
            cv_um: at_least(axis, "cv_um", &self.cv_um, 0.0, "a number from 0 up")?,
        };
        let temperature = |t| at_least(axis, "temperature_c", t, -273.15, "a temperature in °C");
        let warm_up = |t| at_least(axis, "warm_up_s", t, 0.0, "a time in s from 0 up");
        let circumstances = Circumstances {
            runs: self.runs,
            readings: self.readings,
            temperature_c: self.temperature_c.as_ref().map(temperature).transpose()?,
            warm_up_s: self.warm_up_s.as_ref().map(warm_up).transpose()?,
        };
        Ok(AxisCompensation { curve: self.curve(axis)?, quality, circumstances })
    }

    fn curve(&self, axis: Axis) -> Result<ErrorCurve, Located> {
        let [low, high] = self.range_mm.get_ref();
        let end = |number| at_least(axis, "range_mm", number, f64::MIN, "a finite number");
        let range_mm = [end(low)?, end(high)?];
        let chebyshev_um = self.chebyshev_um.get_ref().iter().map(|c| *c.get_ref()).collect();
        let curve =
            Polynomial::new(range_mm, chebyshev_um).map_err(CurveFault::from).and_then(ErrorCurve::new);
        curve.map_err(|fault| (Some(self.place(&fault)), CompensationFault::Curve { axis, fault }))
    }

    /// The byte to blame for `fault`: a list may fill many lines, so a single number is better named by its own.
    fn place(&self, fault: &CurveFault) -> usize {
        let coefficients = &self.chebyshev_um;
        let span = match fault {
            CurveFault::Polynomial(PolynomialFault::Range { .. }) => self.range_mm.span(),
            CurveFault::Polynomial(PolynomialFault::NotFinite { index, .. }) => {
                coefficients.get_ref().get(*index).map_or(coefficients.span(), Spanned::span)
            }
            _ => coefficients.span(),
        };
        span.start
    }
}

fn at_least(
    axis: Axis,
    key: &'static str,
    number: &Spanned<f64>,
    least: f64,
    expected: &'static str,
) -> Result<f64, Located> {
    let value = *number.get_ref();
    if value.is_finite() && value >= least {
        Ok(value)
    } else {
        Err((Some(number.span().start), CompensationFault::Number { axis, key, value, expected }))
    }
}

fn form_fault(e: &toml::de::Error) -> Located {
    let message = e.message().replace('\n', " ");
    let fault = unknown_key(&message).unwrap_or(CompensationFault::Form { message });
    (e.span().map(|span| span.start), fault)
}

/// The parser lists every valid key after an unknown one; the reader wants the one that was meant.
fn unknown_key(message: &str) -> Option<CompensationFault> {
    // From the right: the unknown key may hold any character, the valid ones hold letters and digits.
    let (key, valid) = message.strip_prefix("unknown field `")?.rsplit_once("`, expected ")?;
    let likeness = |name: &&str| strsim::jaro_winkler(&key.to_lowercase(), name);
    let names = valid.split('`').skip(1).step_by(2);
    let nearest = names.max_by(|a, b| likeness(a).total_cmp(&likeness(b)))?;
    Some(CompensationFault::UnknownKey { key: key.to_owned(), nearest: nearest.to_owned() })
}

/// A value that is about to be written has no place yet.
fn unplaced<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

fn line_at(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count()
}
