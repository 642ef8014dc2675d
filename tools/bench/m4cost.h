/* The cycle model: the cycles of an instruction on a Cortex-M4 with zero wait states.
 *
 * "TRM" is Arm's Cortex-M4 Technical Reference Manual, ARM DDI 0439: tables 3-1 (instructions),
 * 3-2 (DSP instructions) and 7-1 (FPU instructions), section 3.3.2 (load/store timings).
 * "Assumption" marks a simplification of ours where the TRM gives a range, less, or nothing.
 *
 * Instructions are identified by the disassembler's text. Assumption: a contended fetch, a full
 * write buffer and an address computed by the previous instruction (all TRM 3.3.2) cost nothing.
 */
#ifndef M4COST_H
#define M4COST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* What the cost of the next instruction depends on. */
enum insn_class {
    CLASS_OTHER,
    CLASS_LDR,
    CLASS_BRANCH,
    CLASS_FP_ALU,
    CLASS_FP_FMA,
    CLASS_FP_DIV,
    CLASS_VLDR,
    CLASS_VSTR,
};

enum {
    /* P, the refill of the pipeline, takes 1 to 3 cycles, depending on the target's alignment and
     * width, and on whether its address was predicted early (TRM 3-1; 3.3.2 has 3 for ldr pc, tbb
     * and tbh). Assumption: 1 if the instruction contains the target, 2 if a register or memory
     * does. */
    REFILL_DIRECT = 1,
    REFILL_INDIRECT = 2,
    /* Assumption: the TRM has 2 to 12, depending on the operands (TRM 3-1). */
    DIVISION = 7,
    /* TRM 3-1 and 7-1: a load of one register that is not pipelined. */
    LOAD = 2,
    /* Assumption: for any misalignment; TRM 3.3.2 has 2 for a word at an odd address. */
    UNALIGNED = 1,
};

/* A rule's condition in addition to the beginning of the mnemonic. */
enum condition {
    ALWAYS,
    IF_WHOLE,
};

/* Cycles that are added to a rule's cycles. */
enum extra {
    NOTHING,
    IF_DOUBLE,           /* 1 if the first operand is a double */
    IF_REGISTER_OFFSET,  /* 1 if a register is added to the address */
    LISTED,              /* 1 for each register in the list, 2 for a double */
    LISTED_REFILL_IF_PC, /* as LISTED, and a refill if the pc is listed */
    REFILL_IF_PC,        /* a refill if the pc is the first operand */
};

struct rule {
    const char *beginning; /* beginning of the mnemonic */
    enum condition condition;
    enum insn_class class;
    unsigned cycles;
    enum extra extra;
};

/* The first rule that matches applies. */
static const struct rule rules[] = {
    /* Floating point. Assumption: integer instructions do not overtake vdiv and vsqrt; vmov between
     * a core and a floating-point register (TRM 7-1: 2) takes 1 cycle. */
    {"vldr",   ALWAYS,    CLASS_VLDR,     LOAD, IF_DOUBLE},               /* TRM 7-1: 2, double 3 */
    {"vstr",   ALWAYS,    CLASS_VSTR,     2, IF_DOUBLE},                  /* TRM 7-1: 2, double 3 */
    {"vldm",   ALWAYS,    CLASS_OTHER,    1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vpop",   ALWAYS,    CLASS_OTHER,    1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vstm",   ALWAYS,    CLASS_OTHER,    1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vpush",  ALWAYS,    CLASS_OTHER,    1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vdiv",   ALWAYS,    CLASS_FP_DIV,   14, NOTHING},                   /* TRM 7-1 */
    {"vsqrt",  ALWAYS,    CLASS_FP_DIV,   14, NOTHING},                   /* TRM 7-1 */
    {"vfma",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vfms",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vmla",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vmls",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vnml",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vfnm",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"v",      ALWAYS,    CLASS_FP_ALU,   1, NOTHING},                    /* TRM 7-1 */
    /* Loads and stores. ldrd and strd are not pipelined; a store with an immediate offset completes
     * while the next instruction runs (both TRM 3.3.2). */
    {"ldrd",   ALWAYS,    CLASS_OTHER,    3, NOTHING},                    /* TRM 3-1: 1+N */
    {"strd",   ALWAYS,    CLASS_OTHER,    3, NOTHING},                    /* TRM 3-1: 1+N */
    {"ldm",    ALWAYS,    CLASS_OTHER,    1, LISTED_REFILL_IF_PC},        /* TRM 3-1: 1+N, 1+N+P */
    {"pop",    ALWAYS,    CLASS_OTHER,    1, LISTED_REFILL_IF_PC},        /* TRM 3-1: 1+N, 1+N+P */
    {"stm",    ALWAYS,    CLASS_OTHER,    1, LISTED},                     /* TRM 3-1: 1+N */
    {"push",   ALWAYS,    CLASS_OTHER,    1, LISTED},                     /* TRM 3-1: 1+N */
    {"ldr",    ALWAYS,    CLASS_LDR,      LOAD, REFILL_IF_PC},            /* TRM 3-1: 2, 2+P */
    {"str",    ALWAYS,    CLASS_OTHER,    1, IF_REGISTER_OFFSET},         /* TRM 3-1: 2; 3.3.2: 1 */
    /* Division. */
    {"sdiv",   ALWAYS,    CLASS_OTHER,    DIVISION, NOTHING},             /* assumption */
    {"udiv",   ALWAYS,    CLASS_OTHER,    DIVISION, NOTHING},             /* assumption */
    /* Branches to an address in a register or in memory. Assumption: a conditional bx (bxeq) costs
     * as much as any other branch. */
    {"tbb",    ALWAYS,    CLASS_OTHER,    2 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 2+P */
    {"tbh",    ALWAYS,    CLASS_OTHER,    2 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 2+P */
    {"bx",     IF_WHOLE,  CLASS_OTHER,    1 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 1+P */
    {"blx",    ALWAYS,    CLASS_OTHER,    1 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 1+P */
    /* Mnemonics that begin like a branch but are not one: bic, bfc and bfi, bkpt. */
    {"bic",    ALWAYS,    CLASS_OTHER,    1, NOTHING},                    /* TRM 3-1 */
    {"bf",     ALWAYS,    CLASS_OTHER,    1, NOTHING},                    /* TRM 3-1 */
    {"bk",     ALWAYS,    CLASS_OTHER,    1, NOTHING},                    /* assumption */
    /* Other branches. If a branch is taken, cycles_behind() adds the refill to the next instruction. */
    {"b",      ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* TRM 3-1: 1, 1+P */
    {"cbz",    ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* TRM 3-1: 1, 1+P */
    {"cbnz",   ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* TRM 3-1: 1, 1+P */
    /* All other instructions, multiplications among them. Assumption: this includes barriers (1+B), waits (1+W), msr, mrs and cps
     * (1 or 2), and arithmetic that writes the pc (1+P). */
    {"",       ALWAYS,    CLASS_OTHER,    1, NOTHING},                    /* TRM 3-1, 3-2 */
};

/* The properties of an instruction that the model uses. */
struct cost {
    enum insn_class class;
    unsigned cycles;      /* without the effect of the previous instruction */
    char first[8];        /* first operand: usually the written register */
    const char *operands; /* all operands, inside the instruction's text */
};

/* Returns whether operands contain a register, not only a name that contains the register's. */
static bool names_register(const char *operands, const char *name)
{
    size_t length = strlen(name);
    const char *at = operands;
    while ((at = strstr(at, name)) != NULL) {
        char before = at == operands ? ' ' : at[-1];
        char behind = at[length];
        bool begins = !(before >= 'a' && before <= 'z');
        bool ends = !(behind >= '0' && behind <= '9');
        if (begins && ends) {
            return true;
        }
        at += length;
    }
    return false;
}

/* Returns the number in a register's name. */
static int register_number(const char *name)
{
    return name[0] == '\0' ? 0 : atoi(name + 1);
}

/* Counts the registers in {..}, a double as two; returns 1 if there is no list. */
static unsigned listed_registers(const char *operands)
{
    const char *at = strchr(operands, '{');
    if (at == NULL) {
        return 1;
    }
    at++;
    int count = 0;
    while (*at != '\0' && *at != '}') {
        at += strspn(at, " ,");
        if (*at == '\0' || *at == '}') {
            break;
        }
        const char *name = at;
        at += strcspn(at, ",}-");
        if (*at == '-') {
            const char *last = at + 1;
            last += strspn(last, " ");
            count += register_number(last) - register_number(name) + 1;
            at += strcspn(at, ",}");
        } else {
            count++;
        }
        if (name[0] == 'd') {
            count++;
        }
    }
    return count != 0 ? (unsigned)count : 1;
}

/* Returns whether an address has a register offset, rather than an immediate offset or none. */
static bool has_register_offset(const char *operands)
{
    const char *address = strchr(operands, '[');
    const char *offset = address == NULL ? NULL : strchr(address, ',');
    if (offset == NULL) {
        return false;
    }
    offset += strspn(offset, ", ");
    return *offset != '#';
}

static const struct rule *rule_for(const char *mnemonic, size_t length)
{
    const struct rule *rule = rules;
    for (;; rule++) {
        /* The last rule's beginning is empty: it matches any mnemonic. */
        size_t beginning = strlen(rule->beginning);
        if (strncmp(mnemonic, rule->beginning, beginning) != 0) {
            continue;
        }
        if (rule->condition == IF_WHOLE && length != beginning) {
            continue;
        }
        return rule;
    }
}

static unsigned extra_cycles(enum extra extra, const struct cost *cost)
{
    switch (extra) {
    case NOTHING:
        return 0;
    case IF_DOUBLE:
        return cost->first[0] == 'd' ? 1 : 0;
    case IF_REGISTER_OFFSET:
        return has_register_offset(cost->operands) ? 1 : 0;
    case LISTED:
        return listed_registers(cost->operands);
    case LISTED_REFILL_IF_PC:
        return listed_registers(cost->operands)
            + (names_register(cost->operands, "pc") ? REFILL_INDIRECT : 0);
    case REFILL_IF_PC:
        return strcmp(cost->first, "pc") == 0 ? REFILL_INDIRECT : 0;
    }
    return 0;
}

/* Computes an instruction's own cost from its disassembly, which must outlive the result. */
static struct cost cost_of(const char *text)
{
    size_t mnemonic = strcspn(text, " \t");
    struct cost cost = {.operands = text + mnemonic};
    cost.operands += strspn(cost.operands, " \t");
    size_t first = strcspn(cost.operands, ", ");
    if (first > sizeof cost.first - 1) {
        first = sizeof cost.first - 1;
    }
    memcpy(cost.first, cost.operands, first);
    const struct rule *rule = rule_for(text, mnemonic);
    cost.class = rule->class;
    cost.cycles = rule->cycles + extra_cycles(rule->extra, &cost);
    return cost;
}

static const char *behind_first(const struct cost *cost)
{
    return cost->operands + strlen(cost->first);
}

static bool loads_one(const struct cost *cost)
{
    return cost->class == CLASS_LDR || cost->class == CLASS_VLDR;
}

static bool is_fp_arithmetic(const struct cost *cost)
{
    return cost->class == CLASS_FP_ALU
        || cost->class == CLASS_FP_FMA
        || cost->class == CLASS_FP_DIV;
}

/* Returns the cycles of an instruction that runs after `previous` (NULL: unknown). `jumped` says that
 * it does not follow `previous` in memory. */
static unsigned cycles_behind(const struct cost *cost, const struct cost *previous, bool jumped)
{
    unsigned cycles = cost->cycles;
    if (previous == NULL) {
        return cycles;
    }
    /* TRM 3.3.2: a load is pipelined after a load, unless its address needs the loaded value.
     * Assumption: vldr is pipelined too; a store with a register offset is not, although it could
     * be. */
    if (loads_one(previous) && loads_one(cost) && cost->cycles == LOAD) {
        if (!names_register(behind_first(cost), previous->first)) {
            cycles = 1;
        }
    }
    /* TRM, chapter 7: if the next instruction consumes the result of floating-point arithmetic, it
     * takes one more cycle. Assumption: accumulating to a register and storing it consume it; the
     * first operand of vmov and vcmp is a result. */
    bool stores = cost->class == CLASS_VSTR;
    bool may_consume = is_fp_arithmetic(cost) || stores;
    if (is_fp_arithmetic(previous) && previous->first[0] == 's' && may_consume) {
        bool reads_first = stores || cost->class == CLASS_FP_FMA;
        const char *read = reads_first ? cost->operands : behind_first(cost);
        if (names_register(read, previous->first)) {
            cycles += 1;
        }
    }
    /* The previous branch was taken. */
    if (jumped && previous->class == CLASS_BRANCH) {
        cycles += REFILL_DIRECT;
    }
    return cycles;
}

#endif
