#include "fuzz.h"

uint64_t fuzz_frames, fuzz_ticks;

static void print(void) {
    (void)fprintf(stderr, "frames %" PRIu64 " ticks %" PRIu64 "\n", fuzz_frames, fuzz_ticks);
}

void fuzz_count_at_exit(void) {
    static bool registered;
    if (!registered) {
        registered = true;
        (void)atexit(print);
    }
}

/* Unity, which guard_fixture.h includes, needs these. */
void setUp(void);
void tearDown(void);

void setUp(void) {}

void tearDown(void) {}
