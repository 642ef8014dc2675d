//! The kernel for Cortex-M with the DSP extension (M4, M7, M33 and up), in assembly.
//!
//! A GyroNet window is 1.12 million multiply-accumulates, 54 % of them in input projections. SMLAD does two in a cycle;
//! the rest is unpacking int8 weights into its halfwords. Two rows share a halfword ([`crate::nn`]), which costs
//!
//! | per column pair | instructions | cycles |
//! |---|---|---|
//! | load the words of gates (i, f) and (g, o), and the column pair of one or two steps | 3 or 4 LDR | 3.5, or 5 |
//! | SMLAD over the packed rows | 2 for each step | 2 |
//! | SXTB16: their low bytes, in place | 2 | 2 |
//! | SMLAD over the low rows | 2 for each step | 2 |
//!
//! **Two shapes.** [`project`] computes two steps at once: 4 rows x 2 steps, 16 multiply-accumulates for 14 instructions
//! and 15 cycles, as many as the registers hold. [`step`] must wait for the previous state: 4 rows x 1 step, two column
//! pairs at a time, 16 for 18 instructions and 19 cycles; its rows are one unit's gates, so no gate is ever stored.
//! Loads are adjacent, since they are pipelined (Cortex-M4 TRM 3.3.2), and use low registers, so that they need two
//! bytes. Through a pointer 4 bytes before its words they reach 30 words; the last one advances it.
//!
//! **As small as the cache.** Flash is read in lines of 16 bytes, six cycles each on an STM32F405 at 168 MHz, and its
//! accelerator holds 64 of them (RM0090 3.5.2). Loops are unrolled [`PROJECT_UNROLL`] and [`STEP_UNROLL`] times, so that
//! a kernel and the loop around it fit in four fifths of that; they are entered in the middle for other numbers of
//! columns. A loop that reads weights from flash begins in the middle of a line: the load that misses is the last one in
//! its line, when the prefetch of the next has ended. No branch depends on data.
//!
//! **A unit's end.** Gate inputs by SMULWB/SMULWT, SSAT to 18 bits; a gate by table word and SMLABB; the cell by SMULWT,
//! SMULTT, QDADD: 70 cycles for four gates, cell and hidden state.
//!
//! Modelled cycles per multiply-accumulate at zero wait states (`cargo bench-target`):
//!
//! | kernel | multiply-accumulates | inner loop alone | whole kernel |
//! |---|---|---|---|
//! | `kernel/project_120x60`: one pair of steps, weights from flash | 57,600 | 0.94 | 1.03 |
//! | `kernel/project_120x60x5`: five pairs, each weight copied once | 288,000 | 0.94 | 1.08 |
//! | `kernel/step_60`, gates and states included | 14,400 | 1.19 | 1.54 |
//!
//! Copying weights to RAM takes 5 % of a window's cycles there. By a model of the flash accelerator, an STM32F405 at 168
//! MHz saves 10 % with it.

#![allow(unsafe_code, reason = "assembly; the only such file of the library")]

use crate::nn::activation::{SIGMOID, SIGMOID_SHIFT, TANH, TANH_FRACTION_SCALE, TANH_SHIFT};
use crate::nn::lstm::{Accumulators, BIAS_WORDS, DirectionWeights, MAX_INPUTS, Projection};
use core::arch::naked_asm;
use core::mem::MaybeUninit;

/// Names a core that has the optional extension: naked functions are assembled without the target's features.
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

/// The unrolled loop of the projection has this many column pairs.
const PROJECT_UNROLL: usize = 12;
/// Bytes of code for one of them: 4 loads of 2 bytes and 10 instructions of 4; the last one has 4 more.
const PROJECT_BYTES: usize = 48;
/// A record of this size fits in the flash accelerator's eight lines for data (RM0090 3.5.2), wherever it begins.
const CACHED_BYTES: usize = 7 * 16;
/// The unrolled loop of the recurrent step has this many double column pairs.
const STEP_UNROLL: usize = 8;
/// Bytes of code for one of them: 4 loads of 2 bytes and 14 instructions of 4; the last one has 2 more.
const STEP_BYTES: usize = 64;

/// Holds the arguments of the projection kernel, in the order in which it unpacks them.
#[repr(C)]
struct ProjectCall {
    /// One word before the columns of the first pair of steps.
    x: *const u32,
    /// One word before the end of the columns of the last pair of steps.
    x_end: *const u32,
    /// Accumulators of the first unit in the first step.
    projection: *mut Accumulators,
    projection_end: *const Accumulators,
    /// The place to copy a unit's record to; null where it is read in place.
    record: *mut u32,
    record_bytes: usize,
    /// Bytes into the unrolled loop at which a pair of steps begins.
    entry: usize,
    /// Bytes of columns and of weights that the entry skips: pointers start this far before the data.
    skipped: usize,
    /// Bytes from a step's accumulators to those of the next one.
    step_bytes: usize,
    /// Bytes from a pair's columns to those of the next one.
    pair_bytes: usize,
}

/// Holds the arguments of the step kernel, in the order in which it unpacks them.
#[repr(C)]
struct StepCall {
    /// One word before the columns, less those that the first iteration of the loop skips.
    previous: *const u32,
    /// One word before the end of the columns.
    previous_end: *const u32,
    projection: *const Accumulators,
    cell_state: *mut i32,
    hidden: *mut u16,
    hidden_end: *const u16,
    /// Bytes into the unrolled loop at which a unit begins, or [`NO_PREVIOUS`].
    entry: usize,
    /// Bytes from a unit's weights back to the loop's top; without a previous state, on to its multipliers.
    to_weights: isize,
    sigmoid: *const i32,
    tanh: *const i32,
}

/// `entry` of a step from the zero state: there is no product to add.
const NO_PREVIOUS: usize = usize::MAX;

pub(in crate::nn) fn project<const U: usize>(
    weights: &DirectionWeights<'_>,
    x: &[u32],
    projection: &mut [Projection<U>],
) {
    let inputs = weights.inputs();
    // The caller has checked all lengths.
    if projection.is_empty() || x.len() != inputs * projection.len() || weights.units() > U {
        return;
    }
    // A record is read for each pair of steps: from the second pair on, reading a copy is faster, unless the record
    // stays in the cache for data.
    let mut record = MaybeUninit::<[u32; BIAS_WORDS + MAX_INPUTS]>::uninit();
    let record_bytes = size_of::<Accumulators>() + 4 * inputs;
    let copies = projection.len() > 1 && record_bytes > CACHED_BYTES;
    let copy = if copies { record.as_mut_ptr().cast() } else { core::ptr::null_mut() };
    let first = projection.as_mut_ptr().cast::<Accumulators>();
    let skipped = entry::<PROJECT_UNROLL>(inputs / 2);
    let call = ProjectCall {
        x: x.as_ptr().wrapping_sub(1),
        x_end: x.as_ptr_range().end.wrapping_sub(1),
        projection: first,
        projection_end: first.wrapping_add(weights.units()),
        record: copy,
        record_bytes,
        entry: skipped * PROJECT_BYTES,
        skipped: 8 * skipped,
        step_bytes: size_of::<[Accumulators; U]>(),
        pair_bytes: 4 * inputs,
    };
    // SAFETY: `DirectionWeights` guarantees units x (4 + inputs) readable words, at least one pair of inputs
    // and at most as many as `record` has words for; `x` has `inputs` words for each pair of steps, and
    // `projection` two times `U` records, at least `units`. The kernel reads and writes just these, and
    // nothing else is aliased by the `&mut`.
    unsafe { project_kernel(&call, weights.input().as_ptr()) }
}

pub(in crate::nn) fn step<const U: usize, const W: usize>(
    weights: &DirectionWeights<'_>,
    projection: &[Accumulators; U],
    previous: Option<&[u32; W]>,
    cell_state: &mut [i32; U],
    hidden: &mut [u32; W],
) {
    let hidden = hidden.as_mut_ptr().cast::<u16>();
    let columns = DirectionWeights::padded(weights.units());
    let quads = columns / 4;
    let skipped = entry::<STEP_UNROLL>(quads);
    let (start, entry, to_weights) = match previous {
        Some(previous) => (previous.as_ptr(), skipped * STEP_BYTES, -((16 * skipped) as isize)),
        None => (core::ptr::null(), NO_PREVIOUS, (4 * columns) as isize),
    };
    let call = StepCall {
        previous: start.wrapping_sub(2 * skipped + 1),
        previous_end: start.wrapping_add(2 * quads).wrapping_sub(1),
        projection: projection.as_ptr(),
        cell_state: cell_state.as_mut_ptr(),
        hidden,
        hidden_end: hidden.wrapping_add(weights.units()),
        entry,
        to_weights,
        // Entry 0 is the most negative input; the kernel indexes from the middle.
        sigmoid: SIGMOID[SIGMOID.len() / 2..].as_ptr(),
        tanh: TANH[TANH.len() / 2..].as_ptr(),
    };
    // SAFETY: `DirectionWeights` guarantees units x (columns + 2) readable words; `lstm::step` has checked
    // that `units` is at most `U`, and that `W` words are at least `units` halfwords, rounded up to four.
    // `previous` has as many words, an even number, or is not read. Table indices come out of SSAT to 18 bits
    // and stay inside both tables. Nothing else is read or written.
    unsafe { step_kernel(&call, weights.recurrent().as_ptr()) }
}

/// Words that the copying kernel copies at once.
const COPY_WORDS: usize = 8;

/// Copies as many words as both slices have.
pub(in crate::nn) fn copy(from: &[u32], to: &mut [u32]) {
    let (from, to) = (from.as_chunks::<COPY_WORDS>(), to.as_chunks_mut::<COPY_WORDS>());
    let chunks = from.0.len().min(to.0.len());
    if chunks > 0 {
        // SAFETY: both have `chunks` chunks, and nothing aliases the `&mut`.
        unsafe { copy_kernel(from.0.as_ptr(), to.0.as_mut_ptr(), to.0.as_ptr().wrapping_add(chunks)) }
    }
    for (from, to) in from.1.iter().zip(to.1) {
        *to = *from;
    }
}

/// Copies chunks until `to` is `to_end`, at least one. The loop lies in one line of flash, so that fetching it does
/// not delay reading the data.
///
/// # Safety
/// As stated where it is called.
#[unsafe(naked)]
unsafe extern "C" fn copy_kernel(
    from: *const [u32; COPY_WORDS],
    to: *mut [u32; COPY_WORDS],
    to_end: *const [u32; COPY_WORDS],
) {
    naked_asm!(
        cpu!(),
        "push {{r4-r10}}",
        "b.n 1f",
        ".p2align 4",
        "1:",
        "ldm r0!, {{r3-r10}}",
        "stm r1!, {{r3-r10}}",
        "cmp r1, r2",
        "bne.n 1b",
        "pop {{r4-r10}}",
        "bx lr",
    )
}

/// Returns where to enter a loop unrolled `UNROLL` times, so that `count` items end with a full iteration.
const fn entry<const UNROLL: usize>(count: usize) -> usize {
    (UNROLL - count % UNROLL) % UNROLL
}

/// Computes for each unit and each pair of steps: both steps' accumulators := bias + rows . columns.
///
/// r0 one word before the weights, r1 one word before the columns, r2 r3 columns of both steps, r4 r5 weights, r6-r9
/// sums of the first step, r10-r12 lr of the second.
///
/// # Safety
/// As stated where it is called.
#[unsafe(naked)]
unsafe extern "C" fn project_kernel(call: &ProjectCall, weights: *const u32) {
    naked_asm!(
        cpu!(),
        "push {{r4-r11, lr}}",
        "ldm r0, {{r2-r11}}",
        "adr.w r12, 2f",
        "add r8, r8, r12",
        "orr r8, r8, #1",
        "sub sp, sp, #16",
        "push {{r2-r11}}",
        // sp: +0 x, +4 x_end, +8 projection, +12 projection_end, +16 record, +20 record_bytes,
        // +24 entry, +28 skipped, +32 step_bytes, +36 pair_bytes; +40 the current record, +44 the
        // current accumulators, +48 the end of the pair's columns, +52 the next unit's record
        // All pointers to records point to the last bias.
        "add.w r1, r1, #12",
        // A unit: its record is copied, or read in place.
        "1:",
        "ldr r0, [sp, #16]",
        "ldr r2, [sp, #20]",
        "str r1, [sp, #40]",
        "cmp r0, #0",
        "bne.w 4f",
        "add r1, r1, r2",
        "6:",
        "str r1, [sp, #52]",
        "ldr r1, [sp, #0]",
        "ldr r2, [sp, #8]",
        "str r2, [sp, #44]",
        // A pair of steps.
        "7:",
        "ldr r0, [sp, #40]",
        "ldr r2, [sp, #28]",
        "ldr r3, [sp, #36]",
        "ldr r6, [r0, #-12]",
        "ldr r7, [r0, #-8]",
        "ldr r8, [r0, #-4]",
        "ldr r9, [r0]",
        "add r3, r3, r1",
        "str r3, [sp, #48]",
        "sub r1, r1, r2",
        "sub r0, r0, r2",
        "mov r10, r6",
        "mov r11, r7",
        "mov r12, r8",
        "mov lr, r9",
        "ldr.w pc, [sp, #24]",
        ".p2align 4",
        ".space 8",
        "2:",
        ".set gyronet_at, 4",
        ".rept {unroll}",
        "ldr.n r2, [r1, #gyronet_at]",
        ".if gyronet_at < 8 * {unroll} - 4",
        "ldr.n r3, [r1, #gyronet_at + 4]",
        "ldr.n r4, [r0, #gyronet_at]",
        "ldr.n r5, [r0, #gyronet_at + 4]",
        ".else",
        "ldr.w r3, [r1, #gyronet_at + 4]!",
        "ldr.n r4, [r0, #gyronet_at]",
        "ldr.w r5, [r0, #gyronet_at + 4]!",
        ".endif",
        ".set gyronet_at, gyronet_at + 8",
        "smlad r7, r4, r2, r7",
        "smlad r11, r4, r3, r11",
        "smlad r9, r5, r2, r9",
        "smlad lr, r5, r3, lr",
        "sxtb16 r4, r4",
        "sxtb16 r5, r5",
        "smlad r6, r4, r2, r6",
        "smlad r10, r4, r3, r10",
        "smlad r8, r5, r2, r8",
        "smlad r12, r5, r3, r12",
        ".endr",
        "ldr r2, [sp, #48]",
        "cmp r1, r2",
        "bne.w 2b",
        // The next line is needed before its prefetch has ended. The branch brings it into the cache, so that it is
        // not prefetched again in each iteration when the first weights are to be read.
        "b.n 8f",
        ".p2align 4",
        "8:",
        "ldr r2, [sp, #44]",
        "ldr r3, [sp, #32]",
        "ldr r4, [sp, #4]",
        "stm r2, {{r6-r9}}",
        "add r2, r2, r3",
        "stm r2, {{r10-r12, lr}}",
        "add r2, r2, r3",
        "str r2, [sp, #44]",
        "cmp r1, r4",
        "bne.w 7b",
        "ldr r2, [sp, #8]",
        "ldr r3, [sp, #12]",
        "ldr r1, [sp, #52]",
        "adds r2, r2, #16",
        "str r2, [sp, #8]",
        "cmp r2, r3",
        "bne.w 1b",
        "add sp, sp, #56",
        "pop {{r4-r11, pc}}",
        // A record is copied.
        "4:",
        "sub.w r1, r1, #12",
        "bic r3, r2, #31",
        "add r3, r3, r0",
        "add.w r4, r0, #12",
        "str r4, [sp, #40]",
        "cmp r0, r3",
        "beq.n 9f",
        "5:",
        "ldm r1!, {{r4-r11}}",
        "stm r0!, {{r4-r11}}",
        "cmp r0, r3",
        "bne.n 5b",
        "9:",
        // Less than two lines are left, with half a line where the number of column pairs is odd.
        "tst r2, #16",
        "itt ne",
        "ldmne r1!, {{r4-r7}}",
        "stmne r0!, {{r4-r7}}",
        "tst r2, #8",
        "itt ne",
        "ldmne r1!, {{r4, r5}}",
        "stmne r0!, {{r4, r5}}",
        "add.w r1, r1, #12",
        "b.w 6b",
        unroll = const PROJECT_UNROLL,
    )
}

/// Computes for each unit: sums := projection + rows . previous; gates; cell state; hidden state.
///
/// r0 one word before the weights, r1 one word before previous, r2 r3 columns, r4-r7 weights, r8-r11 sums, r12 and lr
/// the middles of the tables.
///
/// # Safety
/// As stated where it is called.
#[unsafe(naked)]
unsafe extern "C" fn step_kernel(call: &StepCall, weights: *const u32) {
    naked_asm!(
        cpu!(),
        "push {{r4-r11, lr}}",
        "ldm r0, {{r2-r11}}",
        "sub.w r0, r1, #4",
        "mov r12, r10",
        "mov lr, r11",
        // Without a previous state the entry is after the products.
        "adr.w r10, 2f",
        "adr.w r11, 3f",
        "add r10, r10, r8",
        "cmp r8, #{no_previous}",
        "it eq",
        "moveq r10, r11",
        "orr r8, r10, #1",
        "push {{r2-r9}}",
        // sp: +0 previous, +4 previous_end, +8 projection, +12 cell_state, +16 hidden,
        // +20 hidden_end, +24 entry, +28 to_weights
        "1:",
        "ldr r1, [sp, #0]",
        "ldr r2, [sp, #8]",
        "ldr r3, [sp, #28]",
        "ldm r2!, {{r8-r11}}",
        "add r0, r0, r3",
        "str r2, [sp, #8]",
        "ldr.w pc, [sp, #24]",
        ".p2align 4",
        ".space 8",
        "2:",
        ".set gyronet_at, 4",
        ".rept {unroll}",
        "ldr.n r2, [r1, #gyronet_at]",
        ".if gyronet_at < 8 * {unroll} - 4",
        "ldr.n r3, [r1, #gyronet_at + 4]",
        ".else",
        "ldr.w r3, [r1, #gyronet_at + 4]!",
        ".endif",
        "ldr.n r4, [r0, #2 * gyronet_at - 4]",
        "ldr.n r5, [r0, #2 * gyronet_at]",
        "ldr.w r6, [r0, #2 * gyronet_at + 4]",
        ".if gyronet_at < 8 * {unroll} - 4",
        "ldr.w r7, [r0, #2 * gyronet_at + 8]",
        ".else",
        "ldr.w r7, [r0, #2 * gyronet_at + 8]!",
        ".endif",
        ".set gyronet_at, gyronet_at + 8",
        "smlad r9, r4, r2, r9",
        "smlad r11, r5, r2, r11",
        "smlad r9, r6, r3, r9",
        "smlad r11, r7, r3, r11",
        "sxtb16 r4, r4",
        "sxtb16 r5, r5",
        "sxtb16 r6, r6",
        "sxtb16 r7, r7",
        "smlad r8, r4, r2, r8",
        "smlad r10, r5, r2, r10",
        "smlad r8, r6, r3, r8",
        "smlad r10, r7, r3, r10",
        ".endr",
        "ldr r2, [sp, #4]",
        "cmp r1, r2",
        "bne.w 2b",
        ".p2align 2",
        "3:",
        // The packed sums less the low ones are the high rows' sums times 256.
        "ldr r2, [r0, #4]",
        "ldr.w r3, [r0, #8]!",
        "sub r9, r9, r8",
        "sub r11, r11, r10",
        "smulwb r8, r8, r2",
        "smulwt r9, r9, r2",
        "smulwb r10, r10, r3",
        "smulwt r11, r11, r3",
        "ssat r8, #18, r8",
        "ssat r9, #18, r9, asr #8",
        "ssat r10, #18, r10",
        "ssat r11, #18, r11, asr #8",
        // Gates i, f, g, o: table words by the upper bits ...
        "asr r4, r8, #{sigmoid_shift}",
        "asr r5, r9, #{sigmoid_shift}",
        "asr r6, r10, #{tanh_shift}",
        "asr r7, r11, #{sigmoid_shift}",
        "ldr r4, [r12, r4, lsl #2]",
        "ldr r5, [r12, r5, lsl #2]",
        "ldr r6, [lr, r6, lsl #2]",
        "ldr r7, [r12, r7, lsl #2]",
        // ... and lines by the lower ones. r2 holds tanh's fraction, zero around it.
        "mov r2, #0",
        "ubfx r8, r8, #0, #{sigmoid_shift}",
        "ubfx r9, r9, #0, #{sigmoid_shift}",
        "bfi r2, r10, #{tanh_scale}, #{tanh_shift}",
        "ubfx r11, r11, #0, #{sigmoid_shift}",
        "smlabb r8, r8, r4, r4",
        "smlabb r9, r9, r5, r5",
        "smlabb r10, r2, r6, r6",
        "smlabb r11, r11, r7, r7",
        // Cell state: c f + i g.
        "ldrd r6, r7, [sp, #12]",
        "ldr r4, [r6]",
        "smultt r5, r8, r10",
        "smulwt r4, r4, r9",
        "asr r5, r5, #10",
        "qdadd r4, r5, r4",
        "str r4, [r6], #4",
        // Hidden state: o tanh(c).
        "ssat r4, #18, r4, asr #6",
        "asr r5, r4, #{tanh_shift}",
        "bfi r2, r4, #{tanh_scale}, #{tanh_shift}",
        "ldr r5, [lr, r5, lsl #2]",
        "smlabb r5, r2, r5, r5",
        "smultt r5, r11, r5",
        "add r5, r5, #0x80000",
        "asr r5, r5, #20",
        "strh r5, [r7], #2",
        "strd r6, r7, [sp, #12]",
        "ldr r2, [sp, #20]",
        "cmp r7, r2",
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
