#define _GNU_SOURCE /* for sendmmsg and recvmmsg; -std=c11 hides what is not ISO C */
#include "bus.h"

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include "options.h"
#include "protocol.h"

#define RECEIVE_BUFFER_BYTES (1 << 20) /* about 1,000 frames: 100 ms of a classic bus at full load */
#define MAX_SEND             4u

/* Space for a frame's time stamp and the count of frames lost before it. */
typedef union {
    struct cmsghdr align;
    unsigned char bytes[CMSG_SPACE(sizeof(struct timespec)) + CMSG_SPACE(sizeof(uint32_t))];
} ancillary_t;

static struct can_filter only(uint32_t id) {
    return (struct can_filter){.can_id = id, .can_mask = CAN_SFF_MASK | CAN_EFF_FLAG};
}

static bool set_filters(int fd) {
    struct can_filter filters[(size_t)PROTOCOL_RECEIVE_COUNT + (size_t)PROTOCOL_TRANSMIT_COUNT];
    /* Remote requests with these ids pass the filter, so that the guard can count them. */
    for (size_t slot = 0; slot < (size_t)PROTOCOL_RECEIVE_COUNT; slot++) {
        filters[slot] = only(protocol_receive[slot].id);
    }
    for (size_t slot = 0; slot < (size_t)PROTOCOL_TRANSMIT_COUNT; slot++) {
        filters[(size_t)PROTOCOL_RECEIVE_COUNT + slot] = only(protocol_transmit[slot].id);
    }
    const can_err_mask_t errors = CAN_ERR_MASK;
    const int on = 1;
    const int off = 0;
    return (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FILTER, filters, sizeof filters) == 0) &&
           (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) == 0) &&
           (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on) == 0) &&
           (setsockopt(fd, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, &off, sizeof off) == 0);
}

static bool set_reports(int fd) {
    const int on = 1;
    const int bytes = RECEIVE_BUFFER_BYTES;
    /* Above net.core.rmem_max if permitted. */
    if (setsockopt(fd, SOL_SOCKET, SO_RCVBUFFORCE, &bytes, sizeof bytes) != 0) {
        (void)setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    }
    return (setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) == 0) &&
           (setsockopt(fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on) == 0);
}

/* NULL and an open self->socket, or the reason of the failure. */
static const char *connect_to(bus_t *self) {
    struct ifreq interface = {0};
    if (strlen(self->channel) >= sizeof interface.ifr_name) {
        return "no such network interface";
    }
    const int fd = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
    if (fd < 0) {
        return (errno == EAFNOSUPPORT) ? "this kernel has no CAN (modprobe can-raw)" : strerror(errno);
    }
    (void)memcpy(interface.ifr_name, self->channel, strlen(self->channel));
    const char *problem = NULL;
    struct sockaddr_can address = {.can_family = AF_CAN};
    if (ioctl(fd, SIOCGIFINDEX, &interface) != 0) {
        problem = "no such network interface";
    } else {
        address.can_ifindex = interface.ifr_ifindex;
        if ((ioctl(fd, SIOCGIFHWADDR, &interface) != 0) || (interface.ifr_hwaddr.sa_family != ARPHRD_CAN)) {
            problem = "not a CAN interface";
        } else if ((ioctl(fd, SIOCGIFMTU, &interface) != 0) || (self->fd && (interface.ifr_mtu < (int)CANFD_MTU))) {
            problem = "the configuration requires CAN FD, which this interface does not have or is not set up for";
        } else if (!set_filters(fd) || !set_reports(fd) ||
                   (bind(fd, (const struct sockaddr *)&address, sizeof address) != 0)) {
            problem = strerror(errno);
        } else {
            /* already open */
        }
    }
    if (problem != NULL) {
        (void)close(fd);
        return problem;
    }
    self->socket = fd;
    self->overflows = 0;
    return NULL;
}

bool bus_open(bus_t *self, const char *channel, bool fd) {
    *self = (bus_t){.channel = channel, .fd = fd, .socket = -1};
    const char *const problem = connect_to(self);
    if (problem != NULL) {
        complain("%s: %s", channel, problem);
    }
    return problem == NULL;
}

void bus_close(bus_t *self) {
    if (self->socket >= 0) {
        (void)close(self->socket);
        self->socket = -1;
    }
}

bool bus_reopen(bus_t *self) {
    bus_close(self);
    return connect_to(self) == NULL;
}

static uint32_t errors_of(const struct canfd_frame *raw) {
    uint32_t errors = 0;
    if ((raw->can_id & CAN_ERR_BUSOFF) != 0u) {
        errors |= BUS_ERROR_OFF;
    }
    if ((raw->can_id & CAN_ERR_RESTARTED) != 0u) {
        errors |= BUS_ERROR_RESTARTED;
    }
    if ((raw->can_id & CAN_ERR_TX_TIMEOUT) != 0u) {
        errors |= BUS_ERROR_TX_TIMEOUT;
    }
    if ((raw->can_id & CAN_ERR_CRTL) != 0u) {
        if ((raw->data[1] & CAN_ERR_CRTL_RX_OVERFLOW) != 0) {
            errors |= BUS_ERROR_OVERFLOW;
        }
        if ((raw->data[1] & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0) {
            errors |= BUS_ERROR_PASSIVE;
        }
    }
    return (errors != 0u) ? errors : BUS_ERROR_OTHER;
}

static bus_frame_t frame_of(const struct canfd_frame *raw, size_t size) {
    if ((raw->can_id & CAN_ERR_FLAG) != 0u) {
        return (bus_frame_t){.kind = BUS_FRAME_ERROR, .error = errors_of(raw)};
    }
    bus_frame_t result = {.kind = BUS_FRAME_DATA};
    can_frame_t *const frame = &result.frame;
    const bool extended = (raw->can_id & CAN_EFF_FLAG) != 0u;
    frame->id = raw->can_id & (extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    frame->length = raw->len;
    if (extended) {
        frame->flags |= (uint8_t)CAN_FRAME_EXTENDED;
    }
    if ((raw->can_id & CAN_RTR_FLAG) != 0u) {
        frame->flags |= (uint8_t)CAN_FRAME_REMOTE;
    }
    if (size == CANFD_MTU) {
        frame->flags |= (uint8_t)CAN_FRAME_FD;
        if ((raw->flags & CANFD_BRS) != 0) {
            frame->flags |= (uint8_t)CAN_FRAME_BRS;
        }
    }
    const size_t known = (raw->len < CAN_FRAME_DATA_LENGTH) ? raw->len : CAN_FRAME_DATA_LENGTH;
    (void)memcpy(frame->data, raw->data, known);
    return result;
}

/* Time stamp and overflow count of a frame. */
static void take_ancillary(bus_t *self, struct msghdr *message, bus_frame_t *frame) {
    for (struct cmsghdr *part = CMSG_FIRSTHDR(message); part != NULL; part = CMSG_NXTHDR(message, part)) {
        if (part->cmsg_level != SOL_SOCKET) {
            continue;
        }
        if (part->cmsg_type == SCM_TIMESTAMPNS) {
            (void)memcpy(&frame->stamp, CMSG_DATA(part), sizeof frame->stamp);
            frame->stamped = true;
        } else if (part->cmsg_type == SO_RXQ_OVFL) {
            (void)memcpy(&self->overflows, CMSG_DATA(part), sizeof self->overflows);
        } else {
            /* no other control message was requested */
        }
    }
}

size_t bus_receive(bus_t *self, bus_frame_t frames[BUS_BATCH], int *problem) {
    struct canfd_frame raw[BUS_BATCH];
    struct iovec parts[BUS_BATCH];
    struct mmsghdr messages[BUS_BATCH];
    ancillary_t ancillary[BUS_BATCH];
    *problem = 0;
    for (size_t i = 0; i < BUS_BATCH; i++) {
        parts[i] = (struct iovec){&raw[i], sizeof raw[i]};
        messages[i] = (struct mmsghdr){.msg_hdr = {.msg_iov = &parts[i],
                                                   .msg_iovlen = 1,
                                                   .msg_control = ancillary[i].bytes,
                                                   .msg_controllen = sizeof ancillary[i].bytes}};
    }
    const int received = recvmmsg(self->socket, messages, BUS_BATCH, MSG_DONTWAIT, NULL);
    if (received < 0) {
        *problem = ((errno == EAGAIN) || (errno == EINTR)) ? 0 : errno;
        return 0;
    }
    size_t count = 0;
    for (size_t i = 0; i < (size_t)received; i++) {
        const size_t size = messages[i].msg_len;
        if ((size == CAN_MTU) || (size == CANFD_MTU)) {
            frames[count] = frame_of(&raw[i], size);
            take_ancillary(self, &messages[i].msg_hdr, &frames[count]);
            count++;
        }
    }
    return count;
}

size_t bus_send(bus_t *self, const can_frame_t *frames, size_t count, int *problem) {
    struct canfd_frame raw[MAX_SEND];
    struct iovec parts[MAX_SEND];
    struct mmsghdr messages[MAX_SEND];
    *problem = 0;
    if (self->socket < 0) {
        *problem = ENODEV;
        return 0;
    }
    const size_t all = (count < MAX_SEND) ? count : MAX_SEND;
    for (size_t i = 0; i < all; i++) {
        raw[i] = (struct canfd_frame){.can_id = frames[i].id, .len = frames[i].length};
        raw[i].flags = self->fd ? CANFD_BRS : 0;
        (void)memcpy(raw[i].data, frames[i].data, sizeof frames[i].data);
        parts[i] = (struct iovec){&raw[i], self->fd ? CANFD_MTU : CAN_MTU};
        messages[i] = (struct mmsghdr){.msg_hdr = {.msg_iov = &parts[i], .msg_iovlen = 1}};
    }
    size_t sent = 0;
    while (sent < all) {
        const int more = sendmmsg(self->socket, &messages[sent], (unsigned int)(all - sent), MSG_DONTWAIT);
        if (more <= 0) {
            if ((more < 0) && (errno == EINTR)) {
                continue;
            }
            *problem = (more < 0) ? errno : ENOBUFS;
            break;
        }
        sent += (size_t)more;
    }
    return sent;
}
