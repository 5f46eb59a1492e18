/* version: of the release. The wire's and the configuration's versions are their own (protocol.h, config.h). */
#ifndef TAUPERP_VERSION_H
#define TAUPERP_VERSION_H

#define TAUPERP_VERSION_MAJOR 0u
#define TAUPERP_VERSION_MINOR 1u
#define TAUPERP_VERSION_PATCH 0u

#endif
