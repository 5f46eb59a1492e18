/* firmware/core/explained.c: any limits that config_check accepts, any columns of at most 64, as index.c leaves them
 * (proof_index.c). Each part is shown alone; explained_step calls stubs that assert what a part requires. */
#include "num_sums.h"

#include "config_bounds.h"
#include "explained.c"

/* Any order in which each component comes once; the forces are 0 to 2: proof_index_order. */
uint32_t index_order(const index_config_t *task, uint32_t component[INDEX_COMPONENTS]) {
    uint32_t count, forces = 0, moments = 0;
    HOLDS(__CPROVER_r_ok(task, sizeof(*task)), "the row is there");
    ASSUME(count <= INDEX_COMPONENTS);
    for (uint32_t c = 0; c < INDEX_COMPONENTS; ++c) {
        uint32_t any;
        ASSUME(any < INDEX_COMPONENTS);
        component[c] = any;
        forces += ((c < count) && (any < 3u)) ? 1u : 0u;
        moments += ((c < count) && (any >= 3u)) ? 1u : 0u;
    }
    ASSUME((forces <= 3u) && (moments <= 3u));
    return count;
}

static bool is_number(num_t a) {
    return a >= -INT32_MAX;
}

static bool are_numbers(const num_t a[], uint32_t count) {
    bool all = true;
    for (uint32_t i = 0; i < count; ++i) {
        all = all && is_number(a[i]);
    }
    return all;
}

static bool are_factors(const num_t a[]) {
    bool all = true;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        all = all && sum_is_factor(a[i]);
    }
    return all;
}

static explained_t explained;
static explained_config_t limits;
static subspace_config_t config;
static index_config_t task;
static index_t index;
static observer_t observer;
static acceleration_t acceleration;
static robot_t robot;

static void any_input(void) {
    __CPROVER_havoc_object(&explained);
    __CPROVER_havoc_object(&limits);
    __CPROVER_havoc_object(&config);
    __CPROVER_havoc_object(&task);
    __CPROVER_havoc_object(&index);
    __CPROVER_havoc_object(&observer);
    __CPROVER_havoc_object(&acceleration);
    __CPROVER_havoc_object(&robot);
    ASSUME((robot.joint_count >= 1u) && (robot.joint_count <= ROBOT_MAX_JOINTS));
    ASSUME((config.softness > 0) && (config.softness <= NUM(0.2))); /* config_bounds.c */
    ASSUME((limits.mass_max_kg > 0) && (limits.force_slack_n > 0)); /* config_tasks.c */
    ASSUME((acceleration.size >= 0) && (acceleration.across >= 0)); /* proof_acceleration */
    ASSUME(sum_is_factor(observer.decay));                          /* proof_observer */
    ASSUME(index.columns <= SUBSPACE_MAX_COLUMNS);
    ASSUME(are_numbers(explained.coefficient, SUBSPACE_MAX_COLUMNS));
    for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
        ASSUME(are_factors(index.column[c]));
    }
}

void proof_explained_descend(void) {
    num_t column[ROBOT_MAX_JOINTS], rest[ROBOT_MAX_JOINTS], w, soft;
    uint32_t ignored_count;
    ASSUME(are_factors(column) && sum_is_factor(soft));
    HOLDS(is_number(descend(column, w, soft, rest, &ignored_count)), "the coefficient is a number");
    REACHED;
}

num_t stub_descend(const num_t column[], num_t w, num_t soft, num_t rest[], uint32_t *ignored_count) {
    num_t result;
    (void)w;
    *ignored_count += 0u;
    HOLDS(__CPROVER_r_ok(column, ROBOT_MAX_JOINTS * sizeof(num_t)) && are_factors(column), "a column of at most 64");
    HOLDS(__CPROVER_w_ok(rest, ROBOT_JOINTS * sizeof(num_t)), "the rest is there");
    HOLDS(sum_is_factor(soft), "the square of the softness is at most 64");
    ASSUME(is_number(result));
    return result;
}

void proof_explained_sweep(void) {
    num_t soft;
    uint32_t ignored_count;
    any_input();
    ASSUME(sum_is_factor(soft));
    sweep(&explained, &index, soft, &ignored_count);
    HOLDS(are_numbers(explained.coefficient, SUBSPACE_MAX_COLUMNS), "the coefficients are numbers");
    REACHED;
}

void stub_sweep(explained_t *self, const index_t *of, num_t soft, uint32_t *ignored_count) {
    *ignored_count += 0u;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && (of->columns <= SUBSPACE_MAX_COLUMNS), "the index is there");
    HOLDS(are_numbers(self->coefficient, SUBSPACE_MAX_COLUMNS), "the coefficients are numbers");
    HOLDS(sum_is_factor(soft), "the square of the softness is at most 64");
    __CPROVER_havoc_slice(self->coefficient, sizeof(self->coefficient));
    ASSUME(are_numbers(self->coefficient, SUBSPACE_MAX_COLUMNS));
}

/* The parts of a force or moment, each held within 450 and halved, have squares whose sum fits. */
void proof_explained_length(void) {
    num_t w[3];
    uint32_t count;
    ASSUME(count <= 3u);
    HOLDS(length(w, count) >= 0, "a length is not negative");
    REACHED;
}

num_t stub_length(const num_t w[], uint32_t count) {
    num_t result;
    HOLDS(count <= 3u, "no more than three parts");
    HOLDS(__CPROVER_r_ok(w, count * sizeof(*w)), "the parts are there");
    ASSUME(result >= 0);
    return result;
}

/* vec3_length: proof_vec3. */
num_t stub_size(vec3_t v) {
    num_t result;
    (void)v;
    ASSUME(result >= 0);
    return result;
}

static void step_with(uint32_t kind) {
    uint32_t debounce_ticks;
    any_input();
    task.kind = kind;
    explained_step(&explained, &limits, &config, debounce_ticks, &robot, &observer, &acceleration, &task, &index);
    HOLDS(explained.joint < robot.joint_count, "the reported joint is one of the arm's");
    HOLDS(explained.tripped == ((explained.excess != EXPLAINED_NOTHING) && (explained.above >= debounce_ticks)),
          "a trip has its excess and its debounce");
    HOLDS((explained.excess >= EXPLAINED_NOTHING) && (explained.excess <= EXPLAINED_RESIDUAL), "a known excess");
    HOLDS(are_numbers(explained.coefficient, SUBSPACE_MAX_COLUMNS), "the coefficients are numbers");
}

void proof_explained_payload(void) {
    step_with((uint32_t)INDEX_PAYLOAD);
    REACHED;
}

void proof_explained_contact(void) {
    step_with((uint32_t)INDEX_CONTACT);
    REACHED;
}

void proof_explained_regressor(void) {
    step_with((uint32_t)INDEX_REGRESSOR);
    REACHED;
}

/* Without a valid task, the limits of the row are any numbers. */
void proof_explained_nothing(void) {
    uint32_t debounce_ticks;
    any_input();
    __CPROVER_havoc_object(&limits);
    ASSUME((task.kind == (uint32_t)INDEX_OFF) || (task.kind == (uint32_t)INDEX_RESIDUAL));
    explained_step(&explained, &limits, &config, debounce_ticks, &robot, &observer, &acceleration, &task, &index);
    HOLDS((explained.excess == EXPLAINED_NOTHING) || (explained.excess == EXPLAINED_RESIDUAL), "only the residual");
    explained_init(&explained);
    HOLDS(are_numbers(explained.coefficient, SUBSPACE_MAX_COLUMNS), "the coefficients are numbers");
    REACHED;
}
