/* guard: the safety function. Its inputs are frames and time. Its output is a permission to move, in every tick.
 *
 *   UNINITIALISED -> SELF_TEST -> WAITING -> MONITORING <-> STOPPED        any -> FAULT
 *
 * Motion is a permission: every tick in MONITORING sends it, and no other state does. A robot that receives nothing
 * stops.
 *
 * The permission follows evaluation, not reception. A tick permits only if
 *   - Sync and TaskCommand are younger than their deadlines, each frame checked (E2E, length, format, range);
 *   - a complete joint snapshot went through every stage, and is younger than the joint deadline;
 *   - the observer has run without a restart for `settling_us`;
 *   - time and cycles agree, no sender makes too many errors, the configuration is intact, and no trip is latched.
 *
 * After any start the first permission also needs a GuardReset (IEC 60204-1, ISO 14118). The guard waits with reason
 * AWAITING_RESET, or RESTARTED after an unexpected restart. The reset names the number in StopCommand.TripNumber.
 *
 * These events end the permission and latch STOPPED, with a new trip number:
 *   - COLLISION: the index is above its threshold for its debounce. EXPLAINED_*: what the task explains is beyond its
 *     limits. SUDDEN: what it explains changes too fast.
 *   - An input past its deadline; a sensor fault; a value out of range, implausible or frozen; an invalid task.
 *   - A Sync whose cycle number jumps; an observer restart; a sender with too many errors, or two senders under one id;
 *     time and cycles that advance at different rates.
 *   - BLIND, if configured: the index is blind for a link that the task needs.
 *   - ANOTHER_GUARD: a StopCommand on the bus. A robot cannot distinguish the answers of two guards.
 * One frame that is lost, repeated, late or fails its CRC is dropped and counted. It ends the permission only if no
 * good frame arrives before the deadline.
 *
 * A GuardReset ends a trip. It must name the trip's number, as an edge of Request from 0 to 1 with both frames accepted
 * after the trip. All conditions above must have held, with the index below its thresholds, for `reset_healthy_us`. The
 * guard refuses and counts a request that comes earlier or names another trip.
 *
 * While STOPPED the guard continues to monitor. An event with a worse stop category (IEC 60204-1: 0 is the worst)
 * raises the category and gets a new trip number. A second collision counts as worse than the first. It is a contact
 * after everything was good, or a contact that grows, on any joint, more than 0.5 s after the trip.
 *
 * A failed self-check is FAULT until the next guard_init: corrupt configuration or state, a late or over-long tick, a
 * stage that did not run, time that stands still or runs backwards, too many restarts.
 *
 * A board calls guard_note_start once after guard_init. It calls guard_receive for each received frame, in order of
 * reception. It calls guard_tick once per cycle: as soon as guard_cycle_complete is true, at the latest by the tick
 * deadline. It sends the frames of the tick, and reports its duration with guard_note_tick_time. One thread uses one
 * guard_t. now_us comes from any monotonic clock.
 *
 * Cost on a Cortex-M4F: see `make bench`. guard_t is below 6 KiB; stack below 2 KiB.
 */
#ifndef TAUPERP_GUARD_H
#define TAUPERP_GUARD_H

#include "config.h"
#include "e2e.h"
#include "frame.h"
#include "locate.h"
#include "opinion.h"
#include "protocol.h"
#include "snapshot.h"
#include "values.h"

#define GUARD_MAX_FRAMES 2u /* most frames of one tick */

/* One channel or two: no single flipped bit makes one of the other. */
#define GUARD_ALONE  0x5Au
#define GUARD_PAIRED 0xA5u

/* A flag that leads to a permission: no single flipped bit sets it. Every value except GUARD_SET counts as clear. */
enum { GUARD_CLEAR = 0, GUARD_SET = 0xA5 };

/* Faults of the environment since guard_init. Each counter saturates at its maximum. */
typedef struct {
    uint16_t crc_errors;
    uint16_t sequence_errors; /* repeated, backwards, or too far ahead */
    uint16_t lost_frames;
    uint16_t range_errors;  /* out of range, not available, or a sensor status other than OK */
    uint16_t format_errors; /* unknown id, wrong length, wrong format */
    uint16_t late_frames;   /* readings of another cycle, and repeated readings of one cycle */
    uint16_t resets_refused;
    uint16_t trips;
} guard_counters_t;

typedef struct {
    guard_state_t state;
    guard_reason_t reason;
    bool permitted;
    bool withheld;         /* the opposite of `permitted`, computed on a second path */
    bool fresh;            /* a new snapshot went through the stages in this tick */
    uint8_t task;          /* the active task */
    uint8_t stop_category; /* IEC 60204-1: of the current stop, or of the stop that would follow */
    uint8_t joint;         /* 1 to n: joint of the trip, or the joint that the guard waits for; 0: none */
    uint8_t trip_number;   /* of the last trip; 0 before the first */
    uint16_t cycle;        /* cycle of the newest Sync */
    uint8_t channel;       /* channel of the bank, 0 to 3, whose index is nearest to its threshold */
    uint8_t value_channel; /* channel of value_nm */
    bool full_speed;       /* the permission is not for the reduced speed only */
    uint8_t blind_links;   /* bit per link, link 1 the lowest: the index in force detects no force on it (sight.h) */
    uint8_t needed_links;  /* bit per link: the task in force must detect a force on it */
    uint8_t contact_link;  /* link of the last collision, 1 to n; 0: not known, or not yet */
    uint8_t contact_class; /* contact_class_t of the last collision */
    vec3_t contact_force;  /* on the robot, base frame, N; zero without a link */
    num_t value_nm;        /* the index of `joint` at the trip; for EXPLAINED_* the force in N or the moment in Nm */
    num_t threshold_nm;    /* the limit that it exceeded */
    num_t residual[ROBOT_MAX_JOINTS];        /* r of this tick */
    num_t index[ROBOT_MAX_JOINTS];           /* of this tick, in the channel nearest to its threshold */
    num_t threshold[ROBOT_MAX_JOINTS];       /* threshold in force in that channel */
    uint8_t index_channel[ROBOT_MAX_JOINTS]; /* its number */
    num_t smallest_singular; /* of the active basis, or a lower bound (subspace.h), Nm per N; 0 without a basis */
    uint32_t rank;
    uint32_t frame_count;
    can_frame_t frame[GUARD_MAX_FRAMES]; /* send in this order */
} guard_output_t;

/* Cause of the start, from the board's reset-cause registers or the service manager. GUARD_START_UNKNOWN counts as
 * unexpected. GUARD_START_COMMANDED: a person or a tool. GUARD_START_SERVICE: a service manager. Of the variants, all
 * except GUARD_VARIANT_PRODUCT are for test benches only. */
#define GUARD_MAX_RESTARTS 3u /* unexpected restarts since the last power-on or commanded start; one more is FAULT */

/* A periodic input, and the time of its last good frame. */
typedef struct {
    uint64_t good_us;
    bool seen;
} guard_input_t;

/* Received inputs: guard_receive writes them, guard_tick reads them. */
typedef struct {
    e2e_receiver_t receiver[PROTOCOL_RECEIVE_COUNT];
    uint8_t errors[PROTOCOL_RECEIVE_COUNT];  /* leaky counter of bad frames */
    uint8_t repeats[PROTOCOL_RECEIVE_COUNT]; /* consecutive good frames with a repeated counter */
    uint16_t repeated;                       /* bit per slot: counter repeated since the last good frame */
    snapshot_t snapshot;
    guard_input_t sync, joints, task; /* joints: good when a tick has evaluated them */
    uint64_t completed_us;            /* when the snapshot became complete */
    uint64_t window_start_us;         /* start of the window in which time and cycles are compared */
    uint32_t window_cycles;
    bool window_started;
    bool clocks_agree;   /* in the last whole window; false before the first one, which blocks the permission */
    uint16_t task_cycle; /* cycle of the last good TaskCommand */
    vec3_t acceleration; /* of the end-effector, base frame, m/s^2 */
    uint8_t task_number; /* task of the last good TaskCommand; TASK_INVALID before the first */
    uint32_t task_number_inverted; /* ~task_number: a flipped bit in either is FAULT */
    uint8_t fault_joint;           /* 1 to n, or 0 */
    uint32_t fault;                /* guard_reason_t for the next tick: the worst since the last tick; 0: none */
    bool request; /* Request of the last accepted GuardReset; starts as true, so that an edge needs two frames */
    uint8_t edge; /* GUARD_SET: Request went from 0 to 1 since the last tick */
    uint8_t requested_trip; /* TripNumber of that frame */
} guard_inputs_t;

/* The latched reason of the stop. */
typedef struct {
    uint32_t reason; /* guard_reason_t */
    uint8_t number;  /* 1 to 255, then 1 again; 0 before the first */
    uint8_t joint;
    uint8_t category;
    uint8_t channel; /* of the bank; 0 for a reason that is not of a channel */
    num_t value_nm;
    num_t threshold_nm;
} guard_trip_t;

/* Whether a joint's readings agree with each other from snapshot to snapshot. */
typedef struct {
    num_t position[ROBOT_MAX_JOINTS]; /* of the last snapshot */
    num_t velocity[ROBOT_MAX_JOINTS];
    num_t torque[ROBOT_MAX_JOINTS];
    num_t error_rad[ROBOT_MAX_JOINTS]; /* movement minus integrated velocity; decays with the observer */
    num_t held_nm[ROBOT_MAX_JOINTS];   /* gravity torque when the torque reading last changed */
    uint8_t same[ROBOT_MAX_JOINTS];    /* snapshots since that change */
    uint32_t fault;                    /* guard_reason_t of the last snapshot; 0 none */
    uint32_t joint;                    /* 0 to n-1 */
    bool started;
} plausibility_t;

/* How far each joint's index is above its threshold since the last trip. A contact that grows is a second contact. */
typedef struct {
    num_t reference[ROBOT_MAX_JOINTS]; /* index / threshold */
    uint64_t begun_us;                 /* time of the trip */
    uint32_t snapshots;                /* consecutive snapshots with a joint above its bound */
    uint32_t joint;                    /* 0 to n-1: the last such joint */
} rise_t;

/* Which link the last collision hit, and what kind of contact it was. */
typedef struct {
    locate_t locate;
    uint16_t rising[ROBOT_MAX_JOINTS]; /* consecutive snapshots with the joint's index above half of its threshold */
    uint32_t held;                     /* snapshots since the trip with an index above its threshold in each */
    bool slow;                         /* the index rose slowly to the trip */
    bool touching;                     /* `held` still counts */
    uint8_t kind;                      /* contact_class_t */
} guard_contact_t;

/* Content of the frames in addition to the verdict. */
typedef struct {
    e2e_transmitter_t stop, status, index;
    uint32_t round_robin;  /* position in the sequence of GuardStatus pages and GuardIndex joints */
    uint32_t tick_time_us; /* duration of the last tick, measured by the board; saturates at 65535 */
    uint32_t worst_tick_time_us;
    uint32_t margin_us; /* smallest time to any deadline since the last page that reports it */
} guard_report_t;

typedef struct {
    const guard_config_t *config;
    uint32_t joints;         /* joints of the robot; 0 before guard_init */
    uint32_t state;          /* guard_state_t */
    uint32_t state_inverted; /* ~state: a flipped bit in either is FAULT */
    uint32_t task;           /* the active task */
    uint32_t task_inverted;  /* ~task: a flipped bit in either is FAULT */
    uint8_t acknowledged;    /* GUARD_SET: a GuardReset was accepted since the start. Not GUARD_CLEAR either: FAULT */
    guard_inputs_t inputs;
    motion_t motion;
    observer_t observer;
    acceleration_t acceleration;
    regressor_t regressor;
    index_t index;
    explained_t explained;
    bank_t bank;
    detector_t detector;
    sight_t sight;
    guard_contact_t contact;
    plausibility_t plausibility;
    rise_t rise;
    bool evaluated;          /* a snapshot went through every stage in this tick */
    uint32_t stage_token;    /* last token of the stages of this tick */
    uint32_t settled_cycles; /* cycles since the observer's last restart; saturates at UINT32_MAX */
    uint32_t task_cycles;    /* evaluated cycles since the task became active; saturates at UINT32_MAX */
    guard_trip_t trip;
    uint64_t last_tick_us;
    uint64_t healthy_since_us;
    uint32_t standing_ticks; /* consecutive ticks at the same time */
    uint32_t self_test_step;
    num_t self_test_remaining; /* part of the push that the chain's observer has not followed yet, 1 to 0 */
    bool healthy;
    bool ticked;
    bool over_budget;
    bool tested;         /* the self-test has passed */
    bool second;         /* of two channels */
    bool calm;           /* healthy for reset_healthy_us since the last trip: a collision now is a new one */
    uint8_t start_cause; /* guard_start_t */
    uint8_t restarts;
    uint8_t variant;      /* guard_variant_t */
    uint32_t saturations; /* as of the last tick */
    uint32_t company;     /* GUARD_ALONE, or GUARD_PAIRED; anything else counts as paired */
    agree_t agree;
    config_watch_t watch;
    guard_counters_t counters;
    guard_report_t report;
} guard_t;

/* The inputs with a deadline, in the order in which they are reported missing. */
typedef enum { INPUT_NONE = 0, INPUT_SYNC = 1, INPUT_JOINTS = 2, INPUT_TASK = 3, INPUT_COUNT = 4 } input_t;

/* Why a permission ends. */
typedef struct {
    guard_reason_t reason; /* GUARD_REASON_NONE: it continues */
    uint32_t joint;        /* 1 to n, or 0 */
    uint32_t category;
    uint32_t channel; /* of the bank */
    num_t value_nm;
    num_t threshold_nm;
} guard_event_t;

/* The result of one evaluation of the inputs. */
typedef struct {
    wish_t wish;
    guard_event_t event; /* of the wish */
    input_t missing;
    bool healthy, tested, fresh, saturated; /* as of opinion_t */
} guard_finding_t;

/* Checks the whole block and starts the guard. `config` must stay in place and unchanged while the guard is used. If
 * the result is not GUARD_OK, the guard stays UNINITIALISED: its ticks send a StopCommand without permission. */
guard_status_t guard_init(guard_t *self, const guard_config_t *config);

/* Call once, after guard_init and before the first tick: cause of the start, number of unexpected restarts since the
 * last power-on or commanded start (including this one), and variant of the image. More than GUARD_MAX_RESTARTS
 * restarts are FAULT. Without this call the start counts as one unexpected restart. */
void guard_note_start(guard_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant);

void guard_receive(guard_t *self, const can_frame_t *frame, uint64_t now_us);

/* True if every joint's reading of the newest Sync's cycle was received and no tick has used it yet. */
bool guard_cycle_complete(const guard_t *self);

void guard_tick(guard_t *self, uint64_t now_us, guard_output_t *out);

/* The parts of guard_tick, for two channels (pair.h): look, tell the opinion, decide with that of the other channel,
 * say it on the bus. The second channel confirms the first one's StopCommand: it writes its own inverted copy of the
 * permission and seals the frame. Precondition: guard_init returned GUARD_OK. */
void guard_join(guard_t *self, bool second);
bool guard_is_alone(const guard_t *self);
void guard_refuse(guard_t *self); /* the other channel refused its block: as guard_init does */
void guard_look(guard_t *self, uint64_t now_us, guard_finding_t *finding);
void guard_tell(const guard_t *self, const guard_finding_t *finding, opinion_t *opinion);
void guard_decide(guard_t *self, uint64_t now_us, const guard_finding_t *finding, const opinion_t *own,
                  const opinion_t *other, guard_output_t *out);
void guard_say(guard_t *self, guard_output_t *out);
void guard_confirm(const guard_output_t *own, can_frame_t *stop_command);

/* Duration of the last tick, microseconds, by the board's clock. Above tick_budget_us the next tick is FAULT. */
void guard_note_tick_time(guard_t *self, uint32_t tick_us);

/* Reports a fault that only the board can detect. It latches STOPPED at the next tick, or FAULT if the reason has that
 * class. */
void guard_trip(guard_t *self, guard_reason_t reason);

#endif
