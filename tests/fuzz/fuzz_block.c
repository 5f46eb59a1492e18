/* fuzz_block: configuration blocks against the loader of the Linux process and guard_init, then frames on those that it
 * accepts.
 *
 * An input is a list of changes to a good block, or a file byte for byte. A refused block permits nothing. An accepted
 * one keeps its bounds, which are written here a second time, and its ticks stay free of undefined behaviour.
 */
#define _GNU_SOURCE /* memfd_create */
#include <stdarg.h>
#include <sys/mman.h>
#include <unistd.h>

#include "config_bounds.h"
#include "fuzz.h"
#include "guard_fixture.h"

/* block.c keeps its memory for the life of the process: here it gets the same memory each time. */
static void *fuzz_mmap(size_t size);
#define mmap(address, size, ...) fuzz_mmap(size)
#define mprotect(address, ...)   ((void)(address), 0)
#include "../../firmware/hosts/linux/block.c"
#undef mmap
#undef mprotect

#define TICKS 80u

static void *fuzz_mmap(size_t size) {
    static void *memory;
    free(memory);
    memory = calloc(1u, size);
    return memory;
}

void complain(const char *format, ...) {
    char line[256];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    REQUIRE(length > 0);
    for (const char *at = line; *at != '\0'; ++at) { /* one line of printable characters */
        REQUIRE((*at >= ' ') && (*at <= '~'));
    }
}

static uint32_t crc32_of(const uint8_t *data, size_t size) {
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 0; i < size; ++i) {
        crc ^= data[i];
        for (uint32_t bit = 0; bit < 8u; ++bit) {
            crc = (crc >> 1) ^ (((crc & 1u) != 0u) ? 0xEDB88320u : 0u);
        }
    }
    return ~crc;
}

static uint32_t next32(bytes_t *bytes) {
    const uint32_t low = next16(bytes);
    return low | ((uint32_t)next16(bytes) << 16);
}

/* One word of the block: replaced, one bit flipped, or changed by a small amount. */
static void change(guard_config_t *config, bytes_t *bytes) {
    uint32_t word = 0;
    const uint16_t where = next16(bytes);
    const size_t offset = sizeof word * ((where & 0x0FFFu) % (sizeof *config / sizeof word));
    memcpy(&word, (const uint8_t *)config + offset, sizeof word);
    switch (where >> 14) {
    case 0:
        word = next32(bytes);
        break;
    case 1:
        word ^= 1u << (next8(bytes) % 32u);
        break;
    case 2:
        word += (uint32_t)(int8_t)next8(bytes);
        break;
    default:
        word = next8(bytes);
        break;
    }
    memcpy((uint8_t *)config + offset, &word, sizeof word);
}

static void judge_accepted(const guard_config_t *config) {
    const size_t behind = offsetof(guard_config_t, numeric);
    REQUIRE(config->crc == crc32_of((const uint8_t *)config + behind, sizeof *config - behind));
    REQUIRE((config->robot.joint_count >= 1u) && (config->robot.joint_count <= ROBOT_MAX_JOINTS));
    REQUIRE((config->period_us >= CONFIG_PERIOD_MIN_US) && (config->period_us <= CONFIG_PERIOD_MAX_US));
    REQUIRE(config->sync_deadline_us <= CONFIG_INPUT_MAX_CYCLES * config->period_us);
    REQUIRE(config->task_deadline_us <= CONFIG_INPUT_MAX_CYCLES * config->period_us);
    REQUIRE(config->joint_deadline_us <= CONFIG_INPUT_MAX_US);
    REQUIRE(config->tick_deadline_us <= CONFIG_TICK_MAX_CYCLES * config->period_us);
    REQUIRE(config_reaction_us(config) <= CONFIG_REACTION_MAX_US);
    for (uint32_t t = 1; t < (uint32_t)TASK_COUNT; ++t) {
        const detector_config_t *const detector = &config->task[t].detector;
        for (uint32_t c = 0; (config->task[t].index.kind != (uint32_t)INDEX_OFF) && (c < config->bank.channels); ++c) {
            for (uint32_t i = 0; ((detector->channels >> c) & 1u) != 0u && (i < config->robot.joint_count); ++i) {
                REQUIRE(num_finite(detector->threshold_nm[c][i]) && (detector->threshold_nm[c][i] > NUM(0)));
            }
        }
    }
}

static void judge_refused(guard_t *guard) {
    guard_output_t out;
    for (uint64_t now_us = 0; now_us < 3000u; now_us += 1000u) {
        guard_tick(guard, now_us, &out);
        ++fuzz_ticks;
        REQUIRE(!out.permitted && out.withheld && (out.state == GUARD_STATE_UNINITIALISED));
        REQUIRE(out.frame[0].data[2] != 0xE1u);
    }
}

/* Self-test and start on any accepted block. */
static void drive(bench_t *bench, bytes_t *bytes) {
    rest(bench);
    for (uint32_t i = 0; i < TICKS; ++i) {
        ++bench->cycle;
        bench->now_us += bench->config.period_us;
        bench->torque[i % ROBOT_MAX_JOINTS] = (int16_t)(bench->torque[i % ROBOT_MAX_JOINTS] + (int8_t)next8(bytes));
        receive(bench, sync_frame(bench));
        receive(bench, task_frame(bench));
        for (uint32_t joint = 0; joint < bench->config.robot.joint_count; ++joint) {
            receive(bench, joint_frame(bench, joint));
        }
        fuzz_frames += 2u + bench->config.robot.joint_count;
        tick(bench);
        ++fuzz_ticks;
        REQUIRE(!bench->out.permitted); /* no GuardReset was sent */
        for (uint32_t joint = 0; joint < ROBOT_MAX_JOINTS; ++joint) {
            const bool finite = num_finite(bench->out.residual[joint]) && num_finite(bench->out.index[joint]);
            REQUIRE(finite || (bench->out.state == GUARD_STATE_FAULT));
        }
    }
}

static void load_file(const uint8_t *data, size_t size, const char *robot) {
    static int file = -1;
    char path[64];
    if (file < 0) {
        file = memfd_create("block", 0);
        REQUIRE(file >= 0);
    }
    REQUIRE(ftruncate(file, 0) == 0);
    REQUIRE(pwrite(file, data, size, 0) == (ssize_t)size);
    (void)snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    const void *second = NULL;
    const guard_config_t *const block = block_load(path, robot, &second);
    if (block != NULL) {
        REQUIRE((size == sizeof *block) || ((size == (2u * sizeof *block)) && (second == &block[1])));
        REQUIRE((block->magic == CONFIG_MAGIC) && (memcmp(block, data, size) == 0));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static bench_t bench;
    bytes_t bytes = {.data = data, .size = size};
    const uint8_t mode = next8(&bytes);
    fuzz_count_at_exit();
    bench = (bench_t){.task = (uint8_t)(1u + mode % 3u), .now_us = 1000000u};
    bench.config = make_config();
    if ((mode & 0x80u) != 0u) { /* the input is a file, byte for byte */
        load_file(bytes.data, bytes.size, "ku_dex");
        memcpy(&bench.config, bytes.data, (bytes.size < sizeof bench.config) ? bytes.size : sizeof bench.config);
    } else {
        for (uint32_t changes = 1u + (mode >> 2) % 8u; changes > 0u; --changes) {
            change(&bench.config, &bytes);
        }
    }
    if ((mode & 0x40u) == 0u) {
        seal_config(&bench.config);
    }
    load_file((const uint8_t *)&bench.config, sizeof bench.config, "ku_dex");
    const guard_status_t status = guard_init(&bench.guard, &bench.config);
    REQUIRE((block_problem(status) != NULL) && (status >= GUARD_OK) && (status <= GUARD_BAD_SIGHT));
    if (status == GUARD_OK) {
        judge_accepted(&bench.config);
        drive(&bench, &bytes);
    } else {
        judge_refused(&bench.guard);
    }
    return 0;
}
