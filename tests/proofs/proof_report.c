/* firmware/guard/guard_report.c and event_log.c: any verdict becomes frames. */
#include "proof.h"

#include "guard_any.h"
#include "messages.c"
#include "protocol.c"
#include "scale.h"

static e2e_transmitter_t sealed; /* e2e_protect is shown in proof_e2e.c */

void e2e_protect(e2e_transmitter_t *self, uint8_t *data, uint8_t length, const uint8_t *data_ids) {
    HOLDS((length >= 2u) && (length <= CAN_FRAME_DATA_LENGTH), "the precondition of e2e_protect");
    HOLDS(__CPROVER_w_ok(data, length) && __CPROVER_r_ok(data_ids, E2E_DATA_ID_COUNT), "the bytes are readable");
    *self = sealed;
}

/* guard_opinion.c */
bool guard_is_alone(const guard_t *self) {
    bool alone;
    (void)self;
    return alone;
}

/* A root is of proofs.toml's gaps. */
static num_t any_root(void) {
    num_t root;
    ASSUME(root >= 0);
    return root;
}

#define num_root(square) ((void)(square), any_root())
#include "guard_report.c"

static void report_with(bool configured) {
    guard_t guard;
    guard_output_t out;
    any_guard(&guard);
    if (!configured) {
        guard.config = 0;
        guard.joints = 0;
    }
    ASSUME(guard.report.round_robin < (2u * PAGE_COUNT * 840u));
    report_tick(&guard, &out);
    HOLDS((out.frame_count >= 1u) && (out.frame_count <= GUARD_MAX_FRAMES), "StopCommand and one more frame");
    HOLDS(out.frame[0].id == protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND].id, "the first frame is StopCommand");
    HOLDS(guard.report.round_robin < (2u * PAGE_COUNT * 840u), "the number of the turn stays bounded");
}

void proof_report(void) {
    report_with(true);
    REACHED;
}

void proof_report_without_block(void) {
    report_with(false);
    REACHED;
}

void proof_report_init(void) {
    guard_report_t report;
    report_init(&report);
    REACHED;
}
