/* Project first, then filter: the index, followed by one channel of the bank. */
#include "bank.h"

#include "index_fixture.h"

#define DECAY 0.951229424500714 /* exp(-50/s 1 ms) */

static bank_t bank;
static bank_config_t channels;
static double torque[N]; /* external torque on the arm, with the observer's sign */

void setUp(void) {
    start();
    memset(torque, 0, sizeof(torque));
}
void tearDown(void) {
    assert_no_saturation();
}

/* One tick of an observer with this torque, of the index, and of one first-order channel with the observer's gain. */
static void tick(index_kind_t kind) {
    for (uint32_t i = 0; i < N; ++i) {
        observer.update[i] = num_of((1.0 - DECAY) * torque[i]);
    }
    step(kind);
    bank_step(&bank, &channels, N, 1u, index_state.unexplained, index_state.sudden, 0u);
}

static void project_first(void) {
    setUp();
    config.order = (uint32_t)ORDER_PROJECT_FIRST;
    bank_init(&bank);
    memset(&channels, 0, sizeof(channels));
    channels.channels = 1u;
    channels.channel[0].own[0] = num_of(DECAY);
    channels.channel[0].in[0] = NUM(1);
}

static void test_explained_and_unexplained_add_up_to_the_torque(void) {
    random_start(66);
    project_first();
    for (int round = 0; round < 200; ++round) {
        move_to(random_in(-1.0, 1.0));
        for (uint32_t i = 0; i < N; ++i) {
            torque[i] = 20.0 * random_one();
        }
        tick((round % 2 == 0) ? INDEX_PAYLOAD : INDEX_CONTACT);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(value_of(observer.update[i]),
                         value_of(index_state.explained[i]) + value_of(index_state.unexplained[i]), 1e-6);
        }
    }
}

static void test_a_payload_that_stays_in_task_none_appears_like_a_new_torque(void) {
    const double w[6] = {0.0, 0.0, -19.62, 0.2, 0.4, 0.0};
    project_first();
    wrench(w, torque);
    for (int k = 0; k < 400; ++k) {
        tick(INDEX_PAYLOAD);
        ASSERT_CLOSE(0.0, size_of(bank.channel[0].output), 1e-3);
    }
    for (int m = 1; m < 300; ++m) {
        tick(INDEX_RESIDUAL);
        for (uint32_t i = 0; i < N; ++i) {
            ASSERT_CLOSE(torque[i] * (1.0 - pow(DECAY, m)), value_of(bank.channel[0].output[i]), 3e-3);
        }
    }
}

static void test_a_moving_arm_keeps_a_payload_explained(void) {
    project_first();
    for (int k = 0; k < 1000; ++k) {
        const double w[6] = {0.0, 0.0, -19.62, 0.2, 0.4, 0.0};
        move_to(0.6 * sin(0.004 * k)); /* up to 2.4 rad/s in every joint */
        wrench(w, torque);
        tick(INDEX_PAYLOAD);
        ASSERT_CLOSE(0.0, size_of(bank.channel[0].output), 2e-3);
    }
}

static void test_task_changes_in_each_tick_hide_at_most_their_share_of_ticks(void) {
    double unexplained[N];
    setUp();
    unexplained_by_all(8.0, unexplained);
    project_first();
    double across[N];
    const double w[6] = {0.0, 20.0, 0.0, 0.0, 0.0, 0.0};
    wrench(w, across);
    for (uint32_t i = 0; i < N; ++i) {
        torque[i] = unexplained[i] + across[i];
    }
    for (int k = 0; k < 400; ++k) {
        tick((k % 2 == 0) ? INDEX_RESIDUAL : INDEX_CONTACT);
    }
    double square = 0.0;
    for (uint32_t i = 0; i < N; ++i) {
        square += across[i] * across[i];
    }
    TEST_ASSERT_TRUE(size_of(bank.channel[0].output) > 0.45 * sqrt(square));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_explained_and_unexplained_add_up_to_the_torque);
    RUN_TEST(test_a_payload_that_stays_in_task_none_appears_like_a_new_torque);
    RUN_TEST(test_a_moving_arm_keeps_a_payload_explained);
    RUN_TEST(test_task_changes_in_each_tick_hide_at_most_their_share_of_ticks);
    return UNITY_END();
}
