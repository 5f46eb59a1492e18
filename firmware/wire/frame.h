/* frame: one CAN frame, independent of the CAN controller. Only a board's or host's driver fills it. */
#ifndef TAUPERP_FRAME_H
#define TAUPERP_FRAME_H

#include <stdint.h>

#define CAN_FRAME_DATA_LENGTH 8u /* no message of this wire is longer */

enum {
    CAN_FRAME_FD = 1u,       /* CAN FD format */
    CAN_FRAME_BRS = 2u,      /* data phase at the higher bit rate */
    CAN_FRAME_EXTENDED = 4u, /* 29-bit id */
    CAN_FRAME_REMOTE = 8u    /* remote request: never valid on this wire */
};

typedef struct {
    uint32_t id;
    uint8_t length; /* bytes on the wire, 0 to 64; the guard refuses a frame above 8 by its length */
    uint8_t flags;  /* CAN_FRAME_* */
    uint8_t data[CAN_FRAME_DATA_LENGTH]; /* the first min(length, 8) bytes; the rest is zero */
    uint8_t reserved[2];                 /* zero: the size is 16 on every target */
} can_frame_t;

#endif
