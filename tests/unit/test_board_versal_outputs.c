/* The Versal's permission pin and window watchdog with models of their registers. */
#include <stdbool.h>
#include <string.h>

#define OUTPUT_MODEL
#include "../../firmware/boards/versal_r5/outputs.c"

#include "unity.h"

#define COUNTS_A_US 100u

static struct {
    uint32_t level, direction, enabled; /* of bank 3 */
    uint32_t edges;
    bool high_before_permission;
    uint32_t first, second; /* windows, in counts */
    bool writable, running, reset;
    uint64_t now, begun; /* counts */
    uint32_t lines;      /* of the log */
} model;

static void look(void) {
    const uint64_t since = model.now - model.begun;
    model.reset = model.reset || (model.running && (since > (uint64_t)model.first + model.second));
}

static bool in_second(void) {
    return model.running && ((model.now - model.begun) >= model.first);
}

uint32_t output_read(uint32_t offset) {
    look();
    switch (offset) {
    case GPIO_DIRM_3:
        return model.direction;
    case GPIO_OEN_3:
        return model.enabled;
    case WWDT_ESR:
        return (model.running ? (uint32_t)WWDT_ESR_ENABLE : 0u) | (in_second() ? (uint32_t)WWDT_ESR_SECOND : 0u);
    default:
        TEST_FAIL_MESSAGE("read of a register that has no use");
        return 0;
    }
}

static void write_watchdog(uint32_t offset, uint32_t value) {
    TEST_ASSERT_TRUE_MESSAGE(model.writable, "the watchdog's registers are locked");
    if (offset == WWDT_FWR) {
        TEST_ASSERT_FALSE(model.running);
        model.first = value;
    } else if (offset == WWDT_SWR) {
        TEST_ASSERT_FALSE(model.running);
        model.second = value;
    } else {
        TEST_ASSERT_EQUAL_HEX32(WWDT_ESR, offset);
        const bool serves = (value & (uint32_t)WWDT_ESR_SECOND) != 0u;
        TEST_ASSERT_BITS_HIGH(WWDT_ESR_ENABLE, value);
        if (!model.running) {
            model.running = true;
            model.begun = model.now;
        } else if (serves) {
            model.reset = model.reset || !in_second(); /* too early is an error, like too late */
            model.begun = model.now;
        } else {
            /* as it is */
        }
        model.writable = false;
    }
}

void output_write(uint32_t offset, uint32_t value) {
    look();
    switch (offset) {
    case GPIO_MASK_DATA_3_LSW: {
        const uint32_t changed = ~(value >> 16) & 0xFFFFu;
        const uint32_t level = (model.level & ~changed) | (value & changed);
        TEST_ASSERT_EQUAL_HEX32(0, changed & ~1u); /* pins of other functions */
        model.edges += (level != model.level) ? 1u : 0u;
        model.level = level;
        break;
    }
    case GPIO_DIRM_3:
        model.direction = value;
        break;
    case GPIO_OEN_3:
        model.enabled = value;
        break;
    case WWDT_MWR:
        model.writable = (value & (uint32_t)WWDT_MWR_WRITABLE) != 0u;
        return;
    default:
        write_watchdog(offset, value);
        break;
    }
    const bool driven_high = ((model.enabled & model.level) & 1u) != 0u;
    model.high_before_permission = model.high_before_permission || (driven_high && (model.lines == 0u));
}

void log_text(const char *text) {
    (void)text;
    ++model.lines;
}

void setUp(void) {
    memset(&model, 0, sizeof(model));
    model.level = 1u; /* as a warm reset may leave it */
    model.direction = 0x80000000u;
    model.enabled = 0x80000000u;
    permitted = false;
    outputs_init();
}
void tearDown(void) {}

static void pass_us(uint32_t us) {
    model.now += (uint64_t)us * COUNTS_A_US;
}

static void test_the_pin_is_driven_low_from_the_start_and_is_the_only_one_touched(void) {
    TEST_ASSERT_EQUAL_HEX32(0, model.level);
    TEST_ASSERT_EQUAL_HEX32(0x80000001u, model.direction);
    TEST_ASSERT_EQUAL_HEX32(0x80000001u, model.enabled);
    TEST_ASSERT_FALSE(model.high_before_permission);
}

static void test_every_permission_is_an_edge_and_its_end_is_low(void) {
    model.edges = 0;
    for (uint32_t i = 1; i <= 9u; ++i) {
        permission_toggle();
        TEST_ASSERT_EQUAL(i, model.edges);
    }
    TEST_ASSERT_EQUAL(1, model.lines);
    for (uint32_t i = 0; i < 3u; ++i) {
        permission_withdraw();
        TEST_ASSERT_EQUAL_HEX32(0, model.level);
    }
    TEST_ASSERT_EQUAL(10, model.edges);
    TEST_ASSERT_EQUAL(2, model.lines);
    permission_toggle();
    TEST_ASSERT_EQUAL_HEX32(1, model.level);
}

static void test_a_served_watchdog_does_not_reset(void) {
    watchdog_start(8000u);
    for (uint32_t i = 0; i < 100u; ++i) {
        pass_us(1000u + (i % 7u) * 1000u);
        watchdog_serve();
    }
    pass_us(7900u);
    look();
    TEST_ASSERT_FALSE(model.reset);
}

static void test_the_watchdog_resets_a_board_that_does_not_serve_it_in_time(void) {
    watchdog_start(8000u);
    pass_us(4000u);
    watchdog_serve();
    pass_us(8010u);
    look();
    TEST_ASSERT_TRUE(model.reset);
}

/* Two consecutive ticks without delay: the second is in the first window, where a service would cause a reset. */
static void test_a_second_tick_at_once_causes_no_reset(void) {
    watchdog_start(8000u);
    for (uint32_t i = 0; i < 20u; ++i) {
        pass_us((i % 2u == 0u) ? 1000u : 0u);
        watchdog_serve();
    }
    TEST_ASSERT_FALSE(model.reset);
}

static void test_the_longest_timeout_is_the_limit(void) {
    watchdog_start(UINT32_MAX);
    TEST_ASSERT_EQUAL_HEX32(UINT32_MAX, model.second);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_pin_is_driven_low_from_the_start_and_is_the_only_one_touched);
    RUN_TEST(test_every_permission_is_an_edge_and_its_end_is_low);
    RUN_TEST(test_a_served_watchdog_does_not_reset);
    RUN_TEST(test_the_watchdog_resets_a_board_that_does_not_serve_it_in_time);
    RUN_TEST(test_a_second_tick_at_once_causes_no_reset);
    RUN_TEST(test_the_longest_timeout_is_the_limit);
    return UNITY_END();
}
