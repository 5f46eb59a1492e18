#include "guard_parts.h"
#include "guard_reason.h"

/* A collision brings an index from half of its threshold to all of it in less than this. */
#define TOUCH_RISE_US 40000u
#define LOCATE_US     64000u  /* after the trip: a mean over it locates the contact; longer than every period */
#define CLAMPING_US   750000u /* a contact that rose fast, and lasts this long after the stop */

void contact_init(guard_contact_t *self) {
    *self = (guard_contact_t){.kind = (uint8_t)CONTACT_CLASS_UNKNOWN};
    locate_init(&self->locate);
}

/* The smallest threshold of each joint that applies to the unexplained torque, Nm; 0 without one. */
static void thresholds(const guard_t *self, num_t out[]) {
    const uint32_t number = (self->task < (uint32_t)TASK_COUNT) ? self->task : (uint32_t)TASK_INVALID;
    const detector_config_t *const detector = &self->config->task[number].detector;
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        out[i] = NUM(0);
        for (uint32_t c = 0; c < BANK_MAX_CHANNELS; ++c) {
            if (((detector->channels & (1u << c)) != 0u) &&
                (self->config->bank.channel[c].of == (uint32_t)CHANNEL_UNEXPLAINED)) {
                const num_t one = detector->threshold_nm[c][i];
                out[i] = (out[i] == NUM(0)) ? one : num_min(out[i], one);
            }
        }
    }
}

void contact_note_trip(guard_t *self, const guard_event_t *event) {
    guard_contact_t *const contact = &self->contact;
    if (reason_is_contact(event->reason)) {
        const bool named = (event->joint > 0u) && (event->joint <= ROBOT_MAX_JOINTS);
        const uint32_t joint = named ? (event->joint - 1u) : 0u;
        contact->kind = (uint8_t)CONTACT_CLASS_UNKNOWN;
        contact->slow = ((uint32_t)contact->rising[joint] * self->config->period_us) >= TOUCH_RISE_US;
        contact->held = 0;
        contact->touching = true;
        num_t noise[ROBOT_MAX_JOINTS];
        thresholds(self, noise);
        locate_begin(&contact->locate, self->joints, LOCATE_US / self->config->period_us, noise);
        self->sight.axis = 0; /* from now on the search selects the link that the motion pass keeps */
        self->sight.seen = false;
    }
}

/* Returns true if no index is above half of its threshold. */
static bool count_rising(guard_contact_t *self, const detector_t *detector, uint32_t joints) {
    bool calm = true;
    for (uint32_t i = 0; i < joints; ++i) {
        const bool half = !(num_abs(detector->value_nm[i]) <= (detector->threshold_nm[i] / 2));
        const uint32_t more = self->rising[i] + 1u;
        self->rising[i] = half ? (uint16_t)((more < UINT16_MAX) ? more : UINT16_MAX) : 0u;
        calm = calm && !half;
    }
    return calm;
}

void contact_step(guard_t *self) {
    guard_contact_t *const contact = &self->contact;
    const bool calm = count_rising(contact, &self->detector, self->joints);
    const bool done = locate_step(&contact->locate, &self->config->shape, self->joints, &self->motion, &self->observer,
                                  &self->index, &self->explained, calm);
    if (done) {
        contact->kind = (uint8_t)(contact->slow ? CONTACT_CLASS_TOUCH : CONTACT_CLASS_COLLISION);
    }
    contact->touching =
        contact->touching && (self->detector.any_above || (self->explained.excess != EXPLAINED_NOTHING));
    contact->held += contact->touching ? 1u : 0u;
    if (contact->touching && !contact->slow && (contact->locate.steps == 0u) &&
        (((uint64_t)contact->held * self->config->period_us) >= CLAMPING_US)) {
        contact->kind = (uint8_t)CONTACT_CLASS_CLAMPING;
        contact->touching = false;
    }
}
