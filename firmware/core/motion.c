#include "motion.h"

#include "token.h"
#include "vec3.h"

/* Result of the forward pass for the backward pass, in the link's own frame. */
typedef struct {
    num_sincos_t turn; /* angle q + zero */
    vec3_t angular;    /* angular velocity */
    vec3_t linear;     /* velocity of the frame's origin */
    vec3_t gravity;
} link_t;

/* Frame of a link, in the base frame. */
typedef struct {
    vec3_t row_x, row_y, row_z; /* rows of its rotation: the components of the base axes in this frame */
    vec3_t origin;
} frame_t;

/* A right angle as the generator writes it: a rotation that needs no product. */
static bool is_quarter(const robot_joint_t *joint) {
    return (joint->cos_twist == NUM(0)) && (joint->sin_twist == NUM(1));
}

/* Axes that intersect share one origin. */
static bool has_offset(const robot_joint_t *joint) {
    return (joint->offset.x != NUM(0)) || (joint->offset.y != NUM(0)) || (joint->offset.z != NUM(0));
}

/* Components of a vector of the parent frame in the joint's frame: rotation by the twist about x, then by the joint
 * about z. */
NUM_STEP vec3_t turned(const num_sincos_t *turn, const vec3_t *v, uint32_t *saturations) {
    /* NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): written by forward() for each joint, at least one */
    return (vec3_t){.x = num_narrow(num_wide(turn->cos, v->x) + num_wide(turn->sin, v->y), saturations),
                    .y = num_narrow(num_wide(turn->cos, v->y) - num_wide(turn->sin, v->x), saturations),
                    .z = v->z};
}

NUM_STEP vec3_t into_link(const robot_joint_t *joint, const bool quarter, const num_sincos_t *turn, const vec3_t *v,
                          uint32_t *saturations) {
    vec3_t twisted = {.x = v->x, .y = v->z, .z = -v->y};
    if (!quarter) {
        twisted.y = num_narrow(num_wide(joint->cos_twist, v->y) + num_wide(joint->sin_twist, v->z), saturations);
        twisted.z = num_narrow(num_wide(joint->cos_twist, v->z) - num_wide(joint->sin_twist, v->y), saturations);
    }
    return turned(turn, &twisted, saturations);
}

NUM_STEP vec3_t into_parent(const robot_joint_t *joint, const bool quarter, const num_sincos_t *turn, const vec3_t *v,
                            uint32_t *saturations) {
    const num_t x = num_narrow(num_wide(turn->cos, v->x) - num_wide(turn->sin, v->y), saturations);
    const num_t y = num_narrow(num_wide(turn->sin, v->x) + num_wide(turn->cos, v->y), saturations);
    vec3_t twisted = {.x = x, .y = -v->z, .z = y};
    if (!quarter) {
        twisted.y = num_narrow(num_wide(joint->cos_twist, y) - num_wide(joint->sin_twist, v->z), saturations);
        twisted.z = num_narrow(num_wide(joint->sin_twist, y) + num_wide(joint->cos_twist, v->z), saturations);
    }
    return twisted;
}

static vec3_t base_row(const robot_t *robot, uint32_t i) {
    return (vec3_t){.x = robot->base[i][0], .y = robot->base[i][1], .z = robot->base[i][2]};
}

/* Transforms a point from a link's frame to the base frame. */
NUM_STEP vec3_t point_of(const frame_t *frame, const vec3_t *v, uint32_t *saturations) {
    const vec3_t rotated = {.x = vec3_dot(frame->row_x, *v, saturations),
                            .y = vec3_dot(frame->row_y, *v, saturations),
                            .z = vec3_dot(frame->row_z, *v, saturations)};
    return vec3_add(frame->origin, rotated, saturations);
}

static inline void keep_axis(motion_t *self, uint32_t i, const frame_t *frame) {
    if (i == self->watched) {
        self->link_x = frame->row_x;
        self->link_y = frame->row_y;
        self->link_z = frame->row_z;
        self->link_origin = frame->origin;
    }
    self->jacobian[3][i] = num_factor(frame->row_x.z, &self->saturations);
    self->jacobian[4][i] = num_factor(frame->row_y.z, &self->saturations);
    self->jacobian[5][i] = num_factor(frame->row_z.z, &self->saturations);
}

/* The first joint: its frame is the base frame turned by q_0, and the base does not move. */
NUM_STEP void forward_first(motion_t *self, const robot_t *robot, num_t qd, link_t *link, frame_t *frame) {
    uint32_t *const sat = &self->saturations;
    const vec3_t x = base_row(robot, 0);
    const vec3_t y = base_row(robot, 1);
    const vec3_t z = base_row(robot, 2);
    const vec3_t g = robot->gravity;
    const vec3_t gravity = {.x = num_narrow(num_wide(x.x, g.x) + num_wide(y.x, g.y) + num_wide(z.x, g.z), sat),
                            .y = num_narrow(num_wide(x.y, g.x) + num_wide(y.y, g.y) + num_wide(z.y, g.z), sat),
                            .z = num_narrow(num_wide(x.z, g.x) + num_wide(y.z, g.y) + num_wide(z.z, g.z), sat)};
    link->angular = (vec3_t){NUM(0), NUM(0), qd};
    link->linear = (vec3_t){NUM(0), NUM(0), NUM(0)};
    link->gravity = turned(&link->turn, &gravity, sat);
    frame->row_x = turned(&link->turn, &x, sat);
    frame->row_y = turned(&link->turn, &y, sat);
    frame->row_z = turned(&link->turn, &z, sat);
    frame->origin = (vec3_t){NUM(0), NUM(0), NUM(0)};
    keep_axis(self, 0, frame);
}

/* One step from a joint to the next. */
NUM_STEP void forward_next(motion_t *self, const robot_joint_t *joint, const bool quarter, num_t qd,
                           const link_t *parent, link_t *link, frame_t *frame) {
    uint32_t *const sat = &self->saturations;
    vec3_t velocity = parent->linear;
    if (has_offset(joint)) {
        velocity = vec3_add(velocity, vec3_cross(parent->angular, joint->offset, sat), sat);
        frame->origin = point_of(frame, &joint->offset, sat);
    }
    link->angular = into_link(joint, quarter, &link->turn, &parent->angular, sat);
    link->angular.z = num_add(link->angular.z, qd, sat);
    link->linear = into_link(joint, quarter, &link->turn, &velocity, sat);
    link->gravity = into_link(joint, quarter, &link->turn, &parent->gravity, sat);
    frame->row_x = into_link(joint, quarter, &link->turn, &frame->row_x, sat);
    frame->row_y = into_link(joint, quarter, &link->turn, &frame->row_y, sat);
    frame->row_z = into_link(joint, quarter, &link->turn, &frame->row_z, sat);
}

NUM_STEP void forward(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[], link_t links[]) {
    uint32_t *const sat = &self->saturations;
    frame_t frame;
    vec3_t origins[ROBOT_MAX_JOINTS];
    for (uint32_t i = 0; i < robot->joint_count; ++i) { /* its own loop, so that the many constants stay in registers */
        links[i].turn = num_sincos(num_add(q[i], robot->joint[i].zero_rad, sat));
    }
    forward_first(self, robot, qd[0], &links[0], &frame);
    origins[0] = frame.origin;
    for (uint32_t i = 1; i < robot->joint_count; ++i) {
        const robot_joint_t *const joint = &robot->joint[i];
        if (is_quarter(joint)) {
            forward_next(self, joint, true, qd[i], &links[i - 1u], &links[i], &frame);
        } else {
            forward_next(self, joint, false, qd[i], &links[i - 1u], &links[i], &frame);
        }
        origins[i] = frame.origin;
        keep_axis(self, i, &frame);
    }
    self->tool_x = frame.row_x;
    self->tool_y = frame.row_y;
    self->tool_z = frame.row_z;
    const vec3_t tip = point_of(&frame, &robot->tip, sat);
    self->tip = tip;
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        const vec3_t axis = {.x = self->jacobian[3][i], .y = self->jacobian[4][i], .z = self->jacobian[5][i]};
        const vec3_t arm = vec3_subtract(tip, origins[i], sat);
        self->jacobian[0][i] = num_narrow_factor(num_wide(axis.y, arm.z) - num_wide(axis.z, arm.y), sat);
        self->jacobian[1][i] = num_narrow_factor(num_wide(axis.z, arm.x) - num_wide(axis.x, arm.z), sat);
        self->jacobian[2][i] = num_narrow_factor(num_wide(axis.x, arm.y) - num_wide(axis.y, arm.x), sat);
    }
}

/* Linear momentum of a link relative to its origin: w x h. The origin's velocity is in the parent's part. */
static inline vec3_t own_momentum(const robot_joint_t *joint, vec3_t w, uint32_t *saturations) {
    const num_t hx = joint->moment_x;
    const num_t hy = joint->moment_y;
    return (vec3_t){.x = -num_mul(w.z, hy, saturations),
                    .y = num_mul(w.z, hx, saturations),
                    .z = num_narrow(num_wide(w.x, hy) - num_wide(w.y, hx), saturations)};
}

/* I w + h x v. Sums of up to five products fit, because robot_is_valid keeps the table's factors below 64. */
static inline vec3_t own_angular_momentum(const robot_joint_t *joint, vec3_t w, vec3_t v, uint32_t *saturations) {
    const num_t hx = joint->moment_x;
    const num_t hy = joint->moment_y;
    return (vec3_t){
        .x = num_narrow(num_wide(joint->inertia_xx, w.x) + num_wide(joint->inertia_xy, w.y) +
                            num_wide(joint->inertia_xz, w.z) + num_wide(hy, v.z),
                        saturations),
        .y = num_narrow(num_wide(joint->inertia_xy, w.x) + num_wide(joint->inertia_yz, w.z) - num_wide(hx, v.z),
                        saturations),
        .z = num_narrow(num_wide(joint->inertia_xz, w.x) + num_wide(joint->inertia_yz, w.y) +
                            num_wide(joint->inertia_zz, w.z) + num_wide(hx, v.y) - num_wide(hy, v.x),
                        saturations)};
}

/* Composite of all links beyond a joint, about the joint's origin and in its frame. */
typedef struct {
    vec3_t linear;  /* P: linear momentum */
    vec3_t angular; /* L: angular momentum */
    vec3_t moment;  /* s: first moment of mass */
} beyond_t;

NUM_STEP void add_link(motion_t *self, const robot_joint_t *joint, uint32_t i, const link_t *link, beyond_t *beyond) {
    uint32_t *const sat = &self->saturations;
    const vec3_t w = link->angular;
    const vec3_t v = link->linear;
    const vec3_t gravity = link->gravity;
    beyond->linear = vec3_add(beyond->linear, own_momentum(joint, w, sat), sat);
    beyond->angular = vec3_add(beyond->angular, own_angular_momentum(joint, w, v, sat), sat);
    beyond->moment.x = num_add(beyond->moment.x, joint->moment_x, sat);
    beyond->moment.y = num_add(beyond->moment.y, joint->moment_y, sat);
    self->momentum[i] = beyond->angular.z;
    self->coriolis[i] =
        num_add(num_narrow(num_wide(beyond->angular.x, w.y) - num_wide(beyond->angular.y, w.x), sat),
                num_narrow(num_wide(beyond->linear.x, v.y) - num_wide(beyond->linear.y, v.x), sat), sat);
    self->gravity[i] = num_narrow(num_wide(beyond->moment.y, gravity.x) - num_wide(beyond->moment.x, gravity.y), sat);
}

NUM_STEP void hand_to_parent(const robot_joint_t *joint, const bool quarter, const num_sincos_t *turn, beyond_t *beyond,
                             uint32_t *saturations) {
    beyond->linear = into_parent(joint, quarter, turn, &beyond->linear, saturations);
    beyond->angular = into_parent(joint, quarter, turn, &beyond->angular, saturations);
    beyond->moment = into_parent(joint, quarter, turn, &beyond->moment, saturations);
    if (has_offset(joint)) {
        beyond->angular =
            vec3_add(beyond->angular, vec3_cross(joint->offset, beyond->linear, saturations), saturations);
    }
}

NUM_STEP void backward(motion_t *self, const robot_t *robot, const link_t links[]) {
    beyond_t beyond = {0};
    for (uint32_t i = robot->joint_count - 1u; i > 0u; --i) {
        const robot_joint_t *const joint = &robot->joint[i];
        add_link(self, joint, i, &links[i], &beyond);
        if (is_quarter(joint)) {
            hand_to_parent(joint, true, &links[i].turn, &beyond, &self->saturations);
        } else {
            hand_to_parent(joint, false, &links[i].turn, &beyond, &self->saturations);
        }
    }
    add_link(self, &robot->joint[0], 0, &links[0], &beyond);
}

void motion_init(motion_t *self) {
    *self = (motion_t){0};
}

void motion_step(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]) {
    link_t links[ROBOT_MAX_JOINTS];
    forward(self, robot, q, qd, links);
    backward(self, robot, links);
    self->token = token_next(token_bits(q, robot->joint_count), TOKEN_MOTION, token_bits(qd, robot->joint_count));
}
