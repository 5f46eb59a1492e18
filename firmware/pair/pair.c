#include "pair.h"

#include <stddef.h>
#include <string.h>

#if TAUPERP_CHANNELS == 2

/* Both blocks have one layout. Their fields that do not depend on the numeric type must be equal. */
static bool is_same_installation(const guard_config_t *first, const void *second) {
    const uint8_t *const a = (const uint8_t *)first;
    const uint8_t *const b = (const uint8_t *)second;
    const size_t begin = offsetof(guard_config_t, wire);
    const size_t end = offsetof(guard_config_t, observer);
    const size_t robot = offsetof(guard_config_t, robot);
    const size_t robot_end = robot + offsetof(robot_t, base); /* name and number of joints */
    return (memcmp(&a[begin], &b[begin], end - begin) == 0) && (memcmp(&a[robot], &b[robot], robot_end - robot) == 0);
}

static guard_status_t join(pair_t *self, const guard_config_t *first, const void *second) {
    const guard_status_t status = (guard_status_t)tauperp_second_start(&self->second, second);
    guard_join(&self->guard, false);
    if ((status == GUARD_OK) && is_same_installation(first, second)) {
        return GUARD_OK;
    }
    guard_refuse(&self->guard);
    return (status == GUARD_OK) ? GUARD_BAD_PAIR : status;
}

static void tick_both(pair_t *self, uint64_t now_us, guard_output_t *out) {
    guard_finding_t finding;
    tauperp_second_finding_t other_finding;
    opinion_t opinion;
    opinion_t other;
    guard_look(&self->guard, now_us, &finding);
    guard_tell(&self->guard, &finding, &opinion);
    tauperp_second_look(&self->second, now_us, &other_finding, &other);
    *out = (guard_output_t){.withheld = true};
    guard_decide(&self->guard, now_us, &finding, &opinion, &other, out);
    const bool permits = tauperp_second_decide(&self->second, now_us, &other_finding, &other, &opinion);
    guard_say(&self->guard, out);
    tauperp_second_confirm(&self->second, &out->frame[0]);
    out->permitted = out->permitted && !out->withheld && permits; /* for a pin in addition to the frame */
    out->withheld = out->withheld || !permits;
}

#define SECOND(self, call)                                                                                             \
    do {                                                                                                               \
        if (!guard_is_alone(&(self)->guard)) {                                                                         \
            call;                                                                                                      \
        }                                                                                                              \
    } while (false)

#else

static guard_status_t join(pair_t *self, const guard_config_t *first, const void *second) {
    (void)first;
    (void)second;
    guard_refuse(&self->guard); /* this image has no second channel */
    return GUARD_BAD_PAIR;
}

#define SECOND(self, call) (void)0

#endif

guard_status_t pair_init(pair_t *self, const guard_config_t *first, const void *second) {
    const guard_status_t status = guard_init(&self->guard, first);
    return ((status != GUARD_OK) || (second == NULL)) ? status : join(self, first, second);
}

void pair_note_start(pair_t *self, guard_start_t cause, uint32_t restarts, guard_variant_t variant) {
    guard_note_start(&self->guard, cause, restarts, variant);
    SECOND(self, tauperp_second_note_start(&self->second, (uint32_t)cause, restarts, (uint32_t)variant));
}

void pair_receive(pair_t *self, const can_frame_t *frame, uint64_t now_us) {
    guard_receive(&self->guard, frame, now_us);
    SECOND(self, tauperp_second_receive(&self->second, frame, now_us));
}

bool pair_cycle_complete(const pair_t *self) {
    bool complete = guard_cycle_complete(&self->guard);
    SECOND(self, complete = complete && tauperp_second_complete(&self->second));
    return complete;
}

void pair_tick(pair_t *self, uint64_t now_us, guard_output_t *out) {
#if TAUPERP_CHANNELS == 2
    if ((self->guard.config != NULL) && !guard_is_alone(&self->guard)) {
        tick_both(self, now_us, out);
        return;
    }
#endif
    guard_tick(&self->guard, now_us, out);
}

void pair_note_tick_time(pair_t *self, uint32_t tick_us) {
    guard_note_tick_time(&self->guard, tick_us);
    SECOND(self, tauperp_second_note_tick_time(&self->second, tick_us));
}

void pair_trip(pair_t *self, guard_reason_t reason) {
    guard_trip(&self->guard, reason);
    SECOND(self, tauperp_second_trip(&self->second, (uint32_t)reason));
}
