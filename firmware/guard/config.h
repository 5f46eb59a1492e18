/* config: all settings of one installation, as a constant block that `tauperp config FILE` makes.
 *
 * The block is this struct, byte for byte: 32-bit little-endian words, so the same bytes load on every target. It
 * carries its schema, numeric type and size, and a CRC-32 (IEEE 802.3, reflected, as zlib's crc32) over everything
 * after the CRC field. The guard refuses a block that it does not understand. While it runs, it compares sums over the
 * block in each tick.
 */
#ifndef TAUPERP_CONFIG_H
#define TAUPERP_CONFIG_H

#include "acceleration.h"
#include "bank.h"
#include "detector.h"
#include "explained.h"
#include "index.h"
#include "lever.h"
#include "observer.h"
#include "regressor.h"
#include "robot.h"
#include "sensor.h"
#include "sight.h"
#include "values.h"

#define CONFIG_MAGIC   0x50524554u /* "TERP" */
#define CONFIG_SCHEMA  4u
#define CONFIG_MAX_GAP OBSERVER_MAX_GAP /* most cycles that one observer step may bridge */

typedef enum { FORMAT_CLASSIC = 1, FORMAT_FD = 2 } wire_format_t;
typedef enum { NUMERIC_FLOAT32 = 1, NUMERIC_Q9_22 = 2 } numeric_t;

/* One task: what it explains, the limits of that, and the thresholds for the rest. */
typedef struct {
    index_config_t index;
    detector_config_t detector;
    explained_config_t limits;
    uint32_t needed_links; /* on which it must detect a force, a bit each: sight.h */
} task_config_t;

typedef struct {
    uint32_t magic;
    uint32_t schema;
    uint32_t size;    /* bytes of the whole block */
    uint32_t crc;     /* CRC-32 of everything after this field */
    uint32_t numeric; /* numeric_t */
    uint32_t wire;    /* hash of the DBC's meaning (PROTOCOL_WIRE_CRC) for which the block was made */
    uint32_t format;  /* wire_format_t */
    uint32_t period_us;
    uint32_t sync_deadline_us;  /* age of the newest good input at which the permission ends */
    uint32_t joint_deadline_us; /* the same for the newest complete joint snapshot */
    uint32_t task_deadline_us;
    uint32_t tick_deadline_us; /* largest distance of two ticks; beyond it is FAULT */
    uint32_t tick_budget_us;   /* longest duration of a tick, measured by the board; beyond it is FAULT */
    uint32_t reset_healthy_us; /* how long inputs must be good and the index below its thresholds before a reset, and at
                                  start-up */
    uint32_t stop_collision;   /* stop categories of IEC 60204-1: 0, 1, 2 */
    uint32_t stop_input;
    uint32_t stop_fault;
    uint32_t settling_us;       /* how long the observer must run without a restart before a permission; at least 5/K */
    uint32_t task_dwell_cycles; /* how long a task stays active before the next one replaces it */
    observer_config_t observer;
    bank_config_t bank;
    subspace_config_t subspace;
    acceleration_config_t acceleration;
    regressor_config_t regressor;
    sensor_config_t sensor;
    lever_config_t shape;
    sight_config_t sight;
    task_config_t task[TASK_COUNT]; /* by task_t; [TASK_INVALID] stays INDEX_OFF */
    robot_t robot;
} guard_config_t;

/* The reason why a block is refused; the result of guard_init. */
typedef enum {
    GUARD_STATUS_NONE = 0,
    GUARD_OK = 1,
    GUARD_BAD_MAGIC = 2,  /* not a configuration block */
    GUARD_BAD_SCHEMA = 3, /* made for another version of the firmware */
    GUARD_BAD_SIZE = 4,
    GUARD_BAD_CRC = 5,
    GUARD_BAD_NUMERIC = 6, /* made for the other numeric type */
    GUARD_BAD_WIRE = 7,    /* made for another DBC */
    GUARD_BAD_ROBOT = 8,   /* robot_is_valid() is false */
    GUARD_BAD_TIMING = 9,  /* a period, deadline, budget or time outside its bounds (config_bounds.h) */
    GUARD_BAD_TASK = 10,   /* an unknown index, a threshold or debounce outside its bounds, or no task configured */
    GUARD_CONTACT_NEEDS_JOINTS =
        11, /* a contact with as many components as the arm has joints: the guard would detect no force */
    GUARD_PAYLOAD_NEEDS_6_JOINTS = 12, /* d_p with 5 joints or fewer: the same */
    GUARD_BAD_OBSERVER = 13,           /* too slow, or constants that are inconsistent with each other or the period */
    GUARD_BAD_SUBSPACE = 14,           /* a tolerance, lever or softness outside its bounds, or an unknown order */
    GUARD_BAD_STOP = 15,               /* a stop category that is not allowed for its kind of stop */
    GUARD_BAD_SENSOR = 16,             /* a sensor's offset or friction is outside its bounds */
    GUARD_BAD_LIMITS = 17,             /* a limit on what a task explains is outside its bounds */
    GUARD_BAD_BANK = 18,               /* a channel's gain is not 1, or no channel of a task detects a constant force */
    GUARD_TOO_SLOW = 19,               /* the worst-case reaction time is beyond CONFIG_REACTION_MAX_US */
    GUARD_BAD_PAIR = 20,               /* the blocks of the two channels are of different installations */
    GUARD_BAD_SIGHT = 21               /* a link's shape, a needed link or the reaction is outside its bounds */
} guard_status_t;

/* GUARD_OK if and only if the guard can run with the block and can detect collisions: every bound of config_bounds.h is
 * met. Cost: the CRC over the block and one second of each channel, about 100,000 instructions, once. */
guard_status_t config_check(const guard_config_t *config);

/* Worst-case time from a step of external torque of twice a threshold to the stop frame, in microseconds: one period
 * (the sample's age) + the joint deadline (lost cycles) + the filter's rise to half of the step + the debounce + the
 * tick deadline, for the slowest task. UINT32_MAX if a task never reaches its threshold. Precondition: config_check did
 * not refuse the block for its timing, observer or bank. */
uint32_t config_reaction_us(const guard_config_t *config);

/* The repeated check: sums over the words of the block. Each word is rotated by its place, so a change of any one word
 * changes its sum. The CRC at start protects the block's way to the guard, these sums its stay in memory. */
typedef struct {              /* of the block that config_check accepted */
    uint32_t common;          /* of everything except the tasks' rows */
    uint32_t row[TASK_COUNT]; /* of each task's row */
} config_watch_t;

/* `config`: a block that config_check has just accepted. */
void config_watch_start(config_watch_t *self, const guard_config_t *config);

/* Checks what this tick may use: everything except the tasks' rows, the row of the task that is active, and one other
 * row: that of the task that may become active in this tick, else any. False if any one word of them differs from the
 * block that was checked. Two bits that flip in different words in one tick cancel in about one of 100 cases.
 * Precondition: both tasks below TASK_COUNT. Cost: about 2.2 instructions per word, 1,200 for 520 of 850 words. */
bool config_watch_step(const config_watch_t *self, const guard_config_t *config, uint32_t active, uint32_t other);

#endif
