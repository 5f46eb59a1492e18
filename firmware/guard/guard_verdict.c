#include "guard_parts.h"

static const guard_reason_t waiting_reason[INPUT_COUNT] = {GUARD_REASON_SETTLING, GUARD_REASON_WAITING_SYNC,
                                                           GUARD_REASON_WAITING_JOINT, GUARD_REASON_WAITING_TASK};

static uint32_t category(const guard_t *self) {
    const guard_config_t *const config = self->config;
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        return config->stop_collision;
    case GUARD_STATE_STOPPED:
    case GUARD_STATE_FAULT:
        return self->trip.category;
    case GUARD_STATE_UNINITIALISED:
    case GUARD_STATE_SELF_TEST:
    case GUARD_STATE_WAITING:
    default:
        return config->stop_input;
    }
}

/* A time in the future is older, too: its age is near 2^64. */
static bool is_older(const guard_input_t *input, uint32_t deadline_us, uint64_t now_us) {
    return !input->seen || ((now_us - input->good_us) > deadline_us);
}

/* The second computation, for the inverted copy of the permission. It reads the state's inverted word instead of the
 * state, and the conditions of a permission. True: no permission. */
static bool is_withheld(const guard_t *self, uint64_t now_us) {
    const guard_config_t *const config = self->config;
    const bool other_state = self->state_inverted != ~(uint32_t)GUARD_STATE_MONITORING;
    const bool old = is_older(&self->inputs.sync, config->sync_deadline_us, now_us) ||
                     is_older(&self->inputs.joints, config->joint_deadline_us, now_us) ||
                     is_older(&self->inputs.task, config->task_deadline_us, now_us) || !joints_in_cycles(self) ||
                     !task_in_cycles(self);
    const bool unfit = !is_settled(self) || (self->acknowledged != (uint8_t)GUARD_SET) || (self->inputs.fault != 0u) ||
                       (self->plausibility.fault != 0u);
    const bool blind = is_blind(self) && (config->sight.reaction == (uint32_t)SIGHT_WITHDRAW);
    return other_state || old || unfit || blind || self->detector.tripped || self->explained.tripped;
}

static void tell_waiting(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out) {
    const bool restarted =
        (self->start_cause != (uint8_t)GUARD_START_POWER_ON) && (self->start_cause != (uint8_t)GUARD_START_COMMANDED);
    if (self->inputs.fault != 0u) {
        out->reason = (guard_reason_t)self->inputs.fault;
        out->joint = self->inputs.fault_joint;
    } else if (missing != INPUT_NONE) {
        out->reason = waiting_reason[missing];
        out->joint = (uint8_t)((missing == INPUT_JOINTS) ? missing_joint(&self->inputs.snapshot) : 0u);
    } else if (self->plausibility.fault != 0u) {
        out->reason = (guard_reason_t)self->plausibility.fault;
        out->joint = (uint8_t)(self->plausibility.joint + 1u);
    } else if (is_settled(self) && is_blind(self) && (self->config->sight.reaction == (uint32_t)SIGHT_WITHDRAW)) {
        out->reason = GUARD_REASON_BLIND;
    } else if (healthy_for_long_enough(self, now_us) && (self->acknowledged != (uint8_t)GUARD_SET)) {
        out->reason = restarted ? GUARD_REASON_RESTARTED : GUARD_REASON_AWAITING_RESET;
    } else {
        out->reason = GUARD_REASON_SETTLING;
    }
}

static void tell_reason(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out) {
    switch ((guard_state_t)self->state) {
    case GUARD_STATE_MONITORING:
        out->reason = GUARD_REASON_NONE;
        out->joint = (uint8_t)(self->detector.joint + 1u);
        out->value_channel = self->detector.channel[self->detector.joint];
        out->value_nm = self->detector.value_nm[self->detector.joint];
        out->threshold_nm = self->detector.threshold_nm[self->detector.joint];
        break;
    case GUARD_STATE_STOPPED:
    case GUARD_STATE_FAULT:
        out->reason = (guard_reason_t)self->trip.reason;
        out->joint = self->trip.joint;
        out->value_channel = self->trip.channel;
        out->value_nm = self->trip.value_nm;
        out->threshold_nm = self->trip.threshold_nm;
        break;
    case GUARD_STATE_WAITING:
        tell_waiting(self, missing, now_us, out);
        break;
    case GUARD_STATE_SELF_TEST:
        out->reason = GUARD_REASON_SELF_TEST;
        break;
    case GUARD_STATE_UNINITIALISED:
    default:
        out->reason = GUARD_REASON_UNINITIALISED;
        break;
    }
}

static void tell_sight(const guard_t *self, guard_output_t *out) {
    const bool slow = is_blind(self) && (self->config->sight.reaction != (uint32_t)SIGHT_REPORT);
    const uint32_t task = (self->task < (uint32_t)TASK_COUNT) ? self->task : (uint32_t)TASK_INVALID;
    out->full_speed = out->permitted && !slow;
    out->blind_links = (uint8_t)self->sight.blind;
    out->needed_links = (uint8_t)self->config->task[task].needed_links;
}

static void tell_contact(const guard_contact_t *contact, guard_output_t *out) {
    out->contact_class = contact->kind;
    out->contact_link = (uint8_t)contact->locate.link;
    if (contact->locate.link != 0u) {
        out->contact_force = contact->locate.force_n;
    }
}

void verdict_fill(const guard_t *self, input_t missing, uint64_t now_us, guard_output_t *out) {
    const uint32_t joints = (self->joints < ROBOT_MAX_JOINTS) ? self->joints : ROBOT_MAX_JOINTS;
    out->state = (guard_state_t)self->state;
    out->permitted = self->state == (uint32_t)GUARD_STATE_MONITORING;
    out->withheld = is_withheld(self, now_us);
    out->fresh = self->evaluated;
    out->task = (uint8_t)self->task;
    out->stop_category = (uint8_t)category(self);
    out->trip_number = self->trip.number;
    out->cycle = self->inputs.snapshot.cycle;
    out->channel = self->detector.channel[self->detector.joint];
    tell_sight(self, out);
    tell_contact(&self->contact, out);
    out->smallest_singular = self->index.smallest;
    out->rank = self->index.rank;
    const bool measured = self->state > (uint32_t)GUARD_STATE_SELF_TEST; /* not the self-test's own push */
    for (uint32_t i = 0; measured && (i < joints); ++i) {
        out->residual[i] = self->observer.residual[i];
        out->index[i] = self->detector.value_nm[i];
        out->threshold[i] = self->detector.threshold_nm[i];
        out->index_channel[i] = self->detector.channel[i];
    }
    tell_reason(self, missing, now_us, out);
}
