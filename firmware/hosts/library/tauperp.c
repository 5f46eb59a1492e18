#include "tauperp.h"

#include "version.h"

uint32_t tauperp_version(void) {
    return (TAUPERP_VERSION_MAJOR << 16) | (TAUPERP_VERSION_MINOR << 8) | TAUPERP_VERSION_PATCH;
}

uint32_t tauperp_numeric(void) {
    return NUM_NUMERIC;
}

uint32_t tauperp_config_size(void) {
    return (uint32_t)sizeof(guard_config_t);
}
