/* board: the functions that a circuit provides for the guard's loop (loop.h). Each board implements every function
 * once. All are polled, none waits, and no interrupt is used.
 *
 * The permission is sent twice: as a frame, and as a pin that must keep toggling. A safety relay behind a charge pump
 * drops out when the edges stop, at either level. A hung processor therefore also withdraws the permission.
 */
#ifndef TAUPERP_BOARD_H
#define TAUPERP_BOARD_H

#include "frame.h"
#include "guard.h"

/* Purpose of the image, for the identity record and GuardStatus.Variant. */
#if defined(TAUPERP_LOCKSTEP)
#define BOARD_VARIANT GUARD_VARIANT_LOCKSTEP
#elif defined(TAUPERP_EMULATOR)
#define BOARD_VARIANT GUARD_VARIANT_EMULATOR
#else
#define BOARD_VARIANT GUARD_VARIANT_PRODUCT
#endif

/* Faults that the CAN controller reports. */
enum {
    CAN_FAULT_OVERFLOW = 1u, /* frames were lost before they were read */
    CAN_FAULT_OFF = 2u,      /* bus-off; can_faults has started the recovery (128 times 11 recessive bits) */
    CAN_FAULT_STUCK = 4u     /* a frame of the previous answer was not sent, and was cancelled */
};

extern const guard_config_t board_config; /* with two channels the second one's block is behind it */
extern const uint8_t board_config_end[];

/* Initialises everything below except the CAN controller. The pin is low afterwards. Every wait is bounded: a clock
 * that does not start, or runs at another rate, leads to board_halt with the pin low, nothing sent, and the watchdog
 * running. */
void board_init(void);

/* Cause of the start. Call it once, after board_init and before restarts_note. */
guard_start_t board_start_cause(void);

uint64_t clock_us(void); /* since start-up; call at least every 4 s */

void can_init(
    wire_format_t format); /* sets filters for what protocol_receive lists and for StopCommand, and joins the bus */
bool can_receive(can_frame_t *frame);
/* Cancels all frames of the last answer that are still pending, then sends these: an old permission is never sent late.
 * True if the controller accepted all of them. */
bool can_answer(const can_frame_t frames[], uint32_t count);
uint32_t can_faults(void); /* since the last call: CAN_FAULT_* */

void permission_toggle(void);
void permission_withdraw(void); /* low */

void watchdog_start(uint32_t timeout_us); /* cannot be stopped */
void watchdog_serve(void);

bool uart_write(char character); /* false: no space now */

_Noreturn void board_halt(void);        /* after a fault: sends nothing and no longer serves the watchdog */
_Noreturn void main_returned(int code); /* called if main returns, in images that do not ship */

#endif
