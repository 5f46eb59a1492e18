#include "acceleration.h"

#include "token.h"
#include "vec3.h"

void acceleration_init(acceleration_t *self) {
    *self = (acceleration_t){0};
}

static num_t along_row(const motion_t *motion, uint32_t row, uint32_t joints, const num_t velocity[],
                       uint32_t *saturations) {
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t i = 0; i < joints; ++i) {
        sum += num_wide(motion->jacobian[row][i], velocity[i]);
    }
    return num_narrow(sum, saturations);
}

/* Returns decay * x + gain * u. */
static num_t passed(num_t decay, num_t x, num_t gain, num_t u, uint32_t *saturations) {
    return num_narrow(num_wide(decay, x) + num_wide(gain, u), saturations);
}

static void filter(acceleration_t *self, num_t decay, num_t gain, num_t momentum_gain, vec3_t velocity,
                   vec3_t commanded) {
    uint32_t *const sat = &self->saturations;
    const vec3_t change = vec3_subtract(velocity, self->velocity, sat);
    self->measured = (vec3_t){.x = passed(decay, self->measured.x, momentum_gain, change.x, sat),
                              .y = passed(decay, self->measured.y, momentum_gain, change.y, sat),
                              .z = passed(decay, self->measured.z, momentum_gain, change.z, sat)};
    self->commanded = (vec3_t){.x = passed(decay, self->commanded.x, gain, commanded.x, sat),
                               .y = passed(decay, self->commanded.y, gain, commanded.y, sat),
                               .z = passed(decay, self->commanded.z, gain, commanded.z, sat)};
}

static num_t share_of(num_t part, num_t whole, uint32_t *saturations) {
    return num_max(num_min(num_div(part, whole, saturations), NUM(1)), NUM(0));
}

static num_t trust_of(const acceleration_config_t *config, num_t force, num_t error, uint32_t *saturations) {
    const num_t large =
        share_of(num_subtract(force, config->force_floor_n, saturations), config->force_floor_n, saturations);
    const num_t close =
        share_of(num_subtract(config->error_max, error, saturations), config->error_max / 4, saturations);
    return num_min(large, close);
}

void acceleration_step(acceleration_t *self, const acceleration_config_t *config, const observer_config_t *gains,
                       const observer_t *observer, const robot_t *robot, const motion_t *motion, const num_t velocity[],
                       vec3_t commanded, num_t mass_max_kg) {
    uint32_t *const sat = &self->saturations;
    uint32_t ignored = 0; /* a saturated force is large enough */
    const uint32_t joints = robot->joint_count;
    const vec3_t tip = {.x = along_row(motion, 0, joints, velocity, sat),
                        .y = along_row(motion, 1, joints, velocity, sat),
                        .z = along_row(motion, 2, joints, velocity, sat)};
    if ((observer->gap < 1u) || (observer->gap > OBSERVER_MAX_GAP)) {
        self->measured = (vec3_t){NUM(0), NUM(0), NUM(0)};
        self->commanded = (vec3_t){NUM(0), NUM(0), NUM(0)};
    } else {
        const uint32_t g = observer->gap - 1u;
        filter(self, gains->decay[g], gains->gain[g], gains->momentum_gain[g], tip, commanded);
    }
    self->velocity = tip;

    const vec3_t across = vec3_across(commanded, vec3_unit(robot->gravity, sat), sat);
    const num_t size = vec3_length(across);
    const num_t error = vec3_length(vec3_subtract(self->commanded, self->measured, sat));
    const bool matters = num_wide(mass_max_kg, size) >= num_widen(config->force_floor_n);
    const bool agrees = error <= config->error_max;
    const bool used = matters && agrees;
    self->trust = used ? trust_of(config, num_narrow(num_wide(mass_max_kg, size), &ignored), error, &ignored) : NUM(0);
    self->size = agrees ? vec3_length(commanded) : NUM(0);
    self->across = used ? size : NUM(0);
    self->token = token_next(observer->token, TOKEN_ACCELERATION, 0u);
    self->sideways = used ? vec3_unit(across, sat) : (vec3_t){NUM(0), NUM(0), NUM(0)};
}
