#![no_main]
libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    if data == b"G1 X" {
        panic!("x")
    }
});
