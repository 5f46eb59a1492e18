/* The STM32G4's clocks with a model of RCC, flash and power registers, and its reset flags. */
#include <stdint.h>
#include <string.h>

#define REGISTER_MODEL
#include "../../firmware/boards/stm32g4/clocks.c"
#include "../../firmware/boards/stm32g4/reset_cause.c"

#include "unity.h"

#define WORDS 16u

/* The part that does not answer. */
typedef enum { NONE, CRYSTAL, FLASH, PLL_LOCK, SWITCH, DIVIDER } broken_t;

static struct {
    struct {
        uint32_t address;
        uint32_t value;
    } word[WORDS];
    uint32_t used;
    broken_t broken;
} model;

static volatile uint32_t *word_at(uint32_t address) {
    for (uint32_t i = 0; i < model.used; ++i) {
        if (model.word[i].address == address) {
            return &model.word[i].value;
        }
    }
    TEST_ASSERT_TRUE(model.used < WORDS);
    model.word[model.used].address = address;
    return &model.word[model.used++].value;
}

/* Flags are set at the next read. */
static void answer(void) {
    volatile uint32_t *const control = word_at(RCC_CR_ADDRESS);
    volatile uint32_t *const configuration = word_at(RCC_CFGR_ADDRESS);
    if ((model.broken != CRYSTAL) && ((*control & RCC_CR_HSEON) != 0u)) {
        *control |= RCC_CR_HSERDY;
    }
    if ((model.broken != PLL_LOCK) && ((*control & RCC_CR_PLLON) != 0u)) {
        *control |= RCC_CR_PLLRDY;
    }
    if ((model.broken != SWITCH) && ((*configuration & RCC_CFGR_SW_PLL) != 0u)) {
        *configuration |= RCC_CFGR_SWS_PLL;
    }
    if (model.broken == DIVIDER) {
        *configuration |= RCC_CFGR_HPRE_2;
    }
    if (model.broken == FLASH) {
        *word_at(FLASH_ACR_ADDRESS) &= ~(uint32_t)FLASH_ACR_LATENCY;
    }
}

volatile uint32_t *register_model(uint32_t address) {
    answer();
    return word_at(address);
}

void setUp(void) {
    memset(&model, 0, sizeof(model));
}
void tearDown(void) {}

static void test_the_core_runs_from_the_crystal_and_the_crystal_is_watched(void) {
    TEST_ASSERT_TRUE(clocks_start());
    TEST_ASSERT_EQUAL_HEX32(RCC_CFGR_SWS_PLL, RCC_CFGR & (uint32_t)RCC_CFGR_SWS);
    TEST_ASSERT_EQUAL_HEX32(0, RCC_CFGR & (uint32_t)RCC_CFGR_HPRE);
    TEST_ASSERT_EQUAL_HEX32(RCC_PLLCFGR_SOURCE_HSE, RCC_PLLCFGR & 3u);
    TEST_ASSERT_BITS_HIGH(RCC_CR_CSSON, RCC_CR);
    TEST_ASSERT_BITS_HIGH(RCC_CCIPR_FDCAN_PLLQ, RCC_CCIPR);
}

static void test_the_wait_for_a_crystal_that_does_not_start_is_bounded(void) {
    model.broken = CRYSTAL;
    TEST_ASSERT_FALSE(clocks_start());
    TEST_ASSERT_EQUAL_HEX32(0, RCC_CFGR & (uint32_t)RCC_CFGR_SWS); /* still on the start-up oscillator */
}

static void test_a_flash_without_its_wait_states_prevents_the_start(void) {
    model.broken = FLASH;
    TEST_ASSERT_FALSE(clocks_start());
    TEST_ASSERT_EQUAL_HEX32(0, RCC_CFGR & (uint32_t)RCC_CFGR_SWS);
}

static void test_a_pll_that_does_not_lock_prevents_the_start(void) {
    model.broken = PLL_LOCK;
    TEST_ASSERT_FALSE(clocks_start());
    TEST_ASSERT_EQUAL_HEX32(0, RCC_CFGR & (uint32_t)RCC_CFGR_SWS);
}

static void test_a_clock_switch_without_effect_is_undone(void) {
    model.broken = SWITCH;
    TEST_ASSERT_FALSE(clocks_start());
    TEST_ASSERT_EQUAL_HEX32(0, RCC_CFGR & (uint32_t)(RCC_CFGR_SW_PLL | RCC_CFGR_HPRE));
}

static void test_a_core_at_another_rate_prevents_the_start(void) {
    model.broken = DIVIDER;
    TEST_ASSERT_FALSE(clocks_start());
}

static void test_the_reset_flags_give_the_cause_of_the_start(void) {
    const uint32_t pin = RCC_CSR_PINRSTF; /* every reset drives NRST */
    TEST_ASSERT_EQUAL(GUARD_START_POWER_ON, reset_cause(pin | RCC_CSR_BORRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(pin | RCC_CSR_IWDGRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(pin | RCC_CSR_WWDGRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_COMMANDED, reset_cause(pin, false));
    TEST_ASSERT_EQUAL(GUARD_START_COMMANDED, reset_cause(pin | RCC_CSR_SFTRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_COMMANDED, reset_cause(pin | RCC_CSR_OBLRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_UNKNOWN, reset_cause(pin | RCC_CSR_LPWRRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_UNKNOWN, reset_cause(0, false));
}

static void test_a_watchdog_flag_outranks_a_button_and_an_exception_outranks_the_watchdog(void) {
    TEST_ASSERT_EQUAL(GUARD_START_WATCHDOG, reset_cause(RCC_CSR_IWDGRSTF | RCC_CSR_SFTRSTF | RCC_CSR_PINRSTF, false));
    TEST_ASSERT_EQUAL(GUARD_START_EXCEPTION, reset_cause(RCC_CSR_IWDGRSTF | RCC_CSR_PINRSTF, true));
    TEST_ASSERT_EQUAL(GUARD_START_EXCEPTION, reset_cause(RCC_CSR_PINRSTF, true));
    TEST_ASSERT_EQUAL(GUARD_START_POWER_ON, reset_cause(RCC_CSR_BORRSTF, true)); /* RAM contains arbitrary values */
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_the_core_runs_from_the_crystal_and_the_crystal_is_watched);
    RUN_TEST(test_the_wait_for_a_crystal_that_does_not_start_is_bounded);
    RUN_TEST(test_a_flash_without_its_wait_states_prevents_the_start);
    RUN_TEST(test_a_pll_that_does_not_lock_prevents_the_start);
    RUN_TEST(test_a_clock_switch_without_effect_is_undone);
    RUN_TEST(test_a_core_at_another_rate_prevents_the_start);
    RUN_TEST(test_the_reset_flags_give_the_cause_of_the_start);
    RUN_TEST(test_a_watchdog_flag_outranks_a_button_and_an_exception_outranks_the_watchdog);
    return UNITY_END();
}
