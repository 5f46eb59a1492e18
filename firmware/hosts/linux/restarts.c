#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include "restarts.h"

#include <fcntl.h>
#include <limits.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char file_name[] = "/restarts";

/* False without a folder, or if the path is too long. */
static bool path_of(char path[PATH_MAX]) {
    const char *const folder = getenv("RUNTIME_DIRECTORY");
    if ((folder == NULL) || ((strlen(folder) + sizeof file_name) > (size_t)PATH_MAX)) {
        return false;
    }
    const size_t length = strlen(folder);
    /* NOLINTNEXTLINE(bugprone-not-null-terminated-result): file_name, which follows, ends with the null */
    (void)memcpy(path, folder, length);
    (void)memcpy(path + length, file_name, sizeof file_name);
    return true;
}

/* The count is unknown: the next unexpected restart is the last. */
static const restarts_t uncounted = {.cause = GUARD_START_UNKNOWN, .count = GUARD_MAX_RESTARTS};

restarts_t restarts_note(void) {
    char path[PATH_MAX];
    restarts_t restarts = {.cause = GUARD_START_COMMANDED};
    if (!path_of(path)) {
        return restarts;
    }
    const int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0) {
        return uncounted;
    }
    uint8_t count = 0;
    if (read(file, &count, sizeof count) == (ssize_t)sizeof count) { /* written by the previous process */
        restarts.cause = GUARD_START_SERVICE;
        restarts.count = (count < UINT8_MAX) ? (count + 1u) : UINT8_MAX;
    }
    count = (uint8_t)restarts.count;
    const bool written = pwrite(file, &count, sizeof count, 0) == (ssize_t)sizeof count;
    (void)close(file);
    return written ? restarts : uncounted;
}

void restarts_forget(void) {
    char path[PATH_MAX];
    if (path_of(path)) {
        (void)unlink(path);
    }
}
