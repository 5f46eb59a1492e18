/* minimal: the guard in your own program. docs/porting.md describes the build. The board provides the functions below;
 * none of them waits. `tauperp config my_arm.toml -o block.c` writes the configuration block. */
#include "tauperp.h"

extern const uint32_t tauperp_block[];
extern const size_t tauperp_block_size;

bool board_init(void);            /* clocks, CAN controller, watchdog, permission pin low; false ends the program */
uint32_t board_start_cause(void); /* TAUPERP_START_*, from the reset-cause register */
uint32_t board_restarts(void);    /* unexpected restarts since power-on, from memory that a reset preserves */
uint64_t board_clock_us(void);    /* monotonic */
bool board_runs(void);            /* always true on a controller; a test uses it to end the loop */
bool board_receive(tauperp_frame_t *frame);
void board_answer(const tauperp_frame_t frames[], uint32_t count); /* first cancels frames of the last answer */
uint32_t board_bus_fault(void);                                    /* TAUPERP_REASON_* since the last call, or 0 */
void board_permission(bool permitted); /* true: toggles the pin. A safety relay drops out when the edges stop. */
void board_watchdog(void);             /* serves it; only a program that ticks does */

static tauperp_guard_t guard;
static tauperp_output_t out;

static void tick(void) {
    const uint64_t began_us = board_clock_us();
    tauperp_tick(&guard, began_us, &out);
    board_permission(out.permitted);
    board_answer(out.frame, out.frame_count);
    board_watchdog();
    tauperp_note_tick_time(&guard, (uint32_t)(board_clock_us() - began_us));
}

int main(void) {
    if (!board_init()) {
        return 1;
    }
    /* A refused block is no reason to end: the guard reports on the bus that it cannot run, and permits nothing. */
    (void)tauperp_init(&guard, tauperp_block, tauperp_block_size, board_start_cause(), board_restarts(),
                       board_clock_us());
    while (board_runs()) {
        tauperp_frame_t frame;
        const uint32_t fault = board_bus_fault();
        if (fault != 0u) {
            tauperp_trip(&guard, fault);
        }
        if (board_receive(&frame) && tauperp_receive(&guard, &frame, board_clock_us())) {
            tick();
        }
        if (tauperp_is_due(&guard, board_clock_us())) {
            tick();
        }
    }
    return 0;
}
