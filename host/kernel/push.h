/* push: the strike on the arm. A pulse is a prescribed half-sine force at a point of a link. A contact is a mass on
 * soft tissue (ISO/TS 15066:2016, Annex A) that a person's arm drives with limited force into the link. MuJoCo computes
 * the resulting force on the robot. tauperp.sim.contact.Hand models the same strike.
 */
#ifndef TAUPERP_KERNEL_PUSH_H
#define TAUPERP_KERNEL_PUSH_H

#include "plant.h"

typedef enum { PART_PARKED = 0, PART_APPROACHING = 1, PART_PUSHING = 2, PART_WITHDRAWING = 3 } part_state_t;

typedef struct {
    part_state_t state;
    double since_s;
    double target[3];    /* in the link's frame */
    double direction[3]; /* of the strike, in the link's frame, unit */
    double towards[3];   /* of a prescribed force, base frame, unit; 0 before it */
    double force_n;      /* on the arm in the last step */
    bool started;
    bool obstructed;
    uint32_t link; /* the link touched last, from 1 */
} push_t;

void push_init(push_t *self, const plant_t *plant);

/* Sets the generalised force of the step that starts at `time_s`. */
void push_before_step(push_t *self, plant_t *plant, double time_s);

/* Reads the contact force of that step. */
void push_after_step(push_t *self, plant_t *plant, double time_s);

/* The half-sine at `since_s`, N. */
double push_half_sine(double force_n, double push_s, double since_s);

#endif
