//! The whole state of a controller as bytes.
//!
//! The bytes follow the private fields of the controller, so they mean something only to the build that wrote them;
//! [`layout`] tells such builds apart.

use abbe_core::Controller;
use abbe_core::design::Config;

/// The bytes of a controller.
pub(super) fn of(controller: &Controller<2>) -> Result<Vec<u8>, postcard::Error> {
    postcard::to_stdvec(controller)
}

/// The controller of some bytes; all of them must be used.
pub(super) fn controller(bytes: &[u8]) -> Result<Controller<2>, postcard::Error> {
    match postcard::take_from_bytes(bytes)? {
        (controller, []) => Ok(controller),
        _ => Err(postcard::Error::DeserializeBadEncoding),
    }
}

/// A number that is another when a new controller of this configuration is kept in another form.
pub(super) fn layout(config: &Config<2>) -> Result<u32, postcard::Error> {
    Ok(super::file::CRC.checksum(&of(&Controller::new(*config))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::tests::{preset, rig};
    use abbe_core::compensate::ErrorMap;
    use abbe_core::{Command, Inputs, Outputs, Pos, background};
    use abbe_twin::{Event, Twin};

    /// A stage without a recorder.
    #[derive(Clone)]
    struct Pair {
        controller: Controller<2>,
        twin: Twin,
        outputs: Outputs<2>,
    }

    impl Pair {
        fn tick(&mut self) -> Inputs<2> {
            let inputs = self.twin.step(&self.outputs);
            self.outputs = self.controller.tick(&inputs);
            background::advance(&mut self.controller);
            inputs
        }
    }

    #[test]
    fn a_controller_goes_on_from_its_bytes_as_if_nothing_had_been() {
        let config = preset().controller.config;
        let twin = Twin::standing_at(&preset().plant, &config, 3, [2.0, 1.0]);
        let mut pair = Pair { controller: Controller::new(config), twin, outputs: Outputs::OFF };
        let map = ErrorMap::sample(Pos::from_mm(-5.0), |p| Pos::from_pm(p.pm() / 400)).unwrap();
        // Powered on, homing, mapped and moving, settling, braking, with a plan still wanted, in a fault.
        for tick in 0u32..120_000 {
            match tick {
                5 => _ = pair.controller.command(Command::Home).unwrap(),
                100_000 => pair.controller.set_error_map(0, Some(map)).unwrap(),
                100_010 => _ = pair.controller.command(Command::MoveTo([Pos::from_mm(3.0); 2])).unwrap(),
                110_000 => _ = pair.controller.command(Command::MoveBy([Pos::from_mm(1.0); 2])).unwrap(),
                111_000 => _ = pair.controller.command(Command::Stop).unwrap(),
                118_000 => pair.twin.happen(Event::DriveFault { axis: 1, faulty: true }).unwrap(),
                _ => {}
            }
            if tick.is_multiple_of(4_999) || matches!(tick, 100_010 | 111_000 | 118_010) {
                let mut other = controller(&of(&pair.controller).unwrap()).unwrap();
                let mut ahead = pair.clone();
                for _ in 0..200 {
                    let inputs = ahead.tick();
                    assert_eq!(other.tick(&inputs), ahead.outputs, "after tick {tick}");
                    background::advance(&mut other);
                    assert_eq!(other.status(), ahead.controller.status(), "after tick {tick}");
                }
                assert_eq!(of(&other), of(&ahead.controller));
            }
            pair.tick();
        }
        assert_eq!(pair.controller.status().last_move.map(|report| report.number), Some(2));
        assert!(pair.controller.status().fault.is_some());
    }

    #[test]
    fn bytes_that_are_too_few_or_too_many_are_no_controller() {
        let bytes = of(rig(1).controller()).unwrap();
        assert!(controller(&bytes).is_ok());
        assert!(controller(&bytes[..bytes.len() - 1]).is_err());
        assert!(controller(&[&bytes[..], &[0]].concat()).is_err());
    }
}
