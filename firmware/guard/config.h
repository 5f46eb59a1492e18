/* config: everything that one installation decides, as a constant block made by `tauperp config FILE`.
 *
 * The block is this struct, byte for byte: 32-bit little-endian words, so the same bytes load on every target.
 * It carries its schema, its numeric type, its size and a CRC-32 (IEEE 802.3, reflected, as zlib's crc32) over all
 * that follows the CRC field. The guard refuses a block that it does not understand, and goes on checking the CRC
 * a slice per tick while it runs.
 */
#ifndef TAUPERP_CONFIG_H
#define TAUPERP_CONFIG_H

#include "acceleration.h"
#include "bank.h"
#include "detector.h"
#include "explained.h"
#include "index.h"
#include "observer.h"
#include "regressor.h"
#include "robot.h"
#include "sensor.h"

#define CONFIG_MAGIC   0x50524554u /* "TERP" */
#define CONFIG_SCHEMA  3u
#define CONFIG_MAX_GAP OBSERVER_MAX_GAP /* cycles that one observer step may bridge */

typedef enum { FORMAT_CLASSIC = 1, FORMAT_FD = 2 } wire_format_t;
typedef enum { NUMERIC_FLOAT32 = 1, NUMERIC_Q9_22 = 2 } numeric_t;

/* By convention the first three; an installation may give any row to any number. */
enum { TASK_INVALID = 0, TASK_NONE = 1, TASK_PAYLOAD = 2, TASK_CONTACT = 3, TASK_COUNT = 7 };

/* One task: what it explains, how much of it, and from where on the rest is a collision. */
typedef struct {
    index_config_t index;
    detector_config_t detector;
    explained_config_t limits;
} task_config_t;

typedef struct {
    uint32_t magic;
    uint32_t schema;
    uint32_t size;    /* bytes of the whole block */
    uint32_t crc;     /* CRC-32 of everything behind this field */
    uint32_t numeric; /* numeric_t */
    uint32_t wire;    /* CRC-32 of what the DBC says (PROTOCOL_WIRE_CRC) that the block was made for */
    uint32_t format;  /* wire_format_t */
    uint32_t period_us;
    uint32_t sync_deadline_us;  /* age of the newest good input at which motion ends */
    uint32_t joint_deadline_us; /* of the newest complete joint snapshot */
    uint32_t task_deadline_us;
    uint32_t tick_deadline_us; /* largest distance of two ticks; beyond is FAULT */
    uint32_t tick_budget_us;   /* longest a tick may take, as the board measures it; beyond is FAULT */
    uint32_t
        reset_healthy_us;    /* inputs good and index below its thresholds for so long before a reset and at start-up */
    uint32_t stop_collision; /* stop categories of IEC 60204-1: 0, 1, 2 */
    uint32_t stop_input;
    uint32_t stop_fault;
    uint32_t settling_us;       /* the observer runs for so long without a restart before a permission; 5/K or more */
    uint32_t task_dwell_cycles; /* a task stays in force for so long before the next one takes over */
    observer_config_t observer;
    bank_config_t bank;
    subspace_config_t subspace;
    acceleration_config_t acceleration;
    regressor_config_t regressor;
    sensor_config_t sensor;
    task_config_t task[TASK_COUNT]; /* by task number; [TASK_INVALID] stays INDEX_OFF */
    robot_t robot;
} guard_config_t;

/* Why a block is refused. guard_init passes it on. */
typedef enum {
    GUARD_STATUS_NONE = 0,
    GUARD_OK = 1,
    GUARD_BAD_MAGIC = 2,  /* not a configuration block */
    GUARD_BAD_SCHEMA = 3, /* made for another version of the firmware */
    GUARD_BAD_SIZE = 4,
    GUARD_BAD_CRC = 5,
    GUARD_BAD_NUMERIC = 6, /* made for the other numeric type */
    GUARD_BAD_WIRE = 7,    /* made for another DBC */
    GUARD_BAD_ROBOT = 8,   /* robot_holds() is false */
    GUARD_BAD_TIMING = 9,  /* a period, deadline, budget or time outside its bounds (config_bounds.h) */
    GUARD_BAD_TASK = 10,   /* an unknown index, a threshold or debounce outside its bounds, no task configured */
    GUARD_CONTACT_NEEDS_JOINTS = 11,   /* a contact of k components leaves an arm of k joints or fewer nothing to see */
    GUARD_PAYLOAD_NEEDS_6_JOINTS = 12, /* d_p of 5 joints or fewer likewise */
    GUARD_BAD_OBSERVER = 13,           /* too slow, or constants that do not belong to each other and the period */
    GUARD_BAD_SUBSPACE = 14,           /* a tolerance, lever or softness outside its bounds, an unknown order */
    GUARD_BAD_STOP = 15,               /* a stop category that is not allowed for its kind of stop */
    GUARD_BAD_SENSOR = 16,             /* a sensor's offset or friction is outside its bounds */
    GUARD_BAD_LIMITS = 17,             /* a limit on what a task explains is outside its bounds */
    GUARD_BAD_BANK = 18, /* a channel that is no filter of gain 1, or a task that watches no static force */
    GUARD_TOO_SLOW = 19  /* the worst-case reaction time is beyond CONFIG_REACTION_MAX_US */
} guard_status_t;

/* GUARD_OK iff the guard can run on the block and is not blind with it: every bound of config_bounds.h holds.
 * Cost: the CRC over the block, and one second of each channel; about 100,000 instructions, once. */
guard_status_t config_check(const guard_config_t *config);

/* Worst-case time from a step of external torque of twice a threshold to the stop frame, in microseconds: one period
 * (the sample's age) + the joint deadline (lost cycles) + the filter's rise to half of the step + the debounce + the
 * tick deadline, of the slowest task. UINT32_MAX if a task never gets there. Precondition: a block that config_check
 * did not refuse for its timing, observer or bank. */
uint32_t config_reaction_us(const guard_config_t *config);

#define CONFIG_WATCH_BYTES 16u

/* The CRC check that never ends: CONFIG_WATCH_BYTES a step, so the whole block every 70 or so steps. */
typedef struct {
    uint32_t offset;
    uint32_t crc;
} config_watch_t;

void config_watch_start(config_watch_t *self);

/* False when the block is not the one that was checked any more, as far as the steps have come. */
bool config_watch_step(config_watch_t *self, const guard_config_t *config);

#endif
