#include "explained.h"

#include "token.h"
#include "vec3.h"

enum { COLUMNS = SUBSPACE_MAX_COLUMNS };

void explained_init(explained_t *self) {
    *self = (explained_t){0};
}

/* --- the estimate ------------------------------------------------------------------------------------------------- */

/* A^T A + s^2 I = L D L^T, worked out in place: the lower triangle becomes L, the diagonal D. */
typedef struct {
    num_t entry[COLUMNS][COLUMNS];
} normal_t;

static num_t dot(const num_t a[], const num_t b[], uint32_t *saturations) {
    num_wide_t sum = num_widen(NUM(0));
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        sum += num_wide(a[i], b[i]);
    }
    return num_narrow(sum, saturations);
}

static void fill(normal_t *normal, const index_t *index, num_t softness, uint32_t *saturations) {
    for (uint32_t row = 0; row < index->columns; ++row) {
        for (uint32_t c = 0; c <= row; ++c) {
            normal->entry[row][c] = dot(index->column[row], index->column[c], saturations);
        }
        normal->entry[row][row] =
            num_add(normal->entry[row][row], num_mul(softness, softness, saturations), saturations);
    }
}

/* Each pivot is at least s^2 but for rounding; held there, so that nothing is divided by zero. */
static void factor(normal_t *normal, uint32_t columns, num_t least, uint32_t *saturations) {
    for (uint32_t c = 0; c < columns; ++c) {
        num_t scaled[COLUMNS];
        num_t pivot = normal->entry[c][c];
        for (uint32_t k = 0; k < c; ++k) {
            scaled[k] = num_mul(normal->entry[c][k], normal->entry[k][k], saturations);
            pivot = num_subtract(pivot, num_mul(scaled[k], normal->entry[c][k], saturations), saturations);
        }
        pivot = num_max(pivot, least);
        normal->entry[c][c] = pivot;
        for (uint32_t row = c + 1u; row < columns; ++row) {
            num_t sum = normal->entry[row][c];
            for (uint32_t k = 0; k < c; ++k) {
                sum = num_subtract(sum, num_mul(normal->entry[row][k], scaled[k], saturations), saturations);
            }
            normal->entry[row][c] = num_div(sum, pivot, saturations);
        }
    }
}

static void solve(const normal_t *normal, uint32_t columns, num_t x[], uint32_t *saturations) {
    for (uint32_t row = 0; row < columns; ++row) {
        for (uint32_t c = 0; c < row; ++c) {
            x[row] = num_subtract(x[row], num_mul(normal->entry[row][c], x[c], saturations), saturations);
        }
    }
    for (uint32_t up = columns; up > 0u; --up) {
        const uint32_t row = up - 1u;
        x[row] = num_div(x[row], normal->entry[row][row], saturations);
        for (uint32_t below = up; below < columns; ++below) {
            x[row] = num_subtract(x[row], num_mul(normal->entry[below][row], x[below], saturations), saturations);
        }
    }
}

static void estimate(const index_t *index, num_t softness, num_t x[], uint32_t *saturations) {
    normal_t normal;
    for (uint32_t c = 0; c < index->columns; ++c) {
        x[c] = dot(index->column[c], index->explained, saturations);
    }
    fill(&normal, index, softness, saturations);
    factor(&normal, index->columns, num_mul(softness, softness, saturations), saturations);
    solve(&normal, index->columns, x, saturations);
}

/* Of y the coefficients need the observer's low-pass; r has had it. */
static void track(explained_t *self, const subspace_config_t *config, const observer_t *observer,
                  const index_config_t *task, const index_t *index) {
    const bool same = (self->task.kind == task->kind) && (self->task.components == task->components);
    const bool filtered = (config->order == (uint32_t)ORDER_FILTER_FIRST);
    const num_t decay = (same && !filtered) ? observer->decay : NUM(0);
    num_t x[COLUMNS] = {NUM(0)};
    uint32_t held = 0; /* a coefficient at the end of its range is beyond every limit: no reason to distrust the rest */
    estimate(index, config->softness, x, &held);
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        self->coefficient[c] = num_narrow(num_wide(decay, self->coefficient[c]) + num_widen(x[c]), &held);
    }
    self->task = *task;
}

/* --- the limits --------------------------------------------------------------------------------------------------- */

/* Keeps the first excess. NaN exceeds every limit. */
static void hold(explained_t *self, excess_t kind, num_t value, num_t limit) {
    if ((self->excess == EXPLAINED_NOTHING) && !(value <= limit)) {
        self->excess = kind;
        self->value = value;
        self->limit = limit;
    }
}

static num_t held(num_t value) {
    return num_min(num_max(value, -NUM(EXPLAINED_FORCE_LIMIT)), NUM(EXPLAINED_FORCE_LIMIT));
}

/* Length of up to three coefficients; each is held at EXPLAINED_FORCE_LIMIT, beyond any limit, so that the squares fit.
 */
static num_t length(const num_t w[], uint32_t count) {
    num_wide_t square = num_widen(NUM(0));
    for (uint32_t i = 0; i < count; ++i) {
        const num_t part = num_mul(held(w[i]), NUM(0.5), &(uint32_t){0});
        square += num_wide(part, part);
    }
    return num_mul(num_root(square), NUM(2), &(uint32_t){0});
}

static void look_at_payload(explained_t *self, const explained_config_t *limits, num_t lever, const robot_t *robot,
                            const acceleration_t *acceleration) {
    uint32_t *const sat = &self->saturations;
    const num_t g = vec3_length(robot->gravity);
    const num_t weight_max = num_mul(limits->mass_max_kg, num_add(g, acceleration->size, sat), sat);
    const num_t weight = -self->coefficient[INDEX_FORCE_COLUMN];
    const num_t sideways = num_abs(self->coefficient[INDEX_FORCE_COLUMN + 1u]);
    const num_t sideways_max = num_mul(limits->mass_max_kg, acceleration->across, sat);
    const num_t moment_max = num_add(num_mul(limits->arm_max_m, weight_max, sat), limits->moment_slack_nm, sat);
    const num_t moment = num_mul(length(self->coefficient, INDEX_FORCE_COLUMN), lever, sat);
    hold(self, EXPLAINED_FORCE, weight, num_add(weight_max, limits->force_slack_n, sat));
    hold(self, EXPLAINED_FORCE, -weight, limits->force_slack_n);
    hold(self, EXPLAINED_FORCE, sideways, num_add(sideways_max, limits->force_slack_n, sat));
    hold(self, EXPLAINED_MOMENT, moment, moment_max);
}

static void look_at_contact(explained_t *self, const explained_config_t *limits, num_t lever, uint32_t components) {
    num_t force[3];
    num_t moment[3];
    uint32_t forces = 0;
    uint32_t moments = 0;
    uint32_t column = 0;
    for (uint32_t component = 0; component < INDEX_COMPONENTS; ++component) {
        if ((components & (1u << component)) != 0u) {
            if (component < 3u) {
                force[forces] = self->coefficient[column];
                ++forces;
            } else {
                moment[moments] = self->coefficient[column];
                ++moments;
            }
            ++column;
        }
    }
    hold(self, EXPLAINED_FORCE, length(force, forces), limits->force_max_n);
    hold(self, EXPLAINED_MOMENT, num_mul(length(moment, moments), lever, &self->saturations), limits->moment_max_nm);
}

static void look_at_residual(explained_t *self, const explained_config_t *limits, uint32_t joints,
                             const observer_t *observer) {
    for (uint32_t i = 0; i < joints; ++i) {
        const bool before = self->excess != EXPLAINED_NOTHING;
        hold(self, EXPLAINED_RESIDUAL, num_abs(observer->residual[i]), limits->residual_max_nm[i]);
        if (!before && (self->excess != EXPLAINED_NOTHING)) {
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
        look_at_payload(self, limits, config->lever_m, robot, acceleration);
    } else if (task->kind == (uint32_t)INDEX_CONTACT) {
        look_at_contact(self, limits, config->lever_m, task->components);
    } else {
        /* nothing is explained */
    }
    look_at_residual(self, limits, robot->joint_count, observer);
    if (self->excess == EXPLAINED_NOTHING) {
        self->above = 0;
    } else {
        self->above += (self->above < UINT32_MAX) ? 1u : 0u;
    }
    self->tripped = (self->excess != EXPLAINED_NOTHING) && (self->above >= debounce_ticks);
}
