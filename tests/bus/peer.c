/* peer: the robot's side of the bus for tests and measurements, fast enough not to influence them.
 *
 *   peer replay CAN FILE            plays a candump log in lockstep. It waits for the guard's frames in the log (0x010,
 *                                   0x200, 0x201) as answers; exit 1 at the first that differs or is missing
 *   peer hold CAN CYCLES PERIOD HEX...   a robot that stands still: CYCLES cycles, PERIOD us apart (0: lockstep). HEX:
 * the 8 bytes of each joint's JointState, to which CRC and counter are added peer flood CAN FRAMES GAP HEX   FRAMES
 * frames of JointState1, 8 at a time, GAP us apart
 *
 * Uses CAN FD with bit-rate switch if the interface has it. Prints one JSON object.
 */
#define _GNU_SOURCE /* -std=c11 hides what is not ISO C */
#include <errno.h>
#include <inttypes.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "clock.h"
#include "frame.h"
#include "histogram.h"
#include "protocol.h"

#define MAX_FRAMES        16u
#define ANSWER_TIMEOUT_MS 2000
#define FLOOD_BURST       8u
#define US_PER_S          1000000u
#define TASK_NONE         1u
#define PERMITTED         0xE1u /* Permission 1, PermissionInverted 14 */

typedef struct {
    int socket;
    bool fd;
} peer_t;

static _Noreturn void fail(const char *what, const char *why) {
    (void)fprintf(stderr, "peer: %s: %s\n", what, why);
    exit(2);
}

static peer_t open_bus(const char *channel) {
    peer_t self = {.socket = socket(PF_CAN, SOCK_RAW, CAN_RAW)};
    const int on = 1;
    const int bytes = 1 << 20;
    struct sockaddr_can address = {.can_family = AF_CAN, .can_ifindex = (int)if_nametoindex(channel)};
    struct can_filter of_guard[PROTOCOL_TRANSMIT_COUNT];
    for (size_t i = 0; i < (size_t)PROTOCOL_TRANSMIT_COUNT; i++) {
        of_guard[i] = (struct can_filter){.can_id = protocol_transmit[i].id, .can_mask = CAN_SFF_MASK};
    }
    if ((self.socket < 0) || (address.can_ifindex == 0) ||
        (setsockopt(self.socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) != 0) ||
        (setsockopt(self.socket, SOL_CAN_RAW, CAN_RAW_FILTER, of_guard, sizeof of_guard) != 0) ||
        (bind(self.socket, (const struct sockaddr *)&address, sizeof address) != 0)) {
        fail(channel, strerror(errno));
    }
    (void)setsockopt(self.socket, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes);
    char path[64];
    (void)snprintf(path, sizeof path, "/sys/class/net/%s/mtu", channel);
    FILE *const file = fopen(path, "r");
    int mtu = 0;
    if ((file == NULL) || (fscanf(file, "%d", &mtu) != 1)) {
        fail(path, "cannot be read");
    }
    (void)fclose(file);
    self.fd = mtu >= (int)CANFD_MTU;
    return self;
}

static void send_frames(const peer_t *self, struct canfd_frame *frames, size_t count) {
    struct iovec parts[MAX_FRAMES];
    struct mmsghdr messages[MAX_FRAMES];
    for (size_t i = 0; i < count; i++) {
        frames[i].flags = self->fd ? CANFD_BRS : 0;
        parts[i] = (struct iovec){&frames[i], self->fd ? CANFD_MTU : CAN_MTU};
        messages[i] = (struct mmsghdr){.msg_hdr = {.msg_iov = &parts[i], .msg_iovlen = 1}};
    }
    for (size_t sent = 0; sent < count;) {
        const int more = sendmmsg(self->socket, &messages[sent], (unsigned int)(count - sent), 0);
        if ((more < 0) && (errno == ENOBUFS)) {
            continue;
        }
        if (more <= 0) {
            fail("send", strerror(errno));
        }
        sent += (size_t)more;
    }
}

/* False if nothing arrives within `timeout_ms`. */
static bool receive(const peer_t *self, struct canfd_frame *frame, int timeout_ms) {
    struct pollfd in = {.fd = self->socket, .events = POLLIN};
    for (;;) {
        if (recv(self->socket, frame, sizeof *frame, MSG_DONTWAIT) > 0) {
            return true;
        }
        if ((errno != EAGAIN) && (errno != EINTR)) {
            fail("receive", strerror(errno));
        }
        if (poll(&in, 1, timeout_ms) == 0) {
            return false;
        }
    }
}

/* --- replay ------------------------------------------------------------------------------------------------------- */

/* One line of `candump -L`: (seconds) channel ID#DATA or ID##FDATA. */
static bool parse(const char *line, struct canfd_frame *frame) {
    char id[16];
    char data[160];
    if (sscanf(line, "(%*[^)]) %*s %15[0-9A-Fa-f]#%159s", id, data) != 2) {
        return false;
    }
    *frame = (struct canfd_frame){.can_id = (canid_t)strtoul(id, NULL, 16)};
    const char *bytes = (data[0] == '#') ? &data[2] : data; /* one digit of flags */
    while ((bytes[0] != '\0') && (bytes[1] != '\0') && (frame->len < CAN_FRAME_DATA_LENGTH)) {
        const char pair[3] = {bytes[0], bytes[1], '\0'};
        frame->data[frame->len++] = (unsigned char)strtoul(pair, NULL, 16);
        bytes += 2;
    }
    return true;
}

static bool is_of_guard(const struct canfd_frame *frame) {
    for (size_t i = 0; i < (size_t)PROTOCOL_TRANSMIT_COUNT; i++) {
        if (frame->can_id == protocol_transmit[i].id) {
            return true;
        }
    }
    return false;
}

static int replay(const peer_t *self, const char *path) {
    FILE *const file = fopen(path, "r");
    if (file == NULL) {
        fail(path, strerror(errno));
    }
    struct canfd_frame pending[MAX_FRAMES];
    size_t count = 0;
    uint64_t line_number = 0;
    uint64_t sent = 0;
    uint64_t same = 0;
    char line[256];
    struct canfd_frame wanted;
    struct canfd_frame got;
    while (fgets(line, sizeof line, file) != NULL) {
        line_number++;
        if (!parse(line, &wanted)) {
            fail(path, "a line that candump -L does not write");
        }
        if (!is_of_guard(&wanted)) {
            pending[count++] = wanted;
        }
        if ((count == MAX_FRAMES) || is_of_guard(&wanted)) {
            send_frames(self, pending, count);
            sent += count;
            count = 0;
        }
        if (!is_of_guard(&wanted)) {
            continue;
        }
        const bool answered = receive(self, &got, ANSWER_TIMEOUT_MS);
        if (!answered || (got.can_id != wanted.can_id) || (got.len != wanted.len) ||
            (memcmp(got.data, wanted.data, wanted.len) != 0)) {
            (void)printf("{\"same\":%" PRIu64 ",\"sent\":%" PRIu64 ",\"differs_at_line\":%" PRIu64 ",\"got\":\"", same,
                         sent, line_number);
            for (size_t i = 0; answered && (i < got.len); i++) {
                (void)printf("%s%02X", (i == 0u) ? ((got.can_id == wanted.can_id) ? "" : "other id: ") : "",
                             got.data[i]);
            }
            (void)printf("\"}\n");
            return 1;
        }
        same++;
    }
    (void)fclose(file);
    (void)printf("{\"same\":%" PRIu64 ",\"sent\":%" PRIu64 "}\n", same, sent);
    return 0;
}

/* --- hold --------------------------------------------------------------------------------------------------------- */

static void read_bytes(const char *hex, unsigned char *data) {
    for (size_t i = 0; i < CAN_FRAME_DATA_LENGTH; i++) {
        unsigned int byte = 0;
        if (sscanf(&hex[2u * i], "%2x", &byte) != 1) {
            fail(hex, "not 8 bytes in hex");
        }
        data[i] = (unsigned char)byte;
    }
}

static void seal(struct canfd_frame *frame, uint32_t slot, uint16_t cycle) {
    frame->can_id = protocol_receive[slot].id;
    frame->len = protocol_receive[slot].length;
    e2e_seal(frame->data, frame->len, protocol_receive[slot].data_ids, (uint8_t)(cycle & E2E_COUNTER_MASK));
}

static size_t make_cycle(struct canfd_frame *frames, const struct canfd_frame *joints, size_t joint_count,
                         uint16_t cycle) {
    /* By hand, because the generated code packs the guard's messages only. Cycle is bytes 2 and 3, Task the high nibble
     * of 1. */
    frames[0] = (struct canfd_frame){.data = {0, 0, (uint8_t)(cycle & 0xFFu), (uint8_t)(cycle >> 8u)}};
    frames[1] = (struct canfd_frame){.data = {0, TASK_NONE << 4u}};
    seal(&frames[0], PROTOCOL_RECEIVE_SYNC, cycle);
    seal(&frames[1], PROTOCOL_RECEIVE_TASK_COMMAND, cycle);
    for (size_t joint = 0; joint < joint_count; joint++) {
        frames[2u + joint] = joints[joint];
        frames[2u + joint].data[1] = (uint8_t)(((cycle >> 4u) & 3u) << 6u); /* CycleHigh; SensorStatus is Ok */
        seal(&frames[2u + joint], (uint32_t)(PROTOCOL_RECEIVE_JOINT_STATE + joint), cycle);
    }
    return 2u + joint_count;
}

typedef struct {
    histogram_t latency;
    e2e_receiver_t receiver;
    uint64_t answered;
    uint64_t permitted;
    uint64_t refused; /* answers that fail the E2E check */
} hold_t;

/* True if the frame is a valid StopCommand that answers the cycle. */
static bool take_answer(hold_t *self, const struct canfd_frame *frame, uint16_t cycle) {
    const protocol_transmit_t *const stop = &protocol_transmit[PROTOCOL_TRANSMIT_STOP_COMMAND];
    if (frame->can_id != stop->id) {
        return false;
    }
    const e2e_status_t status = e2e_check(&self->receiver, frame->data, frame->len, stop->data_ids, 1u);
    if (!e2e_accepts(status) && (status != E2E_INITIAL)) {
        self->refused++;
        return false;
    }
    if ((frame->data[3] >> 4u) != (cycle & E2E_COUNTER_MASK)) { /* Cycle */
        return false;
    }
    self->answered++;
    /* The first answer only sets the counter and permits nothing. */
    self->permitted += (e2e_accepts(status) && (frame->data[2] == PERMITTED)) ? 1u : 0u;
    return true;
}

static int hold(const peer_t *self, uint64_t cycles, uint32_t period_us, char **hex, size_t joint_count) {
    static hold_t state;
    struct canfd_frame joints[MAX_FRAMES] = {0};
    struct canfd_frame frames[MAX_FRAMES];
    struct canfd_frame answer;
    for (size_t joint = 0; joint < joint_count; joint++) {
        read_bytes(hex[joint], joints[joint].data);
    }
    const uint64_t start_us = clock_monotonic_us();
    const uint32_t patience = (period_us > 0u) ? 1000u : 3u;
    uint32_t unanswered = 0; /* consecutive */
    for (uint64_t cycle = 0; (cycle < cycles) && (unanswered < patience); cycle++) {
        const size_t count = make_cycle(frames, joints, joint_count, (uint16_t)cycle);
        const uint64_t due_us = start_us + (cycle * period_us);
        const uint64_t end_us = due_us + period_us;
        if (period_us > 0u) {
            const struct timespec when = {(time_t)(due_us / US_PER_S), (long)(due_us % US_PER_S) * 1000};
            (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, NULL);
        }
        const uint64_t sent_us = clock_monotonic_us();
        send_frames(self, frames, count);
        int timeout_ms = ANSWER_TIMEOUT_MS;
        bool done = false;
        while (!done && receive(self, &answer, timeout_ms)) {
            done = take_answer(&state, &answer, (uint16_t)cycle);
            if (period_us > 0u) {
                const uint64_t now_us = clock_monotonic_us();
                timeout_ms = (now_us < end_us) ? (int)((end_us - now_us) / 1000u) : 0;
            }
        }
        unanswered = done ? 0u : (unanswered + 1u);
        if (done &&
            (cycle >
             0u)) { /* the first frame of each sender only sets its counter: in lockstep silence ends that cycle */
            histogram_add(&state.latency, clock_monotonic_us() - sent_us);
        }
    }
    const uint64_t took_us = clock_monotonic_us() - start_us;
    (void)printf("{\"cycles\":%" PRIu64 ",\"answered\":%" PRIu64 ",\"permitted\":%" PRIu64 ",\"refused\":%" PRIu64
                 ",\"frames\":%" PRIu64 ",\"took_us\":%" PRIu64 ",\"p50_us\":%" PRIu64 ",\"p99_us\":%" PRIu64
                 ",\"max_us\":%" PRIu64 "}\n",
                 cycles, state.answered, state.permitted, state.refused, cycles * (2u + joint_count), took_us,
                 histogram_percentile(&state.latency, 50), histogram_percentile(&state.latency, 99),
                 state.latency.longest);
    return (state.answered == cycles) ? 0 : 1;
}

/* --- flood -------------------------------------------------------------------------------------------------------- */

static int flood(const peer_t *self, uint64_t total, uint32_t gap_us, const char *hex) {
    struct canfd_frame frames[FLOOD_BURST] = {0};
    const uint64_t start_us = clock_monotonic_us();
    uint64_t due_us = start_us;
    uint64_t sent = 0;
    while (sent < total) {
        const size_t count = ((total - sent) < FLOOD_BURST) ? (size_t)(total - sent) : FLOOD_BURST;
        for (size_t i = 0; i < count; i++) {
            read_bytes(hex, frames[i].data);
            seal(&frames[i], PROTOCOL_RECEIVE_JOINT_STATE, (uint16_t)(sent + i));
        }
        if (gap_us > 0u) {
            due_us += gap_us;
            const struct timespec when = {(time_t)(due_us / US_PER_S), (long)(due_us % US_PER_S) * 1000};
            (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &when, NULL);
        }
        send_frames(self, frames, count);
        sent += count;
    }
    (void)printf("{\"frames\":%" PRIu64 ",\"took_us\":%" PRIu64 "}\n", sent, clock_monotonic_us() - start_us);
    return 0;
}

int main(int argc, char **argv) {
    if ((argc == 4) && (strcmp(argv[1], "replay") == 0)) {
        const peer_t peer = open_bus(argv[2]);
        return replay(&peer, argv[3]);
    }
    if ((argc > 5) && (argc <= 13) && (strcmp(argv[1], "hold") == 0)) {
        const peer_t peer = open_bus(argv[2]);
        return hold(&peer, strtoull(argv[3], NULL, 10), (uint32_t)strtoul(argv[4], NULL, 10), &argv[5],
                    (size_t)argc - 5u);
    }
    if ((argc == 6) && (strcmp(argv[1], "flood") == 0)) {
        const peer_t peer = open_bus(argv[2]);
        return flood(&peer, strtoull(argv[3], NULL, 10), (uint32_t)strtoul(argv[4], NULL, 10), argv[5]);
    }
    fail("arguments", "see tests/bus/peer.c");
}
