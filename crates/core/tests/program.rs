//! Programs in the hands of a controller: on their path within the limits, stopped, held, hurried, and sent elsewhere.

mod walked;

use abbe_core::background::{self, Planner};
use abbe_core::design::StageSettings;
use abbe_core::edge::{Actuation, AxisInputs, StepRate};
use abbe_core::machine::State;
use abbe_core::plan::Segment;
use abbe_core::plan::curve::Place;
use abbe_core::plan::segment::{Feed, Shape};
use abbe_core::publish::{Fault, Outcome};
use abbe_core::{Command, Controller, Inputs, Outputs, Pos, Refusal};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use walked::{STAGE, assert_within};
