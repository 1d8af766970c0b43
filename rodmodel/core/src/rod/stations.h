/* Pose and curvature along the rod, from a solution and its nodes. */
#ifndef RM_STATIONS_H
#define RM_STATIONS_H

#include "solve.h"

static void put_stations(const rm_rod *rod, const rm_input *input, const rm_solution *solution, const rm_node *nodes,
                         int count, const rm_real *arc_lengths, rm_real *positions, rm_real *rotations,
                         rm_real *curvatures)
{
    const rm_actuator *a = &rod->actuator;
    const rm_real length = a->body_length - a->stiff_tip, end = a->body_length + a->cap_length;
    const vec offset = cap_offset(a, vec_of(solution->free_curvature));
    for (int k = 0; k < count; k++) {
        const rm_real s = arc_lengths[k];
        vec none = {not_a_number(), not_a_number(), not_a_number()}, position = none, turn = none;
        mat frame = {none, none, none};
        /* An arc length beyond the rod by a rounding counts as its end. */
        if (s >= R(0.0) && s <= end * (R(1.0) + R(4.0) * RM_EPSILON)) {
            const rm_real body = smaller(s, length);
            const quat q = pose_between(nodes, solution->steps, length, body, &position, &turn);
            const vec ahead = {R(0.0), R(0.0), s - body};
            position = add(position, out_of_body(q, along(ahead, share_of_offset(body, length), offset)));
            frame = mat_of_quat(q);
            turn = s > length ? no_vec() : scale(R(1.0) / length, turn);
            if (input->given & RM_BASE) {
                const mat base = mat_of_rows(input->base_rotation);
                position = add(vec_of(input->base_position), mat_apply(base, position));
                frame = mat_product(base, frame);
            }
        }
        if (positions != NULL) {
            put_vec(positions + 3 * k, position);
        }
        if (rotations != NULL) {
            put_mat(rotations + 9 * k, frame);
        }
        if (curvatures != NULL) {
            put_vec(curvatures + 3 * k, turn);
        }
    }
}

#endif
