/* A whole board: an MTi on a serial port and the frames of the wheels in, the corrected yaw rate on CAN out.
 *
 * Replace board_qemu.c by your own HAL; this file stays as it is.
 */
#include "board.h"

/* As large as gyronet_size() says; checked at the start. */
static _Alignas(8) unsigned char memory[13 * 1024];

/* Speeds of the wheels as many Toyota cars send them: 0xAA, 15 bits, big endian, 0.01 km/h from -67.67. */
static GyronetWheel wheel(uint8_t start)
{
    GyronetWheel wheel = {0xAA, false, start, 15, true, false, 0.01f, -67.67f};
    return wheel;
}

int main(void)
{
    GyronetSettings settings = gyronet_default_settings();
    settings.wheels[0] = wheel(22);
    settings.wheels[1] = wheel(6);
    settings.wheels[2] = wheel(54);
    settings.wheels[3] = wheel(38);

    Gyronet *gyronet;
    if (gyronet_abi_version() != GYRONET_ABI_VERSION
        || gyronet_init(memory, sizeof memory, &settings, &gyronet) != GYRONET_RESULT_OK) {
        board_failed();
    }
    for (;;) {
        uint64_t now = board_us();
        GyronetFrame frame;
        while (board_can_receive(&frame)) {
            gyronet_receive(gyronet, &frame, now);
        }
        uint8_t bytes[64];
        size_t length;
        while ((length = board_uart_receive(bytes, sizeof bytes)) > 0) {
            gyronet_mti(gyronet, bytes, length, now);
        }
        gyronet_poll(gyronet, now);
        while (gyronet_next_frame(gyronet, &frame)) {
            board_can_send(&frame);
        }
    }
}
