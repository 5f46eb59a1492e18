/* config_bounds: the bounds of a configuration block, so that no block can disable the detection.
 *
 * `tauperp config` states the same bounds in words. tests/host/test_config_bounds.py compares the two.
 */
#ifndef TAUPERP_CONFIG_BOUNDS_H
#define TAUPERP_CONFIG_BOUNDS_H

#include "config.h"

#define CONFIG_PERIOD_MIN_US       250u
#define CONFIG_PERIOD_MAX_US       50000u
#define CONFIG_INPUT_MAX_CYCLES    15u     /* Sync and TaskCommand: the E2E counter cannot distinguish more */
#define CONFIG_INPUT_MAX_US        500000u /* deadline of any input */
#define CONFIG_TICK_MAX_CYCLES     8u
#define CONFIG_TICK_MAX_US         200000u
#define CONFIG_HEALTHY_MAX_US      60000000u
#define CONFIG_SLOWEST_SETTLING_US 500000u /* 5/K of the slowest observer: K is at least 10 1/s */
#define CONFIG_DEBOUNCE_MAX_US     100000u /* two ticks of the longest period */
#define CONFIG_DWELL_MIN_US        200000u
#define CONFIG_DWELL_MAX_US        300000u
#define CONFIG_REACTION_MAX_US     600000u

#define CONFIG_PAYLOAD_MIN_JOINTS 6u

#define CONFIG_THRESHOLD_SHARE     3u /* a threshold is at most the joint's torque limit divided by this */
#define CONFIG_RESIDUAL_SHARE      2u /* a limit on |r| is at most the joint's torque limit times this */
#define CONFIG_SENSOR_SHARE        4u /* offset and friction are at most the joint's torque limit divided by this */
#define CONFIG_MASS_MAX_KG         50
#define CONFIG_ARM_MAX_M           1
#define CONFIG_FORCE_SLACK_MAX_N   60
#define CONFIG_MOMENT_SLACK_MAX_NM 20
#define CONFIG_ERROR_MAX_M_S2      10
#define CONFIG_FORCE_FLOOR_MAX_N   20
#define CONFIG_SIGHT_MAX_N         500
#define CONFIG_SHAPE_MAX_M         4 /* of a link's middle from its frame, each coordinate, and its half length */
#define CONFIG_POINT_MAX_M         1 /* distance of a contact from the end-effector point, each coordinate */

/* Checks the bounds alone, for a block with valid identity and CRC: GUARD_OK, or the first violated bound. */
guard_status_t config_bounds_check(const guard_config_t *config);

#endif
