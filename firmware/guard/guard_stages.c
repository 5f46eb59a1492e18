#include "guard_parts.h"
#include "token.h"

/* The expected last token if every stage ran on this snapshot. */
static uint32_t expected_token(const snapshot_t *snapshot, uint32_t joints) {
    uint32_t token =
        token_next(token_bits(snapshot->position, joints), TOKEN_MOTION, token_bits(snapshot->velocity, joints));
    token = token_next(token, TOKEN_OBSERVER, token_bits(snapshot->torque, joints));
    token = token_next(token, TOKEN_ACCELERATION, 0u);
    token = token_next(token, TOKEN_REGRESSOR, 0u);
    token = token_next(token, TOKEN_INDEX, 0u);
    token = token_next(token, TOKEN_EXPLAINED, 0u);
    token = token_next(token, TOKEN_BANK, 0u);
    token = token_next(token, TOKEN_DETECTOR, 0u);
    return token_next(token, TOKEN_SIGHT, 0u);
}

static void clear_tokens(guard_t *self) {
    self->motion.token = 0;
    self->observer.token = 0;
    self->acceleration.token = 0;
    self->regressor.token = 0;
    self->index.token = 0;
    self->explained.token = 0;
    self->bank.token = 0;
    self->detector.token = 0;
    self->sight.token = 0;
}

void stages_step(guard_t *self, const task_config_t *task, const snapshot_t *snapshot, uint32_t gap,
                 vec3_t acceleration) {
    const guard_config_t *const config = self->config;
    const robot_t *const robot = &config->robot;
    const uint32_t joints = robot->joint_count;
    clear_tokens(self);
    motion_step(&self->motion, robot, snapshot->position, snapshot->velocity);
    observer_step(&self->observer, &config->observer, joints, &self->motion, snapshot->torque, gap);
    acceleration_step(&self->acceleration, &config->acceleration, &config->observer, &self->observer, robot,
                      &self->motion, snapshot->velocity, acceleration, task->limits.mass_max_kg);
    regressor_step(&self->regressor, &config->regressor, &config->observer, robot, &self->motion, &self->observer,
                   &self->acceleration, snapshot->velocity);
    index_step(&self->index, &config->subspace, &task->index, robot, &self->motion, &self->observer,
               &self->acceleration, &self->regressor);
    explained_step(&self->explained, &task->limits, &config->subspace, task->detector.debounce_ticks, robot,
                   &self->observer, &self->acceleration, &task->index, &self->index);
    bank_step(&self->bank, &config->bank, joints, self->observer.gap, self->index.unexplained, self->index.sudden,
              self->explained.token);
    detector_step(&self->detector, &task->detector, joints, &self->bank);
    if (self->contact.locate.steps == 0u) {
        sight_step(&self->sight, &config->sight, &config->shape, joints, &self->motion, &self->index, &config->bank,
                   &task->detector, self->detector.token);
    } else { /* the search for the link that was touched needs the motion pass's link, and its time */
        self->sight.token = token_next(self->detector.token, TOKEN_SIGHT, 0u);
    }
}

/* The requested task becomes active when the active one has had its dwell. In any sequence of tasks each task thus gets
 * the time in which it alone would detect a contact. */
static void choose_task(guard_t *self, uint32_t gap) {
    const uint32_t wanted = self->inputs.task_number;
    const uint32_t room = UINT32_MAX - self->task_cycles;
    self->task_cycles += (gap < room) ? gap : room;
    const bool dwelt = (self->task == (uint32_t)TASK_INVALID) || (self->task_cycles >= self->config->task_dwell_cycles);
    if ((wanted != self->task) && dwelt) {
        self->task = wanted;
        self->task_inverted = ~wanted;
        self->task_cycles = 0;
    }
}

void stages_run(guard_t *self) {
    snapshot_t *const snapshot = &self->inputs.snapshot;
    const uint32_t gap = snapshot_take(snapshot);
    choose_task(self, gap);
    if ((gap < 1u) || (gap > CONFIG_MAX_GAP)) {
        self->settled_cycles = 0;
    } else {
        const uint32_t room = UINT32_MAX - self->settled_cycles;
        self->settled_cycles += (gap < room) ? gap : room;
    }
    /* Without a valid task there are no columns and no permission. The residual is still reported. */
    const uint32_t task = (self->task < (uint32_t)TASK_COUNT) ? self->task : (uint32_t)TASK_INVALID;
    snapshot_t corrected = *snapshot;
    sensor_correct(&self->config->sensor, self->joints, snapshot->velocity, snapshot->torque, corrected.torque);
    stages_step(self, &self->config->task[task], &corrected, gap, self->inputs.acceleration);
    plausibility_step(&self->plausibility, &self->config->observer, self->joints, gap, snapshot, &self->motion);
    self->stage_token = expected_token(&corrected, self->joints);
}

bool stages_complete(const guard_t *self) {
    return self->sight.token == self->stage_token;
}

/* x - x is zero for every number, and NaN for NaN and infinity: NaN stays in the sum. */
bool stages_valid(const guard_t *self) {
    num_t nothing = NUM(0);
    for (uint32_t i = 0; i < self->joints; ++i) {
        nothing += self->observer.residual[i] - self->observer.residual[i];
        nothing += self->detector.value_nm[i] - self->detector.value_nm[i];
    }
    for (uint32_t c = 0; c < self->index.columns; ++c) {
        nothing += self->explained.coefficient[c] - self->explained.coefficient[c];
    }
    /* Uncovered in fixed: 1 branch, 1 condition. Every pattern of Q9.22 is a number. */
    return self->index.converged && (nothing == NUM(0));
}

bool stages_saturated(guard_t *self) {
    const uint32_t sum = self->motion.saturations + self->observer.saturations + self->acceleration.saturations +
                         self->regressor.saturations + self->index.saturations +
                         projection_saturations(&self->index.projection) + self->explained.saturations +
                         self->bank.saturations + self->sight.saturations;
    const bool grew = sum != self->saturations;
    self->saturations = sum;
    return grew;
}

void stages_init(guard_t *self) {
    motion_init(&self->motion);
    observer_init(&self->observer);
    acceleration_init(&self->acceleration);
    regressor_init(&self->regressor);
    index_init(&self->index);
    explained_init(&self->explained);
    bank_init(&self->bank);
    detector_init(&self->detector);
    sight_init(&self->sight, self->joints);
    contact_init(&self->contact);
    plausibility_init(&self->plausibility);
    self->saturations = 0;
}
