#include "explained.h"

#include "token.h"
#include "vec3.h"

enum { COLUMNS = SUBSPACE_MAX_COLUMNS };

void explained_init(explained_t *self) {
    *self = (explained_t){0};
}

/* --- the estimate ------------------------------------------------------------------------------------------------- */

/* Gauss-Seidel step for one column: w_c + (a . rest - s^2 w_c) / (a . a + s^2). Subtracts the change from the rest. */
NUM_STEP num_t descend(const num_t column[], num_t w, num_t soft, num_t rest[], uint32_t *ignored) {
    num_wide_t along = num_widen(NUM(0));
    num_wide_t square = num_widen(soft);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        along += num_wide(column[i], rest[i]);
        square += num_wide(column[i], column[i]);
    }
    const num_t change = num_div(num_narrow(along - num_wide(soft, w), ignored), num_narrow(square, ignored), ignored);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        rest[i] = num_narrow(num_widen(rest[i]) - num_wide(change, column[i]), ignored);
    }
    return num_add(w, change, ignored);
}

/* One sweep over the columns, from the coefficients of the last tick: the arm turns little in a tick. */
static void sweep(explained_t *self, const index_t *index, num_t soft, uint32_t *ignored) {
    num_t rest[ROBOT_JOINTS];
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        num_wide_t sum = num_widen(self->torque[i]);
        for (uint32_t c = 0; c < index->columns; ++c) {
            sum -= num_wide(self->coefficient[c], index->column[c][i]);
        }
        rest[i] = num_narrow(sum, ignored);
    }
    for (uint32_t c = 0; c < index->columns; ++c) {
        self->coefficient[c] = descend(index->column[c], self->coefficient[c], soft, rest, ignored);
    }
}

/* The explained torque of y still needs the observer's low-pass. That of r has passed it. */
static void track(explained_t *self, const subspace_config_t *config, const observer_t *observer,
                  const index_config_t *task, const index_t *index) {
    /* Ignored: a saturated coefficient is beyond every limit, and the others remain valid. */
    uint32_t ignored = 0;
    const bool same = self->task == task;
    const bool filtered = config->order == (uint32_t)ORDER_FILTER_FIRST;
    const num_t decay = (same && !filtered) ? observer->decay : NUM(0);
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        self->torque[i] = num_narrow(num_wide(decay, self->torque[i]) + num_widen(index->explained[i]), &ignored);
    }
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        self->coefficient[c] = (same && (c < index->columns)) ? self->coefficient[c] : NUM(0);
    }
    /* the regressor's columns are in Nm, like its tolerance */
    const bool in_nm = task->kind == (uint32_t)INDEX_REGRESSOR;
    const num_t softness = in_nm ? (config->softness * REGRESSOR_TOLERANCE) : config->softness;
    sweep(self, index, num_mul(softness, softness, &ignored), &ignored);
    self->task = task;
}

/* --- the limits --------------------------------------------------------------------------------------------------- */

/* Records the first excess only. NaN exceeds every limit. */
static void hold(explained_t *self, excess_t kind, num_t value, num_t limit) {
    if ((self->excess == EXPLAINED_NOTHING) && !(value <= limit)) {
        self->excess = kind;
        self->value = value;
        self->limit = limit;
    }
}

/* Above any limit: a saturated value is still an excess. */
#define HELD_N (EXPLAINED_FORCE_LIMIT * 1.125)

static num_t ignored(num_t value) {
    return num_min(num_max(value, -NUM(HELD_N)), NUM(HELD_N));
}

/* Euclidean length of up to three coefficients. Each is limited first, so that the squares fit. */
static num_t length(const num_t w[], uint32_t count) {
    num_wide_t square = num_widen(NUM(0));
    for (uint32_t i = 0; i < count; ++i) {
        const num_t part = num_mul(ignored(w[i]), NUM(0.5), &(uint32_t){0});
        square += num_wide(part, part);
    }
    return num_mul(num_root(square), NUM(2), &(uint32_t){0});
}

/* mass * acceleration + slack, up to EXPLAINED_FORCE_LIMIT. A saturated product is above that limit. */
static num_t force_limit(const explained_config_t *limits, num_t acceleration) {
    uint32_t beyond = 0;
    const num_t force = num_mul(limits->mass_max_kg, acceleration, &beyond);
    return num_min(num_add(force, limits->force_slack_n, &beyond), NUM(EXPLAINED_FORCE_LIMIT));
}

static void look_at_payload(explained_t *self, const explained_config_t *limits, const subspace_config_t *config,
                            const robot_t *robot, const acceleration_t *acceleration) {
    uint32_t *const sat = &self->saturations;
    const num_t weight_max = force_limit(limits, num_add(vec3_length(robot->gravity), acceleration->size, sat));
    const num_t weight = -self->coefficient[INDEX_FORCE_COLUMN];
    const bool soft = config->projector == (uint32_t)PROJECTOR_SOFT; /* the column is then `trust` * u_a */
    const num_t along = num_abs(self->coefficient[INDEX_FORCE_COLUMN + 1u]);
    const num_t sideways = soft ? num_mul(acceleration->trust, ignored(along), sat) : along;
    const num_t sideways_max = force_limit(limits, acceleration->across);
    const num_t load_max = weight_max - limits->force_slack_n;
    const num_t moment_max = num_min(num_add(num_mul(limits->arm_max_m, load_max, sat), limits->moment_slack_nm, sat),
                                     num_mul(NUM(EXPLAINED_FORCE_LIMIT), config->lever_m, sat));
    const num_t moment = num_mul(length(self->coefficient, INDEX_FORCE_COLUMN), config->lever_m, sat);
    hold(self, EXPLAINED_FORCE, weight, weight_max);
    hold(self, EXPLAINED_FORCE, -weight, limits->force_slack_n);
    hold(self, EXPLAINED_FORCE, sideways, sideways_max);
    hold(self, EXPLAINED_MOMENT, moment, moment_max);
}

static void look_at_contact(explained_t *self, const explained_config_t *limits, num_t lever,
                            const index_config_t *task) {
    num_t force[3];
    num_t moment[3];
    uint32_t component[INDEX_COMPONENTS];
    uint32_t forces = 0;
    uint32_t moments = 0;
    const uint32_t count = index_order(task, component);
    for (uint32_t c = 0; c < count; ++c) {
        if (component[c] < 3u) {
            force[forces] = self->coefficient[c];
            ++forces;
        } else {
            moment[moments] = self->coefficient[c];
            ++moments;
        }
    }
    hold(self, EXPLAINED_FORCE, length(force, forces), limits->force_max_n);
    hold(self, EXPLAINED_MOMENT, num_mul(length(moment, moments), lever, &self->saturations), limits->moment_max_nm);
}

/* Limits as forces and moments at rest. The inertia counts as a moment at 10 rad/s^2. */
static void look_at_regressor(explained_t *self, const explained_config_t *limits) {
    uint32_t *const sat = &self->saturations;
    const num_t *const w = self->coefficient;
    const num_t g = NUM(9.81);
    const num_t weight = num_mul(ignored(w[0]), NUM(REGRESSOR_MASS_KG * 9.81), &(uint32_t){0});
    const num_t weight_max = num_mul(limits->mass_max_kg, g, sat);
    const num_t moment = num_mul(length(&w[1], 3u), NUM(REGRESSOR_MOMENT * 9.81), &(uint32_t){0});
    const num_t moment_max = num_add(num_mul(limits->arm_max_m, weight_max, sat), limits->moment_slack_nm, sat);
    const num_t inertia = num_mul(ignored(num_abs(w[4])), NUM(REGRESSOR_INERTIA * 10.0), sat);
    hold(self, EXPLAINED_FORCE, weight, num_add(weight_max, limits->force_slack_n, sat));
    hold(self, EXPLAINED_FORCE, -weight, limits->force_slack_n);
    hold(self, EXPLAINED_MOMENT, moment, moment_max);
    hold(self, EXPLAINED_MOMENT, inertia, moment_max);
}

static void look_at_residual(explained_t *self, const explained_config_t *limits, uint32_t joints,
                             const observer_t *observer) {
    for (uint32_t i = 0; i < joints; ++i) {
        const num_t size = num_abs(observer->residual[i]);
        if ((self->excess == EXPLAINED_NOTHING) && !(size <= limits->residual_max_nm[i])) {
            hold(self, EXPLAINED_RESIDUAL, size, limits->residual_max_nm[i]);
            self->joint = i;
        }
    }
}

void explained_step(explained_t *self, const explained_config_t *limits, const subspace_config_t *config,
                    uint32_t debounce_ticks, const robot_t *robot, const observer_t *observer,
                    const acceleration_t *acceleration, const index_config_t *task, const index_t *index) {
    track(self, config, observer, task, index);
    self->token = token_next(index->token, TOKEN_EXPLAINED, 0u);
    self->excess = EXPLAINED_NOTHING;
    self->joint = 0;
    if (task->kind == (uint32_t)INDEX_PAYLOAD) {
        look_at_payload(self, limits, config, robot, acceleration);
    } else if (task->kind == (uint32_t)INDEX_REGRESSOR) {
        look_at_regressor(self, limits);
    } else if (task->kind == (uint32_t)INDEX_CONTACT) {
        look_at_contact(self, limits, config->lever_m, task);
    } else {
        /* INDEX_RESIDUAL: nothing is explained */
    }
    look_at_residual(self, limits, robot->joint_count, observer);
    if (self->excess == EXPLAINED_NOTHING) {
        self->above = 0;
    } else {
        self->above += (self->above < UINT32_MAX) ? 1u : 0u;
    }
    self->tripped = (self->excess != EXPLAINED_NOTHING) && (self->above >= debounce_ticks);
}
