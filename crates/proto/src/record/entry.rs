//! Entries: the bytes that open them, and what a tick is told apart from.

use super::bytes::{Reader, Writer};
use super::error::RecordFault;
use abbe_core::Inputs;
use abbe_core::edge::{AxisInputs, SinCos};

/// Opens a row of ticks in which nothing changed; the six bits below it hold one less than their number.
pub(super) const RUN: u8 = 0x80;
/// The longest such row.
pub(super) const LONGEST_RUN: u8 = 64;

pub(super) const ENABLE: u8 = 0xc0;
pub(super) const DISABLE: u8 = 0xc1;
pub(super) const HOME: u8 = 0xc2;
pub(super) const MOVE_TO: u8 = 0xc3;
pub(super) const MOVE_BY: u8 = 0xc4;
pub(super) const STOP: u8 = 0xc5;
pub(super) const RESET: u8 = 0xc6;
pub(super) const PLAN: u8 = 0xc7;
pub(super) const MAP: u8 = 0xc8;
pub(super) const NO_MAP: u8 = 0xc9;
pub(super) const HASH: u8 = 0xca;
pub(super) const REFINE: u8 = 0xcb;
pub(super) const GO: u8 = 0xcc;
pub(super) const HOLD: u8 = 0xcd;
pub(super) const RESUME: u8 = 0xce;
pub(super) const FEED_RATE: u8 = 0xcf;
pub(super) const SPANS: u8 = 0xd0;
pub(super) const COMPARE: u8 = 0xd1;

/// In the byte that opens a tick: more than counters and pulses changed.
const REST: u8 = 0x40;

/// Bits of the rest; the lowest three say which axes have a byte of their own.
const TICK: u8 = 1 << 3;
const SWITCHES: u8 = 1 << 4;
const PANEL: u8 = 1 << 5;
const TEMPERATURES: u8 = 1 << 6;
const HEARTBEAT: u8 = 1 << 7;

/// Bits of an axis.
const ILLEGAL: u8 = 1;
const GLITCHES: u8 = 1 << 1;
const INDEX: u8 = 1 << 2;
const SIN_COS_PRESENT: u8 = 1 << 3;
const SIN_COS: u8 = 1 << 4;
const LIMIT_LOW: u8 = 1 << 5;
const LIMIT_HIGH: u8 = 1 << 6;
const DRIVE_FAULT: u8 = 1 << 7;

/// Bits of the shared switches.
const EMERGENCY_STOP: u8 = 1;
const TRIGGER: u8 = 1 << 1;

const fn bit(set: bool, mask: u8) -> u8 {
    if set { mask } else { 0 }
}

/// Whether axis number `axis` has its bit in `mask`; counter and pulses of an axis have two bits side by side.
const fn has(mask: u8, axis: usize) -> bool {
    axis < 8 && mask & (1 << axis) != 0
}

/// What the last tick lets expect of the next: the number goes on, the heartbeat stands or goes on, nothing passed
/// the mark, no edge was wrong, and all else is as it was.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expected<const N: usize> {
    pub(super) inputs: Inputs<N>,
    heartbeat_step: u32,
}

impl<const N: usize> Expected<N> {
    /// At the beginning of a block.
    pub(super) fn new() -> Self {
        Self { inputs: Inputs::at_rest(0), heartbeat_step: 0 }
    }

    /// A tick has passed.
    pub(super) fn pass(&mut self, inputs: &Inputs<N>) {
        let last_heartbeat = self.inputs.heartbeat_age.wrapping_sub(self.heartbeat_step);
        self.heartbeat_step = u32::from(inputs.heartbeat_age.wrapping_sub(last_heartbeat) == 1);
        self.inputs = *inputs;
        self.inputs.tick = inputs.tick.wrapping_add(1);
        self.inputs.heartbeat_age = inputs.heartbeat_age.wrapping_add(self.heartbeat_step);
        for axis in &mut self.inputs.axes {
            (axis.illegal, axis.glitches, axis.index) = (0, 0, None);
        }
    }

    pub(super) fn write(&self, now: &Inputs<N>, to: &mut Writer<'_>) {
        let then = &self.inputs;
        let axes = now.axes.iter().zip(&then.axes);
        let (mut opening, mut shared) = (0, shared_mask(now, then));
        let mut masks = [0; N];
        for (number, (mask, (now, then))) in masks.iter_mut().zip(axes.clone()).enumerate() {
            opening |= moved(now, then) << (number << 1);
            *mask = axis_mask(now, then);
            shared |= bit(*mask != 0, 1 << number);
        }
        to.byte(opening | bit(shared != 0, REST));
        for (now, then) in axes.clone() {
            write_way(now, then, to);
        }
        if shared == 0 {
            return;
        }
        to.byte(shared);
        for (mask, (now, then)) in masks.into_iter().zip(axes).filter(|(mask, _)| *mask != 0) {
            write_axis(mask, now, then, to);
        }
        write_shared(shared, now, then, to);
    }

    /// Reads the tick that `opening` opens.
    pub(super) fn read(&self, opening: u8, from: &mut Reader<'_>) -> Result<Inputs<N>, RecordFault> {
        let mut inputs = self.inputs;
        for (number, axis) in inputs.axes.iter_mut().enumerate() {
            read_way(opening >> (number << 1), axis, from)?;
        }
        if opening & REST == 0 {
            return Ok(inputs);
        }
        let shared = from.byte()?;
        for (_, axis) in inputs.axes.iter_mut().enumerate().filter(|(number, _)| has(shared, *number)) {
            read_axis(axis, from)?;
        }
        read_shared(shared, &mut inputs, from)?;
        Ok(inputs)
    }
}

// ---- how far an axis went ------------------------------------------------------------------------------------------

fn moved(now: &AxisInputs, then: &AxisInputs) -> u8 {
    bit(now.counter != then.counter, 1) | bit(now.pulses != then.pulses, 2)
}

fn write_way(now: &AxisInputs, then: &AxisInputs, to: &mut Writer<'_>) {
    if now.counter != then.counter {
        to.signed32(now.counter.wrapping_sub(then.counter).cast_signed());
    }
    if now.pulses != then.pulses {
        to.signed32(now.pulses.wrapping_sub(then.pulses));
    }
}

fn read_way(moved: u8, axis: &mut AxisInputs, from: &mut Reader<'_>) -> Result<(), RecordFault> {
    if moved & 1 != 0 {
        axis.counter = axis.counter.wrapping_add(from.signed32()?.cast_unsigned());
    }
    if moved & 2 != 0 {
        axis.pulses = axis.pulses.wrapping_add(from.signed32()?);
    }
    Ok(())
}

// ---- the rest of an axis -------------------------------------------------------------------------------------------

/// No value at all counts as 0, 0, so that a first value is a difference too.
fn sin_cos(axis: &AxisInputs) -> SinCos {
    axis.sin_cos.unwrap_or_default()
}

fn axis_mask(now: &AxisInputs, then: &AxisInputs) -> u8 {
    // All fields by name: whoever adds one is led here.
    let AxisInputs {
        counter: _,
        illegal,
        glitches,
        index,
        sin_cos: samples,
        pulses: _,
        limit_low,
        limit_high,
        drive_fault,
    } = now;
    bit(*illegal != 0, ILLEGAL)
        | bit(*glitches != 0, GLITCHES)
        | bit(index.is_some(), INDEX)
        | bit(samples.is_some() != then.sin_cos.is_some(), SIN_COS_PRESENT)
        | bit(samples.is_some() && sin_cos(now) != sin_cos(then), SIN_COS)
        | bit(*limit_low != then.limit_low, LIMIT_LOW)
        | bit(*limit_high != then.limit_high, LIMIT_HIGH)
        | bit(*drive_fault != then.drive_fault, DRIVE_FAULT)
}

fn write_axis(mask: u8, now: &AxisInputs, then: &AxisInputs, to: &mut Writer<'_>) {
    to.byte(mask);
    if now.illegal != 0 {
        to.number32(u32::from(now.illegal));
    }
    if now.glitches != 0 {
        to.number32(u32::from(now.glitches));
    }
    if let Some(index) = now.index {
        to.signed32(index.wrapping_sub(now.counter).cast_signed());
    }
    if mask & SIN_COS != 0 {
        let (now, then) = (sin_cos(now), sin_cos(then));
        to.signed16(now.sin.wrapping_sub(then.sin));
        to.signed16(now.cos.wrapping_sub(then.cos));
    }
}

fn read_axis(axis: &mut AxisInputs, from: &mut Reader<'_>) -> Result<(), RecordFault> {
    let mask = from.byte()?;
    if mask & ILLEGAL != 0 {
        axis.illegal = from.number16()?;
    }
    if mask & GLITCHES != 0 {
        axis.glitches = from.number16()?;
    }
    if mask & INDEX != 0 {
        axis.index = Some(axis.counter.wrapping_add(from.signed32()?.cast_unsigned()));
    }
    read_sin_cos(mask, axis, from)?;
    axis.limit_low ^= mask & LIMIT_LOW != 0;
    axis.limit_high ^= mask & LIMIT_HIGH != 0;
    axis.drive_fault ^= mask & DRIVE_FAULT != 0;
    Ok(())
}

fn read_sin_cos(mask: u8, axis: &mut AxisInputs, from: &mut Reader<'_>) -> Result<(), RecordFault> {
    let mut samples = sin_cos(axis);
    if mask & SIN_COS != 0 {
        samples.sin = samples.sin.wrapping_add(from.signed16()?);
        samples.cos = samples.cos.wrapping_add(from.signed16()?);
    }
    let present = axis.sin_cos.is_some() ^ (mask & SIN_COS_PRESENT != 0);
    axis.sin_cos = present.then_some(samples);
    Ok(())
}

// ---- what all axes share -------------------------------------------------------------------------------------------

fn shared_mask<const N: usize>(now: &Inputs<N>, then: &Inputs<N>) -> u8 {
    let Inputs {
        tick,
        axes: _,
        emergency_stop,
        joystick,
        key_columns,
        trigger,
        temperatures_mk,
        heartbeat_age,
    } = now;
    let switches = *emergency_stop != then.emergency_stop || *trigger != then.trigger;
    let panel = *joystick != then.joystick || *key_columns != then.key_columns;
    bit(*tick != then.tick, TICK)
        | bit(switches, SWITCHES)
        | bit(panel, PANEL)
        | bit(*temperatures_mk != then.temperatures_mk, TEMPERATURES)
        | bit(*heartbeat_age != then.heartbeat_age, HEARTBEAT)
}

fn write_shared<const N: usize>(mask: u8, now: &Inputs<N>, then: &Inputs<N>, to: &mut Writer<'_>) {
    if mask & TICK != 0 {
        to.signed32(now.tick.wrapping_sub(then.tick).cast_signed());
    }
    if mask & SWITCHES != 0 {
        let stop = bit(now.emergency_stop != then.emergency_stop, EMERGENCY_STOP);
        to.byte(stop | bit(now.trigger != then.trigger, TRIGGER));
    }
    if mask & PANEL != 0 {
        for (now, then) in now.joystick.iter().zip(then.joystick) {
            to.signed16(now.wrapping_sub(then));
        }
        to.byte(now.key_columns);
    }
    if mask & TEMPERATURES != 0 {
        for (now, then) in now.temperatures_mk.iter().zip(then.temperatures_mk) {
            to.signed32(now.wrapping_sub(then));
        }
    }
    if mask & HEARTBEAT != 0 {
        to.signed32(now.heartbeat_age.wrapping_sub(then.heartbeat_age).cast_signed());
    }
}

fn read_shared<const N: usize>(
    mask: u8,
    inputs: &mut Inputs<N>,
    from: &mut Reader<'_>,
) -> Result<(), RecordFault> {
    if mask & TICK != 0 {
        inputs.tick = inputs.tick.wrapping_add(from.signed32()?.cast_unsigned());
    }
    if mask & SWITCHES != 0 {
        let toggled = from.byte()?;
        inputs.emergency_stop ^= toggled & EMERGENCY_STOP != 0;
        inputs.trigger ^= toggled & TRIGGER != 0;
    }
    if mask & PANEL != 0 {
        for place in &mut inputs.joystick {
            *place = place.wrapping_add(from.signed16()?);
        }
        inputs.key_columns = from.byte()?;
    }
    if mask & TEMPERATURES != 0 {
        for temperature in &mut inputs.temperatures_mk {
            *temperature = temperature.wrapping_add(from.signed32()?);
        }
    }
    if mask & HEARTBEAT != 0 {
        inputs.heartbeat_age = inputs.heartbeat_age.wrapping_add(from.signed32()?.cast_unsigned());
    }
    Ok(())
}
