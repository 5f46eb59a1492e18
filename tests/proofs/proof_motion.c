/* firmware/core/motion.c: any table that robot_is_valid accepts, any readings. A link is shown alone; the whole pass
 * calls stubs that assert what a link requires (proofs.toml). */
#include "num_sizes.h"

#include "any_table.h"
#include "motion.c"

static bool turn_is_bounded(const num_sincos_t *turn) {
    return is_below(turn->sin, NUM(2)) && is_below(turn->cos, NUM(2));
}

/* Within +-INT32_MAX, as every function of num.h leaves it. */
static bool is_number(vec3_t v) {
    return (v.x >= -INT32_MAX) && (v.y >= -INT32_MAX) && (v.z >= -INT32_MAX);
}

static bool link_is_made(const link_t *of) {
    return turn_is_bounded(&of->turn) && is_number(of->angular) && is_number(of->linear) && is_number(of->gravity);
}

static bool frame_is_made(const frame_t *of) {
    return is_number(of->row_x) && is_number(of->row_y) && is_number(of->row_z) && is_number(of->origin);
}

static bool beyond_is_made(const beyond_t *of) {
    return is_number(of->linear) && is_number(of->angular) && is_number(of->moment);
}

static robot_t table;
static motion_t motion;
static link_t parent, link;
static frame_t frame;
static beyond_t beyond;
static bool quarter;
static num_t speed;

static void any_link(void) {
    __CPROVER_havoc_object(&table);
    __CPROVER_havoc_object(&motion);
    __CPROVER_havoc_object(&parent);
    __CPROVER_havoc_object(&link);
    __CPROVER_havoc_object(&frame);
    __CPROVER_havoc_object(&beyond);
    __CPROVER_havoc_object(&quarter);
    __CPROVER_havoc_object(&speed);
    ASSUME(table_is_bounded(&table));
    ASSUME(speed >= -INT32_MAX);
    ASSUME(link_is_made(&parent) && link_is_made(&link) && frame_is_made(&frame) && beyond_is_made(&beyond));
}

void proof_motion_first(void) {
    any_link();
    forward_first(&motion, &table, speed, &link, &frame);
    HOLDS(link_is_made(&link) && frame_is_made(&frame), "the link and the frame");
    REACHED;
}

void proof_motion_next(void) {
    any_link();
    forward_next(&motion, &table.joint[1], quarter, speed, &parent, &link, &frame);
    HOLDS(link_is_made(&link) && frame_is_made(&frame), "the link and the frame");
    REACHED;
}

void proof_motion_back(void) {
    any_link();
    add_link(&motion, &table.joint[1], 1u, &link, &beyond);
    HOLDS(beyond_is_made(&beyond), "the sum with the link");
    hand_to_parent(&table.joint[1], quarter, &link.turn, &beyond, &motion.saturations);
    HOLDS(beyond_is_made(&beyond), "the sum in the frame of the parent");
    REACHED;
}

static void joint_is_there(const robot_joint_t *joint, const num_sincos_t *turn) {
    HOLDS(__CPROVER_r_ok(joint, sizeof(*joint)), "the joint is there");
    HOLDS(__CPROVER_r_ok(turn, sizeof(*turn)) && turn_is_bounded(turn), "the sine and the cosine of its angle");
}

/* What a step leaves in a link and a frame: any numbers. */
static void any_frame(motion_t *self, link_t *to, frame_t *into) {
    link_t made;
    frame_t turned_frame;
    HOLDS(__CPROVER_w_ok(self, sizeof(*self)), "the pass is there");
    made.turn = to->turn;
    ASSUME(link_is_made(&made) && frame_is_made(&turned_frame));
    *to = made;
    *into = turned_frame;
}

static void any_sum(beyond_t *sum) {
    beyond_t any;
    HOLDS(beyond_is_made(sum), "the sum is made");
    ASSUME(beyond_is_made(&any));
    *sum = any;
}

void stub_first(motion_t *self, const robot_t *robot, num_t qd, link_t *to, frame_t *into) {
    HOLDS(qd >= -INT32_MAX, "a reading");
    joint_is_there(&robot->joint[0], &to->turn);
    any_frame(self, to, into);
}

void stub_next(motion_t *self, const robot_joint_t *joint, const bool right, num_t qd, const link_t *from, link_t *to,
               frame_t *into) {
    (void)right;
    HOLDS(qd >= -INT32_MAX, "a reading");
    HOLDS(__CPROVER_r_ok(from, sizeof(*from)) && link_is_made(from), "the parent is made");
    HOLDS(frame_is_made(into), "the frame of the parent is made");
    joint_is_there(joint, &to->turn);
    any_frame(self, to, into);
}

void stub_keep(motion_t *self, uint32_t i, const frame_t *from) {
    num_t x, y, z;
    HOLDS((i < ROBOT_JOINTS) && __CPROVER_r_ok(from, sizeof(*from)), "the axis and the frame are there");
    ASSUME(stub_below(x, 28u) && stub_below(y, 28u) && stub_below(z, 28u));
    self->jacobian[3][i] = x;
    self->jacobian[4][i] = y;
    self->jacobian[5][i] = z;
}

void proof_motion_keep(void) {
    uint32_t i;
    any_link();
    ASSUME(i < ROBOT_JOINTS);
    keep_axis(&motion, i, &frame);
    HOLDS(stub_below(motion.jacobian[3][i], 28u) && stub_below(motion.jacobian[4][i], 28u) &&
              stub_below(motion.jacobian[5][i], 28u),
          "the angular entries of the Jacobian are below 64");
    REACHED;
}

void stub_add(motion_t *self, const robot_joint_t *joint, uint32_t i, const link_t *from, beyond_t *sum) {
    HOLDS(__CPROVER_w_ok(self, sizeof(*self)) && (i < ROBOT_JOINTS), "the row is there");
    joint_is_there(joint, &from->turn);
    HOLDS(link_is_made(from), "the link is made");
    any_sum(sum);
}

void stub_hand(const robot_joint_t *joint, const bool right, const num_sincos_t *turn, beyond_t *sum,
               uint32_t *saturations) {
    (void)right;
    (void)saturations;
    joint_is_there(joint, turn);
    any_sum(sum);
}

/* Every later stage relies on it. */
static bool jacobian_is_below_64(const motion_t *of) {
    bool all = true;
    for (uint32_t row = 0; row < MOTION_TWIST_ROWS; ++row) {
        for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
            all = all && stub_below(of->jacobian[row][i], 28u);
        }
    }
    return all;
}

void proof_motion(void) {
    num_t q[ROBOT_MAX_JOINTS], qd[ROBOT_MAX_JOINTS];
    any_link();
    for (uint32_t i = 0; i < ROBOT_MAX_JOINTS; ++i) {
        ASSUME((q[i] >= -INT32_MAX) && (qd[i] >= -INT32_MAX));
    }
    assume_jacobian(motion.jacobian); /* entries without a joint stay */
    motion_step(&motion, &table, q, qd);
    HOLDS(jacobian_is_below_64(&motion), "the Jacobian");
    motion_init(&motion);
    HOLDS(jacobian_is_below_64(&motion), "that of the start");
    REACHED;
}
