/* A board in QEMU (netduinoplus2): its inputs come from the file input.bin, its frames go to output.bin, by Arm's
 * semihosting. A step of the input is a time (8 bytes), frames (a count, then each as GyronetFrame) and bytes of the sensor
 * (a count, then they), little endian. The end of the file ends the run. It also starts the chip.
 */
#include "board.h"

enum { SYS_OPEN = 1, SYS_WRITE = 5, SYS_READ = 6, SYS_EXIT = 0x18 };
enum { READ_BINARY = 1, WRITE_BINARY = 5, APPLICATION_EXIT = 0x20026, RUN_TIME_ERROR = 0x20023 };

static uintptr_t input, output;
static uint8_t frames, bytes;

static uintptr_t semihosting(uintptr_t operation, const void *arguments)
{
    register uintptr_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static uintptr_t open_file(const char *name, uintptr_t length, uintptr_t mode)
{
    uintptr_t arguments[] = {(uintptr_t)name, mode, length};
    return semihosting(SYS_OPEN, arguments);
}

static _Noreturn void end(uintptr_t reason)
{
    semihosting(SYS_EXIT, (const void *)reason);
    for (;;) {
    }
}

static void get(void *to, uintptr_t size)
{
    uintptr_t arguments[] = {input, (uintptr_t)to, size};
    if (size > 0 && semihosting(SYS_READ, arguments) != 0) {
        end(APPLICATION_EXIT);
    }
}

uint64_t board_us(void)
{
    uint64_t now;
    get(&now, sizeof now);
    get(&frames, 1);
    return now;
}

bool board_can_receive(GyronetFrame *frame)
{
    if (frames == 0) {
        get(&bytes, 1);
        return false;
    }
    frames--;
    get(frame, sizeof *frame);
    return true;
}

size_t board_uart_receive(uint8_t *to, size_t size)
{
    size_t length = bytes < size ? bytes : size;
    get(to, length);
    bytes -= length;
    return length;
}

void board_can_send(const GyronetFrame *frame)
{
    uintptr_t arguments[] = {output, (uintptr_t)frame, sizeof *frame};
    if (semihosting(SYS_WRITE, arguments) != 0) {
        board_failed();
    }
}

_Noreturn void board_failed(void)
{
    end(RUN_TIME_ERROR);
}

extern uint32_t data_start[], data_end[], data_load[], bss_start[], bss_end[], stack_top[];
int main(void);

static void start(void)
{
    /* The floating-point unit is off after a reset (ARMv7-M architecture, CPACR). */
    *(volatile uint32_t *)0xE000ED88 |= 0xFu << 20;
    __asm__ volatile("dsb\n isb");
    for (uint32_t *to = data_start, *from = data_load; to < data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = bss_start; to < bss_end;) {
        *to++ = 0;
    }
    input = open_file("input.bin", 9, READ_BINARY);
    output = open_file("output.bin", 10, WRITE_BINARY);
    main();
}

static void fault(void)
{
    board_failed();
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, (const void *)start, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault,
    (const void *)fault,
};
