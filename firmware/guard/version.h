/* version: version of the release. The wire and the configuration have their own versions (protocol.h, config.h). */
#ifndef TAUPERP_VERSION_H
#define TAUPERP_VERSION_H

#define TAUPERP_VERSION_MAJOR 0u
#define TAUPERP_VERSION_MINOR 1u
#define TAUPERP_VERSION_PATCH 0u

/* First 32 bits of the SHA-256 of the firmware's sources, from the build; the same for every board. */
#ifndef TAUPERP_BUILD_ID
#define TAUPERP_BUILD_ID 0u
#endif

#endif
