/* dlc: data length of a CAN frame, from its data length code (ISO 11898-1). */
#ifndef TAUPERP_DLC_H
#define TAUPERP_DLC_H

#include <stdbool.h>

#include "frame.h"

/* Bytes of a frame with this code, 0 to 15. A classic frame with a code above 8 has 8 bytes. */
static inline uint8_t dlc_length(uint32_t code, bool fd) {
    static const uint8_t LENGTHS[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    const uint8_t length = LENGTHS[code & 0xFu];
    return (!fd && (length > CAN_FRAME_DATA_LENGTH)) ? (uint8_t)CAN_FRAME_DATA_LENGTH : length;
}

#endif
