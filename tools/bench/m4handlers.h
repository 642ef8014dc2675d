/* Counts the cost of each activation of exception handlers, and the time that interrupts are off.
 *
 * With wait states, a handler and a time without interrupts begin with empty caches, as if the code
 * before them had left no line that they use. Code that a handler preempts finds the caches as it left
 * them; the schedule adds the cost of its lost lines, which it computes from `fills`. */
#ifndef M4HANDLERS_H
#define M4HANDLERS_H

#include "m4flash.h"
#include "m4insn.h"
#include <inttypes.h>
#include <stdio.h>

enum {
    HANDLERS = 32,
    /* Largest depth of preemption. */
    FRAMES = 32,
    /* Kinds of activations, by the number of accesses to the handler's DATA or of executions of the
     * watched instruction; the last kind includes larger numbers. */
    KINDS = 5,
    /* Largest number of instructions that access the DATA of a handler. */
    TOUCHING = 64,
};

/* The activations of one kind. */
struct activations {
    uint64_t runs;
    uint64_t most_insns;
    uint64_t most_cycles;
    uint64_t most_waited; /* cycles with wait states */
    uint64_t most_fills;  /* lines of both caches */
};

/* The costs of the cheapest activation; 0 if there was none. */
struct least {
    uint64_t cycles;
    uint64_t waited; /* cycles with wait states */
    uint64_t fills;  /* lines that the activation with the least `waited` loaded */
};

struct handler {
    char name[48];
    uint32_t start;
    uint32_t end;
    uint32_t data; /* address, or 0: count the watched instruction instead */
    struct least least;
    struct least least_looking; /* of the activations that ran the instruction at look=ADDR and have seen == 0 */
    struct activations kinds[KINDS];
};

/* A handler that is running or preempted. */
struct frame {
    int handler;
    int seen;
    bool looked; /* the instruction at look=ADDR ran */
    uint64_t insns;
    uint64_t cycles;
    uint64_t waits;
    const struct insn *previous; /* previous instruction of this handler, without what preempts it */
    struct memory preempted;     /* memory state of the preempted code */
};

/* A time during which interrupts are off. */
struct lock {
    bool held;
    uint64_t cycles;
    uint64_t most;
    uint64_t waits;
    uint64_t most_waited; /* cycles with wait states */
    struct memory memory;
};

static void keep_most(uint64_t *most, uint64_t count)
{
    if (count > *most) {
        *most = count;
    }
}

static void keep_least(struct least *least, uint64_t cycles, uint64_t waited, uint64_t fills)
{
    if (least->cycles == 0 || cycles < least->cycles) {
        least->cycles = cycles;
    }
    if (least->waited == 0 || waited < least->waited) {
        least->waited = waited;
        least->fills = fills;
    }
}

static struct handler handlers[HANDLERS];
static int handler_count;
static uint32_t watched_pc;
static uint32_t looking_pc;

static struct frame frames[FRAMES];
static int depth;
/* The last instruction may have returned from the handler on top. */
static bool leaving;
static uint32_t last_end;

static struct lock all_off;
static struct lock some_off;
/* The memory state of the running code. */
static struct memory memory;
static const struct insn *last_insn;
/* A handler has run. Before that the image starts, and may have interrupts off for long. */
static bool started;

/* Parses handler=NAME:START:END:DATA, watch=ADDR or look=ADDR; ignores other arguments. */
static void take_argument(const char *argument)
{
    struct handler handler = {0};
    int fields = sscanf(argument, "handler=%47[^:]:%" SCNx32 ":%" SCNx32 ":%" SCNx32, handler.name,
                        &handler.start, &handler.end, &handler.data);
    if (fields == 4 && handler_count < HANDLERS) {
        handlers[handler_count++] = handler;
    }
    sscanf(argument, "watch=%" SCNx32, &watched_pc);
    sscanf(argument, "look=%" SCNx32, &looking_pc);
}

/* Finds the handlers that begin or end at a translated instruction. */
static void find_handlers(struct insn *insn)
{
    insn->watched = watched_pc != 0 && insn->pc == watched_pc;
    insn->enters = NO_HANDLER;
    insn->leaves = NO_HANDLER;
    for (int k = 0; k < handler_count; k++) {
        if (insn->pc == handlers[k].start) {
            insn->enters = k;
        }
        if (insn->returns && insn->pc >= handlers[k].start && insn->pc < handlers[k].end) {
            insn->leaves = k;
        }
    }
}

/* Instructions that have been seen to access a handler's DATA. With -icount QEMU does not report every
 * access to a device, but it reports every instruction: one that was seen to access DATA counts from then
 * on whenever it runs. */
static uint32_t touching[TOUCHING];
static int touching_count;

static bool touches_data(uint32_t pc)
{
    for (int k = 0; k < touching_count; k++) {
        if (touching[k] == pc) {
            return true;
        }
    }
    return false;
}

/* Records that an instruction has accessed an address. */
static void note_access(const struct insn *insn, uint64_t address)
{
    if (depth == 0 || address == 0 || handlers[frames[depth - 1].handler].data != address) {
        return;
    }
    if (!touches_data(insn->pc) && touching_count < TOUCHING) {
        touching[touching_count++] = insn->pc;
    }
}

/* Ends the activation on top, whose handler has returned. */
static void pop_frame(void)
{
    const struct frame *frame = &frames[--depth];
    struct handler *handler = &handlers[frame->handler];
    struct activations *kind = &handler->kinds[frame->seen < KINDS ? frame->seen : KINDS - 1];
    uint64_t waited = frame->cycles + frame->waits;
    uint64_t fills = memory.instructions.fills + memory.data.fills;
    kind->runs++;
    keep_most(&kind->most_insns, frame->insns);
    keep_most(&kind->most_cycles, frame->cycles);
    keep_most(&kind->most_waited, waited);
    keep_most(&kind->most_fills, fills);
    keep_least(&handler->least, frame->cycles, waited, fills);
    if (frame->looked && frame->seen == 0) {
        keep_least(&handler->least_looking, frame->cycles, waited, fills);
    }
    memory = frame->preempted;
}

/* Counts an instruction for a lock. The instructions that begin and end the lock are part of it. */
static void count_lock(struct lock *lock, const struct insn *insn, unsigned cycles, bool begins, bool ends)
{
    if (begins && !lock->held) {
        *lock = (struct lock){
            .held = true,
            .most = lock->most,
            .most_waited = lock->most_waited,
            .memory = cold_memory(),
        };
    }
    if (!lock->held) {
        return;
    }
    lock->cycles += cycles;
    lock->waits += fetch(&lock->memory, insn->pc, insn->size, cycles) + insn->device_wait;
    wait_for_device(&lock->memory, insn->device_wait);
    if (ends) {
        keep_most(&lock->most, lock->cycles);
        keep_most(&lock->most_waited, lock->cycles + lock->waits);
        lock->held = false;
    }
}

static void count_locks(const struct insn *insn)
{
    unsigned cycles = cycles_of(insn, last_insn);
    last_insn = insn;
    if (started) {
        count_lock(&all_off, insn, cycles, insn->lock_change == ALL_OFF, insn->lock_change == ALL_ON);
    }
    /* Only locks of thread mode count. */
    if (depth == 0) {
        count_lock(&some_off, insn, cycles, insn->lock_change == SOME_OFF, insn->lock_change == SOME_ON);
    }
}

static void count_frame(const struct insn *insn, unsigned waits)
{
    struct frame *frame = &frames[depth - 1];
    frame->insns++;
    frame->cycles += cycles_of(insn, frame->previous);
    frame->waits += waits;
    frame->previous = insn;
    bool by_data = handlers[frame->handler].data != 0;
    if (by_data ? touches_data(insn->pc) : insn->watched) {
        frame->seen++;
    }
    frame->looked |= looking_pc != 0 && insn->pc == looking_pc;
    leaving = insn->leaves == frame->handler;
}

/* Adds wait states of data to the running handler. */
static void wait_in_handlers(unsigned waits)
{
    if (depth > 0) {
        frames[depth - 1].waits += waits;
    }
}

/* Adds wait states of data to a lock, whose caches were empty when interrupts were switched off. */
static void wait_in_lock(struct lock *lock, uint32_t address, unsigned bytes)
{
    if (lock->held) {
        lock->waits += use_data(&lock->memory, address, bytes);
    }
}

/* Before an instruction runs: ends the handler that has returned, and begins a new one. */
static void follow_handlers(const struct insn *insn)
{
    /* A conditional return that is not taken falls through. Handlers are adjacent in memory, but none
     * falls through into the next. */
    if (leaving && depth > 0 && (insn->pc != last_end || insn->enters != NO_HANDLER)) {
        pop_frame();
    }
    leaving = false;
    if (insn->enters != NO_HANDLER && depth < FRAMES) {
        frames[depth++] = (struct frame){.handler = insn->enters, .preempted = memory};
        memory = cold_memory();
        started = true;
    }
}

/* Counts an instruction, with its wait states, for the locks and the running handler. */
static void count_for_handlers(const struct insn *insn, unsigned waits)
{
    count_locks(insn);
    if (depth > 0) {
        count_frame(insn, waits);
    }
    last_end = insn->pc + insn->size;
}

static void report_handlers(void)
{
    fprintf(stderr,
            "LOCKED all=%" PRIu64 " some=%" PRIu64 " all_waited=%" PRIu64 " some_waited=%" PRIu64 "\n",
            all_off.most, some_off.most, all_off.most_waited, some_off.most_waited);
    for (int k = 0; k < handler_count; k++) {
        const struct handler *handler = &handlers[k];
        fprintf(stderr,
                "HANDLER %s least=%" PRIu64 " least_waited=%" PRIu64 " least_fills=%" PRIu64
                " looking=%" PRIu64 " looking_waited=%" PRIu64 " looking_fills=%" PRIu64 "\n",
                handler->name, handler->least.cycles, handler->least.waited, handler->least.fills,
                handler->least_looking.cycles, handler->least_looking.waited,
                handler->least_looking.fills);
        for (int seen = 0; seen < KINDS; seen++) {
            const struct activations *kind = &handler->kinds[seen];
            if (kind->runs == 0) {
                continue;
            }
            fprintf(stderr,
                    "ACTIVATION %s seen=%d runs=%" PRIu64 " insns=%" PRIu64 " cycles=%" PRIu64
                    " waited=%" PRIu64 " fills=%" PRIu64 "\n",
                    handler->name, seen, kind->runs, kind->most_insns, kind->most_cycles,
                    kind->most_waited, kind->most_fills);
        }
    }
}

#endif
