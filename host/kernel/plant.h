/* plant: the arm of one run: physics, controller, motion, intended wrench and sensors. */
#ifndef TAUPERP_KERNEL_PLANT_H
#define TAUPERP_KERNEL_PLANT_H

#include <mujoco/mujoco.h>
#include <stdbool.h>

#include "frames.h"
#include "kernel.h"

#define PLANT_DELAY 8

typedef struct {
    double position[KERNEL_JOINTS], velocity[KERNEL_JOINTS], acceleration[KERNEL_JOINTS];
} reference_t;

typedef struct {
    const kernel_setup_t *setup;
    const kernel_run_t *run;
    mjModel *model; /* the setup's plant or contact model, with the run's masses */
    mjData *data;
    mjData *nominal;
    double integral[KERNEL_JOINTS];
    double load[KERNEL_JOINTS];   /* torque at rest that the nominal model does not contain, Nm */
    double torque[KERNEL_JOINTS]; /* link side, mean of the last cycle: the input of the sensors */
    reading_t late[PLANT_DELAY];  /* the last true readings, for the sensors' delay */
    uint32_t readings;
    reference_t stop_from; /* reference at the stop */
    double stop_at_s, stop_s;
    bool stopping;
    double motion_s; /* time since the start of the motion */
    double tip_velocity[3], tip_acceleration[3];
    double push[KERNEL_JOINTS]; /* generalised force of the push, set before each step */
    bool tip_known;
} plant_t;

/* Places the arm at the start of the run, at rest. `data` belongs to `model`, `nominal` to the nominal model. */
void plant_start(plant_t *self, const kernel_setup_t *setup, const kernel_run_t *run, mjModel *model, mjData *data,
                 mjData *nominal);

/* The sensors' readings in `cycle`. */
void plant_read(plant_t *self, uint32_t cycle, reading_t *reading);

/* Starts a stop along the current direction of motion. The arm then stays where it comes to rest. */
void plant_stop(plant_t *self, double time_s);

/* Motor torque for the cycle that starts at `time_s`, and the tip's desired acceleration for its frames. */
void plant_control(plant_t *self, double time_s, double *torque);

/* One step of physics of length period / substeps. Adds its part to the sensed torque. False if MuJoCo had to reset the
 * state. */
bool plant_step(plant_t *self, double time_s, const double *torque);

void plant_begin_cycle(plant_t *self);

#endif
