//! The kernel for Cortex-M with the DSP extension (M4, M7, M33 and up), in assembly.
//!
//! # Where the work is
//! A GyroNet window is 1.12 million multiply-accumulates (1.18 by its shape, but the first step has
//! no recurrent product), 54 % of them in input projections and 46 % in recurrent products. SMLAD
//! does two in a cycle; the rest is getting int8 weights into its halfwords. Two rows share a
//! halfword ([`crate::nn`]), which makes it
//!
//! | per column pair | instructions | cycles |
//! |---|---|---|
//! | load the words of gates (i, f) and (g, o) | 2 LDR, or half an LDM of 4 | 3, or 2.5 |
//! | load the column pair | 2 LDR for two steps, or half an LDRD for one | 2, or 1.5 |
//! | SMLAD over the packed rows | 2 for each step | 2 |
//! | SXTB16: their low bytes, in place | 2 | 2 |
//! | SMLAD over the low rows | 2 for each step | 2 |
//!
//! # Two shapes
//! [`project`] knows its inputs beforehand, so it takes two steps at once: 4 rows x 2 steps, 16
//! multiply-accumulates for 14 instructions and 15 cycles. That is as many as the registers
//! hold: 8 accumulators, 2 words of weights, 2 of columns, 2 pointers. [`step`] must wait for
//! the state before it: 4 rows x 1 step, two column pairs at a time, 16 multiply-accumulates
//! for 14 instructions and 20 cycles; its 4 rows are one unit's gates, so the unit is finished
//! on the spot and no gate is ever stored. (8 rows would save an eighth of the recurrent
//! cycles, but their accumulators and weights do not fit beside the pointers.)
//!
//! Inner loops are unrolled [`PROJECT_UNROLL`] and [`STEP_UNROLL`] times and entered in the
//! middle where the columns do not divide by that; for 60 units and 120 inputs there is no
//! remainder. No branch depends on data: the count of instructions is the same for all inputs.
//!
//! # A unit's end
//! Sums to gate inputs: SMULWB/SMULWT with 16-bit multipliers, SSAT to 18 bits. A gate: table
//! word by the upper bits, SMLABB by the lower ones. Cell state: SMULWT, SMULTT, QDADD. About
//! 50 instructions and 70 cycles for four gates, cell, hidden state and the turn to the next
//! unit.
//!
//! # Expected and got
//! Modelled cycles per multiply-accumulate, zero wait states (`cargo bench-target`):
//!
//! | kernel | multiply-accumulates | inner loop alone | whole kernel |
//! |---|---|---|---|
//! | `kernel/project_120x60` | 57,600 | 0.94 | 0.99 |
//! | `kernel/step_60` | 14,400 | 1.25 | 1.57, gates and states included |

#![allow(unsafe_code, reason = "assembly; the only such file of the library")]

use crate::nn::activation::{SIGMOID, SIGMOID_SHIFT, TANH, TANH_FRACTION_SCALE, TANH_SHIFT};
use crate::nn::lstm::{Accumulators, Direction};
use core::arch::naked_asm;

/// Names a core that has the extension, where the architecture has it as an option: the code of
/// a naked function is assembled without the compiler's target features.
#[cfg(gyronet_armv8m)]
macro_rules! cpu {
    () => {
        ".cpu cortex-m33"
    };
}
#[cfg(not(gyronet_armv8m))]
macro_rules! cpu {
    () => {
        ""
    };
}

/// Column pairs in the unrolled loop of the projection.
const PROJECT_UNROLL: usize = 30;
/// Bytes of code for one of them: 14 instructions of 4 bytes.
const PROJECT_BYTES: usize = 56;
/// Double column pairs in the unrolled loop of the recurrent step.
const STEP_UNROLL: usize = 15;
/// Bytes of code for one of them: 14 instructions of 4 bytes.
const STEP_BYTES: usize = 56;

/// What the projection kernel needs, in the order in which it unpacks it.
#[repr(C)]
struct ProjectCall {
    x: *const u32,
    x_end: *const u32,
    first: *mut Accumulators,
    second: *mut Accumulators,
    first_end: *const Accumulators,
    /// Bytes into the unrolled loop at which a unit begins.
    entry: usize,
    /// From a unit's bias to where its weights would begin if the loop were entered at its top.
    to_weights: isize,
}

/// What the step kernel needs, in the order in which it unpacks it.
#[repr(C)]
struct StepCall {
    previous: *const u32,
    previous_end: *const u32,
    projection: *const Accumulators,
    cell_state: *mut i32,
    hidden: *mut u16,
    hidden_end: *const u16,
    /// Bytes into the unrolled loop at which a unit begins, or [`NO_PREVIOUS`].
    entry: usize,
    /// Bytes of recurrent words before a unit's multipliers.
    row_bytes: usize,
    sigmoid: *const i32,
    tanh: *const i32,
}

/// `entry` of a step from the zero state: there is no product to add.
const NO_PREVIOUS: usize = usize::MAX;

pub(in crate::nn) fn project<const U: usize>(
    direction: &Direction<'_>,
    x: &[u32],
    projection: &mut [[Accumulators; U]; 2],
) {
    let pairs = direction.inputs() / 2;
    let [first, second] = projection;
    // The caller has made sure of both lengths.
    let (Some(x), Some(units)) = (x.get(..direction.inputs()), first.get(..direction.units())) else {
        return;
    };
    let first_end = units.as_ptr_range().end;
    let skipped = entry(pairs, PROJECT_UNROLL);
    let call = ProjectCall {
        // The loop addresses from its top, also when it is entered in the middle.
        x: x.as_ptr().wrapping_sub(2 * skipped),
        x_end: x.as_ptr_range().end,
        first: first.as_mut_ptr(),
        second: second.as_mut_ptr(),
        first_end,
        entry: skipped * PROJECT_BYTES,
        to_weights: 16 - 8 * skipped as isize,
    };
    // SAFETY: `Direction` guarantees units x (4 + inputs) readable words and at least one pair
    // of inputs; `x` has exactly `inputs` words, both planes hold `U` = `units` records. The
    // kernel reads and writes just these, and nothing else is aliased by the `&mut`.
    unsafe { project_kernel(&call, direction.input().as_ptr()) }
}

pub(in crate::nn) fn step<const U: usize, const W: usize>(
    direction: &Direction<'_>,
    projection: &[Accumulators; U],
    previous: Option<&[u32; W]>,
    cell_state: &mut [i32; U],
    hidden: &mut [u32; W],
) {
    let hidden = hidden.as_mut_ptr().cast::<u16>();
    let quads = W / 2;
    let (start, entry) = match previous {
        Some(previous) => (previous.as_ptr(), entry(quads, STEP_UNROLL) * STEP_BYTES),
        None => (core::ptr::null(), NO_PREVIOUS),
    };
    let call = StepCall {
        previous: start,
        previous_end: start.wrapping_add(2 * quads),
        projection: projection.as_ptr(),
        cell_state: cell_state.as_mut_ptr(),
        hidden,
        hidden_end: hidden.wrapping_add(direction.units()),
        entry,
        row_bytes: 8 * W,
        // Entry 0 is the most negative input; the kernel indexes from the middle.
        sigmoid: SIGMOID[SIGMOID.len() / 2..].as_ptr(),
        tanh: TANH[TANH.len() / 2..].as_ptr(),
    };
    // SAFETY: `Direction` guarantees units x (2 W + 2) readable words; `lstm::step` has checked
    // that `U` = `units` and that `W` words are `units` halfwords, rounded up to four. `previous`
    // has `W` words, an even number, or is not read. Table indices come out of SSAT to 18 bits
    // and stay inside both tables. Nothing else is read or written.
    unsafe { step_kernel(&call, direction.recurrent().as_ptr()) }
}

/// Where to enter a loop of `unroll` so that `count` is met at the end of a turn.
fn entry(count: usize, unroll: usize) -> usize {
    (unroll - count % unroll) % unroll
}

/// For each unit: `first` and `second` := bias + rows . x.
///
/// r0 weights, r1 columns, r2 r3 columns of both steps, r4-r7 sums of the first step, r8-r11 of
/// the second, r12 lr weights.
///
/// # Safety
/// As stated where it is called.
#[unsafe(naked)]
unsafe extern "C" fn project_kernel(call: &ProjectCall, weights: *const u32) {
    naked_asm!(
        cpu!(),
        "push {{r4-r11, lr}}",
        "ldm r0, {{r2-r8}}",
        "adr.w r12, 2f",
        "add r7, r7, r12",
        "orr r7, r7, #1",
        "push {{r2-r8}}",
        // sp: +0 x, +4 x_end, +8 first, +12 second, +16 first_end, +20 entry, +24 to_weights
        "mov r0, r1",
        "1:",
        "ldm r0, {{r8-r11}}",
        "ldm r0, {{r4-r7}}",
        "ldr r1, [sp, #0]",
        "ldr r2, [sp, #24]",
        "add r0, r0, r2",
        "ldr.w pc, [sp, #20]",
        ".p2align 2",
        "2:",
        ".set gyronet_at, 0",
        ".rept {unroll}",
        // Four single loads in a row overlap: one cycle less than two LDRD.
        "ldr.w r12, [r0, #gyronet_at]",
        "ldr.w lr, [r0, #gyronet_at + 4]",
        "ldr.w r2, [r1, #gyronet_at]",
        "ldr.w r3, [r1, #gyronet_at + 4]",
        ".set gyronet_at, gyronet_at + 8",
        "smlad r5, r12, r2, r5",
        "smlad r9, r12, r3, r9",
        "smlad r7, lr, r2, r7",
        "smlad r11, lr, r3, r11",
        "sxtb16 r12, r12",
        "sxtb16 lr, lr",
        "smlad r4, r12, r2, r4",
        "smlad r8, r12, r3, r8",
        "smlad r6, lr, r2, r6",
        "smlad r10, lr, r3, r10",
        ".endr",
        "add.w r0, r0, #8 * {unroll}",
        "add.w r1, r1, #8 * {unroll}",
        "ldr r2, [sp, #4]",
        "cmp r1, r2",
        "bne.w 2b",
        "ldrd r2, r3, [sp, #8]",
        "stm r2!, {{r4-r7}}",
        "stm r3!, {{r8-r11}}",
        "strd r2, r3, [sp, #8]",
        "ldr r12, [sp, #16]",
        "cmp r2, r12",
        "bne.w 1b",
        "add sp, sp, #28",
        "pop {{r4-r11, pc}}",
        unroll = const PROJECT_UNROLL,
    )
}

/// For each unit: sums := projection + rows . previous; gates; cell state; hidden state.
///
/// r0 weights, r1 previous, r2 r3 columns, r4-r7 sums, r8-r11 weights, r12 and lr the middles
/// of the tables.
///
/// # Safety
/// As stated where it is called.
#[unsafe(naked)]
unsafe extern "C" fn step_kernel(call: &StepCall, weights: *const u32) {
    naked_asm!(
        cpu!(),
        "push {{r4-r11, lr}}",
        "ldm r0, {{r2-r11}}",
        "mov r0, r1",
        "mov r12, r10",
        "mov lr, r11",
        // Without a previous state the entry is the jump over the products.
        "adr.w r10, 2f",
        "adr.w r11, 4f",
        "add r10, r10, r8",
        "cmp r8, #{no_previous}",
        "it eq",
        "moveq r10, r11",
        "orr r8, r10, #1",
        "push {{r2-r9}}",
        // sp: +0 previous, +4 previous_end, +8 projection, +12 cell_state, +16 hidden,
        // +20 hidden_end, +24 entry, +28 row_bytes
        "1:",
        "ldr r1, [sp, #0]",
        "ldr r2, [sp, #8]",
        "ldm r2!, {{r4-r7}}",
        "str r2, [sp, #8]",
        "ldr.w pc, [sp, #24]",
        ".p2align 2",
        "4:",
        "ldr r2, [sp, #28]",
        "add r0, r0, r2",
        "b.w 3f",
        ".p2align 2",
        "2:",
        ".rept {unroll}",
        "ldm.w r0!, {{r8-r11}}",
        "ldrd r2, r3, [r1], #8",
        "smlad r5, r8, r2, r5",
        "smlad r7, r9, r2, r7",
        "smlad r5, r10, r3, r5",
        "smlad r7, r11, r3, r7",
        "sxtb16 r8, r8",
        "sxtb16 r9, r9",
        "sxtb16 r10, r10",
        "sxtb16 r11, r11",
        "smlad r4, r8, r2, r4",
        "smlad r6, r9, r2, r6",
        "smlad r4, r10, r3, r4",
        "smlad r6, r11, r3, r6",
        ".endr",
        "ldr r2, [sp, #4]",
        "cmp r1, r2",
        "bne.w 2b",
        "3:",
        // The high rows are what the packed sums have more than the low ones, times 256.
        "ldm r0!, {{r2, r3}}",
        "sub r5, r5, r4",
        "sub r7, r7, r6",
        "smulwb r4, r4, r2",
        "smulwt r5, r5, r2",
        "smulwb r6, r6, r3",
        "smulwt r7, r7, r3",
        "ssat r4, #18, r4",
        "ssat r5, #18, r5, asr #8",
        "ssat r6, #18, r6",
        "ssat r7, #18, r7, asr #8",
        // Gates i, f, g, o: table words by the upper bits ...
        "asr r8, r4, #{sigmoid_shift}",
        "asr r9, r5, #{sigmoid_shift}",
        "asr r10, r6, #{tanh_shift}",
        "asr r11, r7, #{sigmoid_shift}",
        "ldr r8, [r12, r8, lsl #2]",
        "ldr r9, [r12, r9, lsl #2]",
        "ldr r10, [lr, r10, lsl #2]",
        "ldr r11, [r12, r11, lsl #2]",
        // ... and lines by the lower ones. r2 holds tanh's fraction, zero around it.
        "mov r2, #0",
        "ubfx r4, r4, #0, #{sigmoid_shift}",
        "ubfx r5, r5, #0, #{sigmoid_shift}",
        "bfi r2, r6, #{tanh_scale}, #{tanh_shift}",
        "ubfx r7, r7, #0, #{sigmoid_shift}",
        "smlabb r4, r4, r8, r8",
        "smlabb r5, r5, r9, r9",
        "smlabb r6, r2, r10, r10",
        "smlabb r7, r7, r11, r11",
        // Cell state: c f + i g.
        "ldrd r10, r11, [sp, #12]",
        "ldr r8, [r10]",
        "smultt r9, r4, r6",
        "smulwt r8, r8, r5",
        "asr r9, r9, #10",
        "qdadd r8, r9, r8",
        "str r8, [r10], #4",
        // Hidden state: o tanh(c).
        "ssat r8, #18, r8, asr #6",
        "asr r9, r8, #{tanh_shift}",
        "bfi r2, r8, #{tanh_scale}, #{tanh_shift}",
        "ldr r9, [lr, r9, lsl #2]",
        "smlabb r9, r2, r9, r9",
        "smultt r9, r7, r9",
        "add r9, r9, #0x80000",
        "asr r9, r9, #20",
        "strh r9, [r11], #2",
        "strd r10, r11, [sp, #12]",
        "ldr r2, [sp, #20]",
        "cmp r11, r2",
        "bne.w 1b",
        "add sp, sp, #32",
        "pop {{r4-r11, pc}}",
        unroll = const STEP_UNROLL,
        no_previous = const -1,
        sigmoid_shift = const SIGMOID_SHIFT,
        tanh_shift = const TANH_SHIFT,
        tanh_scale = const TANH_FRACTION_SCALE,
    )
}
