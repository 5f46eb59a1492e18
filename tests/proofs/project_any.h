/* project_any: both projectors of projection.h, with any columns and any softness in its range; the same for both
 * channels. */
static void project_any(void) {
    projection_t projection;
    num_t column[SUBSPACE_MAX_COLUMNS][ROBOT_MAX_JOINTS], tau[ROBOT_MAX_JOINTS], tolerance, softness;
    num_t rejected[ROBOT_MAX_JOINTS], first_rejected[ROBOT_MAX_JOINTS];
    uint32_t n, k, first;
    ASSUME((softness >= NUM(SOFT_MIN)) && (softness <= NUM(1)));
    ASSUME((k <= SUBSPACE_MAX_COLUMNS) && (first <= SUBSPACE_MAX_COLUMNS)); /* first above k: a row not in use */
    projection_init(&projection);
    projection_hard(&projection, n, k, column, tolerance, tau, rejected);
    projection_soft(&projection, n, k, column, softness, tau, rejected, first, first_rejected);
    projection_reject(&projection, tau, rejected);
    (void)projection_saturations(&projection);
}
