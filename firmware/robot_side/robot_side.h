/* robot_side: the other end of the wire, for a robot's controller. It packs the frames for the guard and decides from
 * StopCommand whether motion is permitted (rules: docs/robot-side.md). It depends on firmware/wire only and has no
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
 *     whenever the drives are commanded:
 *                    permit = robot_side_permit(&robot, clock_us());
 *                    if (!permit.allowed) stop by category permit.category;
 *
 * Times are microseconds of one monotonic clock. One robot_side_t is used by one thread; the joints of a robot may sit
 * on nodes of their own, each with its own robot_side_t that follows the cycle by robot_side_follow.
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
    ROBOT_SIDE_TASK_4 = 4, /* from here on rows of the installation's own */
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
    uint32_t answer_us; /* after Sync, until which an answer permits: at most half a period */
    uint32_t hold_us;   /* after Sync, for which a permission lasts: at most a period and answer_us */
} robot_side_config_t;

typedef struct {
    robot_side_sensor_t status;
    float position_rad;
    float velocity_rad_s;
    float torque_nm;
} robot_side_reading_t;

/* The verdict at one time. */
typedef struct {
    bool allowed;
    uint8_t category; /* IEC 60204-1, of the stop to perform; 1 on silence */
    uint8_t reason;   /* StopCommand.Reason, 0 if no valid frame decided */
    uint8_t joint;    /* 1 to n of the trip, 0 none */
    uint8_t trip;     /* to be named in a GuardReset */
} robot_side_permit_t;

typedef struct {
    robot_side_config_t config;
    uint16_t cycle;    /* under way */
    bool begun;        /* a cycle is */
    uint64_t begun_us; /* when its Sync was packed */
    bool answered;     /* a good answer to it permits */
    bool stopped;      /* a stop was heard in it; stays for the cycle */
    robot_side_permit_t stop, answer;
    uint8_t last_trip; /* that a StopCommand named */
    uint32_t sequence; /* the last 24 StopCommands, bit 0 the newest: refused by their counter */
    e2e_receiver_t receiver;
    e2e_transmitter_t reset;
} robot_side_t;

/* False, and nothing is ever permitted, for a configuration outside the ranges above. */
bool robot_side_init(robot_side_t *self, const robot_side_config_t *config);

/* Begins the next cycle and packs its Sync. Precondition: robot_side_hear has got every frame received before. */
void robot_side_begin(robot_side_t *self, uint64_t now_us, can_frame_t *frame);

/* Begins the cycle that the Sync of another node names; for joints on nodes of their own. False, and nothing changes,
 * for any other frame and for a Sync that fails its CRC. */
bool robot_side_follow(robot_side_t *self, const can_frame_t *sync, uint64_t now_us);

/* TaskCommand of the cycle under way. `acceleration`: of the end-effector's reference, base frame, m/s^2, each within
 * +-32.767. False, and no frame, for a value that the wire cannot carry. */
bool robot_side_task(const robot_side_t *self, robot_side_task_t task, const float acceleration[3], can_frame_t *frame);

/* JointState of joint 0 to joints - 1 in the cycle under way. A reading that the wire cannot carry (+-4.095875 rad,
 * +-8.19175 rad/s, +-327.67 Nm, or not a number) is packed as NOT_AVAILABLE, which ends the permission: never clamped.
 * False, and no frame, for another joint. */
bool robot_side_joint(const robot_side_t *self, uint32_t joint, const robot_side_reading_t *reading,
                      can_frame_t *frame);

/* GuardReset, which names the last trip that was heard, or 0 before the first. The guard wants an edge: `request`
 * false, then true in a later cycle, both after the trip. Only on a person's command (IEC 60204-1, ISO 14118). */
void robot_side_reset(robot_side_t *self, bool request, can_frame_t *frame);

/* Any received frame and its time of reception. Frames other than StopCommand are ignored. */
void robot_side_hear(robot_side_t *self, const can_frame_t *frame, uint64_t now_us);

/* The verdict at `now_us`. Call it each time the drives are commanded: a permission expires. */
robot_side_permit_t robot_side_permit(const robot_side_t *self, uint64_t now_us);

/* True if two guards answer, seen by two interleaved counters. Nothing is permitted then. */
bool robot_side_has_company(const robot_side_t *self);

#endif
