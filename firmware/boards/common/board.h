/* board: what a circuit gives the guard's loop (loop.h). Each board implements every function once; all are polled,
 * none waits, and no interrupt is used.
 *
 * Permission goes out twice: as a frame, and as a pin that must go on toggling. A safety relay behind a charge pump
 * drops out when the edges stop, whatever level the pin stopped at; so a hung processor withdraws it as well.
 */
#ifndef TAUPERP_BOARD_H
#define TAUPERP_BOARD_H

#include "frame.h"
#include "guard.h"

/* What the image is for; the identity record and GuardStatus.Variant say it. */
#if defined(TAUPERP_LOCKSTEP)
#define BOARD_VARIANT GUARD_VARIANT_LOCKSTEP
#elif defined(TAUPERP_EMULATOR)
#define BOARD_VARIANT GUARD_VARIANT_EMULATOR
#else
#define BOARD_VARIANT GUARD_VARIANT_PRODUCT
#endif

/* What the CAN controller reports besides frames. */
enum {
    CAN_FAULT_OVERFLOW = 1u, /* frames were lost before they were read */
    CAN_FAULT_OFF = 2u,      /* bus-off; can_faults has started the recovery (128 times 11 recessive bits) */
    CAN_FAULT_STUCK = 4u     /* a frame of the answer before did not get onto the bus, and was taken back */
};

extern const guard_config_t board_config;

/* Everything below, except the controller; the pin is low afterwards. Every wait is bounded: a clock that does not
 * start or runs at another rate ends in board_halt with the pin low, nothing sent, and the watchdog running. */
void board_init(void);

/* Why the board starts. Once, after board_init and before restarts_note. */
guard_start_t board_start_cause(void);

uint64_t clock_us(void); /* since start-up; must be called at least every 4 s */

void can_init(
    wire_format_t format); /* filters for what protocol_receive lists and for StopCommand, and joins the bus */
bool can_receive(can_frame_t *frame);
/* Takes back whatever of the last answer has not gone out yet, then sends these: an old permission is never sent late.
 * True if the controller took all of them. */
bool can_answer(const can_frame_t frames[], uint32_t count);
uint32_t can_faults(void); /* since the last call: CAN_FAULT_* */

void permission_toggle(void);
void permission_withdraw(void); /* low */

void watchdog_start(uint32_t timeout_us); /* no way back */
void watchdog_serve(void);

bool uart_write(char character); /* false: no room now */

_Noreturn void board_halt(void);        /* after a fault: nothing more is sent or served */
_Noreturn void main_returned(int code); /* which main of an image that ships does not */

#endif
