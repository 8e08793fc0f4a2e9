//! The static call graph: what a function reaches, by which way, and how much stack that takes at worst.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use super::flow::{Riddle, Summary, follow};
use super::{Function, Image, is_costly, offence_of};

/// What was followed from one function.
pub(crate) struct Graph<'a> {
    image: &'a Image,
    from: u32,
    /// Every function that is reached, by address.
    summaries: BTreeMap<u32, Summary>,
    /// Who reached it first: on a shortest way.
    callers: BTreeMap<u32, u32>,
}

/// Stack from a function down.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Stack {
    /// At most so many bytes, along this chain of calls.
    Bounded { bytes: u32, chain: Vec<String> },
    /// There is no bound: this chain of calls is a circle.
    Recursion(Vec<String>),
    /// Why there may be no bound.
    Unknown(String),
}

/// The deepest way from a function down.
#[derive(Clone)]
struct Depth {
    bytes: u32,
    way: Vec<u32>,
}

impl<'a> Graph<'a> {
    /// Follows all calls from a function.
    pub(crate) fn from(image: &'a Image, entry: &Function) -> Self {
        let from = entry.address;
        let mut graph = Self { image, from, summaries: BTreeMap::new(), callers: BTreeMap::new() };
        let mut open = VecDeque::from([from]);
        while let Some(address) = open.pop_front() {
            let Some(function) = image.function_at(address) else { continue };
            let summary = follow(image, function);
            for call in &summary.calls {
                let known = call.to == from || graph.callers.contains_key(&call.to);
                if !known {
                    graph.callers.insert(call.to, address);
                    open.push_back(call.to);
                }
            }
            graph.summaries.insert(address, summary);
        }
        graph
    }

    /// Every function that can be reached, the first one included.
    pub(crate) fn reachable(&self) -> impl Iterator<Item = &'a Function> {
        self.summaries.keys().filter_map(|address| self.image.function_at(*address))
    }

    /// A sentence for each thing that the tick must not do, with the shortest chain of calls to it. A function that is
    /// only reached through another offender is not named a second time.
    ///
    /// `allowed` names functions that may call through a register.
    pub(crate) fn offences(&self, allowed: &[&str]) -> Vec<String> {
        let mut findings = Vec::new();
        for function in self.reachable() {
            let chain = self.chain_to(function.address);
            if let Some(what) = offence(function)
                && !self.offends_on_the_way(function.address)
            {
                findings.push(format!("{what}: {}", chain.join(" → ")));
            }
            let may_be_indirect = allowed.contains(&function.name().as_str());
            let riddles = self.summaries[&function.address].riddles.iter();
            let riddles = riddles.filter(|(_, riddle)| !(may_be_indirect && *riddle == Riddle::IndirectCall));
            findings.extend(
                riddles.map(|(at, riddle)| format!("{} at {at:#x}: {}", riddle.what(), chain.join(" → "))),
            );
        }
        findings.extend(self.traps());
        findings
    }

    fn traps(&self) -> Vec<String> {
        let with_traps = self.summaries.iter().filter(|(_, summary)| !summary.traps.is_empty());
        let outside = with_traps.filter(|(address, _)| {
            !self.offends_on_the_way(**address)
                && self.image.function_at(**address).and_then(offence).is_none()
        });
        outside
            .map(|(address, _)| format!("ends in a trap: {}", self.chain_to(*address).join(" → ")))
            .collect()
    }

    fn offends_on_the_way(&self, address: u32) -> bool {
        let mut ways = self.way_to(address).into_iter().filter(|other| *other != address);
        ways.any(|other| self.image.function_at(other).and_then(offence).is_some())
    }

    /// Costly routines, each with its callers.
    pub(crate) fn costly(&self) -> BTreeMap<String, BTreeSet<String>> {
        let mut costly: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (caller, summary) in &self.summaries {
            for call in &summary.calls {
                let Some(function) = self.image.function_at(call.to) else { continue };
                if let Some(routine) = function.symbols.iter().find(|symbol| is_costly(symbol)) {
                    costly.entry(routine.clone()).or_default().insert(self.name(*caller));
                }
            }
        }
        costly
    }

    /// Worst case of the stack from the first function down.
    pub(crate) fn stack(&self) -> Stack {
        match self.depth(self.from, &mut Vec::new(), &mut BTreeMap::new()) {
            Ok(depth) => {
                let chain = depth.way.iter().map(|address| self.with_frame(*address)).collect();
                Stack::Bounded { bytes: depth.bytes, chain }
            }
            Err(stack) => stack,
        }
    }

    fn depth(
        &self,
        address: u32,
        way: &mut Vec<u32>,
        known: &mut BTreeMap<u32, Depth>,
    ) -> Result<Depth, Stack> {
        if let Some(depth) = known.get(&address) {
            return Ok(depth.clone());
        }
        if let Some(start) = way.iter().position(|other| *other == address) {
            let circle = way.iter().skip(start).chain([&address]);
            return Err(Stack::Recursion(circle.map(|address| self.name(*address)).collect()));
        }
        let summary = &self.summaries[&address];
        if let Some((at, riddle)) = summary.riddles.first() {
            let reason = format!("{} at {at:#x} in {}", riddle.what(), self.name(address));
            return Err(Stack::Unknown(reason));
        }
        way.push(address);
        let mut deepest = Depth { bytes: summary.frame, way: vec![address] };
        for call in &summary.calls {
            let below = self.depth(call.to, way, known)?;
            let bytes = call.depth + below.bytes;
            if bytes > deepest.bytes {
                deepest = Depth { bytes, way: std::iter::once(address).chain(below.way).collect() };
            }
        }
        way.pop();
        known.insert(address, deepest.clone());
        Ok(deepest)
    }

    fn with_frame(&self, address: u32) -> String {
        format!("{} ({})", self.name(address), self.summaries[&address].frame)
    }

    fn name(&self, address: u32) -> String {
        self.image.function_at(address).map(Function::name).unwrap_or_default()
    }

    /// The names on a shortest way from the first function.
    fn chain_to(&self, address: u32) -> Vec<String> {
        self.way_to(address).into_iter().map(|address| self.name(address)).collect()
    }

    fn way_to(&self, address: u32) -> Vec<u32> {
        let mut way: Vec<u32> =
            std::iter::successors(Some(address), |address| self.callers.get(address).copied()).collect();
        way.reverse();
        way
    }
}

/// What a function does that a tick must not, in words.
fn offence(function: &Function) -> Option<&'static str> {
    function.symbols.iter().find_map(|symbol| offence_of(symbol)).map(super::Offence::what)
}

impl Riddle {
    fn what(self) -> String {
        match self {
            Self::IndirectCall => "an indirect call".into(),
            Self::NoFunction(to) => format!("a jump to {to:#x}, where no function begins,"),
            Self::RunsOff => "a way that runs off the end of the function".into(),
            Self::Stack => "a stack frame of unknown size".into(),
            Self::NoInstruction => "something that is no instruction".into(),
        }
    }
}
