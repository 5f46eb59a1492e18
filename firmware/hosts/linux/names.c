#include "names.h"

#include <stddef.h>

#include "guard.h"

/* tests/bus holds these against the DBC's value tables. */
static const char *const STATES[] = {"Uninitialised", "SelfTest", "Waiting", "Monitoring", "Stopped", "Fault"};
static const char *const REASONS[] = {"Uninitialised", "None",           "SelfTest",       "WaitingSync",
                                      "WaitingJoint",  "WaitingTask",    "Collision",      "SyncTimeout",
                                      "JointTimeout",  "TaskTimeout",    "TaskInvalid",    "SensorStatus",
                                      "InputRange",    "TickLate",       "TickOverBudget", "ConfigCorrupt",
                                      "StateCorrupt",  "SelfTestFailed", "StageMissed",    "BusOff",
                                      "BusDown",       "RxOverflow",     "Shutdown",       "TimeBackwards",
                                      "Saturated",     "Settling",       "AnotherGuard",   "AwaitingReset",
                                      "Restarted",     "RestartLimit",   "CycleJump",      "ObserverRestart",
                                      "Implausible",   "Frozen",         "ErrorRate",      "AnotherSender",
                                      "ClockRate",     "ClockStopped",   "ExplainedForce", "ExplainedMoment",
                                      "ResidualLimit"};
_Static_assert(sizeof REASONS / sizeof REASONS[0] == GUARD_REASON_COUNT, "each reason has its name");
static const char *const TASKS[] = {"Invalid", "None", "Payload", "Contact"};

static const char *pick(const char *const *names, size_t count, uint32_t number) {
    return (number < count) ? names[number] : "Unknown";
}

const char *state_name(uint32_t state) {
    return pick(STATES, sizeof STATES / sizeof STATES[0], state);
}

const char *reason_name(uint32_t reason) {
    return pick(REASONS, sizeof REASONS / sizeof REASONS[0], reason);
}

const char *task_name(uint32_t task) {
    return pick(TASKS, sizeof TASKS / sizeof TASKS[0], task);
}
