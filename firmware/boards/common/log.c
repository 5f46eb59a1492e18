#include "log.h"

#include "board.h"

#define CAPACITY 1024u /* a power of two */

static char buffer[CAPACITY];
static uint32_t written;
static uint32_t read;

static bool dropped;

static void put(char character) {
    static const char mark[] = "...\r\n";
    const uint32_t room = CAPACITY - (written - read);
    if (room < (dropped ? sizeof(mark) : 1u)) {
        dropped = true;
        return;
    }
    for (uint32_t i = 0; dropped && (i + 1u < sizeof(mark)); ++i) {
        buffer[written % CAPACITY] = mark[i];
        ++written;
    }
    dropped = false;
    buffer[written % CAPACITY] = character;
    ++written;
}

void log_text(const char *text) {
    for (; *text != '\0'; ++text) {
        if (*text == '\n') {
            put('\r');
        }
        put(*text);
    }
}

void log_number(uint32_t number) {
    char digits[11];
    uint32_t at = sizeof(digits) - 1u;
    digits[at] = '\0';
    do {
        --at;
        digits[at] = (char)('0' + (number % 10u));
        number /= 10u;
    } while (number > 0u);
    log_text(&digits[at]);
}

void log_hex(uint32_t number, uint32_t digits) {
    for (uint32_t i = digits; i-- > 0u;) {
        put("0123456789abcdef"[(number >> (4u * i)) & 0xFu]);
    }
}

void log_pump(void) {
    if ((read != written) && uart_write(buffer[read % CAPACITY])) {
        ++read;
    }
}

void log_flush(void) {
    for (uint32_t tries = 0; (read != written) && (tries < LOG_TRIES); ++tries) {
        const uint32_t before = read;
        log_pump();
        tries = (read != before) ? 0u : tries;
    }
    read = written;
}
