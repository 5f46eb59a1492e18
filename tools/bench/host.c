/* host: the counting programs' board functions, on the host under Valgrind's Callgrind.
 *
 * Callgrind counts every instruction. On the program's request it appends the count since the last dump to a file; the
 * last line is the sum, which is read back at once. Without Callgrind nothing is counted.
 */
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <valgrind/callgrind.h>

#include "counter.h"
#include "semihosting.h"

#define TAIL_BYTES 64u

static int dumps;
static uint32_t instructions;

static _Noreturn void give_up(const char *why) {
    semihosting_write(why);
    semihosting_exit(1);
}

void counter_init(void) {
    const char *const path = getenv("BENCH_DUMPS"); /* where Callgrind appends */
    CALLGRIND_DUMP_STATS;                           /* so that the file exists */
    dumps = (path != 0) ? open(path, O_RDWR) : -1;
    if (dumps < 0) {
        give_up("not under callgrind, or BENCH_DUMPS does not name its file\n");
    }
}

/* "totals: N" at the end of the file. The file is truncated, because it would otherwise grow by a gigabyte. */
static uint32_t last_total(void) {
    char tail[TAIL_BYTES + 1u] = {0};
    const off_t end = lseek(dumps, 0, SEEK_END);
    const off_t from = (end > (off_t)TAIL_BYTES) ? (end - (off_t)TAIL_BYTES) : 0;
    if (pread(dumps, tail, TAIL_BYTES, from) <= 0) {
        give_up("callgrind wrote nothing\n");
    }
    const char *const total = strstr(tail, "totals: ");
    if ((total == 0) || (ftruncate(dumps, 0) != 0)) {
        give_up("callgrind's file is not as expected\n");
    }
    return (uint32_t)strtoul(total + strlen("totals: "), 0, 10);
}

uint32_t counter_read(void) {
    CALLGRIND_DUMP_STATS;
    instructions += last_total();
    CALLGRIND_ZERO_STATS;
    return instructions;
}

uint32_t counter_instructions(uint32_t from, uint32_t to) {
    return to - from;
}

void semihosting_write(const char *text) {
    if (write(STDOUT_FILENO, text, strlen(text)) < 0) {
        exit(1);
    }
}

_Noreturn void semihosting_exit(int32_t code) {
    exit(code);
}
