/* What exception handlers cost, activation by activation, and how long interrupts are kept off. */
#ifndef M4HANDLERS_H
#define M4HANDLERS_H

#include "m4insn.h"
#include <inttypes.h>
#include <stdio.h>

enum {
    HANDLERS = 32,
    /* How deep they preempt each other. */
    FRAMES = 32,
    /* Kinds of activations: by how often the handler's DATA or the watched instruction was seen in
     * them; the last one is as often or more. */
    KINDS = 5,
    /* Instructions that read or write some handler's DATA. */
    TOUCHING = 64,
};

/* The activations of one kind. */
struct activations {
    uint64_t runs;
    uint64_t most_insns;
    uint64_t most_cycles;
};

struct handler {
    char name[48];
    uint32_t start;
    uint32_t end;
    uint32_t data; /* address, or 0: the watched instruction is looked for instead */
    uint64_t least_cycles;
    struct activations kinds[KINDS];
};

/* A handler that is running, or preempted. */
struct frame {
    int handler;
    int seen;
    uint64_t insns;
    uint64_t cycles;
    const struct insn *previous; /* of this handler: what preempts it is left out */
};

/* A time for which interrupts are kept off. */
struct lock {
    bool held;
    uint64_t cycles;
    uint64_t most;
};

static void keep_most(uint64_t *most, uint64_t count)
{
    if (count > *most) {
        *most = count;
    }
}

static struct handler handlers[HANDLERS];
static int handler_count;
static uint32_t watched_pc;

static struct frame frames[FRAMES];
static int depth;
/* The last instruction was one with which the handler on top may return. */
static bool leaving;
static uint32_t last_end;

static struct lock all_off;
static struct lock some_off;
static const struct insn *last_insn;
/* A handler has run: before that the image starts, and may have interrupts off. */
static bool started;

/* handler=NAME:START:END:DATA or watch=ADDR; anything else is somebody else's. */
static void take_argument(const char *argument)
{
    struct handler handler = {0};
    int fields = sscanf(argument, "handler=%47[^:]:%" SCNx32 ":%" SCNx32 ":%" SCNx32, handler.name,
                        &handler.start, &handler.end, &handler.data);
    if (fields == 4 && handler_count < HANDLERS) {
        handlers[handler_count++] = handler;
    }
    sscanf(argument, "watch=%" SCNx32, &watched_pc);
}

/* What a translated instruction means to the handlers. */
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

/* Instructions that read or write a handler's DATA, as far as they have been seen to. With -icount
 * an access to a device is not always reported, its instruction is: one that was seen to touch DATA
 * counts from then on, whenever it runs. */
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

/* An instruction has read or written an address. */
static void note_access(const struct insn *insn, uint64_t address)
{
    if (depth == 0 || address == 0 || handlers[frames[depth - 1].handler].data != address) {
        return;
    }
    if (!touches_data(insn->pc) && touching_count < TOUCHING) {
        touching[touching_count++] = insn->pc;
    }
}

/* The handler on top has returned. */
static void pop_frame(void)
{
    const struct frame *frame = &frames[--depth];
    struct handler *handler = &handlers[frame->handler];
    struct activations *kind = &handler->kinds[frame->seen < KINDS ? frame->seen : KINDS - 1];
    kind->runs++;
    keep_most(&kind->most_insns, frame->insns);
    keep_most(&kind->most_cycles, frame->cycles);
    if (handler->least_cycles == 0 || frame->cycles < handler->least_cycles) {
        handler->least_cycles = frame->cycles;
    }
}

/* An instruction runs that may begin or end a lock: both of them are part of it. */
static void count_lock(struct lock *lock, unsigned cycles, bool begins, bool ends)
{
    if (lock->held) {
        lock->cycles += cycles;
    }
    if (ends && lock->held) {
        keep_most(&lock->most, lock->cycles);
        lock->held = false;
    } else if (begins && !lock->held) {
        lock->held = true;
        lock->cycles = cycles;
    }
}

static void count_locks(const struct insn *insn)
{
    unsigned cycles = cycles_of(insn, last_insn);
    last_insn = insn;
    if (started) {
        count_lock(&all_off, cycles, insn->lock_change == ALL_OFF, insn->lock_change == ALL_ON);
    }
    /* Only thread mode's. */
    if (depth == 0) {
        count_lock(&some_off, cycles, insn->lock_change == SOME_OFF, insn->lock_change == SOME_ON);
    }
}

static void count_frame(const struct insn *insn)
{
    struct frame *frame = &frames[depth - 1];
    frame->insns++;
    frame->cycles += cycles_of(insn, frame->previous);
    frame->previous = insn;
    bool by_data = handlers[frame->handler].data != 0;
    if (by_data ? touches_data(insn->pc) : insn->watched) {
        frame->seen++;
    }
    leaving = insn->leaves == frame->handler;
}

/* An instruction runs. */
static void count_for_handlers(const struct insn *insn)
{
    /* A return that is not taken falls through; handlers lie one behind the other, but none falls
     * into the next. */
    if (leaving && depth > 0 && (insn->pc != last_end || insn->enters != NO_HANDLER)) {
        pop_frame();
    }
    leaving = false;
    if (insn->enters != NO_HANDLER && depth < FRAMES) {
        frames[depth++] = (struct frame){.handler = insn->enters};
        started = true;
    }
    count_locks(insn);
    if (depth > 0) {
        count_frame(insn);
    }
    last_end = insn->pc + insn->size;
}

static void report_handlers(void)
{
    fprintf(stderr, "LOCKED all=%" PRIu64 " some=%" PRIu64 "\n", all_off.most, some_off.most);
    for (int k = 0; k < handler_count; k++) {
        const struct handler *handler = &handlers[k];
        fprintf(stderr, "HANDLER %s least=%" PRIu64 "\n", handler->name, handler->least_cycles);
        for (int seen = 0; seen < KINDS; seen++) {
            const struct activations *kind = &handler->kinds[seen];
            if (kind->runs == 0) {
                continue;
            }
            fprintf(stderr,
                    "ACTIVATION %s seen=%d runs=%" PRIu64 " insns=%" PRIu64 " cycles=%" PRIu64 "\n",
                    handler->name, seen, kind->runs, kind->most_insns, kind->most_cycles);
        }
    }
}

#endif
