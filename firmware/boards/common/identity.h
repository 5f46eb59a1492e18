/* identity: firmware, build and configuration of an image, in the section .tauperp_version. `tauperp version ELF`
 * prints it. Little-endian. New fields are appended, and `format` counts them. */
#ifndef TAUPERP_IDENTITY_H
#define TAUPERP_IDENTITY_H

#include <stdint.h>

#define IDENTITY_FORMAT 2u

typedef struct {
    char magic[8];       /* "TAUPERP" */
    uint32_t format;     /* of this record */
    uint32_t version;    /* major << 16 | minor << 8 | patch */
    uint32_t build;      /* of the firmware's sources; GuardStatus.BuildId is its upper half */
    uint32_t config_crc; /* of the configuration block in .tauperp_config */
    uint32_t wire_crc;   /* of the DBC file */
    uint32_t numeric;    /* numeric_t */
    char board[16];
    uint32_t variant; /* guard_variant_t, since format 2 */
} identity_t;

extern const identity_t identity;

void identity_log(void);

#endif
