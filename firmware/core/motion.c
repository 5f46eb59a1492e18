#include "motion.h"

#include "vec3.h"

/* What the forward pass leaves for the backward pass, in the link's own frame. */
typedef struct {
    num_sincos_t turn; /* of q + zero */
    vec3_t angular;    /* angular velocity */
    vec3_t linear;     /* velocity of the frame's origin */
    vec3_t gravity;
} link_t;

/* Components of a vector of the parent frame in the joint's frame: twist about x, then the joint about z. */
static inline vec3_t into_link(const robot_joint_t *joint, num_sincos_t turn, vec3_t v, uint32_t *saturations) {
    const num_t y = num_narrow(num_wide(joint->cos_twist, v.y) + num_wide(joint->sin_twist, v.z), saturations);
    const num_t z = num_narrow(num_wide(joint->cos_twist, v.z) - num_wide(joint->sin_twist, v.y), saturations);
    return (vec3_t){.x = num_narrow(num_wide(turn.cos, v.x) + num_wide(turn.sin, y), saturations),
                    .y = num_narrow(num_wide(turn.cos, y) - num_wide(turn.sin, v.x), saturations),
                    .z = z};
}

static inline vec3_t into_parent(const robot_joint_t *joint, num_sincos_t turn, vec3_t v, uint32_t *saturations) {
    const num_t x = num_narrow(num_wide(turn.cos, v.x) - num_wide(turn.sin, v.y), saturations);
    const num_t y = num_narrow(num_wide(turn.sin, v.x) + num_wide(turn.cos, v.y), saturations);
    return (vec3_t){.x = x,
                    .y = num_narrow(num_wide(joint->cos_twist, y) - num_wide(joint->sin_twist, v.z), saturations),
                    .z = num_narrow(num_wide(joint->sin_twist, y) + num_wide(joint->cos_twist, v.z), saturations)};
}

/* What turns with a body rotates by one matrix row at a time: R <- R Rx(twist) Rz(q + zero). */
static inline vec3_t turn_row(const robot_joint_t *joint, num_sincos_t turn, vec3_t row, uint32_t *saturations) {
    return into_link(joint, turn, row, saturations);
}

static vec3_t base_row(const robot_t *robot, uint32_t i) {
    return (vec3_t){.x = robot->base[i][0], .y = robot->base[i][1], .z = robot->base[i][2]};
}

/* Components in the base frame of a vector of the frame that has these rows. */
static inline vec3_t out_of_link(vec3_t row_x, vec3_t row_y, vec3_t row_z, vec3_t v, uint32_t *saturations) {
    return (vec3_t){.x = vec3_dot(row_x, v, saturations),
                    .y = vec3_dot(row_y, v, saturations),
                    .z = vec3_dot(row_z, v, saturations)};
}

static inline vec3_t axis_of(vec3_t row_x, vec3_t row_y, vec3_t row_z) {
    return (vec3_t){.x = row_x.z, .y = row_y.z, .z = row_z.z};
}

static void forward(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[], link_t links[]) {
    uint32_t *const sat = &self->saturations;
    const vec3_t base_x = base_row(robot, 0);
    const vec3_t base_y = base_row(robot, 1);
    const vec3_t base_z = base_row(robot, 2);
    vec3_t row_x = base_x, row_y = base_y, row_z = base_z; /* rows of the rotation of frame i in the base frame */
    vec3_t origin = {NUM(0), NUM(0), NUM(0)};
    vec3_t origins[ROBOT_MAX_JOINTS];
    const vec3_t g = robot->gravity;
    link_t parent = {
        .gravity = {.x = num_narrow(num_wide(base_x.x, g.x) + num_wide(base_y.x, g.y) + num_wide(base_z.x, g.z), sat),
                    .y = num_narrow(num_wide(base_x.y, g.x) + num_wide(base_y.y, g.y) + num_wide(base_z.y, g.z), sat),
                    .z = num_narrow(num_wide(base_x.z, g.x) + num_wide(base_y.z, g.y) + num_wide(base_z.z, g.z), sat)}};
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        const robot_joint_t *const joint = &robot->joint[i];
        link_t *const link = &links[i];
        link->turn = num_sincos(num_add(q[i], joint->zero_rad, sat));
        const vec3_t at_joint = vec3_add(parent.linear, vec3_cross(parent.angular, joint->offset, sat), sat);
        link->angular = into_link(joint, link->turn, parent.angular, sat);
        link->angular.z = num_add(link->angular.z, qd[i], sat);
        link->linear = into_link(joint, link->turn, at_joint, sat);
        link->gravity = into_link(joint, link->turn, parent.gravity, sat);
        parent = *link;

        origin = vec3_add(origin, out_of_link(row_x, row_y, row_z, joint->offset, sat), sat);
        origins[i] = origin;
        row_x = turn_row(joint, link->turn, row_x, sat);
        row_y = turn_row(joint, link->turn, row_y, sat);
        row_z = turn_row(joint, link->turn, row_z, sat);
        const vec3_t axis = axis_of(row_x, row_y, row_z);
        self->jacobian[3][i] = axis.x;
        self->jacobian[4][i] = axis.y;
        self->jacobian[5][i] = axis.z;
    }
    const vec3_t tip = vec3_add(origin, out_of_link(row_x, row_y, row_z, robot->tip, sat), sat);
    for (uint32_t i = 0; i < robot->joint_count; ++i) {
        const vec3_t axis = {.x = self->jacobian[3][i], .y = self->jacobian[4][i], .z = self->jacobian[5][i]};
        const vec3_t linear = vec3_cross(axis, vec3_subtract(tip, origins[i], sat), sat);
        self->jacobian[0][i] = linear.x;
        self->jacobian[1][i] = linear.y;
        self->jacobian[2][i] = linear.z;
    }
}

/* Linear momentum of a link beyond what the velocity of its origin gives, which is in the parent's share: w x h. */
static inline vec3_t own_momentum(const robot_joint_t *joint, vec3_t w, uint32_t *saturations) {
    const num_t hx = joint->moment_x;
    const num_t hy = joint->moment_y;
    return (vec3_t){.x = -num_mul(w.z, hy, saturations),
                    .y = num_mul(w.z, hx, saturations),
                    .z = num_narrow(num_wide(w.x, hy) - num_wide(w.y, hx), saturations)};
}

/* I w + h x v. The sums of up to five products fit because robot_holds keeps the table's factors below 64. */
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

static void backward(motion_t *self, const robot_t *robot, const link_t links[]) {
    uint32_t *const sat = &self->saturations;
    vec3_t linear = {NUM(0), NUM(0), NUM(0)};  /* P: linear momentum of everything beyond the joint */
    vec3_t angular = {NUM(0), NUM(0), NUM(0)}; /* L: angular momentum about the joint's origin */
    vec3_t moment = {NUM(0), NUM(0), NUM(0)};  /* s: first moment of mass about it */
    for (uint32_t i = robot->joint_count; i-- > 0u;) {
        const robot_joint_t *const joint = &robot->joint[i];
        const vec3_t w = links[i].angular;
        const vec3_t v = links[i].linear;
        linear = vec3_add(linear, own_momentum(joint, w, sat), sat);
        angular = vec3_add(angular, own_angular_momentum(joint, w, v, sat), sat);
        moment.x = num_add(moment.x, joint->moment_x, sat);
        moment.y = num_add(moment.y, joint->moment_y, sat);

        const vec3_t gravity = links[i].gravity;
        self->momentum[i] = angular.z;
        self->coriolis[i] = num_add(num_narrow(num_wide(angular.x, w.y) - num_wide(angular.y, w.x), sat),
                                    num_narrow(num_wide(linear.x, v.y) - num_wide(linear.y, v.x), sat), sat);
        self->gravity[i] = num_narrow(num_wide(moment.y, gravity.x) - num_wide(moment.x, gravity.y), sat);

        linear = into_parent(joint, links[i].turn, linear, sat);
        angular = into_parent(joint, links[i].turn, angular, sat);
        moment = into_parent(joint, links[i].turn, moment, sat);
        angular = vec3_add(angular, vec3_cross(joint->offset, linear, sat), sat);
    }
}

void motion_init(motion_t *self) {
    *self = (motion_t){0};
}

void motion_step(motion_t *self, const robot_t *robot, const num_t q[], const num_t qd[]) {
    link_t links[ROBOT_MAX_JOINTS];
    forward(self, robot, q, qd, links);
    backward(self, robot, links);
}
