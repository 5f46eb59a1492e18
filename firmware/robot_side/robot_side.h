/* robot_side: the robot controller's end of the wire. It packs the frames for the guard, and it decides from
 * StopCommand whether motion is permitted (rules: docs/robot-side.md). It depends on firmware/wire only. It has no
 * heap, clock or I/O.
 *
 *     static robot_side_t robot;
 *     robot_side_init(&robot, &(robot_side_config_t){.joints = 7, .fd = true, .answer_us = 500, .hold_us = 1500});
 *
 *     each period:   while (bus_receive(&frame, &at_us)) robot_side_hear(&robot, &frame, at_us);
 *                    robot_side_begin(&robot, clock_us(), &frame);                       bus_send(&frame);   Sync
 *                    robot_side_task(&robot, ROBOT_SIDE_TASK_NONE, no_acceleration, &frame);  bus_send(&frame);
 *                    robot_side_joint(&robot, i, &reading, &frame);     for each joint   bus_send(&frame);
 *     in between:    while (bus_receive(&frame, &at_us)) robot_side_hear(&robot, &frame, at_us);
 *     before each command to the drives:
 *                    permit = robot_side_permit(&robot, clock_us());
 *                    if (!permit.allowed) stop by category permit.category;
 *                    else if (!permit.full_speed) keep to the reduced speed;
 *
 * Times are microseconds of one monotonic clock. One thread uses one robot_side_t. The joints of a robot may be on
 * separate nodes, each with its own robot_side_t that follows the cycle by robot_side_follow.
 */
#ifndef TAUPERP_ROBOT_SIDE_H
#define TAUPERP_ROBOT_SIDE_H

#include <stdbool.h>
#include <stdint.h>

#include "e2e.h"
#include "frame.h"

#define ROBOT_SIDE_MAX_JOINTS 8u

/* TaskCommand.Task */
typedef enum {
    ROBOT_SIDE_TASK_NONE = 1,
    ROBOT_SIDE_TASK_PAYLOAD = 2,
    ROBOT_SIDE_TASK_CONTACT = 3,
    ROBOT_SIDE_TASK_4 = 4, /* this and higher numbers are the installation's own rows */
    ROBOT_SIDE_TASK_5 = 5,
    ROBOT_SIDE_TASK_6 = 6
} robot_side_task_t;

/* JointState.SensorStatus */
typedef enum {
    ROBOT_SIDE_SENSOR_OK = 0,
    ROBOT_SIDE_SENSOR_DEGRADED = 1,
    ROBOT_SIDE_SENSOR_FAULT = 2,
    ROBOT_SIDE_SENSOR_NOT_AVAILABLE = 3
} robot_side_sensor_t;

typedef struct {
    uint32_t joints;    /* 1 to ROBOT_SIDE_MAX_JOINTS */
    bool fd;            /* CAN FD with bit-rate switch, or classic CAN */
    uint32_t answer_us; /* time after Sync until which an answer permits; at most half a period */
    uint32_t hold_us;   /* time after Sync for which a permission lasts; at most a period plus answer_us */
} robot_side_config_t;

typedef struct {
    robot_side_sensor_t status;
    float position_rad;
    float velocity_rad_s;
    float torque_nm;
} robot_side_reading_t;

/* The verdict at one instant. */
typedef struct {
    bool allowed;
    bool full_speed;  /* of a permission. False: at the robot's reduced speed only, because of a blind link */
    uint8_t category; /* IEC 60204-1, of the stop to perform; 1 on silence */
    uint8_t reason;   /* StopCommand.Reason; 0 if no valid frame decided */
    uint8_t joint;    /* 1 to n: joint of the trip; 0: none */
    uint8_t trip;     /* number that a GuardReset must name */
} robot_side_permit_t;

typedef struct {
    robot_side_config_t config;
    uint16_t cycle;    /* the current cycle */
    bool begun;        /* a cycle has started */
    uint64_t begun_us; /* when its Sync was packed */
    bool answered;     /* a valid answer to this cycle permits */
    bool stopped;      /* a stop was received in this cycle; stays set for the cycle */
    robot_side_permit_t stop, answer;
    uint8_t last_trip; /* the last trip number in a StopCommand */
    uint32_t sequence; /* the last 24 StopCommands, bit 0 the newest: refused because of their counter */
    e2e_receiver_t receiver;
    e2e_transmitter_t reset;
} robot_side_t;

/* False for a configuration outside the ranges above. Then nothing is ever permitted. */
bool robot_side_init(robot_side_t *self, const robot_side_config_t *config);

/* Starts the next cycle and packs its Sync. Precondition: robot_side_hear got every earlier frame. */
void robot_side_begin(robot_side_t *self, uint64_t now_us, can_frame_t *frame);

/* Starts the cycle that another node's Sync names, for joints on separate nodes. False, without effect, for any other
 * frame and for a Sync with a wrong CRC. */
bool robot_side_follow(robot_side_t *self, const can_frame_t *sync, uint64_t now_us);

/* Packs TaskCommand of the current cycle. `acceleration`: reference of the end-effector, base frame, m/s^2, each
 * component within +-32.767. False, without a frame, for a value that the wire cannot carry. */
bool robot_side_task(const robot_side_t *self, robot_side_task_t task, const float acceleration[3], can_frame_t *frame);

/* Packs JointState of a joint, 0 to joints - 1, in the current cycle. A reading that the wire cannot carry (beyond
 * +-4.095875 rad, +-8.19175 rad/s, +-327.67 Nm, or not a number) is packed as NOT_AVAILABLE, never clamped. The guard
 * then ends the permission. False, without a frame, for another joint. */
bool robot_side_joint(const robot_side_t *self, uint32_t joint, const robot_side_reading_t *reading,
                      can_frame_t *frame);

/* Packs a GuardReset that names the last received trip, or 0 before the first. The guard needs an edge: `request`
 * false, then true in a later cycle, both after the trip. Send it only on a person's command (IEC 60204-1, ISO 14118).
 */
void robot_side_reset(robot_side_t *self, bool request, can_frame_t *frame);

/* Processes a received frame with its time of reception. Ignores frames other than StopCommand. */
void robot_side_hear(robot_side_t *self, const can_frame_t *frame, uint64_t now_us);

/* The verdict at `now_us`. Call it before each command to the drives, because a permission expires. */
robot_side_permit_t robot_side_permit(const robot_side_t *self, uint64_t now_us);

/* True if two guards answer, detected by two interleaved counters. Nothing is permitted then. */
bool robot_side_has_company(const robot_side_t *self);

#endif
