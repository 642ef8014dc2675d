/* A translated instruction: its place, its cost, and whether it is a marker. */
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

struct insn {
    uint32_t pc;
    uint32_t size;
    struct cost cost;
    enum marker marker;
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

/* Decodes an instruction from its encoding and its text; the text must outlive the instruction. */
static void decode(struct insn *insn, uint32_t pc, const uint8_t *bytes, const char *text)
{
    insn->pc = pc;
    insn->size = size_of(bytes);
    uint32_t first = halfword(bytes);
    uint32_t second = insn->size == 4 ? halfword(bytes + 2) : 0;
    insn->marker = marker_of(first, second);
    insn->cost = cost_of(text);
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
