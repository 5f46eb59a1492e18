/* The permission pin, EMIO 0 of the LPD's GPIO, and the LPD's window watchdog. */
#include "outputs.h"
#include "../common/board.h"
#include "../common/log.h"
#include "output_registers.h"

#define PIN 1u

/* A service in the first window causes a reset. This window has the minimum length. */
enum { WWDT_MHZ = 100, FIRST_WINDOW = 100 };

static bool permitted;

static void drive(uint32_t level) {
    output_write(GPIO_MASK_DATA_3_LSW, ((0xFFFFu & ~PIN) << 16) | level);
}

static void log_permission(bool now) {
    if (now != permitted) {
        permitted = now;
        log_text(now ? "permission\n" : "no permission\n");
    }
}

void outputs_init(void) {
    permission_withdraw(); /* level before direction, so that the pin is never high in between */
    output_write(GPIO_DIRM_3, output_read(GPIO_DIRM_3) | PIN);
    output_write(GPIO_OEN_3, output_read(GPIO_OEN_3) | PIN);
}

void permission_toggle(void) {
    static uint32_t level;
    level = permitted ? (level ^ PIN) : PIN;
    drive(level);
    log_permission(true);
}

void permission_withdraw(void) {
    drive(0);
    log_permission(false);
}

void watchdog_start(uint32_t timeout_us) {
    const uint64_t counts = (uint64_t)timeout_us * (uint32_t)WWDT_MHZ;
    output_write(WWDT_MWR, WWDT_MWR_WRITABLE);
    output_write(WWDT_FWR, FIRST_WINDOW);
    output_write(WWDT_SWR, (counts < UINT32_MAX) ? (uint32_t)counts : UINT32_MAX);
    output_write(WWDT_ESR, WWDT_ESR_ENABLE);
}

void watchdog_serve(void) {
    const uint32_t status = output_read(WWDT_ESR);
    if ((status & WWDT_ESR_SECOND) != 0u) {
        output_write(WWDT_MWR, WWDT_MWR_WRITABLE);
        output_write(WWDT_ESR, status);
    }
}
