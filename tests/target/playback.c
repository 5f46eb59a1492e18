/* playback: runs a recording through the guard on an emulated processor, and compares every result with the library's,
 * to the bit. The file's name is the last word of the command line; tests/target/recording.py writes it.
 *
 * A recording consists of records of 16 little-endian bytes. Each tick carries the CRC-32 over all outputs of the guard
 * since the start of the file: state, verdict, residual and index as they are in memory, and the frames. Prints
 *     same TICKS CRC WORST         and ends with 0; WORST: instructions of the most expensive cycle, including its
 * frames different TICK WORD...       the first tick, from 0, and its output; ends with 1
 */
#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "counter.h"
#include "crc32.h"
#include "guard.h"
#include "semihosting.h"

typedef enum {
    RECORD_START = 1,     /* `word` bytes of configuration block follow, padded to whole records; guard_init */
    RECORD_AT = 2,        /* time of the following records: `now_us` */
    RECORD_FRAME = 3,     /* guard_receive: flags, length, word is the id, data */
    RECORD_TICK = 4,      /* guard_tick; word is the expected CRC after it */
    RECORD_TICK_TIME = 5, /* guard_note_tick_time(word) */
    RECORD_TRIP = 6,      /* guard_trip(word) */
    RECORD_END = 7        /* after `word` ticks */
} record_kind_t;

typedef struct {
    uint8_t kind; /* record_kind_t */
    uint8_t flags;
    uint8_t length;
    uint8_t spare;
    uint32_t word;
    union {
        uint64_t now_us;
        uint8_t data[CAN_FRAME_DATA_LENGTH];
    };
} record_t;
static_assert(sizeof(record_t) == 16, "as it is in the file");

enum { BUFFERED = 256, WORDS = 9 + 2 * ROBOT_MAX_JOINTS + 4 * GUARD_MAX_FRAMES, EXIT_DIFFERENT = 1, EXIT_USAGE = 2 };

int main(void);

static int32_t file;
static record_t buffer[BUFFERED];
static uint32_t buffered, at;

static guard_config_t config;
static guard_t guard;
static guard_output_t out;
static uint32_t words[WORDS];

/* The next record, or 0 at the end of the file. */
static const record_t *next(void) {
    if (at == buffered) {
        buffered = semihosting_read(file, buffer, sizeof(buffer)) / (uint32_t)sizeof(record_t);
        at = 0;
        if (buffered == 0u) {
            return 0;
        }
    }
    return &buffer[at++];
}

static bool read_block(uint32_t size) {
    uint8_t *const to = (uint8_t *)&config;
    if (size != sizeof(config)) {
        return false;
    }
    for (uint32_t done = 0; done < size; done += (uint32_t)sizeof(record_t)) {
        const record_t *const piece = next();
        const uint32_t left = size - done;
        if (piece == 0) {
            return false;
        }
        memcpy(to + done, piece, (left < sizeof(record_t)) ? left : sizeof(record_t));
    }
    const guard_status_t status = guard_init(&guard, &config);
    guard_note_start(&guard, GUARD_START_COMMANDED, 0u, GUARD_VARIANT_LOCKSTEP); /* as the library does */
    return status == GUARD_OK;
}

static uint32_t bits_of(num_t value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof(bits));
    return bits;
}

static void collect(void) {
    uint32_t n = 0;
    words[n++] = (uint32_t)out.state;
    words[n++] = (uint32_t)out.reason;
    words[n++] = (out.permitted ? 1u : 0u) | (out.fresh ? 2u : 0u) | ((uint32_t)out.task << 8) |
                 ((uint32_t)out.stop_category << 16) | ((uint32_t)out.joint << 24);
    words[n++] = (uint32_t)out.cycle | ((uint32_t)out.trip_number << 16);
    words[n++] = out.rank;
    words[n++] = out.frame_count;
    words[n++] = bits_of(out.value_nm);
    words[n++] = bits_of(out.threshold_nm);
    words[n++] = bits_of(out.smallest_singular);
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        words[n++] = bits_of(out.residual[i]);
    }
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        words[n++] = bits_of(out.index[i]);
    }
    for (uint32_t i = 0; i < GUARD_MAX_FRAMES; ++i) {
        const can_frame_t *const frame = &out.frame[i];
        words[n++] = frame->id;
        words[n++] = (uint32_t)frame->length | ((uint32_t)frame->flags << 8);
        memcpy(&words[n], frame->data, CAN_FRAME_DATA_LENGTH);
        n += 2u;
    }
}

static uint32_t instructions(uint32_t from) {
    return counter_instructions(from, counter_read());
}

static int play(void) {
    uint64_t now_us = 0;
    uint32_t crc = CRC32_START, ticks = 0, cycle = 0, worst = 0;
    for (const record_t *record = next(); record != 0; record = next()) {
        const uint32_t begin = counter_read();
        switch ((record_kind_t)record->kind) {
        case RECORD_START:
            if (!read_block(record->word)) {
                printf("a configuration block that is refused\n");
                return EXIT_USAGE;
            }
            break;
        case RECORD_AT:
            now_us = record->now_us;
            cycle = 0;
            break;
        case RECORD_FRAME: {
            can_frame_t frame = {.id = record->word, .length = record->length, .flags = record->flags};
            memcpy(frame.data, record->data, sizeof(frame.data));
            guard_receive(&guard, &frame, now_us);
            cycle += instructions(begin);
            break;
        }
        case RECORD_TICK:
            guard_tick(&guard, now_us, &out);
            cycle += instructions(begin);
            worst = (cycle > worst) ? cycle : worst;
            cycle = 0;
            collect();
            crc = crc32_fold(crc, (const uint8_t *)words, sizeof(words));
            if (crc32_finish(crc) != record->word) {
                printf("different %lu", (unsigned long)ticks);
                for (uint32_t i = 0; i < (uint32_t)WORDS; ++i) {
                    printf(" %08lx", (unsigned long)words[i]);
                }
                printf("\n");
                return EXIT_DIFFERENT;
            }
            ++ticks;
            break;
        case RECORD_TICK_TIME:
            guard_note_tick_time(&guard, record->word);
            break;
        case RECORD_TRIP:
            guard_trip(&guard, (guard_reason_t)record->word);
            break;
        case RECORD_END:
            if (record->word != ticks) {
                printf("%lu ticks, not %lu\n", (unsigned long)ticks, (unsigned long)record->word);
                return EXIT_USAGE;
            }
            printf("same %lu %08lx %lu\n", (unsigned long)ticks, (unsigned long)crc32_finish(crc),
                   (unsigned long)worst);
            return 0;
        default:
            printf("no record of this kind: %u\n", record->kind);
            return EXIT_USAGE;
        }
    }
    printf("the recording has no end record\n");
    return EXIT_USAGE;
}

int main(void) {
    static char line[512];
    const char *const path = semihosting_command_line(line, sizeof(line)) ? strrchr(line, ' ') : 0;
    file = (path != 0) ? semihosting_open(path + 1) : -1;
    if (file < 0) {
        printf("no recording: %s\n", line);
        return EXIT_USAGE;
    }
    counter_init();
    return play();
}
