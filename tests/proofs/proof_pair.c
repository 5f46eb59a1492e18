/* firmware/pair/pair.c: any guard in two channels, or in one. */
#include "guard_stub.h"
#include "pair.c"

static uint32_t second_status;
static bool second_permits;

uint32_t tauperp_second_start(tauperp_second_t *self, const void *block) {
    there(self, sizeof(*self));
    HOLDS(block != 0, "the second block is there");
    return second_status;
}

void tauperp_second_note_start(tauperp_second_t *self, uint32_t cause, uint32_t restarts, uint32_t variant) {
    there(self, sizeof(*self));
}

void tauperp_second_receive(tauperp_second_t *self, const can_frame_t *frame, uint64_t now_us) {
    there(self, sizeof(*self));
}

static bool second_complete;

bool tauperp_second_complete(const tauperp_second_t *self) {
    HOLDS(__CPROVER_r_ok(self, sizeof(*self)), "the second channel is there");
    return second_complete;
}

void tauperp_second_look(tauperp_second_t *self, uint64_t now_us, tauperp_second_finding_t *finding,
                         opinion_t *opinion) {
    opinion_t any;
    there(self, sizeof(*self));
    there(finding, sizeof(*finding));
    there(opinion, sizeof(*opinion));
    *opinion = any;
}

bool tauperp_second_decide(tauperp_second_t *self, uint64_t now_us, const tauperp_second_finding_t *finding,
                           const opinion_t *own, const opinion_t *other) {
    there(self, sizeof(*self));
    HOLDS(own != other, "two opinions");
    return second_permits;
}

static bool confirmed;

void tauperp_second_confirm(const tauperp_second_t *self, can_frame_t *stop_command) {
    there(stop_command, sizeof(*stop_command));
    confirmed = true;
}

void tauperp_second_note_tick_time(tauperp_second_t *self, uint32_t tick_us) {
    there(self, sizeof(*self));
}

void tauperp_second_trip(tauperp_second_t *self, uint32_t reason) {
    there(self, sizeof(*self));
}

void proof_pair_init(void) {
    pair_t pair;
    guard_config_t first, second;
    bool two;
    __CPROVER_havoc_object(&second_status);
    refusals = 0;
    const guard_status_t status = pair_init(&pair, &first, two ? &second : 0);
    if (status == GUARD_OK) {
        HOLDS(pair.guard.config == &first, "the first channel uses its block");
        HOLDS(guard_is_alone(&pair.guard) == !two, "two blocks: two channels");
        HOLDS(!two || (second_status == (uint32_t)GUARD_OK), "the second channel accepts its block");
        HOLDS(!two || ((first.wire == second.wire) && (first.period_us == second.period_us) &&
                       (first.robot.joint_count == second.robot.joint_count)),
              "both blocks are of one installation");
    } else {
        HOLDS(pair.guard.config == 0, "without both blocks no channel has one");
    }
    REACHED;
}

/* Neither channel alone permits. */
void proof_pair_tick(void) {
    pair_t pair;
    guard_config_t block;
    guard_output_t out;
    uint64_t now_us;
    bool refused;
    __CPROVER_havoc_object(&second_permits);
    pair.guard.config = refused ? 0 : &block;
    confirmed = false;
    pair_tick(&pair, now_us, &out);
    if (!refused && !guard_is_alone(&pair.guard)) {
        HOLDS(!out.permitted || (second_permits && !out.withheld), "both channels permit");
        HOLDS(confirmed, "the second channel writes its copy");
        HOLDS(out.withheld || second_permits, "the copy is the second channel's");
    }
    REACHED;
}

void proof_pair_calls(void) {
    pair_t pair;
    can_frame_t frame;
    uint64_t now_us;
    guard_start_t cause;
    guard_variant_t variant;
    guard_reason_t reason;
    uint32_t number;
    __CPROVER_havoc_object(&second_complete);
    pair_note_start(&pair, cause, number, variant);
    pair_receive(&pair, &frame, now_us);
    const bool complete = pair_cycle_complete(&pair);
    HOLDS(guard_is_alone(&pair.guard) || !complete || second_complete, "complete in both");
    pair_note_tick_time(&pair, number);
    pair_trip(&pair, reason);
    REACHED;
}
