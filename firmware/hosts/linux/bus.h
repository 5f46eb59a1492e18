/* bus: one raw SocketCAN socket, as the guard needs it.
 *
 * The kernel delivers only the ids of protocol.h's tables and error frames, each with its time of reception. Frames
 * that this socket sent are not received again (CAN_RAW_RECV_OWN_MSGS is 0). So a frame with one of the guard's own ids
 * comes from another guard. CAN FD reception is always on, so that the guard refuses and counts frames of the wrong
 * format. Remote requests and 29-bit frames are filtered by their id alone, too.
 *
 * An interface that goes down, or is removed and created again, is reported once. The socket then continues, or
 * bus_reopen opens it again. Nothing here blocks or allocates in this process.
 */
#ifndef TAUPERP_LINUX_BUS_H
#define TAUPERP_LINUX_BUS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <time.h>

#include "frame.h"

#define BUS_BATCH 64u /* most frames that one system call reads */

typedef enum {
    BUS_FRAME_NONE = 0,
    BUS_FRAME_DATA = 1,
    BUS_FRAME_ERROR = 2 /* the controller's own report; `error` says of what */
} bus_frame_kind_t;

/* What an error frame reports (linux/can/error.h), or the socket. */
enum {
    BUS_ERROR_OFF = 1u,       /* bus-off: the controller has left the bus */
    BUS_ERROR_RESTARTED = 2u, /* it is back */
    BUS_ERROR_OVERFLOW = 4u,  /* the controller lost frames */
    BUS_ERROR_TX_TIMEOUT = 8u,
    BUS_ERROR_PASSIVE = 16u, /* error passive: its error counters are above 127 */
    BUS_ERROR_OTHER = 32u
};

typedef struct {
    bus_frame_kind_t kind;
    uint32_t error;
    can_frame_t frame;
    bool stamped;
    struct timespec stamp; /* CLOCK_REALTIME */
} bus_frame_t;

typedef struct {
    const char *channel;
    bool fd;            /* frames are sent as CAN FD with bit-rate switch, else as classic CAN */
    int socket;         /* -1: closed */
    uint32_t overflows; /* frames that did not fit into the socket's buffer, as the kernel counts them since opening */
} bus_t;

/* False after one line on stderr: no such interface, not a CAN interface, or CAN FD asked of one that lacks it. An
 * interface that exists and is down is good: it may come up. */
bool bus_open(bus_t *self, const char *channel, bool fd);

void bus_close(bus_t *self);

/* Opens it again, without a message. False if it is not available yet. */
bool bus_reopen(bus_t *self);

/* Reads what is there, at most BUS_BATCH frames, and returns how many. 0 with *problem 0 if there is nothing; with an
 * errno if the interface is gone or down (told once each time it goes). */
size_t bus_receive(bus_t *self, bus_frame_t frames[BUS_BATCH], int *problem);

/* Sends in this order; returns how many went out, and why the next one did not. */
size_t bus_send(bus_t *self, const can_frame_t *frames, size_t count, int *problem);

#endif
