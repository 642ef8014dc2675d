/* A translated instruction: its cost, and its effect on handlers and interrupt locks. */
#ifndef M4INSN_H
#define M4INSN_H

#include "m4cost.h"
#include <stdbool.h>
#include <stdint.h>

enum marker {
    NO_MARKER,
    REGION_BEGINS,
    REGION_ENDS,
};

/* The effect on interrupts: PRIMASK masks all of them, BASEPRI some. */
enum lock_change {
    LOCK_UNCHANGED,
    ALL_OFF,
    ALL_ON,
    SOME_OFF,
    SOME_ON,
};

enum { NO_HANDLER = -1 };

struct insn {
    uint32_t pc;
    uint32_t size;
    struct cost cost;
    enum marker marker;
    enum lock_change lock_change;
    bool returns; /* is a return instruction, perhaps a conditional one */
    bool watched; /* is the instruction at watch=ADDR */
    int enters; /* the handler that begins here, or NO_HANDLER */
    int leaves; /* the handler that ends here, or NO_HANDLER */
    unsigned device_wait; /* wait states, once it was seen to access a peripheral register */
    const char *text;
    uint64_t executed; /* number of executions in the region */
    uint64_t waited;   /* wait states in the region, cycles */
};

static uint32_t halfword(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8;
}

/* Returns the size by the first halfword: 0b11101, 0b11110 and 0b11111 begin a 32-bit instruction.
 * qemu_plugin_insn_size() is not used: QEMU 7.2 over-reports near the ends of 1 KiB pages. */
static uint32_t size_of(const uint8_t *bytes)
{
    return bytes[1] >> 3 >= 0x1D ? 4 : 2;
}

/* Decodes the markers DBG #1 and DBG #2. */
static enum marker marker_of(uint32_t first, uint32_t second)
{
    if (first == 0xF3AF && second == 0x80F1) {
        return REGION_BEGINS;
    }
    if (first == 0xF3AF && second == 0x80F2) {
        return REGION_ENDS;
    }
    return NO_MARKER;
}

/* Assumption: PRIMASK is written only to unmask interrupts, and BASEPRI only to restore its value from
 * before BASEPRI_MAX was raised. The written value is not checked. */
static enum lock_change lock_change_of(uint32_t first, uint32_t second)
{
    if (first == 0xB672) { /* cpsid i */
        return ALL_OFF;
    }
    if (first == 0xB662) { /* cpsie i */
        return ALL_ON;
    }
    if ((first & 0xFFF0) != 0xF380) { /* msr */
        return LOCK_UNCHANGED;
    }
    switch (second) {
    case 0x8810: /* primask */
        return ALL_ON;
    case 0x8812: /* basepri_max */
        return SOME_OFF;
    case 0x8811: /* basepri */
        return SOME_ON;
    default:
        return LOCK_UNCHANGED;
    }
}

static bool is_return(uint32_t first, uint32_t second)
{
    return first == 0x4770                             /* bx lr */
        || (first & 0xFF00) == 0xBD00                  /* pop {.., pc} */
        || (first == 0xE8BD && (second & 0x8000) != 0) /* pop.w {.., pc} */
        || (first == 0xF85D && second == 0xFB04);      /* ldr pc, [sp], #4 */
}

/* Decodes an instruction from its encoding and its text; the text must outlive the instruction. */
static void decode(struct insn *insn, uint32_t pc, const uint8_t *bytes, const char *text)
{
    insn->pc = pc;
    insn->size = size_of(bytes);
    uint32_t first = halfword(bytes);
    uint32_t second = insn->size == 4 ? halfword(bytes + 2) : 0;
    insn->marker = marker_of(first, second);
    insn->lock_change = lock_change_of(first, second);
    insn->returns = is_return(first, second);
    insn->text = text;
    insn->cost = cost_of(text);
    if (insn->marker != NO_MARKER) {
        insn->cost.class = CLASS_MARKER;
    }
}

static bool jumps(const struct insn *insn, const struct insn *previous)
{
    return insn->pc != previous->pc + previous->size;
}

/* Returns the cycles of an instruction that runs after `previous` (NULL: unknown). */
static unsigned cycles_of(const struct insn *insn, const struct insn *previous)
{
    if (previous == NULL) {
        return cycles_behind(&insn->cost, NULL, false);
    }
    return cycles_behind(&insn->cost, &previous->cost, jumps(insn, previous));
}

#endif
