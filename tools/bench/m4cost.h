/* The cycle model: what an instruction costs on a Cortex-M4 with zero wait states.
 *
 * "TRM" is Arm's Cortex-M4 Technical Reference Manual, ARM DDI 0439: tables 3-1 (instructions),
 * 3-2 (DSP instructions) and 7-1 (FPU instructions), section 3.3.2 (load/store timings). What is
 * marked "assumption" is a simplification of ours where the TRM gives a range, less, or nothing.
 *
 * Instructions are told apart by the disassembler's text. Assumption: a contended fetch, a full
 * write buffer and an address that the instruction before has computed (all TRM 3.3.2) are free.
 */
#ifndef M4COST_H
#define M4COST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum insn_class {
    CLASS_ALU,
    CLASS_MUL,
    CLASS_DSP_MAC,
    CLASS_DIV,
    CLASS_LDR,
    CLASS_LDRD,
    CLASS_LDM,
    CLASS_STR,
    CLASS_STM,
    CLASS_BRANCH,
    CLASS_INDIRECT,
    CLASS_FP_ALU,
    CLASS_FP_FMA,
    CLASS_FP_DIV,
    CLASS_VLDR,
    CLASS_VLDM,
    CLASS_VSTR,
    CLASS_VSTM,
    CLASS_MVE,
    CLASS_MARKER,
    CLASSES,
};

/* As a histogram prints them. */
static const char *const class_names[CLASSES] = {
    [CLASS_ALU] = "alu",
    [CLASS_MUL] = "mul/mla",
    [CLASS_DSP_MAC] = "smlad/dsp-mac",
    [CLASS_DIV] = "div",
    [CLASS_LDR] = "ldr",
    [CLASS_LDRD] = "ldrd",
    [CLASS_LDM] = "ldm/pop",
    [CLASS_STR] = "str/strd",
    [CLASS_STM] = "stm/push",
    [CLASS_BRANCH] = "branch",
    [CLASS_INDIRECT] = "branch-ind",
    [CLASS_FP_ALU] = "fp-alu",
    [CLASS_FP_FMA] = "fp-fma",
    [CLASS_FP_DIV] = "fp-div/sqrt",
    [CLASS_VLDR] = "vldr",
    [CLASS_VLDM] = "vldm/vpop",
    [CLASS_VSTR] = "vstr",
    [CLASS_VSTM] = "vstm/vpush",
    [CLASS_MVE] = "mve",
    [CLASS_MARKER] = "mark",
};

enum {
    /* P, the refill of the pipeline, is 1 to 3 by the target's alignment and width, and by whether
     * its address was guessed early (TRM 3-1; 3.3.2 has 3 for ldr pc, tbb and tbh). Assumption: 1
     * where the instruction holds the target, 2 where a register or memory does. */
    REFILL_DIRECT = 1,
    REFILL_INDIRECT = 2,
    /* Assumption: 2 to 12 by the operands (TRM 3-1). */
    DIVISION = 7,
    /* Assumption: no Cortex-M4 has MVE; its instructions are four beats, here two a cycle. */
    VECTOR = 2,
    /* TRM 3-1 and 7-1: a load of one register that nothing is pipelined with. */
    LOAD = 2,
    /* Assumption: however unaligned; by TRM 3.3.2 it is 2 for a word at an odd address. */
    UNALIGNED = 1,
};

/* What a rule asks for beside the beginning of the mnemonic. */
enum condition {
    ALWAYS,
    IF_WHOLE,
    IF_VECTOR,
};

/* What comes on top of a rule's cycles. */
enum extra {
    NOTHING,
    IF_DOUBLE,           /* 1 if the first operand is a double */
    IF_REGISTER_OFFSET,  /* 1 if a register is added to the address */
    LISTED,              /* 1 for each register in the list, 2 for a double */
    LISTED_REFILL_IF_PC, /* the same, and a refill if the pc is among them */
    REFILL_IF_PC,        /* a refill if the pc is the first operand */
};

struct rule {
    const char *beginning; /* of the mnemonic */
    enum condition condition;
    enum insn_class class;
    unsigned cycles;
    enum extra extra;
};

/* The first rule that fits counts. */
static const struct rule rules[] = {
    /* Vectors. */
    {"v",      IF_VECTOR, CLASS_MVE,      VECTOR, NOTHING},               /* assumption */
    {"vctp",   ALWAYS,    CLASS_MVE,      VECTOR, NOTHING},               /* assumption */
    {"vpst",   ALWAYS,    CLASS_MVE,      VECTOR, NOTHING},               /* assumption */
    {"vpt",    ALWAYS,    CLASS_MVE,      VECTOR, NOTHING},               /* assumption */
    /* Floating point. Assumption: integers do not overtake vdiv and vsqrt; between a core and a
     * floating-point register (TRM 7-1: 2), vmov is 1. */
    {"vldr",   ALWAYS,    CLASS_VLDR,     LOAD, IF_DOUBLE},               /* TRM 7-1: 2, double 3 */
    {"vstr",   ALWAYS,    CLASS_VSTR,     2, IF_DOUBLE},                  /* TRM 7-1: 2, double 3 */
    {"vldm",   ALWAYS,    CLASS_VLDM,     1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vpop",   ALWAYS,    CLASS_VLDM,     1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vstm",   ALWAYS,    CLASS_VSTM,     1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vpush",  ALWAYS,    CLASS_VSTM,     1, LISTED},                     /* TRM 7-1: 1+N, 1+2N */
    {"vdiv",   ALWAYS,    CLASS_FP_DIV,   14, NOTHING},                   /* TRM 7-1 */
    {"vsqrt",  ALWAYS,    CLASS_FP_DIV,   14, NOTHING},                   /* TRM 7-1 */
    {"vfma",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vfms",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vmla",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vmls",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vnml",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"vfnm",   ALWAYS,    CLASS_FP_FMA,   3, NOTHING},                    /* TRM 7-1 */
    {"v",      ALWAYS,    CLASS_FP_ALU,   1, NOTHING},                    /* TRM 7-1 */
    /* Loads and stores. ldrd and strd are pipelined with nothing; a store with an immediate offset
     * is done while the next instruction runs (both TRM 3.3.2). */
    {"ldrd",   ALWAYS,    CLASS_LDRD,     3, NOTHING},                    /* TRM 3-1: 1+N */
    {"strd",   ALWAYS,    CLASS_STR,      3, NOTHING},                    /* TRM 3-1: 1+N */
    {"ldm",    ALWAYS,    CLASS_LDM,      1, LISTED_REFILL_IF_PC},        /* TRM 3-1: 1+N, 1+N+P */
    {"pop",    ALWAYS,    CLASS_LDM,      1, LISTED_REFILL_IF_PC},        /* TRM 3-1: 1+N, 1+N+P */
    {"stm",    ALWAYS,    CLASS_STM,      1, LISTED},                     /* TRM 3-1: 1+N */
    {"push",   ALWAYS,    CLASS_STM,      1, LISTED},                     /* TRM 3-1: 1+N */
    {"ldr",    ALWAYS,    CLASS_LDR,      LOAD, REFILL_IF_PC},            /* TRM 3-1: 2, 2+P */
    {"str",    ALWAYS,    CLASS_STR,      1, IF_REGISTER_OFFSET},         /* TRM 3-1: 2; 3.3.2: 1 */
    /* Multiplication and division: TRM 3-1 has those of 32 and 64 bits, 3-2 those of halfwords, of
     * the most significant word, and umaal. */
    {"sdiv",   ALWAYS,    CLASS_DIV,      DIVISION, NOTHING},             /* assumption */
    {"udiv",   ALWAYS,    CLASS_DIV,      DIVISION, NOTHING},             /* assumption */
    {"smlad",  ALWAYS,    CLASS_DSP_MAC,  1, NOTHING},                    /* TRM 3-2 */
    {"smuad",  ALWAYS,    CLASS_DSP_MAC,  1, NOTHING},                    /* TRM 3-2 */
    {"smlald", ALWAYS,    CLASS_DSP_MAC,  1, NOTHING},                    /* TRM 3-2 */
    {"smlsd",  ALWAYS,    CLASS_DSP_MAC,  1, NOTHING},                    /* TRM 3-2 */
    {"smusd",  ALWAYS,    CLASS_DSP_MAC,  1, NOTHING},                    /* TRM 3-2 */
    {"mul",    ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1 */
    {"mla",    ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1 */
    {"mls",    ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1 */
    {"smul",   ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1, 3-2 */
    {"smla",   ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1, 3-2 */
    {"umul",   ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1 */
    {"umla",   ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-1 */
    {"uma",    ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-2 */
    {"smm",    ALWAYS,    CLASS_MUL,      1, NOTHING},                    /* TRM 3-2 */
    /* Branches to what a register or memory holds. Assumption: a bx under a condition (bxeq) is as
     * any other branch. */
    {"tbb",    ALWAYS,    CLASS_INDIRECT, 2 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 2+P */
    {"tbh",    ALWAYS,    CLASS_INDIRECT, 2 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 2+P */
    {"bx",     IF_WHOLE,  CLASS_INDIRECT, 1 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 1+P */
    {"blx",    ALWAYS,    CLASS_INDIRECT, 1 + REFILL_INDIRECT, NOTHING},  /* TRM 3-1: 1+P */
    /* What begins as a branch does and is none: bic, bfc and bfi, bkpt. */
    {"bic",    ALWAYS,    CLASS_ALU,      1, NOTHING},                    /* TRM 3-1 */
    {"bf",     ALWAYS,    CLASS_ALU,      1, NOTHING},                    /* TRM 3-1 */
    {"bk",     ALWAYS,    CLASS_ALU,      1, NOTHING},                    /* assumption */
    /* Other branches. Where one is taken, the refill comes on top of the next instruction:
     * cycles_behind(). Loops of ARMv8.1-M (le, wls, dls) are such. */
    {"b",      ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* TRM 3-1: 1, 1+P */
    {"cbz",    ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* TRM 3-1: 1, 1+P */
    {"cbnz",   ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* TRM 3-1: 1, 1+P */
    {"le",     ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* assumption */
    {"wls",    ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* assumption */
    {"dls",    ALWAYS,    CLASS_BRANCH,   1, NOTHING},                    /* assumption */
    /* All else. Assumption: so are barriers (1+B), waits (1+W), msr, mrs and cps (1 or 2), and what
     * computes the pc (1+P). */
    {"",       ALWAYS,    CLASS_ALU,      1, NOTHING},                    /* TRM 3-1, 3-2 */
};

/* What the model knows of an instruction. */
struct cost {
    enum insn_class class;
    unsigned cycles;      /* alone */
    char first[8];        /* operand: mostly the register that is written */
    const char *operands; /* all of them, in the instruction's text */
};

/* Whether operands name a register, and not only one that its name is a part of. */
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

static bool names_vector(const char *operands)
{
    static const char *const vectors[] = {"q0", "q1", "q2", "q3", "q4", "q5", "q6", "q7"};
    for (size_t k = 0; k < sizeof vectors / sizeof *vectors; k++) {
        if (names_register(operands, vectors[k])) {
            return true;
        }
    }
    return false;
}

/* The number in a register's name. */
static int register_number(const char *name)
{
    return name[0] == '\0' ? 0 : atoi(name + 1);
}

/* Counts the registers in {..}, a double as two; where there is no list, it is one. */
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

/* Whether an address is offset by a register, not by an immediate or not at all. */
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

static const struct rule *rule_for(const char *mnemonic, size_t length, const char *operands)
{
    const struct rule *rule = rules;
    for (;; rule++) {
        /* The last one's beginning is empty: it fits anything. */
        size_t beginning = strlen(rule->beginning);
        if (strncmp(mnemonic, rule->beginning, beginning) != 0) {
            continue;
        }
        if (rule->condition == IF_WHOLE && length != beginning) {
            continue;
        }
        if (rule->condition == IF_VECTOR && !names_vector(operands)) {
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

/* What an instruction costs alone, by its disassembly, which must stay where it is. */
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
    const struct rule *rule = rule_for(text, mnemonic, cost.operands);
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

/* Cycles of an instruction that runs behind another one (NULL: nothing is known of it), and
 * `jumped` where it does not lie behind that. */
static unsigned cycles_behind(const struct cost *cost, const struct cost *previous, bool jumped)
{
    unsigned cycles = cost->cycles;
    if (previous == NULL) {
        return cycles;
    }
    /* TRM 3.3.2: a load is pipelined behind a load, unless its address needs what that one loads.
     * Assumption: vldr is as well; a store with a register offset is not, though it could be. */
    if (loads_one(previous) && loads_one(cost) && cost->cycles == LOAD) {
        if (!names_register(behind_first(cost), previous->first)) {
            cycles = 1;
        }
    }
    /* TRM, chapter 7: a result of floating-point arithmetic that the next instruction consumes
     * costs a cycle more. Assumption: being accumulated to, or stored, is being consumed; what vmov
     * and vcmp name first is a result. */
    bool stores = cost->class == CLASS_VSTR;
    bool may_consume = is_fp_arithmetic(cost) || stores;
    if (is_fp_arithmetic(previous) && previous->first[0] == 's' && may_consume) {
        bool reads_first = stores || cost->class == CLASS_FP_FMA;
        const char *read = reads_first ? cost->operands : behind_first(cost);
        if (names_register(read, previous->first)) {
            cycles += 1;
        }
    }
    /* Taken. */
    if (jumped && previous->class == CLASS_BRANCH) {
        cycles += REFILL_DIRECT;
    }
    return cycles;
}

#endif
