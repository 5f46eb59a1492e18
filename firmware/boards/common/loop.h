/* loop: the guard on a board. It receives every frame, makes one tick per cycle and sends every answer.
 *
 * schedule.h decides when to tick. Built with TAUPERP_LOCKSTEP, guard time is bus time (lockstep.h). The answers are
 * then those of the library, byte for byte, at any processor speed. Use lockstep for emulators and test benches only,
 * because it has no deadlines for a silent bus.
 *
 * The watchdog is served after a complete tick and nowhere else.
 */
#ifndef TAUPERP_LOOP_H
#define TAUPERP_LOOP_H

_Noreturn void loop_run(void);

#endif
