/* output_registers: GPIO and window watchdog of the low-power domain, for the permission pin and the watchdog; reset
 * reasons and time stamps of the platform, read only (AM012, Versal ACAP register reference: LPD_GPIO, LPD_WWDT, CRP,
 * IOU_SCNTRS).
 *
 * The code uses these two functions only. QEMU's Versal has none of these devices, and an access to them faults. A
 * build for the emulator therefore uses words in memory instead. A test uses a model.
 */
#ifndef TAUPERP_VERSAL_R5_OUTPUT_REGISTERS_H
#define TAUPERP_VERSAL_R5_OUTPUT_REGISTERS_H

#include <stdint.h>

/* Each device has 0x400 bytes of these offsets. */
enum {
    GPIO_MASK_DATA_3_LSW = 0x018, /* bank 3 (EMIO 0 to 31), pins 0 to 15: mask in the upper half, levels in the lower */
    GPIO_DIRM_3 = 0x2C4,          /* 1: output */
    GPIO_OEN_3 = 0x2C8,           /* 1: driven */
    WWDT_MWR = 0x400,             /* bit 0: enables writing the other registers */
    WWDT_ESR = 0x404,
    WWDT_FWR = 0x40C,         /* first window, in which a service is forbidden, in counts */
    WWDT_SWR = 0x410,         /* second window, after which it resets, in counts */
    CRP_RESET_REASON = 0xA20, /* reset_cause.h */
    SCNTR_COUNT = 0xC08,      /* time stamp counter, lower half */
    SCNTR_FREQUENCY = 0xC20,  /* Hz */
    OUTPUT_WORDS = 0x1000 / 4
};

enum {
    WWDT_MWR_WRITABLE = 1u << 0,
    WWDT_ESR_ENABLE = 1u << 0,
    WWDT_ESR_SECOND = 1u << 8 /* read: in the second window; writing a one serves the watchdog */
};

#if defined(OUTPUT_MODEL)
uint32_t output_read(uint32_t offset);
void output_write(uint32_t offset, uint32_t value);
#else
#ifdef TAUPERP_EMULATOR
extern volatile uint32_t output_words[OUTPUT_WORDS];
static inline volatile uint32_t *output_word(uint32_t offset) {
    return &output_words[offset / 4u];
}
#else
static inline volatile uint32_t *output_word(uint32_t offset) {
    /* LPD_GPIO, LPD_WWDT, CRP, IOU_SCNTRS */
    static const uint32_t bases[4] = {0xFF0B0000u, 0xFF120000u, 0xF1260000u, 0xFF140000u};
    return (volatile uint32_t *)(bases[(offset / 0x400u) & 3u] + (offset & 0x3FFu));
}
#endif
static inline uint32_t output_read(uint32_t offset) {
    return *output_word(offset);
}
static inline void output_write(uint32_t offset, uint32_t value) {
    *output_word(offset) = value;
}
#endif

#endif
