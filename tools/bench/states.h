/* states: random states of the arm for the instruction counts, including states at which the Jacobian loses rank.
 *
 * A third of the states are purely random. In the others each joint is, with probability one half, at a multiple of a
 * quarter turn: arms with aligned or folded axes, of rank 3 to 6. Half of those deviate by up to 1e-4 or 1e-2 rad: near
 * the singularity but not in it. Velocities reach the table's limit, and every eighth state is at rest. The desired
 * acceleration is random up to 8 m/s^2, or zero, or parallel to gravity. Every second state is the previous one a cycle
 * later, as in motion; the others are new random states.
 */
#ifndef TAUPERP_BENCH_STATES_H
#define TAUPERP_BENCH_STATES_H

#include "config.h"
#include "random.h"

typedef struct {
    num_t position[ROBOT_MAX_JOINTS];
    num_t velocity[ROBOT_MAX_JOINTS];
    num_t torque[ROBOT_MAX_JOINTS];
    vec3_t acceleration;
} bench_state_t;

void states_jump(bench_state_t *self, const guard_config_t *config, random_t *random);

/* Advances by one period; joints that would leave their range reverse. */
void states_advance(bench_state_t *self, const guard_config_t *config, random_t *random);

/* State number `index` from the previous one: a jump for an even number. True for a jump. */
bool states_next(bench_state_t *self, const guard_config_t *config, random_t *random, uint32_t index);

#endif
