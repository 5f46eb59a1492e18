#include "config.h"

#include <stddef.h>

#include "config_bounds.h"
#include "crc32.h"
#include "protocol.h"

/* First byte that the CRC covers. */
#define COVERED offsetof(guard_config_t, numeric)

static bool crc_matches(const guard_config_t *config) {
    const uint8_t *const bytes = (const uint8_t *)config;
    const uint32_t length = (uint32_t)(sizeof(*config) - COVERED);
    return crc32_finish(crc32_fold(CRC32_START, bytes + COVERED, length)) == config->crc;
}

static guard_status_t check_identity(const guard_config_t *config) {
    if (config->magic != CONFIG_MAGIC) {
        return GUARD_BAD_MAGIC;
    }
    if (config->schema != CONFIG_SCHEMA) {
        return GUARD_BAD_SCHEMA;
    }
    if (config->size != (uint32_t)sizeof(*config)) {
        return GUARD_BAD_SIZE;
    }
    if (!crc_matches(config)) {
        return GUARD_BAD_CRC;
    }
    if (config->numeric != NUM_NUMERIC) {
        return GUARD_BAD_NUMERIC;
    }
    return (config->wire == PROTOCOL_WIRE_CRC) ? GUARD_OK : GUARD_BAD_WIRE;
}

guard_status_t config_check(const guard_config_t *config) {
    const guard_status_t status = check_identity(config);
    return (status == GUARD_OK) ? config_bounds_check(config) : status;
}

void config_watch_start(config_watch_t *self) {
    *self = (config_watch_t){.offset = COVERED, .crc = CRC32_START};
}

bool config_watch_step(config_watch_t *self, const guard_config_t *config) {
    if ((self->offset < COVERED) || (self->offset >= sizeof(*config))) {
        return false;
    }
    const uint32_t left = (uint32_t)sizeof(*config) - self->offset;
    const uint32_t length = (left < CONFIG_WATCH_BYTES) ? left : CONFIG_WATCH_BYTES;
    self->crc = crc32_fold(self->crc, (const uint8_t *)config + self->offset, length);
    self->offset += length;
    bool intact = (config->magic == CONFIG_MAGIC) && (config->schema == CONFIG_SCHEMA) &&
                  (config->size == (uint32_t)sizeof(*config));
    if (self->offset == sizeof(*config)) {
        intact = intact && (crc32_finish(self->crc) == config->crc);
        config_watch_start(self);
    }
    return intact;
}
