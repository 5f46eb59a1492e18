/* tauperp: the firmware as a shared library, for hosts that drive it in lockstep. Everything below is the firmware's
 * own interface; the library adds what a loader wants to know about it. */
#ifndef TAUPERP_H
#define TAUPERP_H

#include "arrays.h"
#include "event_log.h"
#include "guard.h"
#include "robot.h"
#include "robot_side.h"
#include "schedule.h"

/* Release version as major << 16 | minor << 8 | patch, and what the build decided. */
uint32_t tauperp_version(void);
uint32_t tauperp_numeric(void);     /* numeric_t */
uint32_t tauperp_config_size(void); /* sizeof(guard_config_t) */

#endif
