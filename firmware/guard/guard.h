/* guard: the safety function. Frames and time go in, a permission to move comes out, every tick.
 *
 *   UNINITIALISED -> SELF_TEST -> WAITING -> MONITORING <-> STOPPED        any -> FAULT
 *
 * Motion is a permission: every tick in MONITORING sends it and no other state does. A robot that hears nothing stops.
 *
 * The permission follows evaluation, not reception. A tick permits only if
 *   - Sync and TaskCommand are younger than their deadlines, each frame checked (E2E, length, format, range);
 *   - a complete joint snapshot went through every stage, and is younger than the joint deadline;
 *   - the observer has run without a restart for `settling_us`;
 *   - time and cycles agree, no sender makes too many errors, the configuration is intact, no trip is latched.
 *
 * After any start the first permission needs a GuardReset too (IEC 60204-1, ISO 14118): the guard waits with reason
 * AWAITING_RESET, or RESTARTED after an unexpected restart, and wants the number in StopCommand.TripNumber.
 *
 * These end the permission and latch as STOPPED, with a new trip number:
 *   - the index above its threshold for its debounce: COLLISION; what the task explains beyond its limits: EXPLAINED_*;
 *     what it explains changing too fast: SUDDEN;
 *   - an input past its deadline; a sensor fault; a value out of range, implausible or frozen; an invalid task;
 *   - a Sync whose cycle number jumps; an observer that had to restart; a sender with too many errors, or two senders
 *     under one id; time that runs at another rate than the cycles;
 *   - a StopCommand on the bus: ANOTHER_GUARD. A robot cannot tell the answers of two guards apart.
 * One frame that is lost, repeated, late or fails its CRC is dropped and counted. It ends the permission only when
 * nothing good arrives before the deadline.
 *
 * A trip ends on a GuardReset that names its number, as an edge of Request from 0 to 1 with both frames accepted after
 * the trip, when everything above has held and the index was below its thresholds for `reset_healthy_us`. A request
 * that comes earlier or names another trip is refused and counted.
 *
 * While STOPPED the guard goes on watching. An event of a worse stop category (IEC 60204-1: 0 is the worst) raises the
 * category and gives a new trip number. A second collision counts as worse than the first: a contact after everything
 * was good, or one that grows, on any joint, later than 0.5 s after the trip.
 *
 * A failed self-check is FAULT until the next guard_init: corrupt configuration or state, a late or over-long tick, a
 * stage that did not run, time that stands or runs backwards, too many restarts.
 *
 * A board calls guard_note_start once after guard_init, guard_receive for each frame of others in the order of
 * reception, guard_tick once a cycle (as soon as guard_cycle_complete says so, and no later than the tick deadline),
 * sends what the tick put out, and reports how long it took by guard_note_tick_time. One guard_t is used by one thread.
 * now_us is any monotonic clock.
 *
 * Cost on a Cortex-M4F: see `make bench`. guard_t below 6 KiB; stack below 2 KiB.
 */
#ifndef TAUPERP_GUARD_H
#define TAUPERP_GUARD_H

#include "config.h"
#include "e2e.h"
#include "frame.h"
#include "protocol.h"
#include "snapshot.h"
#include "values.h"

#define GUARD_MAX_FRAMES 2u /* that one tick puts out */

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
    bool withheld;         /* the second opinion: the opposite of `permitted`, by another path */
    bool fresh;            /* a new snapshot went through the stages on this tick */
    uint8_t task;          /* in force */
    uint8_t stop_category; /* IEC 60204-1, of the stop in force, or the one that a stop would have */
    uint8_t joint;         /* 1 to n: of the trip or waited for; 0 none */
    uint8_t trip_number;   /* of the last trip; 0 before the first */
    uint16_t cycle;        /* of the newest Sync */
    uint8_t channel;       /* of the bank, 0 to 3: of the index that is nearest to its threshold */
    num_t value_nm;        /* the index of `joint` at the trip; for EXPLAINED_* the force in N or the moment in Nm */
    num_t threshold_nm;    /* what it exceeded */
    num_t residual[ROBOT_MAX_JOINTS];  /* r of this tick */
    num_t index[ROBOT_MAX_JOINTS];     /* of this tick, in the channel nearest to its threshold */
    num_t threshold[ROBOT_MAX_JOINTS]; /* in force there */
    num_t smallest_singular; /* of the basis in force, or a bound below it (subspace.h), Nm per N; 0 without one */
    uint32_t rank;
    uint32_t frame_count;
    can_frame_t frame[GUARD_MAX_FRAMES]; /* to be sent in this order */
} guard_output_t;

/* Why the guard starts, as the board knows it (reset-cause registers, service manager): GUARD_START_UNKNOWN counts as
 * unexpected, GUARD_START_COMMANDED is a person or a tool, GUARD_START_SERVICE a service manager. Of the variants
 * anything but GUARD_VARIANT_PRODUCT is for test benches only. */
#define GUARD_MAX_RESTARTS 3u /* unexpected restarts since the last power-on or commanded start; one more is FAULT */

/* A periodic input, and when it was last good. */
typedef struct {
    uint64_t good_us;
    bool seen;
} guard_input_t;

/* What came in: written by guard_receive only, read by guard_tick. */
typedef struct {
    e2e_receiver_t receiver[PROTOCOL_RECEIVE_COUNT];
    uint8_t errors[PROTOCOL_RECEIVE_COUNT];  /* leaky count of bad frames */
    uint8_t repeats[PROTOCOL_RECEIVE_COUNT]; /* consecutive good frames whose counter came a second time */
    uint16_t repeated;                       /* bit per slot: since the last good frame */
    snapshot_t snapshot;
    guard_input_t sync, joints, task; /* joints: good when a tick has evaluated them */
    uint64_t completed_us;            /* when the snapshot became complete */
    uint64_t window_start_us;         /* of the comparison of time and cycles */
    uint32_t window_cycles;
    bool window_started;
    bool clocks_agree;      /* over the last whole window: no permission before the first one */
    uint16_t task_cycle;    /* of the last good TaskCommand */
    vec3_t acceleration;    /* of the end-effector, base frame, m/s^2 */
    uint8_t task_number;    /* the last good one; TASK_INVALID before */
    uint8_t fault_joint;    /* 1 to n, or 0 */
    uint32_t fault;         /* guard_reason_t that the next tick acts on: the worst since the last tick; 0 none */
    bool request;           /* of the last accepted GuardReset; starts as true, so that it takes two to make an edge */
    bool edge;              /* Request went from 0 to 1 since the last tick */
    uint8_t requested_trip; /* TripNumber of that frame */
} guard_inputs_t;

/* The latched reason why motion ended. */
typedef struct {
    uint32_t reason; /* guard_reason_t */
    uint8_t number;  /* 1 to 255, then 1 again; 0 before the first */
    uint8_t joint;
    uint8_t category;
    num_t value_nm;
    num_t threshold_nm;
} guard_trip_t;

/* Do a joint's readings agree with each other from snapshot to snapshot? */
typedef struct {
    num_t position[ROBOT_MAX_JOINTS]; /* of the last snapshot */
    num_t velocity[ROBOT_MAX_JOINTS];
    num_t torque[ROBOT_MAX_JOINTS];
    num_t error_rad[ROBOT_MAX_JOINTS]; /* moved minus integrated velocity, decaying with the observer */
    num_t held_nm[ROBOT_MAX_JOINTS];   /* gravity torque when the torque reading last changed */
    uint8_t same[ROBOT_MAX_JOINTS];    /* snapshots since */
    uint32_t fault;                    /* guard_reason_t of the last snapshot; 0 none */
    uint32_t joint;                    /* 0 to n-1 */
    bool started;
} plausibility_t;

/* How far each joint's index is above its threshold since the last trip: a contact that grows is a second one. */
typedef struct {
    num_t reference[ROBOT_MAX_JOINTS]; /* index / threshold */
    uint64_t begun_us;                 /* of the trip */
    uint32_t snapshots;                /* consecutive ones in which a joint is above its bound */
    uint32_t joint;                    /* 0 to n-1: the last of these joints */
} rise_t;

/* What the guard says on the bus besides its verdict. */
typedef struct {
    e2e_transmitter_t stop, status, index;
    uint32_t round_robin;  /* of the pages of GuardStatus and the joints of GuardIndex */
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
    acceleration_t acceleration;
    regressor_t regressor;
    index_t index;
    explained_t explained;
    bank_t bank;
    detector_t detector;
    plausibility_t plausibility;
    rise_t rise;
    bool evaluated;          /* a snapshot went through every stage in this tick */
    uint32_t stage_token;    /* what the stages of this tick left behind */
    uint32_t settled_cycles; /* that the observer has run without a restart, held at UINT32_MAX */
    uint32_t task;           /* in force */
    uint32_t task_cycles;    /* evaluated since it came into force, held at UINT32_MAX */
    guard_trip_t trip;
    uint64_t last_tick_us;
    uint64_t healthy_since_us;
    uint32_t standing_ticks; /* consecutive ticks at one and the same time */
    uint32_t self_test_step;
    num_t self_test_remaining; /* what the chain's observer has yet to see of the push, 1 to 0 */
    bool healthy;
    bool ticked;
    bool over_budget;
    bool calm;           /* healthy for reset_healthy_us since the last trip: a collision now is another one */
    bool acknowledged;   /* a GuardReset has come since the start */
    uint8_t start_cause; /* guard_start_t */
    uint8_t restarts;
    uint8_t variant;      /* guard_variant_t */
    uint32_t saturations; /* as of the last tick */
    config_watch_t watch;
    guard_counters_t counters;
    guard_report_t report;
} guard_t;

/* Checks the whole block, and starts. `config` must stay in place and unchanged while the guard is used. On anything
 * but GUARD_OK the guard stays UNINITIALISED: its ticks put out a StopCommand without permission. */
guard_status_t guard_init(guard_t *self, const guard_config_t *config);

/* Once, after guard_init and before the first tick: why the guard started, the number of unexpected restarts since the
 * last power-on or commanded start (this one included), and what the image was built for. More than GUARD_MAX_RESTARTS
 * restarts are FAULT. Without this call the start counts as one unexpected restart. */
void guard_note_start(guard_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant);

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
