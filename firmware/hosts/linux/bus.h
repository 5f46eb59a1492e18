/* bus: one raw SocketCAN socket with the filters and options that the guard needs.
 *
 * The kernel delivers only the ids of protocol.h's tables and error frames, each with its time of reception. It does
 * not return frames that this socket sent (CAN_RAW_RECV_OWN_MSGS is 0). A frame with one of the guard's own ids
 * therefore comes from another guard. CAN FD reception is always on, so that the guard refuses and counts frames of the
 * wrong format. Remote requests and 29-bit frames are also filtered by their id alone.
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

#define BUS_BATCH 64u /* most frames of one system call */

typedef enum {
    BUS_FRAME_NONE = 0,
    BUS_FRAME_DATA = 1,
    BUS_FRAME_ERROR = 2 /* a report of the controller; `error` states its kind */
} bus_frame_kind_t;

/* Content of an error frame (linux/can/error.h), or of a socket error. */
enum {
    BUS_ERROR_OFF = 1u,       /* bus-off: the controller has left the bus */
    BUS_ERROR_RESTARTED = 2u, /* the controller is back on the bus */
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
    uint32_t overflows; /* frames that did not fit into the socket's buffer, counted by the kernel since the socket was
                           opened */
} bus_t;

/* False, after one line on stderr, if the interface does not exist, is no CAN interface, or lacks the requested CAN FD.
 * An interface that is down is accepted: it may come up later. */
bool bus_open(bus_t *self, const char *channel, bool fd);

void bus_close(bus_t *self);

/* Opens the socket again, without a message. False if the interface is not available yet. */
bool bus_reopen(bus_t *self);

/* Reads the waiting frames, at most BUS_BATCH, and returns their number. 0 with *problem 0: none waits. 0 with an
 * errno: the interface is gone or down; reported once each time. */
size_t bus_receive(bus_t *self, bus_frame_t frames[BUS_BATCH], int *problem);

/* Sends the frames in this order. Returns how many were sent, and why the next one was not. */
size_t bus_send(bus_t *self, const can_frame_t *frames, size_t count, int *problem);

#endif
