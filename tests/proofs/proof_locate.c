/* firmware/core/locate.c: any residual, any motion, any columns of a task. Each function is shown alone; the next one
 * up calls stubs (proofs.toml). lever.c: proof_sight.c. soft.c: proof_soft.c. */
#include "num_sizes.h"
#include "stub_object.h"

/* Each product of a sum has a factor up to 64: a column, or a change over its largest entry. */
static inline num_wide_t stub_moderate(num_t a, num_t b) {
    HOLDS(num_abs(a) <= NUM(64), "a factor up to 64");
    (void)b;
    return stub_product(59u);
}

#undef num_wide
#define num_wide(a, b) stub_moderate((a), (b))
#define num_widen(a)   ((void)(a), stub_product(53u))

#include "locate.c"

enum { SLOTS = ROBOT_MAX_JOINTS + SUBSPACE_MAX_COLUMNS };

static locate_t locate;
static lever_config_t shape;
static motion_t motion;
static observer_t observer;
static index_t task;
static explained_t explained;
static num_t column[COLUMNS][ROBOT_MAX_JOINTS], vector[ROBOT_MAX_JOINTS], size;
static uint32_t joints, saturations;

/* What locate_init makes and each call keeps. */
static bool is_sound(const locate_t *self) {
    return (self->next < (uint32_t)SLOTS) && (self->sigma >= NUM(LOCATE_NOISE_NM));
}

static void any_search(void) {
    __CPROVER_havoc_object(&locate);
    __CPROVER_havoc_object(&shape);
    __CPROVER_havoc_object(&motion);
    __CPROVER_havoc_object(&observer);
    __CPROVER_havoc_object(&task);
    __CPROVER_havoc_object(&explained);
    __CPROVER_havoc_object(column);
    __CPROVER_havoc_object(vector);
    __CPROVER_havoc_object(&size);
    __CPROVER_havoc_object(&joints);
    __CPROVER_havoc_object(&saturations);
    ASSUME((joints >= 1u) && (joints <= ROBOT_JOINTS) && (task.columns <= SUBSPACE_MAX_COLUMNS) && is_sound(&locate));
}

uint32_t lever_link(const motion_t *of) {
    uint32_t link;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)), "the motion is there");
    ASSUME(link < ROBOT_MAX_JOINTS);
    return link;
}

vec3_t lever_arm(const motion_t *of, const lever_config_t *with, uint32_t *sat) {
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && __CPROVER_r_ok(with, sizeof(*with)), "motion and shape are there");
    return (vec3_t){.x = stub_number(sat), .y = stub_number(sat), .z = stub_number(sat)};
}

void lever_torque(const motion_t *of, vec3_t arm, vec3_t force, vec3_t moment, num_t torque[], uint32_t *sat) {
    (void)arm;
    (void)force;
    (void)moment;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && __CPROVER_w_ok(torque, ROBOT_JOINTS * sizeof(*torque)), "they are there");
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        torque[i] = stub_number(sat);
    }
}

void proof_locate_columns(void) {
    any_search();
    make_columns(&motion, &shape, locate.weight, column, &saturations);
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
            HOLDS(num_abs(column[c][i]) <= NUM(64), "a column that soft_step takes");
        }
    }
    REACHED;
}

void proof_locate_logarithm(void) {
    num_t ratio;
    ASSUME(ratio >= 0);
    (void)logarithm(ratio, &saturations);
    REACHED;
}

/* Instead of the functions that one link needs (proofs.toml). */
void stub_make_columns(const motion_t *of, const lever_config_t *with, const num_t weight[],
                       num_t to[][ROBOT_MAX_JOINTS], uint32_t *sat) {
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && __CPROVER_r_ok(with, sizeof(*with)), "motion and shape are there");
    HOLDS(__CPROVER_r_ok(weight, ROBOT_JOINTS * sizeof(*weight)) && (sat != NULL), "the weights are there");
    for (uint32_t c = 0; c < (uint32_t)COLUMNS; ++c) {
        for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
            to[c][i] = stub_within(NUM(64));
        }
    }
}

num_t stub_logarithm(num_t ratio, uint32_t *sat) {
    HOLDS(ratio >= 0, "a ratio of lengths");
    return stub_number(sat);
}

void soft_step(soft_t *self, uint32_t k, const num_t of[][ROBOT_MAX_JOINTS], num_t s) {
    uint32_t columns;
    stub_columns(k, of);
    for (uint32_t c = 0; c < k; ++c) {
        for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
            HOLDS(num_abs(of[c][i]) <= NUM(64), "a column that soft_step takes");
        }
    }
    HOLDS((s >= NUM(SOFT_MIN)) && (s <= NUM(1)), "a softness");
    ASSUME(columns <= k);
    self->columns = columns;
    for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
        self->triangle[c][c] = stub_root(0); /* a length */
    }
}

void soft_reject(soft_t *self, const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    HOLDS((self->columns <= SUBSPACE_MAX_COLUMNS) && (first == 0u) && (first_rejected != NULL), "all columns");
    HOLDS(__CPROVER_r_ok(tau, ROBOT_JOINTS * sizeof(*tau)), "the torque is there");
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        rejected[i] = stub_number(&self->saturations);
    }
}

void proof_locate_look(void) {
    any_search();
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        ASSUME((vector[i] >= -NUM(1)) && (vector[i] <= NUM(1)));
    }
    look(&locate, &shape, &motion, vector, size);
    HOLDS(is_sound(&locate), "what a search keeps");
    REACHED;
}

/* Instead of look. */
void stub_look(locate_t *self, const lever_config_t *with, const motion_t *of, const num_t change[], num_t largest) {
    HOLDS(__CPROVER_w_ok(self, sizeof(*self)) && __CPROVER_r_ok(with, sizeof(*with)), "search and shape are there");
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && (largest >= NUM(LOCATE_NOISE_NM)), "a motion, and a change beyond noise");
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        HOLDS(num_abs(change[i]) <= NUM(1), "no entry is beyond the largest");
    }
}

void proof_locate_search(void) {
    any_search();
    search(&locate, &shape, joints, &motion);
    HOLDS(motion.watched < joints, "the next link is one of the arm");
    HOLDS(is_sound(&locate), "what a search keeps");
    REACHED;
}

void proof_locate_expected(void) {
    uint32_t i;
    any_search();
    ASSUME(i < joints);
    (void)expected(&locate, &task, i, size, &saturations);
    REACHED;
}

/* Instead of expected. */
num_t stub_expected(const locate_t *self, const index_t *index, uint32_t i, num_t rest, uint32_t *sat) {
    (void)rest;
    HOLDS(__CPROVER_r_ok(self, sizeof(*self)) && (index->columns <= SUBSPACE_MAX_COLUMNS), "the columns of a task");
    HOLDS(i < ROBOT_JOINTS, "a joint");
    return stub_number(sat);
}

void proof_locate_means(void) {
    any_search();
    learn(&locate, joints, &observer, &task, &explained);
    add(&locate, joints, &observer, &task);
    HOLDS(is_sound(&locate), "what a search keeps");
    REACHED;
}

/* Instead of the functions of a step. */
void stub_search(locate_t *self, const lever_config_t *with, uint32_t of, motion_t *in) {
    HOLDS((of <= ROBOT_JOINTS) && __CPROVER_w_ok(self, sizeof(*self)), "the joints");
    HOLDS(__CPROVER_r_ok(with, sizeof(*with)) && __CPROVER_w_ok(in, sizeof(*in)), "shape and motion are there");
}

void stub_learn(locate_t *self, uint32_t of, const observer_t *by, const index_t *index, const explained_t *part) {
    HOLDS(is_sound(self) && (of <= ROBOT_JOINTS) && (index->columns <= SUBSPACE_MAX_COLUMNS), "what learn requires");
    HOLDS(__CPROVER_r_ok(by, sizeof(*by)) && __CPROVER_r_ok(part, sizeof(*part)), "observer and coefficients");
}

void stub_add(locate_t *self, uint32_t of, const observer_t *by, const index_t *index) {
    HOLDS(is_sound(self) && (of <= ROBOT_JOINTS) && (index->columns <= SUBSPACE_MAX_COLUMNS), "what add requires");
    HOLDS(__CPROVER_r_ok(by, sizeof(*by)), "the observer is there");
}

void proof_locate_step(void) {
    bool calm;
    any_search();
    const uint32_t steps = locate.steps;
    (void)locate_step(&locate, &shape, joints, &motion, &observer, &task, &explained, calm);
    HOLDS(locate.steps == ((steps == 0u) ? 0u : (steps - 1u)), "the search ends");
    HOLDS(is_sound(&locate), "what a search keeps");
    REACHED;
}

void proof_locate_begin(void) {
    uint32_t ticks;
    any_search();
    ASSUME((ticks >= 1u) && (ticks <= (uint32_t)INT32_MAX));
    locate_begin(&locate, joints, ticks, vector);
    HOLDS(is_sound(&locate) && (locate.steps == (ticks + joints)), "a search of this length");
    locate_init(&locate);
    HOLDS(is_sound(&locate) && (locate.steps == 0u), "no search at first");
    REACHED;
}
