/* The columns of the regressor against double precision: arbitrary motion of eight joints, gravity in any direction,
 * steps over every gap. */
#include "core_fixture.h"
#include "regressor.h"
#include "token.h"

#define N     ROBOT_MAX_JOINTS
#define TIGHT 2e-5

static robot_t robot;
static motion_t motion;
static observer_t observer;
static observer_config_t gains;
static acceleration_t acceleration;
static regressor_config_t config;
static regressor_t regressor;
static num_t velocity[N];

/* What the step before left. */
static struct {
    double jacobian[6][N], tool[3][3], velocity[3], rate[3];
    double level[REGRESSOR_COLUMNS + 1u][N], slope[REGRESSOR_COLUMNS + 1u][N];
} last;

void setUp(void) {
    regressor_init(&regressor);
    memset(&last, 0, sizeof(last));
    config.used = 1u;
    random_start(43);
    robot.gravity = (vec3_t){.x = NUM(3), .y = NUM(-5), .z = NUM(-8)};
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        channel_config_t *const c = &config.low_pass;
        gains.momentum_gain[g] = num_of(1.0 + g);
        c->own[g] = num_of(0.9 - 0.1 * g);
        c->cross[g] = num_of(0.2 + 0.05 * g);
        c->back[g] = num_of(-0.3 - 0.05 * g);
        c->stay[g] = num_of(0.7 - 0.1 * g);
        c->in[g] = num_of(0.6 + 0.05 * g);
        c->in_back[g] = num_of(0.4 - 0.05 * g);
    }
    observer.gain = NUM(0.5);
}
void tearDown(void) {
    TEST_ASSERT_EQUAL(0, regressor.saturations);
}

static vec3_t any(double size) {
    return (vec3_t){
        .x = num_of(size * random_one()), .y = num_of(size * random_one()), .z = num_of(size * random_one())};
}

static void take(vec3_t v, double out[3]) {
    out[0] = value_of(v.x);
    out[1] = value_of(v.y);
    out[2] = value_of(v.z);
}

static void cross(const double a[3], const double b[3], double out[3]) {
    const double product[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    memcpy(out, product, sizeof(product));
}

static void draw(void) {
    for (uint32_t i = 0; i < N; ++i) {
        for (uint32_t row = 0; row < 6u; ++row) {
            motion.jacobian[row][i] = num_of(random_one());
        }
        velocity[i] = num_of(random_one());
        observer.update[i] = num_of(3.0 * random_one());
    }
    motion.tool_x = any(1.0);
    motion.tool_y = any(1.0);
    motion.tool_z = any(1.0);
    acceleration.velocity = any(2.0);
}

/* One step of the filter in double precision. */
static void filter(uint32_t column, uint32_t g, const double u[N]) {
    const channel_config_t *const c = &config.low_pass;
    for (uint32_t i = 0; i < N; ++i) {
        const double x = last.level[column][i], v = last.slope[column][i];
        last.level[column][i] = value_of(c->own[g]) * x + value_of(c->cross[g]) * v + value_of(c->in[g]) * u[i];
        last.slope[column][i] = value_of(c->back[g]) * x + value_of(c->stay[g]) * v + value_of(c->in_back[g]) * u[i];
    }
}

/* Forces and moments of the five parameters as means over the step (regressor.h). */
static void wrenches(uint32_t g, double force[5][3], double moment[5][3]) {
    double now[3], rate[3], gravity[3], tool[3][3], push[3], turn[3], mean[3];
    take(acceleration.velocity, now);
    take(robot.gravity, gravity);
    take(motion.tool_x, tool[0]);
    take(motion.tool_y, tool[1]);
    take(motion.tool_z, tool[2]);
    memset(force, 0, 5u * sizeof(force[0]));
    memset(moment, 0, 5u * sizeof(moment[0]));
    for (uint32_t a = 0; a < 3u; ++a) {
        rate[a] = 0.0;
        for (uint32_t i = 0; i < N; ++i) {
            rate[a] += value_of(motion.jacobian[3u + a][i]) * value_of(velocity[i]);
        }
        push[a] = (now[a] - last.velocity[a]) * (1.0 + g) - 0.5 * gravity[a];
        turn[a] = (rate[a] - last.rate[a]) * (1.0 + g);
        mean[a] = 0.5 * (rate[a] + last.rate[a]);
        force[0][a] = 3.0 * push[a];
        moment[4][a] = 0.03 * turn[a];
    }
    for (uint32_t a = 0; a < 3u; ++a) {
        double arm[3], whirl[3], sideways[3];
        for (uint32_t row = 0; row < 3u; ++row) {
            arm[row] = 0.3 * 0.5 * (tool[row][a] + last.tool[row][a]);
        }
        cross(mean, arm, whirl);
        cross(mean, whirl, whirl);
        cross(turn, arm, sideways);
        for (uint32_t row = 0; row < 3u; ++row) {
            force[1u + a][row] = sideways[row] + 0.5 * whirl[row];
        }
        cross(arm, push, moment[1u + a]);
    }
    memcpy(last.velocity, now, sizeof(now));
    memcpy(last.rate, rate, sizeof(rate));
    memcpy(last.tool, tool, sizeof(tool));
}

static void expect(uint32_t gap) {
    double force[5][3], moment[5][3], u[N];
    const bool runs = (gap >= 1u) && (gap <= OBSERVER_MAX_GAP);
    const uint32_t g = runs ? gap - 1u : 0u;
    wrenches(g, force, moment);
    for (uint32_t c = 0; c < REGRESSOR_COLUMNS; ++c) {
        for (uint32_t i = 0; i < N; ++i) {
            u[i] = 0.0;
            for (uint32_t row = 0; row < 6u; ++row) {
                const double mean = 0.5 * (last.jacobian[row][i] + value_of(motion.jacobian[row][i]));
                u[i] += mean * ((row < 3u) ? force[c][row] : moment[c][row - 3u]);
            }
        }
        filter(c, g, u);
    }
    for (uint32_t i = 0; i < N; ++i) {
        u[i] = value_of(observer.update[i]);
        for (uint32_t row = 0; row < 6u; ++row) {
            last.jacobian[row][i] = value_of(motion.jacobian[row][i]);
        }
    }
    filter(REGRESSOR_COLUMNS, g, u);
    if (!runs) {
        memset(last.level, 0, sizeof(last.level));
        memset(last.slope, 0, sizeof(last.slope));
    }
}

static void step(uint32_t gap) {
    observer.gap = gap;
    regressor_step(&regressor, &config, &gains, &robot, &motion, &observer, &acceleration, velocity);
}

static void assert_columns(void) {
    for (uint32_t i = 0; i < N; ++i) {
        for (uint32_t c = 0; c < REGRESSOR_COLUMNS; ++c) {
            ASSERT_CLOSE(last.level[c][i], value_of(regressor.column[c][i]), TIGHT);
            ASSERT_CLOSE(last.slope[c][i], value_of(regressor.slope[c][i]), TIGHT);
        }
        ASSERT_CLOSE(last.level[REGRESSOR_COLUMNS][i], value_of(regressor.torque[i]), TIGHT);
    }
}

static void test_every_column_of_every_joint_over_every_gap(void) {
    static const uint32_t gap[] = {0u, 1u, 1u, 2u, 3u, 4u, 1u, 5u, 1u, 4u, 0u, 2u, 1u};
    for (uint32_t i = 0; i < sizeof(gap) / sizeof(gap[0]); ++i) {
        draw();
        expect(gap[i]);
        step(gap[i]);
        assert_columns();
    }
}

static void test_a_restart_keeps_the_count_of_saturations(void) {
    draw();
    regressor.saturations = 7u;
    step(0u);
    TEST_ASSERT_EQUAL(7, regressor.saturations);
    regressor.saturations = 0u;
}

static void test_a_regressor_that_no_task_uses_passes_the_token_only(void) {
    static const regressor_t none;
    config.used = 0u;
    acceleration.token = 77u;
    draw();
    step(1u);
    TEST_ASSERT_EQUAL_HEX32(token_next(77u, TOKEN_REGRESSOR, 0u), regressor.token);
    regressor.token = 0u;
    TEST_ASSERT_EQUAL_MEMORY(&none, &regressor, sizeof(none));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_column_of_every_joint_over_every_gap);
    RUN_TEST(test_a_restart_keeps_the_count_of_saturations);
    RUN_TEST(test_a_regressor_that_no_task_uses_passes_the_token_only);
    return UNITY_END();
}
