/* What main.c needs of a board. No function waits. */
#ifndef BOARD_H
#define BOARD_H

#include "gyronet.h"

/* Time since the start, microseconds. */
uint64_t board_us(void);
/* Copies received bytes of the sensor; returns their number, 0 where none wait. */
size_t board_uart_receive(uint8_t *to, size_t size);
/* Takes a received frame; false where none waits. */
bool board_can_receive(GyronetFrame *frame);
/* Hands a frame to the controller. */
void board_can_send(const GyronetFrame *frame);
/* Reports that the library cannot start. */
_Noreturn void board_failed(void);

#endif
