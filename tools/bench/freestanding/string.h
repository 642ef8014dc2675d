/* The two functions that CMSIS-NN uses, for compilers that come without a C library (defined in cmsis_nn.c). */
#ifndef STRING_H
#define STRING_H

#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t bytes);
void *memset(void *to, int value, size_t bytes);

#endif
