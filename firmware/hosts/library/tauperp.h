/* tauperp: the firmware as a shared library, for hosts that drive it in lockstep. It offers the firmware's own
 * interface, and functions that identify the build. */
#ifndef TAUPERP_H
#define TAUPERP_H

#include "arrays.h"
#include "event_log.h"
#include "guard.h"
#include "jacobi.h"
#ifndef TAUPERP_FIXED
#include "pair.h"
#endif
#include "robot.h"
#include "robot_side.h"
#include "schedule.h"

/* Release version as major << 16 | minor << 8 | patch, and properties of the build. */
uint32_t tauperp_version(void);
uint32_t tauperp_numeric(void);     /* numeric_t */
uint32_t tauperp_config_size(void); /* sizeof(guard_config_t) */

#endif
