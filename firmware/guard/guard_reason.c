#include "guard_reason.h"

reason_class_t reason_class(guard_reason_t reason) {
    return ((uint32_t)reason < (uint32_t)GUARD_REASON_COUNT) ? (reason_class_t)reason_class_of[reason] : REASON_UNKNOWN;
}

bool reason_is_contact(guard_reason_t reason) {
    return (reason == GUARD_REASON_COLLISION) || (reason == GUARD_REASON_SUDDEN) ||
           (reason == GUARD_REASON_EXPLAINED_FORCE) || (reason == GUARD_REASON_EXPLAINED_MOMENT) ||
           (reason == GUARD_REASON_RESIDUAL_LIMIT);
}

/* 0 for no reason. An unknown reason ranks with FAULT. */
static uint32_t rank(guard_reason_t reason) {
    const reason_class_t class = reason_class(reason);
    if ((reason == GUARD_REASON_UNINITIALISED) || (reason == GUARD_REASON_NONE)) {
        return 0u;
    }
    return (class == REASON_UNKNOWN) ? (uint32_t)REASON_FAULT : (uint32_t)class;
}

guard_reason_t reason_worse(guard_reason_t first, guard_reason_t second) {
    /* NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): an unknown reason is kept, and ranks with FAULT */
    return (rank(second) > rank(first)) ? second : first;
}
