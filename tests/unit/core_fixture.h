/* core_fixture: common parts of the core's tests: conversion between num_t and double, random numbers, and arms that
 * are simple enough for a closed form. */
#ifndef CORE_FIXTURE_H
#define CORE_FIXTURE_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "robot.h"
#include "unity.h"

#ifdef TAUPERP_FIXED
#define IF_FIXED(fixed, floating) (fixed)
static inline num_t num_of(double x) {
    return (num_t)lrint(x * 4194304.0);
}
static inline double value_of(num_t x) {
    return (double)x / 4194304.0;
}
#else
#define IF_FIXED(fixed, floating) (floating)
static inline num_t num_of(double x) {
    return (num_t)x;
}
static inline double value_of(num_t x) {
    return (double)x;
}
#endif

/* The number of random numbers of a test. An emulated processor with software floating point is a thousand times slower
 * than the host. Its images use SPARSER: they test the processor, not the density. */
#ifndef SPARSER
#define SPARSER 1
#endif
#define DRAWS(n) ((n) / SPARSER)

#define ASSERT_CLOSE(expected, actual, tolerance) assert_close((expected), (actual), (tolerance), __LINE__)

/* False for NaN on either side. */
static inline void assert_close(double expected, double actual, double tolerance, int line) {
    if (!(fabs(expected - actual) <= tolerance)) {
        char text[120];
        snprintf(text, sizeof(text), "line %d: expected %.9g within %.2g, got %.9g", line, expected, tolerance, actual);
        TEST_FAIL_MESSAGE(text);
    }
}

static uint64_t random_state;

static inline void random_start(uint64_t seed) {
    random_state = seed;
    printf("seed %llu\n", (unsigned long long)seed);
}

/* -1 to 1. Knuth's linear congruence, upper bits. */
static inline double random_one(void) {
    random_state = random_state * 6364136223846793005ULL + 1442695040888963407ULL;
    return (double)(random_state >> 11) / 4503599627370496.0 - 1.0;
}

static inline double random_in(double low, double high) {
    return low + (high - low) * 0.5 * (random_one() + 1.0);
}

/* A pendulum, and two links in series, in the vertical x-z plane: axes along -y, stretched along x at q = 0. Link i:
 * mass kg at com m along the link, inertia kg m^2 about its centre of mass, length m. */
typedef struct {
    double mass[2], com[2], inertia[2], length[2];
} links_t;

static const links_t two_links = {
    .mass = {3.0, 1.5}, .com = {0.2, 0.3}, .inertia = {0.05, 0.03}, .length = {0.45, 0.5}};

static inline robot_t planar_arm(const links_t *links, uint32_t joints) {
    robot_t robot;
    memset(&robot, 0, sizeof(robot));
    memcpy(robot.name, "planar", 6);
    robot.joint_count = joints;
    robot.base[0][0] = NUM(1);
    robot.base[1][2] = NUM(-1);
    robot.base[2][1] = NUM(1);
    robot.gravity.z = NUM(-9.81);
    robot.tip.x = num_of(links->length[joints - 1u]);
    for (uint32_t i = 0; i < joints; ++i) {
        robot_joint_t *const joint = &robot.joint[i];
        const double beyond = (i + 1u < joints) ? links->mass[i + 1u] : 0.0; /* at this link's end */
        const double length = links->length[i];
        joint->offset.x = (i > 0u) ? num_of(links->length[i - 1u]) : NUM(0);
        joint->cos_twist = NUM(1);
        joint->moment_x = num_of(links->mass[i] * links->com[i] + beyond * length);
        joint->inertia_zz =
            num_of(links->inertia[i] + links->mass[i] * links->com[i] * links->com[i] + beyond * length * length);
        joint->position_min_rad = NUM(-3);
        joint->position_max_rad = NUM(3);
        joint->velocity_max_rad_s = NUM(5);
        joint->torque_max_nm = NUM(100);
    }
    return robot;
}

#endif
