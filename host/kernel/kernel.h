/* kernel: many simulated collisions with the compiled firmware in the loop, without Python between two cycles.
 *
 * One call of kernel_simulate() or kernel_inject() computes a part of the plan. It accesses nothing but its arguments.
 * Calls on different runs may use as many threads as there are cores, each with its own setup, because the arm's masses
 * are written into its mjModel. A result depends on its row of the plan only. It has the same bits for any number of
 * threads and in any order.
 *
 * Structs have doubles first, then 64-bit, then 32-bit integers, so that no compiler adds padding. The host's
 * tauperp/kernel/layout.py holds the same layouts as numpy types and compares the sizes when it loads the library.
 * Units: m, kg, s, rad, N, Nm. Joints and links count from 0 here. Vectors are in the base frame unless stated.
 */
#ifndef TAUPERP_KERNEL_H
#define TAUPERP_KERNEL_H

#include <stdint.h>

#define KERNEL_ABI       6u
#define KERNEL_COLUMNS   6u /* SUBSPACE_MAX_COLUMNS */
#define KERNEL_JOINTS    8
#define KERNEL_GUARDS    8  /* guards that receive the same frames; the first one controls the arm */
#define KERNEL_DETECTORS 16 /* signals compared with thresholds in the same run */
#define KERNEL_SECTIONS  4  /* second-order sections of a detector's filter */
#define KERNEL_WAVES     3
#define KERNEL_CHANNELS  4 /* of the first guard's bank */

/* TOUCH rises over push_s and then stays. CLAMP rises in CLAMP_RISE_S and then stays. */
typedef enum {
    KERNEL_NO_PUSH = 0,
    KERNEL_PULSE = 1,
    KERNEL_CONTACT = 2,
    KERNEL_TOUCH = 3,
    KERNEL_CLAMP = 4
} kernel_push_t;
typedef enum { KERNEL_REST = 0, KERNEL_MOVE = 1, KERNEL_WAVE = 2 } kernel_motion_t;
/* OWN: the guard's index against its own thresholds, in the channel nearest to its threshold. */
typedef enum { KERNEL_RESIDUAL = 0, KERNEL_INDEX = 1, KERNEL_OWN = 2 } kernel_source_t;

/* Outcome of a run. Only a run that is DONE says anything about detection. */
typedef enum {
    KERNEL_UNDONE = 0,
    KERNEL_DONE = 1,
    KERNEL_NOT_PERMITTED = 2, /* the guard never permitted the first move */
    KERNEL_FALSE_STOP = 3,    /* it stopped before the arm was touched */
    KERNEL_OBSTRUCTED = 4,    /* the striking part has no free path to any side of the link */
    KERNEL_NOT_TOUCHED = 5,   /* the striking part missed */
    KERNEL_DIVERGED = 6,      /* MuJoCo reset the state */
    KERNEL_OFF_WIRE = 7       /* a guard went to FAULT, or a reading left the wire's range */
} kernel_status_t;

/* One signal inside a frame of at most 8 bytes, little-endian. */
typedef struct {
    double per_unit; /* raw steps in one unit */
    uint32_t shift;
    uint32_t mask;
    int32_t min;
    int32_t max;
} kernel_signal_t;

/* One message of the robot. `signal` is in the order that frames.c states for it. */
typedef struct {
    kernel_signal_t signal[4];
    uint32_t id;
    uint32_t length;
    uint32_t counter_is_cycle;
    uint32_t reserved;
    uint8_t data_ids[16];
} kernel_message_t;

/* A detector in addition to the guards: |filtered source| against a threshold per joint, for `debounce` consecutive
 * ticks. */
typedef struct {
    double section[KERNEL_SECTIONS][6]; /* b0 b1 b2 a0 = 1 a1 a2, in the format of scipy.signal */
    double threshold[KERNEL_JOINTS];
    uint32_t sections;
    uint32_t guard;  /* guard whose signal it uses */
    uint32_t source; /* kernel_source_t */
    uint32_t debounce;
} kernel_detector_t;

typedef struct {
    void *plant;   /* mjModel of the arm as it really is; its masses are overwritten for each run */
    void *nominal; /* mjModel that the controller uses */
    void *contact; /* the plant with a striking part, or NULL */
    const void *config[KERNEL_GUARDS];
    double mass[KERNEL_JOINTS]; /* of the links, as compiled */
    double inertia[KERNEL_JOINTS][3];
    double torque_max[KERNEL_JOINTS];
    double capsule[KERNEL_JOINTS][7]; /* p0, p1, radius, in the joint's frame */
    double bandwidth_rad_s;           /* of the position controller */
    double deceleration_rad_s2;       /* of a stop */
    uint64_t config_size;
    uint32_t period_us;
    uint32_t substeps; /* of physics in one cycle */
    uint32_t joints;
    uint32_t guards;
    uint32_t detectors;
    uint32_t fd;
    uint32_t channels; /* of the first guard's bank */
    uint32_t reserved;
    int32_t body[KERNEL_JOINTS]; /* MuJoCo's number of each link */
    int32_t payload;             /* body */
    int32_t tip;                 /* site */
    int32_t hand_geom;           /* in the contact model */
    int32_t hand_body;
    int32_t hand_position; /* first address in qpos and in qvel */
    int32_t hand_speed;
    int32_t link_geom[KERNEL_JOINTS];
    int32_t pair[KERNEL_JOINTS]; /* contact pair of the part with each link */
    kernel_message_t sync, task, reset, joint[KERNEL_JOINTS];
    kernel_detector_t detector[KERNEL_DETECTORS];
} kernel_setup_t;

/* Sensor errors of one arm in one run. */
typedef struct {
    double offset[KERNEL_JOINTS];                              /* Nm */
    double gain[KERNEL_JOINTS];                                /* factor */
    double ripple[KERNEL_JOINTS];                              /* Nm */
    double phase[KERNEL_JOINTS];                               /* of the ripple, rad */
    double friction[KERNEL_JOINTS];                            /* Coulomb friction in the sensor's reading, Nm */
    double torque_noise, velocity_noise, position_noise;       /* standard deviations */
    double torque_quantum, velocity_quantum, position_quantum; /* 0: only the wire's resolution */
    double ripple_per_turn;
    uint32_t delay; /* cycles, 0 to 7 */
    uint32_t reserved;
} kernel_sensors_t;

/* One run: the motion of the arm, its payload, and the strike. */
typedef struct {
    double start[KERNEL_JOINTS], goal[KERNEL_JOINTS];    /* rad */
    double amplitude[KERNEL_WAVES][KERNEL_JOINTS];       /* of a wave about `start`, rad */
    double frequency[KERNEL_WAVES], phase[KERNEL_WAVES]; /* rad/s, rad */
    double move_s; /* duration from `start` to `goal`; the arm then returns, and repeats */
    double duration_s;
    double payload_mass, payload_com[3], payload_inertia[3]; /* about its centre, in the last link's axes */
    double mass_scale[KERNEL_JOINTS];                        /* per link: the model error of the firmware */
    double guide_force[3], guide_moment[3];                  /* intended wrench at the tip */
    double guide_start_s, guide_rise_s, guide_hold_s;
    double point[3];     /* pulse: in the link's frame */
    double direction[3]; /* pulse: unit */
    double force_n, push_s, onset_s;
    double along, angle; /* contact: position along the capsule, and side */
    double part_mass, part_stiffness, part_radius, speed_m_s;
    kernel_sensors_t sensors;
    uint64_t seed, number;
    uint32_t task; /* as on the wire */
    uint32_t motion;
    uint32_t push;
    uint32_t link;
    uint32_t obeys; /* 0: it moves without permission and never stops, to record the signals of its whole motion */
    uint32_t reserved;
} kernel_run_t;

typedef struct {
    double onset_s, release_s; /* first and last force; NaN without a contact */
    double stop_s;             /* the guard's first stop after the first permission; NaN without */
    double force_at_stop_n;
    double peak_force_n; /* largest force of the run */
    double peak_force_after_stop_n;
    double mean_force_after_stop_n; /* over the time in which the guard locates the contact */
    double tip_speed_m_s;           /* at the onset, or at the end without one */
    double free_s;                  /* observed with permission before the onset or the stop */
    double simulated_s;
    double stop_value_nm, stop_threshold_nm;
    double contact_force[3];          /* on the robot as the guard estimates it, base frame; 0 without an answer */
    double true_force[3];             /* of the push when the guard stopped, a unit vector; 0 for a striking part */
    double before[KERNEL_DETECTORS];  /* largest ratio to the threshold before the onset */
    double during[KERNEL_DETECTORS];  /* the same from the onset on */
    double delay_s[KERNEL_DETECTORS]; /* from the onset to the first excess; NaN without */
    double early_s[KERNEL_DETECTORS]; /* time of the first excess before the onset; NaN without */
    double free_max[KERNEL_DETECTORS][KERNEL_JOINTS];   /* largest |signal| of each joint before the onset, Nm */
    double channel_max[KERNEL_CHANNELS][KERNEL_JOINTS]; /* the same for the first guard's channels */
    uint64_t number;
    uint32_t status;        /* kernel_status_t */
    uint32_t reason;        /* of the stop; number as on the wire */
    uint32_t joint;         /* from 1; 0 none */
    uint32_t link;          /* the touched link, from 1; 0 none */
    uint32_t stops;         /* before the onset, because of a computed value */
    uint32_t contact_link;  /* that the guard names, from 1; 0: not known */
    uint32_t contact_class; /* contact_class_t, as the guard says at the end */
    uint32_t input_stops;   /* before the onset, because of an input: missing, frozen, implausible */
} kernel_result_t;

/* A recording of a real arm for kernel_inject(): `rows` of readings, each (rows, joints), and the cycle of each row. */
typedef struct {
    const double *position, *velocity, *torque;
    const uint32_t *cycle; /* ascending */
    uint32_t rows;
    uint32_t task;
} kernel_recording_t;

/* A push on the arm of a recording, starting at row `row`. */
typedef struct {
    double point[3], direction[3];
    double force_n, push_s;
    uint64_t number;
    uint32_t row;
    uint32_t link;
} kernel_injection_t;

/* Writes KERNEL_ABI, the sizes of the structs above in their order (setup, run, result, recording, injection), and the
 * versions of MuJoCo's headers and library. */
void kernel_describe(uint32_t abi_sizes_versions[8]);

/* Computes `count` runs while *stop is 0; another thread may set it. Writes the results in order and returns the number
 * of completed runs. 0 if a guard refuses its configuration. */
uint32_t kernel_simulate(const kernel_setup_t *setup, const kernel_run_t *runs, uint32_t count,
                         kernel_result_t *results, const volatile uint32_t *stop);

/* Sends a recording through the first guard. It requests a reset whenever the guard does not permit motion. Writes r
 * (rows, joints) and the index in each channel of the bank (rows, channels, joints), both Nm, the coefficients of what
 * the task explains (rows, KERNEL_COLUMNS; core/explained.h), and the verdict of each row: bit 0 permitted, bit 1 a new
 * snapshot was evaluated. Returns the number of rows that were sent. It is smaller
 * than `rows` if the guard went to FAULT or a reading left the wire's range.
 */
uint32_t kernel_listen(const kernel_setup_t *setup, const kernel_recording_t *recording, double *residual,
                       double *index, double *explained, uint8_t *verdict, const volatile uint32_t *stop);

/* Like kernel_simulate(), for pushes that are added to a recording's torques through the transposed Jacobian.
 * `injections` are sorted by row. The guards receive the recording up to a push. A copy of their state then receives
 * the pushed rows for `window_s`. `free_max` and `before` of each result are those of the recording up to the push.
 */
uint32_t kernel_inject(const kernel_setup_t *setup, const kernel_recording_t *recording,
                       const kernel_injection_t *injections, uint32_t count, double window_s, kernel_result_t *results,
                       const volatile uint32_t *stop);

#endif
