/* firmware/core/index.c: any row that config_check accepts, any Jacobian below 64. Each part is shown alone; index_step
 * calls stubs that assert what a part requires. */
#include "num_sums.h"

#include "any_table.h"
#include "index.c"
#include "stub_object.h"
#include "unit_stub.h"

/* Below 64, which explained.c and the projectors require. */
static bool is_column(const num_t column[]) {
    bool all = true;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        all = all && stub_below(column[i], 28u);
    }
    return all;
}

static bool are_columns(const index_t *index) {
    bool all = true;
    for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
        all = all && is_column(index->column[c]);
    }
    return all;
}

static void any_column(num_t column[]) {
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        num_t any;
        ASSUME(stub_below(any, 28u));
        column[i] = any;
    }
}

/* --- the projectors: proof_projection.c --------------------------------------------------------------------------- */

void projection_init(projection_t *self) {
    stub_object(self, sizeof(*self));
}

static void any_projection(projection_t *self, const num_t tau[], num_t rejected[]) {
    projection_t any;
    HOLDS(__CPROVER_r_ok(tau, ROBOT_MAX_JOINTS * sizeof(*tau)), "the torque is there");
    *self = any;
    for (uint32_t i = 0; i < ROBOT_JOINTS; ++i) {
        num_t number;
        rejected[i] = number;
    }
}

static void columns_are_there(uint32_t k, const num_t column[][ROBOT_MAX_JOINTS]) {
    HOLDS(k <= SUBSPACE_MAX_COLUMNS, "no more columns than a projector takes");
    for (uint32_t c = 0; c < SUBSPACE_MAX_COLUMNS; ++c) {
        HOLDS(is_column(column[c]), "the columns are below 64");
    }
}

void projection_hard(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS],
                     num_t tolerance, const num_t tau[], num_t rejected[]) {
    columns_are_there(k, column);
    any_projection(self, tau, rejected);
}

void projection_soft(projection_t *self, uint32_t n, uint32_t k, const num_t column[][ROBOT_MAX_JOINTS], num_t s,
                     const num_t tau[], num_t rejected[], uint32_t first, num_t first_rejected[]) {
    HOLDS((s >= NUM(SOFT_MIN)) && (s <= NUM(1)), "a softness");
    HOLDS(first <= SUBSPACE_MAX_COLUMNS, "no more fast columns than a projector takes");
    columns_are_there(k, column);
    any_projection(self, tau, first_rejected);
    any_projection(self, tau, rejected);
}

void projection_reject(projection_t *self, const num_t tau[], num_t rejected[]) {
    any_projection(self, tau, rejected);
}

/* --- one column -----------------------------------------------------------------------------------------------------
 */

static index_t index;
static subspace_config_t config;
static index_config_t task;
static robot_t robot;
static motion_t motion;
static observer_t observer;
static acceleration_t acceleration;
static regressor_t regressor;

static void any_input(void) {
    __CPROVER_havoc_object(&index);
    __CPROVER_havoc_object(&config);
    __CPROVER_havoc_object(&task);
    __CPROVER_havoc_object(&robot);
    __CPROVER_havoc_object(&motion);
    __CPROVER_havoc_object(&observer);
    __CPROVER_havoc_object(&acceleration);
    __CPROVER_havoc_object(&regressor);
    ASSUME((config.tolerance > 0) && (config.tolerance <= NUM(0.1)) && (config.lever_m > 0) &&
           (config.lever_m <= NUM(1)));
    ASSUME((config.projector != (uint32_t)PROJECTOR_SOFT) || (config.tolerance >= NUM(SOFT_MIN)));
    assume_jacobian(motion.jacobian); /* proof_motion */
    ASSUME(are_columns(&index));
}

static bool is_scale(num_t a) {
    return (a >= -NUM(1)) && (a <= NUM(1));
}

void proof_index_vector(void) {
    num_t column[ROBOT_MAX_JOINTS] = {0};
    vec3_t v;
    bool angular;
    uint32_t saturations;
    any_input();
    vector_column(&motion, angular ? (uint32_t)ANGULAR : (uint32_t)LINEAR, v, column, &saturations);
    HOLDS(is_column(column), "a column below 64");
    REACHED;
}

void stub_vector(const motion_t *of, uint32_t first, vec3_t v, num_t column[], uint32_t *saturations) {
    (void)v;
    *saturations += 0u;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)) && ((first == (uint32_t)LINEAR) || (first == (uint32_t)ANGULAR)),
          "three rows of the Jacobian");
    any_column(column);
}

void proof_index_row(void) {
    num_t row[ROBOT_MAX_JOINTS], column[ROBOT_MAX_JOINTS] = {0}, scale;
    uint32_t saturations;
    ASSUME(is_scale(scale) && is_column(row));
    row_column(row, scale, column, &saturations);
    HOLDS(is_column(column), "a column below 64");
    REACHED;
}

void stub_row(const num_t row[], num_t scale, num_t column[], uint32_t *saturations) {
    *saturations += 0u;
    HOLDS(__CPROVER_r_ok(row, ROBOT_MAX_JOINTS * sizeof(num_t)) && is_column(row), "a row below 64");
    HOLDS(is_scale(scale), "a factor within 1");
    any_column(column);
}

/* vec3_cross: proof_vec3_cross. */
vec3_t stub_cross(vec3_t a, vec3_t b, uint32_t *saturations) {
    (void)a;
    (void)b;
    return (vec3_t){.x = stub_number(saturations), .y = stub_number(saturations), .z = stub_number(saturations)};
}

void proof_index_component(void) {
    num_t column[ROBOT_MAX_JOINTS] = {0}, lever;
    vec3_t axis, arm;
    bool is_force;
    uint32_t saturations;
    any_input();
    component_column(&motion, is_force, axis, arm, lever, column, &saturations);
    HOLDS(is_column(column), "a column below 64");
    REACHED;
}

void stub_component(const motion_t *of, bool is_force, vec3_t axis, vec3_t arm, num_t lever, num_t column[],
                    uint32_t *saturations) {
    (void)is_force;
    (void)axis;
    (void)arm;
    (void)lever;
    *saturations += 0u;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)), "the motion is there");
    any_column(column);
}

/* --- all columns ----------------------------------------------------------------------------------------------------
 */

void proof_index_order(void) {
    uint32_t component[INDEX_COMPONENTS], seen = 0, forces = 0;
    any_input(); /* any row, also one that is not in use and was not checked */
    const uint32_t count = index_order(&task, component);
    HOLDS(count <= INDEX_COMPONENTS, "no more than there are");
    for (uint32_t c = 0; c < count; ++c) {
        HOLDS((component[c] < INDEX_COMPONENTS) && ((seen & (1u << component[c])) == 0u), "each component once");
        seen |= 1u << component[c];
        forces += (component[c] < 3u) ? 1u : 0u;
    }
    HOLDS((forces <= 3u) && ((count - forces) <= 3u), "at most three forces and three moments");
    HOLDS(count_of(task.components & task.fast) <= count, "no more fast columns than columns");
    REACHED;
}

uint32_t stub_order(const index_config_t *of, uint32_t component[INDEX_COMPONENTS]) {
    uint32_t count;
    HOLDS(__CPROVER_r_ok(of, sizeof(*of)), "the row is there");
    ASSUME(count <= INDEX_COMPONENTS);
    for (uint32_t c = 0; c < INDEX_COMPONENTS; ++c) {
        uint32_t any;
        ASSUME(any < INDEX_COMPONENTS);
        component[c] = any;
    }
    return count;
}

/* The axes and the point of a row that axes_are_valid accepts. */
static void assume_axes(void) {
    for (uint32_t a = 0; a < 3u; ++a) {
        ASSUME(is_below(task.point[a], NUM(2)));
        ASSUME(is_below(task.axis[a][0], NUM(2)) && is_below(task.axis[a][1], NUM(2)) &&
               is_below(task.axis[a][2], NUM(2)));
    }
}

static void step_with(uint32_t kind) {
    any_input();
    assume_axes();
    task.kind = kind;
    index_step(&index, &config, &task, &robot, &motion, &observer, &acceleration, &regressor);
    HOLDS(index.columns <= SUBSPACE_MAX_COLUMNS, "no more columns than there is room for");
    HOLDS(are_columns(&index), "the columns are below 64");
    HOLDS(index.kind == kind, "the kind of this step");
}

void proof_index_payload(void) {
    step_with((uint32_t)INDEX_PAYLOAD);
    REACHED;
}

void proof_index_contact(void) {
    step_with((uint32_t)INDEX_CONTACT);
    REACHED;
}

void proof_index_regressor(void) {
    step_with((uint32_t)INDEX_REGRESSOR);
    REACHED;
}

void proof_index_residual(void) {
    step_with((uint32_t)INDEX_RESIDUAL);
    REACHED;
}

/* config_check accepts any other word of a row that is not in use. */
void proof_index_off(void) {
    any_input();
    task.kind = (uint32_t)INDEX_OFF;
    index_step(&index, &config, &task, &robot, &motion, &observer, &acceleration, &regressor);
    HOLDS((index.columns == 0u) && are_columns(&index), "no columns");
    REACHED;
}

void proof_index_reject(void) {
    num_t torque[ROBOT_MAX_JOINTS];
    any_input();
    index_reject(&index, torque, torque);
    HOLDS(are_columns(&index), "the columns are below 64");
    REACHED;
}

void proof_index_init(void) {
    any_input();
    index_init(&index);
    HOLDS(are_columns(&index) && (index.columns == 0u), "no columns at the start");
    REACHED;
}
