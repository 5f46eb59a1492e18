#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include "block.h"

#include <errno.h>
#include <fcntl.h>
#include <stdbool.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "options.h"

/* Reads up to `size` bytes. Returns their number, or -1 with errno. */
static ssize_t read_all(int file, unsigned char *bytes, size_t size) {
    size_t done = 0;
    while (done < size) {
        const ssize_t more = read(file, &bytes[done], size - done);
        if ((more < 0) && (errno == EINTR)) {
            continue;
        }
        if (more < 0) {
            return -1;
        }
        if (more == 0) {
            break;
        }
        done += (size_t)more;
    }
    return (ssize_t)done;
}

static bool is_for(const guard_config_t *block, const char *path, const char *robot) {
    char name[ROBOT_NAME_LENGTH + 1u] = {0};
    (void)memcpy(name, block->robot.name, ROBOT_NAME_LENGTH);
    if (strcmp(name, robot) == 0) {
        return true;
    }
    /* Print a name only from data with the header of a block, and without characters that a terminal would obey. */
    for (uint32_t i = 0; i < ROBOT_NAME_LENGTH; ++i) {
        const bool drawn = (name[i] == '\0') || ((name[i] >= ' ') && (name[i] <= '~'));
        name[i] = (char)(drawn ? name[i] : '?');
    }
    if (block->magic == CONFIG_MAGIC) {
        complain("%s: the block is for the robot '%s', not for '%s'", path, name, robot);
    } else {
        complain("%s: %s", path, block_problem(GUARD_BAD_MAGIC));
    }
    return false;
}

const guard_config_t *block_load(const char *path, const char *robot, const void **second) {
    const size_t size = sizeof(guard_config_t);
    const size_t most = 2u * size;
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        complain("%s: %s", path, strerror(errno));
        return NULL;
    }
    /* One byte more than two blocks, to detect a file that is too long. */
    void *const memory = mmap(NULL, most + 1u, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    const ssize_t length = (memory == MAP_FAILED) ? -1 : read_all(file, memory, most + 1u);
    const int reason = errno;
    (void)close(file);
    if (length < 0) {
        complain("%s: %s", path, strerror(reason));
        return NULL;
    }
    const guard_config_t *const block = memory;
    if (((size_t)length >= sizeof block->magic) && (block->magic != CONFIG_MAGIC)) {
        complain("%s: %s", path, block_problem(GUARD_BAD_MAGIC));
        return NULL;
    }
    if (((size_t)length != size) && ((size_t)length != most)) {
        complain("%s: %s%zd bytes, a configuration block of this firmware has %zu, two channels have two of them", path,
                 ((size_t)length > most) ? "more than " : "", ((size_t)length > most) ? length - 1 : length, size);
        return NULL;
    }
    if (!is_for(block, path, robot)) {
        return NULL;
    }
    if (mprotect(memory, most + 1u, PROT_READ) != 0) {
        complain("%s: %s", path, strerror(errno));
        return NULL;
    }
    *second = ((size_t)length == most) ? (const void *)&block[1] : NULL;
    return block;
}

const char *block_problem(guard_status_t status) {
    switch (status) {
    case GUARD_BAD_MAGIC:
        return "not a configuration block (made by 'tauperp config FILE -o OUT')";
    case GUARD_BAD_SCHEMA:
        return "made for another version of the firmware; make it again with 'tauperp config'";
    case GUARD_BAD_SIZE:
        return "the size that it states is not that of a block of this firmware";
    case GUARD_BAD_CRC:
        return "its CRC is wrong: the file is damaged or was edited";
    case GUARD_BAD_NUMERIC:
        return "made for the other number type (see 'tauperp config --numeric')";
    case GUARD_BAD_WIRE:
        return "made for another DBC; make it again with 'tauperp config'";
    case GUARD_BAD_ROBOT:
        return "its robot table is not valid";
    case GUARD_BAD_TIMING:
        return "a period, deadline or budget is out of range";
    case GUARD_BAD_TASK:
        return "a task has a threshold or debounce that is not positive, or an unknown index; or no task is configured";
    case GUARD_CONTACT_NEEDS_JOINTS:
        return "a contact explains as many directions as the arm has joints: the guard would detect no force";
    case GUARD_PAYLOAD_NEEDS_6_JOINTS:
        return "d_p needs 6 joints: with fewer the guard would detect no force";
    case GUARD_BAD_OBSERVER:
        return "the observer's constants are inconsistent";
    case GUARD_BAD_SUBSPACE:
        return "the projection's tolerance, lever or basis is out of range";
    case GUARD_BAD_STOP:
        return "a stop category is not 0, 1 or 2";
    case GUARD_BAD_SENSOR:
        return "a sensor's offset or friction is out of range";
    case GUARD_BAD_LIMITS:
        return "a limit on what a task explains is out of range";
    case GUARD_BAD_BANK:
        return "a channel's gain is not 1, or no channel of a task detects a constant force";
    case GUARD_TOO_SLOW:
        return "the worst-case reaction time is too long";
    case GUARD_BAD_PAIR:
        return "its two blocks are of different installations";
    case GUARD_STATUS_NONE:
    case GUARD_OK:
    default:
        return "refused";
    }
}
