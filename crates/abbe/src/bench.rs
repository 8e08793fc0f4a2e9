//! The stage with its instruments, as `metrology` wants to see them: each behind its own trait, all on one rig.

use crate::rig::{Rig, RigError};
use abbe_metrology::Axis;
use abbe_metrology::measure::{Arrival, Instrument, Stage, Thermometer};
use abbe_twin::instruments::{Interferometer, Thermometer as TwinThermometer};
use std::cell::RefCell;
use std::convert::Infallible;
use std::rc::Rc;

/// A rig that stage and instruments share.
pub(crate) type Shared = Rc<RefCell<Rig>>;

/// The stage.
pub(crate) struct BenchStage(pub(crate) Shared);

impl Stage for BenchStage {
    type Error = RigError;

    fn move_to(&mut self, position_mm: [f64; 2]) -> Result<Arrival, RigError> {
        self.0.borrow_mut().move_to(position_mm)
    }

    fn dwell(&mut self, seconds: f64) -> Result<(), RigError> {
        self.0.borrow_mut().wait(seconds)
    }
}

/// What the interferometer read, beside the truth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    pub(crate) time_s: f64,
    pub(crate) read_um: f64,
    pub(crate) table_um: [f64; 2],
}

/// An interferometer set up along one axis; it takes a reading every millisecond of the stage's time.
pub(crate) struct BenchInterferometer {
    rig: Shared,
    instrument: Interferometer,
    pub(crate) log: Vec<Reading>,
}

/// Time between two readings, s.
const READING_S: f64 = 1e-3;

impl BenchInterferometer {
    /// Sets the instrument up; each number of `set_up` is another set-up.
    pub(crate) fn set_up(rig: &Shared, axis: Axis, set_up: u64) -> Self {
        let instrument = Interferometer::set_up(&rig.borrow().twin, axis.index(), set_up);
        Self { rig: Rc::clone(rig), instrument, log: Vec::new() }
    }
}

impl Instrument for BenchInterferometer {
    type Error = RigError;

    fn set_zero(&mut self) -> Result<(), RigError> {
        self.instrument.set_zero(&self.rig.borrow().twin);
        Ok(())
    }

    fn read_um(&mut self) -> Result<f64, RigError> {
        let mut rig = self.rig.borrow_mut();
        rig.wait(READING_S)?;
        let read_um = self.instrument.read_um(&rig.twin);
        let truth = rig.twin.truth();
        self.log.push(Reading { time_s: truth.time_s, read_um, table_um: truth.table_um });
        Ok(read_um)
    }
}

/// What a thermometer stands on.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Spot {
    Scale,
    Structure,
}

/// A thermometer.
pub(crate) struct BenchThermometer {
    rig: Shared,
    spot: Spot,
    instrument: TwinThermometer,
}

impl BenchThermometer {
    /// One on the scale and one on the structure.
    pub(crate) fn pair(rig: &Shared) -> [Self; 2] {
        [(Spot::Scale, "reference scale"), (Spot::Structure, "reference structure")].map(|(spot, name)| {
            let twin = &rig.borrow().twin;
            let instrument = TwinThermometer::new(&twin.plant().thermometers, twin.seed(), name);
            Self { rig: Rc::clone(rig), spot, instrument }
        })
    }
}

impl Thermometer for BenchThermometer {
    type Error = Infallible;

    fn name(&self) -> &str {
        match self.spot {
            Spot::Scale => "scale",
            Spot::Structure => "structure",
        }
    }

    fn read_c(&mut self) -> Result<f64, Infallible> {
        let rig = self.rig.borrow();
        let true_c = match self.spot {
            Spot::Scale => rig.twin.heat().scale_c(),
            Spot::Structure => rig.twin.heat().structure_c(),
        };
        Ok(self.instrument.read_c(true_c))
    }
}
