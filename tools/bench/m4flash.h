/* The wait states of a Cortex-M4 in an STM32F405 at 168 MHz: flash with 5 wait states behind ST's
 * accelerator (ART), instructions from SRAM, peripheral registers on slow buses.
 *
 * Sources: "RM" is ST's RM0090, 3.4 (lines of 128 bits, 5 wait states at 168 MHz) and 3.5.2 (ART);
 * "TRM" is Arm's Cortex-M4 TRM, 2.3.1 (bus interfaces), whose text on fetches is that of the
 * Cortex-M3 TRM, DDI 0337, 14.5; "APB" is Arm's IHI 0024. Rules:
 *
 *   - A line is read in 6 cycles, one read at a time; a read in progress ends before the next one
 *     begins. (RM: DCode has priority over ICode. Assumption: DCode does not abort a read.)
 *   - Instructions are available without delay from the line in use, the instruction cache (64 lines)
 *     and the prefetched line, if its read has ended. (RM)
 *   - When the line in use changes, the next line is prefetched unless the cache holds it. (RM says
 *     that prefetch reads the next line. That a cached line is not prefetched, and that a line from the
 *     cache triggers a prefetch too, are assumptions.)
 *   - Both caches are fully associative and replace the least recently used line. (RM: LRU for the
 *     instruction cache, and the data cache works like it. Full associativity: assumption.)
 *   - A line enters the instruction cache if it was missed: read, or still being read by the prefetch.
 *     A line that was prefetched in time does not. (RM; a line still being read: assumption.)
 *   - Data from flash (literals, tables, weights) are read over DCode, with a cache of 8 lines. (RM)
 *   - Instructions in SRAM are fetched over the system bus: two cycles a word, one more at the target of a
 *     jump, and no fetch in a cycle in which data use that bus. (TRM: fetches there are registered,
 *     cannot be back to back, and data have priority. At most three words are fetched ahead: TRM 2.1.)
 *   - CCM is on DCode, without delay, and cannot be executed. (RM 2.3.1)
 *   - Access to a register of APB1 takes two APB1 clocks, 8 cycles, and up to 3 cycles until a clock
 *     begins; for APB2 4 and 1. (APB; RM 2.3.1 has the maximum clocks. Writes count as reads.)
 *
 * Not modelled: fetches ahead of a taken jump, DMA, and the other bus masters.
 */
#ifndef M4FLASH_H
#define M4FLASH_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum {
    LINE_BYTES = 16,
    WAIT_STATES = 5,
    LINE_READ = WAIT_STATES + 1,
    INSTRUCTION_LINES = 64,
    DATA_LINES = 8,
    WORD_FROM_SRAM = 2,
    WORDS_AHEAD = 3,
    APB1_WAIT = 8 + 3 - 1,
    APB2_WAIT = 4 + 1 - 1,
};

/* A number that no line has. */
static const uint32_t NO_LINE = UINT32_MAX;

/* Policies that the manual leaves open, or that apply if the manual is wrong. */
static struct {
    bool first_in_first_out; /* instead of LRU */
    bool keep_prefetched;    /* lines prefetched in time enter the cache too */
} policy;

struct cache {
    uint32_t lines[INSTRUCTION_LINES];
    uint64_t used[INSTRUCTION_LINES]; /* sequence number of the last use, or of the fill; 0: empty */
    unsigned size;
    unsigned fills;
};

/* The state of the memory system, with times in cycles. */
struct memory {
    uint64_t now;
    uint64_t uses;
    uint64_t flash_busy_until;
    struct cache instructions;
    struct cache data;
    uint32_t line_in_use;
    uint32_t prefetched;
    uint64_t prefetched_at;
    uint32_t next_pc;
    uint32_t sram_word;     /* last fetched word */
    uint64_t sram_word_at;  /* time at which it is available */
    uint64_t word_begins[WORDS_AHEAD]; /* times at which the last words began to run */
};

/* Returns a memory system with empty caches and no read in progress. */
static struct memory cold_memory(void)
{
    struct memory memory = {.line_in_use = NO_LINE, .prefetched = NO_LINE, .sram_word = NO_LINE};
    memory.now = LINE_READ;
    memory.instructions.size = INSTRUCTION_LINES;
    memory.data.size = DATA_LINES;
    return memory;
}

static bool is_flash(uint32_t address)
{
    return address < 0x00100000 || (address >= 0x08000000 && address < 0x08100000);
}

static bool is_sram(uint32_t address)
{
    return address >= 0x20000000 && address < 0x40000000;
}

/* Returns the index of a line in a cache, or -1. */
static int find_line(const struct cache *cache, uint32_t line)
{
    for (unsigned k = 0; k < cache->size; k++) {
        if (cache->used[k] != 0 && cache->lines[k] == line) {
            return (int)k;
        }
    }
    return -1;
}

static bool hits(struct memory *memory, struct cache *cache, uint32_t line)
{
    int at = find_line(cache, line);
    if (at < 0) {
        return false;
    }
    if (!policy.first_in_first_out) {
        cache->used[at] = ++memory->uses;
    }
    return true;
}

static void fill(struct memory *memory, struct cache *cache, uint32_t line)
{
    unsigned oldest = 0;
    for (unsigned k = 1; k < cache->size; k++) {
        if (cache->used[k] < cache->used[oldest]) {
            oldest = k;
        }
    }
    cache->lines[oldest] = line;
    cache->used[oldest] = ++memory->uses;
    cache->fills++;
}

/* Reads a line that the core needs now; returns the wait states. */
static unsigned read_line(struct memory *memory)
{
    /* Without wait states the read would have begun a cycle ago, and the line would be available now. */
    uint64_t begins = memory->now - 1;
    if (begins < memory->flash_busy_until) {
        begins = memory->flash_busy_until;
    }
    memory->flash_busy_until = begins + LINE_READ;
    return (unsigned)(memory->flash_busy_until - memory->now);
}

/* Makes a line the line in use; returns the wait states. */
static unsigned use_line(struct memory *memory, uint32_t line)
{
    unsigned wait = 0;
    if (hits(memory, &memory->instructions, line)) {
        /* Available without a wait. */
    } else if (memory->prefetched == line) {
        if (memory->prefetched_at > memory->now) {
            wait = (unsigned)(memory->prefetched_at - memory->now);
        }
        if (wait > 0 || policy.keep_prefetched) {
            fill(memory, &memory->instructions, line);
        }
    } else {
        wait = read_line(memory);
        fill(memory, &memory->instructions, line);
    }
    memory->line_in_use = line;
    uint32_t next = line + 1;
    if (memory->prefetched != next && find_line(&memory->instructions, next) < 0) {
        uint64_t begins = memory->now + wait;
        if (begins < memory->flash_busy_until) {
            begins = memory->flash_busy_until;
        }
        memory->prefetched = next;
        memory->prefetched_at = begins + LINE_READ;
        memory->flash_busy_until = memory->prefetched_at;
    }
    return wait;
}

/* Fetches a word of SRAM that is to run; returns the wait states. */
static unsigned use_sram_word(struct memory *memory, uint32_t word)
{
    uint64_t at;
    if (word == memory->sram_word + 1) {
        uint64_t room = memory->word_begins[word % WORDS_AHEAD];
        uint64_t begins = memory->sram_word_at > room ? memory->sram_word_at : room;
        at = begins + WORD_FROM_SRAM;
    } else {
        /* The first of the two cycles is part of the jump's own cycles. */
        at = memory->now + WORD_FROM_SRAM - 1;
    }
    memory->sram_word = word;
    memory->sram_word_at = at;
    unsigned wait = at > memory->now ? (unsigned)(at - memory->now) : 0;
    memory->word_begins[word % WORDS_AHEAD] = memory->now + wait;
    return wait;
}

/* Fetches an instruction that takes `cycles` cycles without wait states; returns the wait states. */
static unsigned fetch(struct memory *memory, uint32_t pc, uint32_t size, unsigned cycles)
{
    unsigned waits = 0;
    uint32_t last = pc + size - 2;
    if (is_flash(pc)) {
        for (uint32_t line = pc / LINE_BYTES; line <= last / LINE_BYTES; line++) {
            if (line != memory->line_in_use) {
                unsigned wait = use_line(memory, line);
                memory->now += wait;
                waits += wait;
            }
        }
    } else if (is_sram(pc)) {
        if (pc != memory->next_pc) {
            memory->sram_word = NO_LINE - 1;
        }
        for (uint32_t word = pc / 4; word <= last / 4; word++) {
            if (word != memory->sram_word) {
                unsigned wait = use_sram_word(memory, word);
                memory->now += wait;
                waits += wait;
            }
        }
    }
    memory->next_pc = pc + size;
    memory->now += cycles;
    return waits;
}

/* Reads or writes data of an instruction; returns the wait states. */
static unsigned use_data(struct memory *memory, uint32_t address, unsigned bytes)
{
    unsigned waits = 0;
    if (is_flash(address)) {
        for (uint32_t line = address / LINE_BYTES; line <= (address + bytes - 1) / LINE_BYTES; line++) {
            if (!hits(memory, &memory->data, line)) {
                unsigned wait = read_line(memory);
                fill(memory, &memory->data, line);
                memory->now += wait;
                waits += wait;
            }
        }
    } else if (is_sram(address)) {
        /* Instruction fetches from SRAM wait. */
        memory->sram_word_at += (bytes + 3) / 4;
    }
    return waits;
}

/* Waits for a peripheral register, whose access occupies the system bus. */
static void wait_for_device(struct memory *memory, unsigned waits)
{
    memory->now += waits;
    memory->sram_word_at += waits;
}

/* Returns the wait states of a peripheral register on a slow bus; 0 for other addresses. */
static unsigned device_wait(uint32_t address)
{
    if (address >= 0x40000000 && address < 0x40008000) {
        return APB1_WAIT;
    }
    if (address >= 0x40010000 && address < 0x40016000) {
        return APB2_WAIT;
    }
    return 0;
}

#endif
