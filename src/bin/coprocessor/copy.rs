//! Copies memory word by word at any address, which a Cortex-M4 can. The compiler's own routines, which these replace, are
//! for any processor, and take three times as many instructions for the short pieces that samples and frames are.
#![allow(
    unsafe_code,
    reason = "the routines that the compiler calls to copy, by the rules of Arm's run-time ABI"
)]

use core::arch::naked_asm;

/// Copies `length` bytes between places that do not overlap.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn __aeabi_memcpy(to: *mut u8, from: *const u8, length: usize) {
    naked_asm!(
        "subs r2, #8",
        "blo 2f",
        "1:",
        "ldr r3, [r1], #4",
        "ldr r12, [r1], #4",
        "str r3, [r0], #4",
        "str r12, [r0], #4",
        "subs r2, #8",
        "bhs 1b",
        // Of the length's low bits, which the subtraction has kept, bit 2 goes to the carry, bit 1 to the sign.
        "2:",
        "lsls r3, r2, #30",
        "itt cs",
        "ldrcs r3, [r1], #4",
        "strcs r3, [r0], #4",
        "itt mi",
        "ldrhmi r3, [r1], #2",
        "strhmi r3, [r0], #2",
        "lsls r3, r2, #31",
        "itt mi",
        "ldrbmi r3, [r1]",
        "strbmi r3, [r0]",
        "bx lr",
    )
}

/// The same for aligned places.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn __aeabi_memcpy4(to: *mut u32, from: *const u32, length: usize) {
    naked_asm!("b {copy}", copy = sym __aeabi_memcpy)
}

#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn __aeabi_memcpy8(to: *mut u64, from: *const u64, length: usize) {
    naked_asm!("b {copy}", copy = sym __aeabi_memcpy)
}
