/* The functions that newlib requires from a board, for images that use it: tests print with printf. Output goes to the
 * debugger. */
#include <errno.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

#include "semihosting.h"

int _write(int file, const char *data, int length);
void *_sbrk(ptrdiff_t increment);
int _close(int file);
int _fstat(int file, struct stat *status);
int _isatty(int file);
int _lseek(int file, int offset, int whence);
int _read(int file, char *data, int length);
int _kill(int process, int signal);
int _getpid(void);
_Noreturn void _exit(int code);

extern uint8_t linker_heap_start[], linker_heap_end[];

int _write(int file, const char *data, int length) {
    (void)file;
    char text[65];
    for (int done = 0; done < length;) {
        size_t n = 0;
        for (; (n + 1u < sizeof text) && (done < length); ++n, ++done) {
            text[n] = data[done];
        }
        text[n] = '\0';
        semihosting_write(text);
    }
    return length;
}

void *_sbrk(ptrdiff_t increment) {
    static uint8_t *end = linker_heap_start;
    if ((increment > linker_heap_end - end) || (increment < linker_heap_start - end)) {
        errno = ENOMEM;
        return (void *)-1;
    }
    uint8_t *const before = end;
    end += increment;
    return before;
}

int _close(int file) {
    (void)file;
    return -1;
}

int _fstat(int file, struct stat *status) {
    (void)file;
    status->st_mode = S_IFCHR;
    return 0;
}

int _isatty(int file) {
    (void)file;
    return 1;
}

int _lseek(int file, int offset, int whence) {
    (void)file;
    (void)offset;
    (void)whence;
    return 0;
}

int _read(int file, char *data, int length) {
    (void)file;
    (void)data;
    (void)length;
    return 0;
}

int _kill(int process, int signal) {
    (void)process;
    (void)signal;
    return -1;
}

int _getpid(void) {
    return 1;
}

_Noreturn void _exit(int code) {
    semihosting_exit(code);
}
