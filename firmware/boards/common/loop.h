/* loop: the guard on a board. Every frame goes in, each cycle gets its tick, every answer goes out.
 *
 * In real time a tick comes as soon as the cycle is complete, and otherwise when the period has passed; half of what
 * the tick deadline leaves over is the grace that a late cycle gets. Built with TAUPERP_LOCKSTEP, guard time is bus
 * time (lockstep.h): the answers are then the library's, byte for byte, however slow the processor is. That is for
 * emulators and test benches; deadlines of silence do not hold in it.
 *
 * The watchdog is served after a complete tick and nowhere else.
 */
#ifndef TAUPERP_LOOP_H
#define TAUPERP_LOOP_H

_Noreturn void loop_run(void);

#endif
