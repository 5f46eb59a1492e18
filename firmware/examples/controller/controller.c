/* controller: a robot's controller on SocketCAN, with firmware/robot_side. It holds an arm still and prints what the
 * guard permits. A real controller reads its joints instead of constants and commands its drives.
 *
 *     build/controller vcan0 classic|fd PERIOD_US CYCLES POSITION,TORQUE...       rad and Nm, one pair per joint
 *
 * For a guard in lockstep: the next cycle starts when the last one is answered, at the latest after half of PERIOD_US.
 * The first permission, and each permission after a stop, needs a GuardReset. Here the program sends it; in a cell a
 * person does.
 */
#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "robot_side.h"

enum { FIRST_JOINT = 5, RESET_HALF = 8 }; /* cycles of Request 0, then of 1 */

static robot_side_t robot;

static uint64_t clock_us(void) {
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return ((uint64_t)now.tv_sec * 1000000u) + ((uint64_t)now.tv_nsec / 1000u);
}

static int open_bus(const char *channel) {
    const int bus = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK, CAN_RAW);
    const struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(channel)};
    const int on = 1;
    const bool good = (bus >= 0) && (address.can_ifindex != 0) &&
                      (setsockopt(bus, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) == 0) &&
                      (bind(bus, (const struct sockaddr *)&address, sizeof address) == 0);
    return good ? bus : -1;
}

static void transmit(int bus, const can_frame_t *frame) {
    const bool fd = (frame->flags & (uint8_t)CAN_FRAME_FD) != 0u;
    struct canfd_frame raw = {.can_id = frame->id, .len = frame->length, .flags = fd ? CANFD_BRS : 0};
    (void)memcpy(raw.data, frame->data, sizeof frame->data);
    (void)!write(bus, &raw,
                 fd ? CANFD_MTU : CAN_MTU); /* a frame that is not sent is missing at the guard, which then stops */
}

/* Processes every frame that has arrived. */
static void hear(int bus) {
    struct canfd_frame raw;
    while (read(bus, &raw, sizeof raw) > 0) {
        if ((raw.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) == 0u) {
            can_frame_t frame = {.id = raw.can_id, .length = raw.len};
            (void)memcpy(frame.data, raw.data, sizeof frame.data);
            robot_side_hear(&robot, &frame, clock_us());
        }
    }
}

static void send_cycle(int bus, char **pairs, uint32_t joints) {
    static const float still[3] = {0.0f, 0.0f, 0.0f};
    can_frame_t frame;
    hear(bus); /* frames that arrived before this cycle answer an earlier one */
    robot_side_begin(&robot, clock_us(), &frame);
    transmit(bus, &frame);
    if (robot_side_task(&robot, ROBOT_SIDE_TASK_NONE, still, &frame)) {
        transmit(bus, &frame);
    }
    for (uint32_t joint = 0; joint < joints; ++joint) {
        char *comma = NULL;
        robot_side_reading_t reading = {.status = ROBOT_SIDE_SENSOR_OK};
        reading.position_rad = strtof(pairs[joint], &comma);
        reading.torque_nm = strtof(comma + 1, NULL);
        if (robot_side_joint(&robot, joint, &reading, &frame)) {
            transmit(bus, &frame);
        }
    }
}

/* Processes frames until the cycle is answered or its time has passed. */
static robot_side_permit_t await_answer(int bus) {
    const uint64_t end_us = robot.begun_us + robot.config.answer_us;
    for (uint64_t now_us = clock_us(); !robot.answered && !robot.stopped && (now_us < end_us); now_us = clock_us()) {
        struct pollfd in = {.fd = bus, .events = POLLIN};
        (void)poll(&in, 1, (int)((end_us - now_us) / 1000u) + 1);
        hear(bus);
    }
    return robot_side_permit(&robot, clock_us());
}

static void print_change(uint32_t cycle, robot_side_permit_t now) {
    static robot_side_permit_t before = {.category = UINT8_MAX};
    if ((now.allowed != before.allowed) || (now.reason != before.reason) || (cycle == 0u)) {
        (void)printf("cycle %u: %s, category %u, reason %u, joint %u, trip %u\n", cycle, now.allowed ? "move" : "stop",
                     now.category, now.reason, now.joint, now.trip);
        (void)fflush(stdout);
    }
    before = now;
}

int main(int argc, char **argv) {
    if (argc <= FIRST_JOINT) {
        (void)fputs("usage: controller CHANNEL classic|fd PERIOD_US CYCLES POSITION,TORQUE...\n", stderr);
        return 2;
    }
    const uint32_t joints = (uint32_t)(argc - FIRST_JOINT);
    const uint32_t period_us = (uint32_t)strtoul(argv[3], NULL, 10);
    const uint32_t cycles = (uint32_t)strtoul(argv[4], NULL, 10);
    const robot_side_config_t config = {.joints = joints,
                                        .fd = strcmp(argv[2], "fd") == 0,
                                        .answer_us = period_us / 2u,
                                        .hold_us = period_us + (period_us / 2u)};
    const int bus = open_bus(argv[1]);
    if ((bus < 0) || !robot_side_init(&robot, &config)) {
        (void)fprintf(stderr, "controller: %s\n", (bus < 0) ? "no such CAN interface" : "settings out of range");
        return 2;
    }
    for (uint32_t cycle = 0; cycle < cycles; ++cycle) {
        send_cycle(bus, &argv[FIRST_JOINT], joints);
        const robot_side_permit_t permit = await_answer(bus);
        print_change(cycle, permit);
        if (!permit.allowed) {
            can_frame_t frame;
            robot_side_reset(&robot, ((cycle / RESET_HALF) % 2u) != 0u, &frame);
            transmit(bus, &frame);
        }
    }
    (void)close(bus);
    return 0;
}
