//! One function, followed along all its ways: what it calls, and how deep its stack is where it does.
//!
//! Each register is followed as far as that is easy: a constant, a distance from the stack pointer at the entry, the
//! return address, or unknown. Where two ways meet, what they do not agree on is unknown. That is enough for calls
//! through literal pools, for large frames and for epilogues that restore the stack pointer from another register.

use std::collections::{BTreeMap, BTreeSet};

use super::thumb::{Expression, Instruction, LR, Op, PC, SP, Table, decode};
use super::{Function, Image};

/// What a function does, seen from outside.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Summary {
    /// Deepest use of the stack in bytes, calls not counted.
    pub(crate) frame: u32,
    /// Each call, with the depth of the stack at that place.
    pub(crate) calls: BTreeSet<Call>,
    /// Places that cannot be followed, each with the reason.
    pub(crate) riddles: BTreeSet<(u32, Riddle)>,
    /// Places from which there is no way on: UDF, BKPT.
    pub(crate) traps: BTreeSet<u32>,
}

/// A call, or a jump to the start of another function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Call {
    /// Address of the function.
    pub(crate) to: u32,
    /// Bytes of stack in use at that place.
    pub(crate) depth: u32,
}

/// Why a place cannot be followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Riddle {
    /// A call or jump through a register whose content is not a constant.
    IndirectCall,
    /// A call or jump to a place where no function begins.
    NoFunction(u32),
    /// The way runs off the end of the function.
    RunsOff,
    /// The stack pointer is not known any more.
    Stack,
    /// Bytes that are no instruction.
    NoInstruction,
}

/// What is known of a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Value {
    Unknown,
    Constant(u32),
    /// A distance from the stack pointer at the entry, bytes.
    Stack(i32),
    /// Where the caller goes on.
    Return,
}

/// What is known when an instruction begins.
#[derive(Clone, Debug, PartialEq, Eq)]
struct State {
    registers: [Value; 15],
    /// Where the return address was put, as a distance from the stack pointer at the entry.
    saved_return: Option<i32>,
}

/// How an instruction leaves.
enum Next {
    /// With this state, to the next instruction.
    On(State),
    /// With this state, to these places.
    To(State, Vec<u32>),
    /// With this state, to the next instruction or that place.
    Either(State, u32),
    /// Back to the caller, or to another function.
    Out,
}

/// A walk over one function.
struct Walk<'a> {
    image: &'a Image,
    function: &'a Function,
    /// By address.
    instructions: BTreeMap<u32, Instruction>,
    /// Those that an if-then makes conditional.
    conditional: BTreeSet<u32>,
    states: BTreeMap<u32, State>,
    /// Jumps through a table that have been reached, with their state.
    tables: BTreeMap<u32, State>,
    open: Vec<u32>,
    summary: Summary,
}

/// Follows a function along all its ways.
pub(crate) fn follow(image: &Image, function: &Function) -> Summary {
    if let Some(summary) = as_thunk(image, function) {
        return summary;
    }
    let mut walk = Walk::new(image, function);
    walk.reach(function.address, &State::at_entry());
    walk.run();
    while let Some(place) = walk.reached_only_through_a_table() {
        let states: Vec<State> = walk.tables.values().cloned().collect();
        for state in &states {
            walk.reach(place, state);
        }
        walk.run();
    }
    walk.summary
}

/// The linker's bridge between code in flash and code in RAM: a jump to the only address it holds.
fn as_thunk(image: &Image, function: &Function) -> Option<Summary> {
    /// The bridge saves two registers before it can load the address.
    const FRAME: u32 = 8;
    let is_thunk = |symbol: &String| symbol.starts_with("__Thumb") && symbol.contains("ABSLongThunk_");
    if !function.symbols.iter().any(is_thunk) {
        return None;
    }
    let places = (function.address..function.end).step_by(2).filter(|place| place.is_multiple_of(4));
    let words = places.filter(|place| !image.is_code(*place)).filter_map(|place| image.word(place));
    let to = words.map(|word| word & !1).find(|word| image.function_at(*word).is_some())?;
    let calls = BTreeSet::from([Call { to, depth: 0 }]);
    Some(Summary { frame: FRAME, calls, ..Summary::default() })
}

impl State {
    fn at_entry() -> Self {
        let mut registers = [Value::Unknown; 15];
        registers[usize::from(SP)] = Value::Stack(0);
        registers[usize::from(LR)] = Value::Return;
        Self { registers, saved_return: None }
    }

    fn get(&self, register: u8) -> Value {
        self.registers.get(usize::from(register)).copied().unwrap_or(Value::Unknown)
    }

    fn set(&mut self, register: u8, value: Value) {
        if let Some(place) = self.registers.get_mut(usize::from(register)) {
            *place = value;
        }
    }

    fn forget(&mut self, registers: u16) {
        (0..15).filter(|register| registers & 1 << register != 0).for_each(|r| self.set(r, Value::Unknown));
    }

    /// What remains known where another way joins this one.
    fn meet(&self, other: &Self) -> Self {
        let mut met = self.clone();
        for (ours, theirs) in met.registers.iter_mut().zip(&other.registers) {
            if ours != theirs {
                *ours = Value::Unknown;
            }
        }
        if self.saved_return != other.saved_return {
            met.saved_return = None;
        }
        met
    }

    /// Bytes of stack in use.
    fn depth(&self) -> Option<u32> {
        match self.get(SP) {
            Value::Stack(offset) => Some(offset.min(0).unsigned_abs()),
            _ => None,
        }
    }

    fn move_stack(&mut self, bytes: i32) {
        let moved = match self.get(SP) {
            Value::Stack(offset) => Value::Stack(offset + bytes),
            _ => Value::Unknown,
        };
        self.set(SP, moved);
    }

    fn push(&mut self, registers: u16) {
        // The highest register lies highest: just below where the stack pointer was.
        if registers & 1 << LR != 0
            && self.get(LR) == Value::Return
            && let Value::Stack(offset) = self.get(SP)
        {
            self.saved_return = Some(offset - 4);
        }
        self.move_stack(-4 * registers.count_ones().cast_signed());
    }

    /// What the highest register of the list gets; the others are unknown.
    fn pop(&mut self, registers: u16) -> Value {
        let count = registers.count_ones().cast_signed();
        let highest = match self.get(SP) {
            Value::Stack(offset) if Some(offset + 4 * (count - 1)) == self.saved_return => Value::Return,
            _ => Value::Unknown,
        };
        self.forget(registers & !(1 << SP));
        self.set(15 - registers.leading_zeros() as u8, highest);
        self.move_stack(4 * count);
        highest
    }

    /// A call keeps r4 to r11 and the stack pointer.
    fn call(&mut self) {
        self.forget(0b1111 | 1 << 12 | 1 << LR);
    }
}

impl<'a> Walk<'a> {
    fn new(image: &'a Image, function: &'a Function) -> Self {
        let mut walk = Self {
            image,
            function,
            instructions: BTreeMap::new(),
            conditional: BTreeSet::new(),
            states: BTreeMap::new(),
            tables: BTreeMap::new(),
            open: Vec::new(),
            summary: Summary::default(),
        };
        walk.decode();
        walk
    }

    fn decode(&mut self) {
        let (mut address, mut under_condition) = (self.function.address, 0);
        while address < self.function.end {
            let here = self.image.halfword(address).filter(|_| self.image.is_code(address));
            let decoded = here.and_then(|first| decode(address, first, self.image.halfword(address + 2)));
            let Some(instruction) = decoded else {
                address += 2;
                continue;
            };
            self.instructions.insert(address, instruction);
            if under_condition > 0 {
                under_condition -= 1;
                self.conditional.insert(address);
            }
            if let Op::IfThen(count) = instruction.op {
                under_condition = count;
            }
            address += instruction.length;
        }
    }

    fn riddle(&mut self, at: u32, riddle: Riddle) {
        self.summary.riddles.insert((at, riddle));
    }

    /// A way leads to `address` with this state.
    fn reach(&mut self, address: u32, state: &State) {
        let met = self.states.get(&address).map_or_else(|| state.clone(), |known| known.meet(state));
        if self.states.get(&address) != Some(&met) {
            self.states.insert(address, met);
            self.open.push(address);
        }
    }

    fn run(&mut self) {
        while let Some(address) = self.open.pop() {
            let Some(before) = self.states.get(&address).cloned() else { continue };
            let Some(&instruction) = self.instructions.get(&address) else {
                self.riddle(address, Riddle::NoInstruction);
                continue;
            };
            let next = address + instruction.length;
            if self.conditional.contains(&address) {
                self.go_on(address, next, &before);
            }
            match self.step(address, instruction, before) {
                Next::On(state) => self.go_on(address, next, &state),
                Next::To(state, places) => places.iter().for_each(|place| self.reach(*place, &state)),
                Next::Either(state, place) => {
                    self.go_on(address, next, &state);
                    self.reach(place, &state);
                }
                Next::Out => {}
            }
        }
    }

    /// To the next instruction. A call may be the last: of a function that never returns.
    fn go_on(&mut self, from: u32, next: u32, state: &State) {
        let called =
            matches!(self.instructions.get(&from).map(|i| i.op), Some(Op::Call(_) | Op::CallRegister(_)));
        if self.instructions.contains_key(&next) {
            self.reach(next, state);
        } else if next >= self.function.end && !called && self.image.function_at(next).is_some() {
            self.call(from, next, state);
        } else if !called {
            self.riddle(from, Riddle::RunsOff);
        }
    }

    fn step(&mut self, at: u32, instruction: Instruction, mut state: State) -> Next {
        match instruction.op {
            Op::Set { register, value } => {
                let value = self.value(&state, value);
                state.set(register, value);
                self.note_depth(at, &state);
            }
            Op::Clobber(registers) => {
                state.forget(registers);
                self.note_depth(at, &state);
            }
            Op::Push(registers) => {
                state.push(registers);
                self.note_depth(at, &state);
            }
            Op::Pop(registers) => {
                let highest = state.pop(registers);
                if registers & 1 << PC != 0 {
                    return self.leave(at, highest, &state);
                }
            }
            Op::Branch(to) => return self.branch(at, to, state),
            Op::BranchIf(to) => return self.branch_if(at, to, state),
            Op::Call(to) => return self.call_or_far_jump(at, to, state),
            Op::CallRegister(register) => {
                self.call_register(at, register, &state);
                state.call();
            }
            Op::BranchRegister(register) => return self.leave(at, state.get(register), &state),
            Op::Jump(table) => return self.jump(at, instruction, table, state),
            Op::Trap => {
                self.summary.traps.insert(at);
                return Next::Out;
            }
            Op::IfThen(_) => {}
        }
        Next::On(state)
    }

    fn value(&self, state: &State, expression: Expression) -> Value {
        use Value::{Constant, Return, Stack, Unknown};
        let of = |register| state.get(register);
        match expression {
            Expression::Constant(value) => Constant(value),
            Expression::Copy(register) | Expression::ShiftedLeft(register, 0) => of(register),
            Expression::Plus(register, more) => match of(register) {
                Constant(value) => Constant(value.wrapping_add_signed(more)),
                Stack(offset) => Stack(offset.wrapping_add(more)),
                Unknown | Return => Unknown,
            },
            Expression::Sum(one, other) => match (of(one), of(other)) {
                (Constant(one), Constant(other)) => Constant(one.wrapping_add(other)),
                (Stack(offset), Constant(more)) | (Constant(more), Stack(offset)) => {
                    Stack(offset.wrapping_add(more.cast_signed()))
                }
                _ => Unknown,
            },
            Expression::Literal(place) => self.image.constant_word(place).map_or(Unknown, Constant),
            Expression::Minus(register)
            | Expression::ShiftedLeft(register, _)
            | Expression::WithUpperHalf(register, _)
            | Expression::Word(register, _) => match of(register) {
                Constant(value) => self.of_constant(value, expression),
                _ => Unknown,
            },
        }
    }

    /// What an expression of one register makes of a constant in it.
    fn of_constant(&self, value: u32, expression: Expression) -> Value {
        match expression {
            Expression::Minus(_) => Value::Constant(value.wrapping_neg()),
            Expression::ShiftedLeft(_, by) => Value::Constant(value << by),
            Expression::WithUpperHalf(_, half) => Value::Constant(value & 0xFFFF | u32::from(half) << 16),
            Expression::Word(_, offset) => {
                self.image.constant_word(value.wrapping_add(offset)).map_or(Value::Unknown, Value::Constant)
            }
            _ => Value::Unknown,
        }
    }

    fn note_depth(&mut self, at: u32, state: &State) {
        match state.depth() {
            Some(depth) => self.summary.frame = self.summary.frame.max(depth),
            None => self.riddle(at, Riddle::Stack),
        }
    }

    fn is_inside(&self, address: u32) -> bool {
        self.function.address <= address && address < self.function.end
    }

    fn call(&mut self, at: u32, to: u32, state: &State) {
        if self.image.function_at(to).is_none() {
            self.riddle(at, Riddle::NoFunction(to));
        } else if let Some(depth) = state.depth() {
            self.summary.calls.insert(Call { to, depth });
        }
    }

    fn branch(&mut self, at: u32, to: u32, state: State) -> Next {
        if self.is_inside(to) {
            return Next::To(state, vec![to]);
        }
        self.call(at, to, &state);
        Next::Out
    }

    fn branch_if(&mut self, at: u32, to: u32, state: State) -> Next {
        if self.is_inside(to) {
            return Next::Either(state, to);
        }
        self.call(at, to, &state);
        Next::On(state)
    }

    /// BL inside a function is a jump that is too far for B; only to its start it is a call of itself.
    fn call_or_far_jump(&mut self, at: u32, to: u32, mut state: State) -> Next {
        if self.is_inside(to) && to != self.function.address {
            state.forget(1 << LR);
            return Next::To(state, vec![to]);
        }
        self.call(at, to, &state);
        state.call();
        Next::On(state)
    }

    fn call_register(&mut self, at: u32, register: u8, state: &State) {
        match state.get(register) {
            Value::Constant(to) => self.call(at, to & !1, state),
            _ => self.riddle(at, Riddle::IndirectCall),
        }
    }

    /// To an address from a register or the stack.
    fn leave(&mut self, at: u32, to: Value, state: &State) -> Next {
        match to {
            Value::Return => {}
            Value::Constant(to) => return self.branch(at, to & !1, state.clone()),
            _ => self.riddle(at, Riddle::IndirectCall),
        }
        Next::Out
    }

    fn jump(&mut self, at: u32, instruction: Instruction, table: Table, state: State) -> Next {
        let places = self.entries(at, instruction, table);
        if places.is_empty() {
            self.riddle(at, Riddle::IndirectCall);
            return Next::Out;
        }
        self.tables.insert(at, state.clone());
        Next::To(state, places)
    }

    /// Where a jump table leads. It lies just behind the jump; the comparison before the jump says how long it is. An
    /// entry that leads to no instruction of this function is none.
    fn entries(&self, at: u32, instruction: Instruction, table: Table) -> Vec<u32> {
        let mut start = at + instruction.length;
        let unit = match table {
            Table::Bytes => 1,
            Table::Halfwords => 2,
            Table::Words => 4,
            Table::Distances => self.width_of_distances(at),
        };
        if table == Table::Words {
            start = start.next_multiple_of(4);
        }
        if self.image.is_code(start) {
            return Vec::new();
        }
        let end = self.image.data_end(start).min(self.function.end);
        let longest = (end - start) / unit;
        let count = self.compared_with(at).map_or(longest, |most| longest.min(most + 1));
        let places = (0..count).filter_map(|index| self.entry(at + 4, start + index * unit, unit));
        let mut places: Vec<u32> = places.filter(|place| self.instructions.contains_key(place)).collect();
        places.dedup();
        places
    }

    fn entry(&self, base: u32, place: u32, unit: u32) -> Option<u32> {
        match unit {
            1 => self.image.byte(place).map(|distance| base + 2 * u32::from(distance)),
            2 => self.image.halfword(place).map(|distance| base + 2 * u32::from(distance)),
            _ => self.image.word(place).filter(|word| word & 1 == 1).map(|word| word & !1),
        }
    }

    /// Bytes of an entry: as many as the load of a byte or halfword before the jump takes.
    fn width_of_distances(&self, at: u32) -> u32 {
        let loads_byte = |word: u16| word >> 11 == 0b01111 || word >> 9 == 0b010_1110;
        let before = self.instructions.range(..at).rev().take(6);
        let words = before.filter_map(|(place, _)| self.image.halfword(*place));
        let mut loads =
            words.filter(|word| loads_byte(*word) || word >> 11 == 0b10001 || word >> 9 == 0b010_1101);
        if loads.next().is_some_and(loads_byte) { 1 } else { 2 }
    }

    /// What `cmp r, #n` before the jump compares with.
    fn compared_with(&self, at: u32) -> Option<u32> {
        let before = self.instructions.range(..at).rev().take(12);
        let mut words = before.filter_map(|(place, _)| self.image.halfword(*place));
        words.find(|word| word >> 11 == 0b00101).map(|word| u32::from(word & 0xFF))
    }

    /// An instruction that no way leads to, in a function with jump tables: its table is longer than it looked.
    fn reached_only_through_a_table(&self) -> Option<u32> {
        /// What fills a gap before a table or a literal: `nop`, `mov r8, r8`, `movs r0, r0`.
        const FILLERS: [u16; 3] = [0xBF00, 0x46C0, 0x0000];
        if self.tables.is_empty() {
            return None;
        }
        let mut places = self.instructions.keys().filter(|place| !self.states.contains_key(place));
        let filler = |place: &u32| self.image.halfword(*place).is_some_and(|word| FILLERS.contains(&word));
        places.find(|place| !filler(place)).copied()
    }
}
