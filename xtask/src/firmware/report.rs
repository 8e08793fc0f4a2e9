//! The findings of all images as a table for people and as JSON for programs.

use serde_json::{Value, json};

use super::{EntryVerdict, Verdict};
use crate::compiler::Route;
use crate::image::Stack;

/// How a report is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    Table,
    Json,
}

impl Form {
    /// The report: the verdicts, and the offenders that were missed.
    pub(super) fn of(self, verdicts: &[Verdict], route: Route, missed: &[String]) -> String {
        match self {
            Self::Table => table(verdicts) + &findings(verdicts, missed),
            Self::Json => {
                let images: Vec<Value> = verdicts.iter().map(image).collect();
                let passed = missed.is_empty() && verdicts.iter().all(|verdict| verdict.findings.is_empty());
                let report =
                    json!({ "compiler": route.name(), "images": images, "missed": missed, "passed": passed });
                format!("{report:#}")
            }
        }
    }
}

/// Memory of each image, stack of each entry, costly routines.
pub(super) fn table(verdicts: &[Verdict]) -> String {
    let mut lines =
        vec![format!("{:<12} {:<24} {:>14} {:>14}", "image", "target", "flash (bytes)", "RAM (bytes)")];
    for verdict in verdicts {
        let (row, flash, ram) = (verdict.row, verdict.flash, verdict.ram);
        lines.push(format!("{:<12} {:<24} {flash:>14} {ram:>14}", row.name, row.target));
        let (flash, ram) = (row.limits.flash, row.limits.ram);
        lines.push(format!("{:<12} {:<24} {flash:>14} {ram:>14}", "", "limit"));
    }
    for verdict in verdicts {
        lines.push(format!(
            "\n{}: from an entry down (limit of stack {})",
            verdict.row.name, verdict.row.limits.stack
        ));
        lines.extend(verdict.entries.iter().map(entry_line));
        lines.extend(
            verdict
                .row
                .may_call_indirectly
                .iter()
                .map(|(function, reason)| format!("  {function} may call through a register: {reason}")),
        );
        for (routine, callers) in &verdict.costly {
            let callers: Vec<&str> = callers.iter().map(String::as_str).collect();
            lines.push(format!("  costly: {routine} ← {}", callers.join(", ")));
        }
    }
    lines.join("\n") + "\n"
}

fn entry_line(entry: &EntryVerdict) -> String {
    let stack = match &entry.stack {
        Stack::Bounded { bytes, chain } => format!("{bytes} bytes of stack: {}", chain.join(" → ")),
        Stack::Recursion(circle) => format!("stack without a bound: {}", circle.join(" → ")),
        Stack::Unknown(reason) => format!("stack unknown: {reason}"),
    };
    format!("  {}: {} functions, {stack}", entry.entry.name(), entry.functions)
}

fn findings(verdicts: &[Verdict], missed: &[String]) -> String {
    let all: Vec<&String> = verdicts.iter().flat_map(|verdict| &verdict.findings).chain(missed).collect();
    if all.is_empty() {
        return "\nno panic, no allocation, no soft float, no wide division, no indirect call; every limit is kept".into();
    }
    let lines = all.iter().map(|finding| format!("\n  {finding}"));
    format!("\nfindings: {}{}", all.len(), lines.collect::<String>())
}

fn image(verdict: &Verdict) -> Value {
    let entries: Vec<Value> = verdict.entries.iter().map(entry).collect();
    json!({
        "name": verdict.row.name,
        "target": verdict.row.target,
        "flash_bytes": verdict.flash,
        "flash_limit_bytes": verdict.row.limits.flash,
        "ram_bytes": verdict.ram,
        "ram_limit_bytes": verdict.row.limits.ram,
        "stack_limit_bytes": verdict.row.limits.stack,
        "entries": entries,
        "costly": verdict.costly,
        "findings": verdict.findings,
    })
}

fn entry(entry: &EntryVerdict) -> Value {
    let (bytes, chain, reason) = match &entry.stack {
        Stack::Bounded { bytes, chain } => (Some(bytes), chain.clone(), None),
        Stack::Recursion(circle) => (None, circle.clone(), Some("recursion".to_owned())),
        Stack::Unknown(reason) => (None, Vec::new(), Some(reason.clone())),
    };
    json!({
        "function": entry.entry.name(),
        "functions_reached": entry.functions,
        "stack_bytes": bytes,
        "stack_chain": chain,
        "stack_unknown": reason,
    })
}
