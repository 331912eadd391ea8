/* Numbers that this process has not used before. They identify a thing that other processes have copies of. */
#ifndef SELVEDGE_BASE_UNIQUE_NUMBER_H
#define SELVEDGE_BASE_UNIQUE_NUMBER_H

#include <stdint.h>

/* At least 1. May be called from any thread. */
uint64_t unique_number(void);

#endif
