/* GyroNet's window computed by CMSIS-NN, for comparison: an image for QEMU's mps2-an386 (Cortex-M4).
 *
 * The network has GyroNet's shape: two bidirectional LSTM layers of 60 units over ten steps of six inputs, and a
 * dense layer with one output a step. CMSIS-NN has no bidirectional layer; the way back is a second call on the
 * reversed steps. Weights are int8, activations int8 or int16. All gates share one block of random weights, and
 * biases are zero: other values change the counts by a thousandth. Each region between two markers is counted by m4count.c, and
 * its name is printed. `gyronet bench-target --cmsis-nn DIR` builds and runs it. */
#include "arm_nnfunctions.h"
#include <stdint.h>
#include <string.h>

enum { STEPS = 10, INPUTS = 6, UNITS = 60, FEATURES = 2 * UNITS };
/* Semihosting: operations, the mode "w" of a file, and the reason "application exit". */
enum { OPEN = 0x01, WRITE = 0x05, EXIT = 0x18, FOR_WRITING = 4, APPLICATION_EXIT = 0x20026 };

/* The larger of int8 and int16 activations fits. */
static int16_t inputs[STEPS * INPUTS];
static int16_t reversed[STEPS * FEATURES];
static int16_t ways[2][STEPS * UNITS];
static int16_t features[STEPS * FEATURES];
static int16_t outputs[STEPS];
static int16_t scratch[3][UNITS];
static int8_t weights[UNITS * FEATURES];
static const int64_t no_bias[UNITS];
static arm_cmsis_nn_status failed = ARM_CMSIS_NN_SUCCESS;

void *memcpy(void *restrict to, const void *restrict from, size_t bytes)
{
    uint8_t *byte = to;
    const uint8_t *source = from;
    for (; bytes >= 4; bytes -= 4, byte += 4, source += 4) {
        *(uint32_t *)byte = *(const uint32_t *)source;
    }
    while (bytes-- > 0) {
        *byte++ = *source++;
    }
    return to;
}

void *memset(void *to, int value, size_t bytes)
{
    uint8_t *byte = to;
    for (; bytes >= 4; bytes -= 4, byte += 4) {
        *(uint32_t *)byte = (uint8_t)value * 0x01010101u;
    }
    while (bytes-- > 0) {
        *byte++ = (uint8_t)value;
    }
    return to;
}

static int semihost(int operation, const void *argument)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* Writes to standard output. */
static void print(const char *text)
{
    static const char console[] = ":tt";
    static int output;
    if (output == 0) {
        output = semihost(OPEN, (const uintptr_t[]){(uintptr_t)console, FOR_WRITING, sizeof console - 1});
    }
    size_t length = 0;
    while (text[length] != 0) {
        length++;
    }
    semihost(WRITE, (const uintptr_t[]){output, (uintptr_t)text, length});
}

static void fill(void *to, size_t bytes)
{
    static uint32_t state = 7;
    for (uint8_t *byte = to; bytes > 0; bytes--, byte++) {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        *byte = (uint8_t)(state >> 8);
    }
}

static void keep(arm_cmsis_nn_status status)
{
    if (status != ARM_CMSIS_NN_SUCCESS) {
        failed = status;
    }
}

/* One direction of a layer, from the zero state; `wide` activations are int16. */
static void direction(bool wide, int width, int steps, const void *from, void *to)
{
    cmsis_nn_lstm_gate gate = {
        .input_multiplier = 1 << 30,
        .input_shift = wide ? -10 : -2,
        .input_weights = weights,
        .input_effective_bias = no_bias,
        .hidden_multiplier = 1 << 30,
        .hidden_shift = wide ? -10 : -2,
        .hidden_weights = weights,
        .hidden_effective_bias = no_bias,
        .activation_type = ARM_SIGMOID,
    };
    cmsis_nn_lstm_params params = {
        .time_major = true,
        .batch_size = 1,
        .time_steps = steps,
        .input_size = width,
        .hidden_size = UNITS,
        .forget_to_cell_multiplier = 1 << 30,
        .forget_to_cell_shift = -14,
        .input_to_cell_multiplier = 1 << 30,
        .input_to_cell_shift = -17,
        .cell_clip = INT16_MAX,
        .cell_scale_power = -12,
        .output_multiplier = 1 << 30,
        .output_shift = wide ? -14 : -22,
        .forget_gate = gate,
        .input_gate = gate,
        .cell_gate = gate,
        .output_gate = gate,
    };
    params.cell_gate.activation_type = ARM_TANH;
    cmsis_nn_lstm_context context = {scratch[0], scratch[1], scratch[2], NULL};
    if (wide) {
        keep(arm_lstm_unidirectional_s16(from, to, &params, &context));
    } else {
        keep(arm_lstm_unidirectional_s8(from, to, &params, &context));
    }
}

/* Reverses the order of `STEPS` steps. */
static void reverse(const void *from, void *to, int bytes)
{
    for (int step = 0; step < STEPS; step++) {
        memcpy((int8_t *)to + bytes * (STEPS - 1 - step), (const int8_t *)from + bytes * step, bytes);
    }
}

/* Both directions of a layer; the backward one runs for `back` steps. The result is in `features`. */
static void layer(bool wide, int width, const void *from, int back)
{
    int bytes = wide ? 2 : 1;
    int half = bytes * UNITS;
    direction(wide, width, STEPS, from, ways[0]);
    reverse(from, reversed, bytes * width);
    direction(wide, width, back, reversed, ways[1]);
    for (int step = STEPS - back; step < STEPS; step++) {
        int8_t *to = (int8_t *)features + 2 * half * step;
        memcpy(to, (int8_t *)ways[0] + half * step, half);
        memcpy(to + half, (int8_t *)ways[1] + half * (STEPS - 1 - step), half);
    }
}

/* The dense layer over the last steps. */
static void dense(bool wide, int steps)
{
    cmsis_nn_context none = {NULL, 0};
    cmsis_nn_fc_params params = {.activation = {wide ? INT16_MIN : INT8_MIN, wide ? INT16_MAX : INT8_MAX}};
    cmsis_nn_per_tensor_quant_params scale = {1 << 30, -6};
    cmsis_nn_dims input = {steps, 1, 1, FEATURES};
    cmsis_nn_dims filter = {FEATURES, 1, 1, 1};
    cmsis_nn_dims one = {1, 1, 1, 1};
    const int8_t *from = (const int8_t *)features + (wide ? 2 : 1) * FEATURES * (STEPS - steps);
    if (wide) {
        keep(arm_fully_connected_s16(&none, &params, &scale, &input, (const int16_t *)from, &filter, weights, &one,
                                     no_bias, &one, outputs));
    } else {
        keep(arm_fully_connected_s8(&none, &params, &scale, &input, from, &filter, weights, &one,
                                    (const int32_t *)no_bias, &one, (int8_t *)outputs));
    }
}

/* The outputs of all steps of a window. */
static void network(bool wide, const char *name)
{
    __asm__ volatile(".inst.w 0xF3AF80F1" ::: "memory");
    layer(wide, INPUTS, inputs, STEPS);
    layer(wide, FEATURES, features, STEPS);
    dense(wide, STEPS);
    __asm__ volatile(".inst.w 0xF3AF80F2" ::: "memory");
    print(failed == ARM_CMSIS_NN_SUCCESS ? name : "FAILED: CMSIS-NN refuses a layer\n");
}

void reset(void)
{
    fill(inputs, sizeof inputs);
    fill(weights, sizeof weights);
    network(false, "s8/window\n");
    network(true, "s16/window\n");
    semihost(EXIT, (const void *)APPLICATION_EXIT);
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[] = {(void *)0x20100000, reset};
