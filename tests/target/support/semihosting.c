#include "semihosting.h"

enum {
    SYS_OPEN = 0x01,
    SYS_WRITE0 = 0x04,
    SYS_READ = 0x06,
    SYS_GET_CMDLINE = 0x15,
    SYS_EXIT = 0x18,
    SYS_EXIT_EXTENDED = 0x20,
    ADP_STOPPED_APPLICATION_EXIT = 0x20026,
    MODE_READ_BINARY = 1,
};

static uint32_t call(uint32_t operation, uintptr_t argument) {
    register uint32_t r0 __asm("r0") = operation;
    register uintptr_t r1 __asm("r1") = argument;
#if __ARM_ARCH_PROFILE == 'M'
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
#elif defined(__thumb__)
    __asm volatile("svc 0xab" : "+r"(r0) : "r"(r1) : "memory", "lr");
#else
    __asm volatile("svc 0x123456" : "+r"(r0) : "r"(r1) : "memory", "lr");
#endif
    return r0;
}

void semihosting_write(const char *text) {
    (void)call(SYS_WRITE0, (uintptr_t)text);
}

_Noreturn void semihosting_exit(int32_t code) {
    const uint32_t block[2] = {ADP_STOPPED_APPLICATION_EXIT, (uint32_t)code};
    (void)call(SYS_EXIT_EXTENDED, (uintptr_t)block);
    (void)call(SYS_EXIT, ADP_STOPPED_APPLICATION_EXIT); /* for a debugger that does not know the extended call */
    for (;;) {}
}

bool semihosting_command_line(char text[], uint32_t size) {
    const uint32_t block[2] = {(uint32_t)(uintptr_t)text, size};
    return call(SYS_GET_CMDLINE, (uintptr_t)block) == 0u;
}

int32_t semihosting_open(const char *path) {
    uint32_t length = 0;
    while (path[length] != '\0') {
        ++length;
    }
    const uint32_t block[3] = {(uint32_t)(uintptr_t)path, MODE_READ_BINARY, length};
    return (int32_t)call(SYS_OPEN, (uintptr_t)block);
}

uint32_t semihosting_read(int32_t file, void *to, uint32_t length) {
    const uint32_t block[3] = {(uint32_t)file, (uint32_t)(uintptr_t)to, length};
    const uint32_t missing = call(SYS_READ, (uintptr_t)block);
    return (missing < length) ? (length - missing) : 0u;
}
