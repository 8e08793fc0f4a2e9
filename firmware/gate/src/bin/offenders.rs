//! One function for each thing that the tick must not do. A gate that does not find them all proves nothing.
//!
//! Nothing here is ever run.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_panic() {
    black_box(black_box([1_u8, 2, 3])[black_box(7_usize)]);
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_float() {
    black_box(black_box(1.5_f64) * black_box(2.5_f64));
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_division() {
    black_box(black_box(1_i64).wrapping_div(black_box(7_i64) | 1));
}

unsafe extern "C" {
    /// The run-time library's division of 128 bits. Of its own accord the compiler writes such a division out in place.
    fn __udivti3(dividend: u128, divisor: u128) -> u128;
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_128_bits() {
    // SAFETY: nothing here is ever run.
    black_box(unsafe { __udivti3(black_box(1), black_box(7)) });
}

/// There is no allocator on a board; a function of the name that the compiler would call stands for it.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn __rust_alloc(size: usize, align: usize) -> usize {
    black_box(size.wrapping_add(align))
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_allocation() {
    black_box(__rust_alloc(black_box(8), black_box(4)));
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_indirect_call() {
    black_box(harmless as extern "C" fn())();
}

#[inline(never)]
extern "C" fn harmless() {
    black_box(0);
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_recursion(depth: u32) -> u32 {
    let rest = black_box(depth).wrapping_sub(1);
    black_box(if rest == 0 { 0 } else { black_box(known_recursion(rest)).wrapping_add(1) })
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_trap() {
    // SAFETY: nothing here is ever run.
    unsafe { core::arch::asm!("udf #0") };
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn known_large_frame() {
    black_box(&black_box([1_u8; 9000]));
}

/// Where the image would start.
#[unsafe(no_mangle)]
pub extern "C" fn _start() -> ! {
    loop {
        known_panic();
        known_float();
        known_division();
        known_128_bits();
        known_allocation();
        known_indirect_call();
        known_recursion(black_box(3));
        known_trap();
        known_large_frame();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {}
}
