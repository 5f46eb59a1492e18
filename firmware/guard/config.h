/* config: everything that one installation decides, as a constant block made by `tauperp config FILE`.
 *
 * The block is this struct, byte for byte: 32-bit little-endian words, so the same bytes load on every target.
 * It carries its schema, its numeric type, its size and a CRC-32 (IEEE 802.3, reflected, as zlib's crc32) over all
 * that follows the CRC field. The guard refuses a block that it does not understand, and goes on checking the CRC
 * a slice per tick while it runs.
 */
#ifndef TAUPERP_CONFIG_H
#define TAUPERP_CONFIG_H

#include "robot.h"
#include "sensor.h"

#define CONFIG_MAGIC   0x50524554u /* "TERP" */
#define CONFIG_SCHEMA  2u
#define CONFIG_MAX_GAP 4u /* cycles that one observer step may bridge */

/* What the torque is projected on; the wire's task numbers (1 none, 2 payload, 3 contact) pick one each. */
typedef enum {
    INDEX_OFF = 0,      /* the task is not configured here: asking for it is an invalid task */
    INDEX_RESIDUAL = 1, /* r itself */
    INDEX_PAYLOAD = 2,  /* d_p: what no payload at the end-effector explains (eq. 14) */
    INDEX_CONTACT = 3   /* d_e: what no wrench at the end-effector explains (eq. 20) */
} index_kind_t;

typedef enum { BASIS_INSTANTANEOUS = 1, BASIS_FILTERED = 2 } basis_kind_t; /* filtered by the observer's low-pass */
typedef enum {
    TORQUE_INTERVAL = 1,
    TORQUE_INSTANT = 2
} torque_sample_t; /* mean since the last Sync, or sampled at it */
typedef enum { FORMAT_CLASSIC = 1, FORMAT_FD = 2 } wire_format_t;
typedef enum { NUMERIC_FLOAT32 = 1, NUMERIC_Q9_22 = 2 } numeric_t;

enum { TASK_INVALID = 0, TASK_NONE = 1, TASK_PAYLOAD = 2, TASK_CONTACT = 3, TASK_COUNT = 4 };

typedef struct {
    uint32_t index;                       /* index_kind_t */
    uint32_t debounce_ticks;              /* consecutive ticks above the threshold that make a trip, at least 1 */
    num_t threshold_nm[ROBOT_MAX_JOINTS]; /* positive */
} task_config_t;

/* Constants of the discretised observer for a step that bridges 1 to CONFIG_MAX_GAP cycles, K the gain in 1/s. */
typedef struct {
    num_t decay[CONFIG_MAX_GAP];         /* a = exp(-K g T), g = 1, 2, ... */
    num_t gain[CONFIG_MAX_GAP];          /* 1 - a */
    num_t momentum_gain[CONFIG_MAX_GAP]; /* (1 - a) / (g T), 1/s */
    uint32_t torque_sample;              /* torque_sample_t */
} observer_config_t;

typedef struct {
    uint32_t basis;  /* basis_kind_t */
    num_t tolerance; /* Nm per N: directions of force that move no joint by more count as unexplained */
    num_t lever_m;   /* a moment counts as a force on this lever, so that the tolerance has one unit */
} subspace_config_t;

typedef struct {
    uint32_t magic;
    uint32_t schema;
    uint32_t size;    /* bytes of the whole block */
    uint32_t crc;     /* CRC-32 of everything behind this field */
    uint32_t numeric; /* numeric_t */
    uint32_t wire;    /* CRC-32 of the DBC file that the block was made for */
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
    observer_config_t observer;
    subspace_config_t subspace;
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
    GUARD_BAD_TIMING = 9,  /* zero, a deadline below one period, or a joint deadline beyond CONFIG_MAX_GAP periods */
    GUARD_BAD_TASK = 10,   /* a threshold or debounce that is not positive, an unknown index, no task configured */
    GUARD_CONTACT_NEEDS_7_JOINTS = 11, /* d_e of 6 joints or fewer is zero for every force: it would see nothing */
    GUARD_PAYLOAD_NEEDS_6_JOINTS = 12, /* d_p of 5 joints or fewer likewise */
    GUARD_BAD_OBSERVER = 13,           /* a decay outside 0 to 1, or a gain that does not belong to it */
    GUARD_BAD_SUBSPACE = 14,           /* a tolerance or lever that is not positive, an unknown basis */
    GUARD_BAD_STOP = 15,               /* a stop category above 2 */
    GUARD_BAD_SENSOR = 16              /* sensor_holds() is false */
} guard_status_t;

#define CONFIG_CONTACT_MIN_JOINTS 7u
#define CONFIG_PAYLOAD_MIN_JOINTS 6u

/* GUARD_OK iff the guard can run on the block. Cost: its CRC, about 15,000 instructions. */
guard_status_t config_check(const guard_config_t *config);

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
