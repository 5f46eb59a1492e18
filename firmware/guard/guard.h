/* guard: the safety function. Frames and time go in, a permission to move comes out, every tick.
 *
 *   UNINITIALISED -> SELF_TEST -> WAITING -> MONITORING <-> STOPPED        any -> FAULT
 *
 * Motion is a permission: it is sent by every tick in MONITORING and by no other state, and a robot that hears nothing
 * stops by itself. MONITORING needs every input: Sync, a complete joint snapshot and the task, each younger than its
 * deadline, each checked (E2E, length, format, range); deadlines are looked at by every tick from the first one on.
 *
 * The first permission comes when all of this has been so for reset_healthy_us, with the index below its thresholds:
 * an observer that has just started cannot see yet what already leans on the arm.
 *
 * What ends the permission:
 *   - the index in force above its threshold for its debounce: COLLISION, with joint, value and threshold;
 *   - an input older than its deadline, a joint that reports a sensor fault, a value out of its range, a task that is
 *     invalid or not configured. One frame that is lost, repeated, late or fails its CRC is dropped and counted, and
 *     ends the permission only when nothing good arrives before the deadline;
 *   - a StopCommand on the bus, right or wrong: ANOTHER_GUARD, in WAITING too. A robot cannot tell the answers of two
 *     guards apart, the counters of both pass its E2E check now and then; so neither may permit anything.
 * All latch as STOPPED with a new trip number. It ends on a GuardReset that names the trip number, as an edge of
 * Request from 0 to 1 (both in accepted frames, after the trip), when every input has been good and the index below
 * its thresholds for reset_healthy_us; a request that comes earlier or names another trip is refused and counted.
 *   - a failed self-check: corrupt configuration or state, a tick late or over budget, a stage that did not run, time
 *     going backwards: FAULT, until the next guard_init.
 *
 * A board calls guard_receive for each frame of others in the order of reception, guard_tick once a cycle (as soon as
 * guard_cycle_complete says so, and no later than the tick deadline), sends what the tick put out, and tells how long
 * it took by guard_note_tick_time. One guard_t is used by one thread. now_us is any monotonic clock.
 *
 * Cost on a Cortex-M4F: see `make bench`. guard_t below 4 KiB; stack below 1 KiB, in Q9.22 1.1 KiB.
 */
#ifndef TAUPERP_GUARD_H
#define TAUPERP_GUARD_H

#include "config.h"
#include "detector.h"
#include "e2e.h"
#include "frame.h"
#include "index.h"
#include "protocol.h"
#include "snapshot.h"

#define GUARD_MAX_FRAMES 2u /* that one tick puts out */

typedef enum {
    GUARD_STATE_UNINITIALISED = 0,
    GUARD_STATE_SELF_TEST = 1,
    GUARD_STATE_WAITING = 2, /* no complete fresh input yet */
    GUARD_STATE_MONITORING = 3,
    GUARD_STATE_STOPPED = 4, /* latched by a collision or an input fault */
    GUARD_STATE_FAULT = 5    /* latched until restart */
} guard_state_t;

/* Why motion is not permitted; the values of StopCommand.Reason in the DBC. */
typedef enum {
    GUARD_REASON_UNINITIALISED = 0,
    GUARD_REASON_NONE = 1, /* it is permitted */
    GUARD_REASON_SELF_TEST = 2,
    GUARD_REASON_WAITING_SYNC = 3,
    GUARD_REASON_WAITING_JOINT = 4,
    GUARD_REASON_WAITING_TASK = 5,
    GUARD_REASON_COLLISION = 6,
    GUARD_REASON_SYNC_TIMEOUT = 7,
    GUARD_REASON_JOINT_TIMEOUT = 8,
    GUARD_REASON_TASK_TIMEOUT = 9,
    GUARD_REASON_TASK_INVALID = 10,
    GUARD_REASON_SENSOR_STATUS = 11,
    GUARD_REASON_INPUT_RANGE = 12,
    GUARD_REASON_TICK_LATE = 13, /* from here to 18: FAULT */
    GUARD_REASON_TICK_OVER_BUDGET = 14,
    GUARD_REASON_CONFIG_CORRUPT = 15,
    GUARD_REASON_STATE_CORRUPT = 16,
    GUARD_REASON_SELF_TEST_FAILED = 17,
    GUARD_REASON_STAGE_MISSED = 18,
    GUARD_REASON_BUS_OFF = 19, /* from here to 22: told by the board through guard_trip */
    GUARD_REASON_BUS_DOWN = 20,
    GUARD_REASON_RX_OVERFLOW = 21,
    GUARD_REASON_SHUTDOWN = 22,
    GUARD_REASON_TIME_BACKWARDS = 23, /* FAULT */
    GUARD_REASON_SATURATED = 24,      /* a fixed-point result did not fit: STOPPED */
    GUARD_REASON_SETTLING = 25,       /* waiting: every input is good, but not for long enough yet */
    GUARD_REASON_ANOTHER_GUARD = 26   /* a StopCommand came in: another guard answers on this bus */
} guard_reason_t;

/* What the environment did wrong since guard_init. Each saturates at its maximum. */
typedef struct {
    uint16_t crc_errors;
    uint16_t sequence_errors; /* repeated, backwards, or too far ahead */
    uint16_t lost_frames;
    uint16_t range_errors;  /* out of range, not available, or a sensor status other than OK */
    uint16_t format_errors; /* unknown id, wrong length, wrong format */
    uint16_t late_frames;   /* readings of another cycle, and second readings of one */
    uint16_t resets_refused;
    uint16_t trips;
} guard_counters_t;

typedef struct {
    guard_state_t state;
    guard_reason_t reason;
    bool permitted;
    bool fresh;            /* a new snapshot went through the stages on this tick */
    uint8_t task;          /* in force */
    uint8_t stop_category; /* IEC 60204-1, of the stop in force, or the one that a stop would have */
    uint8_t joint;         /* 1 to n: of the trip or waited for; 0 none */
    uint8_t trip_number;   /* of the last trip; 0 before the first */
    uint16_t cycle;        /* of the newest Sync */
    num_t value_nm;        /* the index of `joint` at the trip */
    num_t threshold_nm;
    num_t residual[ROBOT_MAX_JOINTS]; /* r of this tick */
    num_t index[ROBOT_MAX_JOINTS];    /* the index in force of this tick */
    num_t smallest_singular; /* of the basis in force, or a bound below it (subspace.h), Nm per N; 0 without one */
    uint32_t rank;
    uint32_t frame_count;
    can_frame_t frame[GUARD_MAX_FRAMES]; /* to be sent in this order */
} guard_output_t;

/* A periodic input, and when it was last good. */
typedef struct {
    uint64_t good_us;
    bool seen;
} guard_input_t;

/* What came in: written by guard_receive only, read by guard_tick. */
typedef struct {
    e2e_receiver_t receiver[PROTOCOL_RECEIVE_COUNT];
    snapshot_t snapshot;
    guard_input_t sync, joints, task;
    vec3_t acceleration;    /* of the end-effector, base frame, m/s^2 */
    uint8_t task_number;    /* the last good one; TASK_INVALID before */
    uint8_t fault_joint;    /* 1 to n, or 0 */
    uint32_t fault;         /* guard_reason_t that the next tick acts on, the first since the last tick; 0 none */
    bool request;           /* of the last accepted GuardReset; starts as true, so that it takes two to make an edge */
    bool edge;              /* Request went from 0 to 1 since the last tick */
    uint8_t requested_trip; /* TripNumber of that frame */
} guard_inputs_t;

/* The latched reason why motion ended. */
typedef struct {
    uint32_t reason; /* guard_reason_t */
    uint8_t number;  /* 1 to 255, then 1 again; 0 before the first */
    uint8_t joint;
    num_t value_nm;
    num_t threshold_nm;
} guard_trip_t;

/* What the guard says on the bus besides its verdict. */
typedef struct {
    e2e_transmitter_t stop, status, index;
    uint32_t turn;         /* of the pages of GuardStatus and the joints of GuardIndex */
    uint32_t tick_time_us; /* of the tick before, as the board measured it; held at 65535 */
    uint32_t worst_tick_time_us;
    uint32_t margin_us; /* smallest time left to any deadline since the page that says so */
} guard_report_t;

typedef struct {
    const guard_config_t *config;
    uint32_t joints;         /* of the robot; 0 before guard_init */
    uint32_t state;          /* guard_state_t */
    uint32_t state_inverted; /* ~state: a flipped bit in either is FAULT */
    guard_inputs_t inputs;
    motion_t motion;
    observer_t observer;
    index_t index;
    detector_t detector;
    uint32_t stages; /* bit per stage that ran in this tick */
    guard_trip_t trip;
    uint64_t last_tick_us;
    uint64_t healthy_since_us;
    bool healthy;
    bool ticked;
    bool over_budget;
    uint32_t saturations; /* as of the last tick */
    config_watch_t watch;
    guard_counters_t counters;
    guard_report_t report;
} guard_t;

/* Checks the whole block, and starts. `config` must stay in place and unchanged while the guard is used. On anything
 * but GUARD_OK the guard stays UNINITIALISED: its ticks put out a StopCommand without permission. */
guard_status_t guard_init(guard_t *self, const guard_config_t *config);

void guard_receive(guard_t *self, const can_frame_t *frame, uint64_t now_us);

/* Every joint's reading of the newest Sync's cycle is in, and no tick has used it yet. */
bool guard_cycle_complete(const guard_t *self);

void guard_tick(guard_t *self, uint64_t now_us, guard_output_t *out);

/* How long the tick just done took, microseconds, by the board's clock. Over tick_budget_us is FAULT at the next tick.
 */
void guard_note_tick_time(guard_t *self, uint32_t tick_us);

/* A fault that only the board can see: latches STOPPED at the next tick, or FAULT if the reason is one of FAULT's. */
void guard_trip(guard_t *self, guard_reason_t reason);

#endif
