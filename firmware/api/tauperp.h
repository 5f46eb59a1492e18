/* tauperp: the collision guard for a controller's own program. Include this header only.
 *
 *     #include "tauperp.h"
 *
 *     static tauperp_guard_t guard;
 *     static tauperp_output_t out;
 *
 *     tauperp_init(&guard, block, block_size, TAUPERP_START_POWER_ON, 0, clock_us());
 *     for (;;) {
 *         tauperp_frame_t frame;
 *         const bool complete = can_receive(&frame) && tauperp_receive(&guard, &frame, clock_us());
 *         if (complete || tauperp_is_due(&guard, clock_us())) {
 *             const uint64_t began_us = clock_us();
 *             tauperp_tick(&guard, began_us, &out);
 *             can_send(out.frame, out.frame_count);
 *             tauperp_note_tick_time(&guard, (uint32_t)(clock_us() - began_us));
 *         }
 *     }
 *
 * firmware/examples/minimal is the complete program. docs/porting.md states what a board must provide and check.
 *
 * The firmware exists in two numeric types, float32 and Q9.22. TAUPERP_FIXED selects the one that this header declares.
 * Every external symbol carries the prefix of its type, so one program may link both.
 *
 * The functions use no heap, clock, I/O or global state. One thread uses one guard. now_us is microseconds of any
 * monotonic clock. No function waits. No function fails, except as stated.
 */
#ifndef TAUPERP_API_H
#define TAUPERP_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef TAUPERP_FIXED
#define TAUPERP_NAME(name) tauperp_fixed_##name
#else
#define TAUPERP_NAME(name) tauperp_float_##name
#endif

#define tauperp_init           TAUPERP_NAME(init)
#define tauperp_receive        TAUPERP_NAME(receive)
#define tauperp_is_due         TAUPERP_NAME(is_due)
#define tauperp_due_us         TAUPERP_NAME(due_us)
#define tauperp_tick           TAUPERP_NAME(tick)
#define tauperp_note_tick_time TAUPERP_NAME(note_tick_time)
#define tauperp_trip           TAUPERP_NAME(trip)

#ifdef __cplusplus
extern "C" {
#endif

#define TAUPERP_MAX_JOINTS  8u
#define TAUPERP_MAX_FRAMES  2u    /* most frames of one tick */
#define TAUPERP_GUARD_BYTES 6656u /* enough for the state of a guard with eight joints */

/* The state of one guard. Allocate it statically. Its content is private. */
typedef struct {
    uint64_t storage[TAUPERP_GUARD_BYTES / sizeof(uint64_t)];
} tauperp_guard_t;

enum {
    TAUPERP_FRAME_FD = 1u,       /* CAN FD format */
    TAUPERP_FRAME_BRS = 2u,      /* data phase at the higher bit rate */
    TAUPERP_FRAME_EXTENDED = 4u, /* 29-bit id */
    TAUPERP_FRAME_REMOTE = 8u    /* remote request */
};

typedef struct {
    uint32_t id;
    uint8_t length; /* bytes on the wire, 0 to 64; the guard refuses a frame above 8 by its length */
    uint8_t flags;  /* TAUPERP_FRAME_* */
    uint8_t data[8];
} tauperp_frame_t;

/* Cause of the start, from the board's reset-cause register. UNKNOWN counts as unexpected. */
enum {
    TAUPERP_START_UNKNOWN = 0,
    TAUPERP_START_POWER_ON = 1,
    TAUPERP_START_COMMANDED = 2,
    TAUPERP_START_WATCHDOG = 3,
    TAUPERP_START_EXCEPTION = 4,
    TAUPERP_START_SERVICE = 5
};

enum {
    TAUPERP_STATE_UNINITIALISED = 0,
    TAUPERP_STATE_SELF_TEST = 1,
    TAUPERP_STATE_WAITING = 2,
    TAUPERP_STATE_MONITORING = 3, /* the only state that permits motion */
    TAUPERP_STATE_STOPPED = 4,    /* until an accepted GuardReset */
    TAUPERP_STATE_FAULT = 5       /* until the next tauperp_init */
};

/* Reasons that a board reports by tauperp_trip. The DBC lists all reasons (StopCommand.Reason). */
enum {
    TAUPERP_REASON_BUS_OFF = 19,
    TAUPERP_REASON_BUS_DOWN = 20,    /* frames cannot be sent */
    TAUPERP_REASON_RX_OVERFLOW = 21, /* frames were lost before they were read */
    TAUPERP_REASON_SHUTDOWN = 22
};

#define TAUPERP_OK 1u /* result of tauperp_init */

/* Verdict of one tick. Torques in mNm, rounded to nearest, range +-512,000. */
typedef struct {
    bool permitted;        /* motion is permitted until the next tick */
    uint8_t state;         /* TAUPERP_STATE_* */
    uint8_t reason;        /* StopCommand.Reason in the DBC */
    uint8_t stop_category; /* of IEC 60204-1: 0, 1, 2 */
    uint8_t task;          /* active task; TaskCommand.Task in the DBC */
    uint8_t joint;         /* 1 to n: joint of the trip, or the joint that the guard waits for; 0: none */
    uint8_t trip_number;   /* of the last trip; 0 before the first */
    uint8_t frame_count;   /* frames to send, in this order */
    tauperp_frame_t frame[TAUPERP_MAX_FRAMES];
    int32_t residual_mnm[TAUPERP_MAX_JOINTS]; /* r */
    int32_t index_mnm[TAUPERP_MAX_JOINTS];    /* d, in the channel nearest to its threshold */
    int32_t threshold_mnm[TAUPERP_MAX_JOINTS];
} tauperp_output_t;

/* Checks the configuration block that `tauperp config FILE -o block.c` wrote, and starts the guard.
 *   block      stays in place, unchanged and aligned to 4 bytes, as long as the guard is used
 *   start      TAUPERP_START_*
 *   restarts   unexpected restarts since the last power-on or commanded start, including this one; above 3 means FAULT
 * Returns TAUPERP_OK, or the number of the reason why it refuses the block (guard_status_t in guard/config.h). A guard
 * with a refused block is safe to use: its ticks send a StopCommand without permission. Cost: about 100,000
 * instructions.
 */
uint32_t tauperp_init(tauperp_guard_t *self, const void *block, size_t block_size, uint32_t start, uint32_t restarts,
                      uint64_t now_us);

/* Call for each received frame, in order of reception. True if the cycle is complete: call tauperp_tick now. */
bool tauperp_receive(tauperp_guard_t *self, const tauperp_frame_t *frame, uint64_t now_us);

/* True if a tick is due. Call it whenever no frame is waiting. */
bool tauperp_is_due(const tauperp_guard_t *self, uint64_t now_us);

/* The time at which tauperp_is_due becomes true, for a program that sleeps. */
uint64_t tauperp_due_us(const tauperp_guard_t *self);

/* One tick. Before sending out->frame[0 .. frame_count-1] in this order, cancel frames of the last answer that the
 * controller still holds: an old permission must not be sent late. Cost: `make bench`. */
void tauperp_tick(tauperp_guard_t *self, uint64_t now_us, tauperp_output_t *out);

/* Duration of the last tick, microseconds. Above the configured budget the next tick is FAULT. */
void tauperp_note_tick_time(tauperp_guard_t *self, uint32_t tick_us);

/* Reports a fault that only the board can detect, TAUPERP_REASON_*. The next tick stops. Any other number means FAULT.
 */
void tauperp_trip(tauperp_guard_t *self, uint32_t reason);

#ifdef __cplusplus
}
#endif

#endif
