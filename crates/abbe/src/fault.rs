//! Faults of the program itself: even a panic ends in one clear sentence.

use crate::failure::{Failure, one_line};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::sync::OnceLock;

/// What the first panic said, and where.
static TOLD: OnceLock<String> = OnceLock::new();

/// Runs everything; a panic becomes a failure. With `RUST_BACKTRACE` set, the usual story is told before.
pub(crate) fn watched<T>(work: impl FnOnce() -> Result<T, Failure>) -> Result<T, Failure> {
    let usual = std::panic::take_hook();
    let wanted = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    std::panic::set_hook(Box::new(move |panic| {
        TOLD.get_or_init(|| told(panic));
        if wanted {
            usual(panic);
        }
    }));
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Err(failure()))
}

fn told(panic: &PanicHookInfo<'_>) -> String {
    let message = panic.payload_as_str().unwrap_or("no message");
    let place = panic.location().map(|place| format!(" at {}:{}", place.file(), place.line()));
    format!("{}{}", one_line(message), place.unwrap_or_default())
}

fn failure() -> Failure {
    Failure::work(format!(
        "a fault of the program itself, please report it with this command line: {}",
        TOLD.get().map_or("no message", String::as_str)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_sentence_with_its_place() {
        let failure = watched::<()>(|| panic!("the lamp\n is missing")).unwrap_err();
        _ = std::panic::take_hook();
        assert_eq!(failure.status(), 1);
        let sentence = failure.sentence();
        assert!(sentence.contains("the lamp is missing at ") && sentence.contains("fault.rs:"), "{sentence}");
    }
}
