/* firmware/guard/guard_rise.c and guard_plausible.c. */
#include "num_stub.h"

#include "guard_plausible.c"
#include "guard_rise.c"

void proof_rise(void) {
    rise_t rise;
    detector_t detector;
    uint32_t joints;
    uint64_t now_us;
    ASSUME((joints <= ROBOT_MAX_JOINTS) && (rise.snapshots <= 3u) && (rise.joint < ROBOT_MAX_JOINTS));
    (void)rise_step(&rise, &detector, joints, now_us);
    HOLDS((rise.snapshots <= 3u) && (rise.joint < ROBOT_MAX_JOINTS), "the counts stay bounded");
    rise_start(&rise, now_us);
    REACHED;
}

void proof_plausibility(void) {
    plausibility_t plausibility;
    observer_config_t gains;
    snapshot_t snapshot;
    motion_t motion;
    uint32_t joints, gap;
    ASSUME((joints >= 1u) && (joints <= ROBOT_MAX_JOINTS) && (plausibility.joint < ROBOT_MAX_JOINTS));
    for (uint32_t g = 0; g < OBSERVER_MAX_GAP; ++g) {
        ASSUME((gains.decay[g] > 0) && (gains.decay[g] < NUM(1)));
    }
    plausibility_step(&plausibility, &gains, joints, gap, &snapshot, &motion);
    HOLDS(plausibility.joint < joints || plausibility.fault == 0u, "the joint is one of the arm's");
    HOLDS(plausibility.joint < ROBOT_MAX_JOINTS, "the joint stays bounded");
    plausibility_init(&plausibility);
    REACHED;
}
